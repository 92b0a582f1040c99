//! Latency over size as a picture: one panel for each case, one colour for each rung, both axes
//! logarithmic.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use plotters::coord::combinators::{BindKeyPoints as _, IntoLogRange as _};
use plotters::prelude::{
    BLACK, ChartBuilder, Circle, Color as _, IntoDrawingArea as _, LineSeries, PathElement,
    RGBColor, SVGBackend, Text, WHITE,
};

use super::StressError;
use super::logs::Logs;
use super::measure::{Timing, TimingQuantiles};
use super::report::StressReport;
use crate::plots::{Area, Drawn, GRID, INK, ink, left};

/// Rungs with their colours, in the order of the legend; what is not among them is grey.
const RUNGS: &[(&str, RGBColor)] = &[
    ("cold", RGBColor(0x59, 0x59, 0x59)),
    ("search", RGBColor(0xff, 0x7f, 0x0e)),
    ("improve", RGBColor(0x94, 0x67, 0xbd)),
    ("mutex", RGBColor(0xe3, 0x77, 0xc2)),
    ("table", RGBColor(0x1f, 0x77, 0xb4)),
    ("suffix", RGBColor(0x17, 0xbe, 0xcf)),
    ("trajectory", RGBColor(0x2c, 0xa0, 0x2c)),
    ("unchanged", RGBColor(0x8c, 0x56, 0x4b)),
    ("goal", RGBColor(0xbc, 0xbd, 0x22)),
    ("none", RGBColor(0xb0, 0xb0, 0xb0)),
    ("late", RGBColor(0xd6, 0x27, 0x28)),
    ("fast-downward", BLACK),
];
/// The colour of anything else.
const OTHER: RGBColor = RGBColor(0x8c, 0x8c, 0x8c);
/// Width and height of one panel with its axes, in pixels.
const PANEL: (u32, u32) = (480, 360);
/// Panels side by side.
const COLUMNS: usize = 2;
/// Height of the title.
const TITLE_HEIGHT: u32 = 56;
/// Width of the legend at the right.
const LEGEND_WIDTH: u32 = 150;
/// Least distance of two labelled sizes, as a share of the axis.
const TICK_SHARE_MIN: f64 = 0.055;

/// One point of a curve.
#[derive(Debug, Clone, Copy)]
struct Point {
    size: u32,
    p50_ns: f64,
    p99_ns: f64,
}

/// Curves by name, of one case.
type Curves = BTreeMap<String, Vec<Point>>;

/// Draws a report as SVG.
///
/// # Errors
/// [`StressError::Plot`] when a panel cannot be laid out.
pub fn plot(report: &StressReport, logs: &Logs) -> Result<String, StressError> {
    draw(&curves(report, logs)).map_err(|e| StressError::Plot { reason: e.to_string() })
}

fn curves(report: &StressReport, logs: &Logs) -> BTreeMap<String, Curves> {
    let mut times: BTreeMap<(&str, &str, u32), Vec<u64>> = BTreeMap::new();
    for (key, samples) in &logs.0 {
        let at = (key.case.as_str(), key.rung.as_str(), key.size);
        times.entry(at).or_default().extend(samples.all().map(Timing::cpu_ns));
    }
    for comparison in &report.comparisons {
        let at = (comparison.case.as_str(), comparison.planner.as_str(), comparison.size);
        times.entry(at).or_default().push(comparison.other_cpu_ns.p50);
    }
    let mut cases: BTreeMap<String, Curves> = BTreeMap::new();
    for ((case, name, size), times) in times {
        let TimingQuantiles { p50, p99, .. } = TimingQuantiles::of(times.iter().copied());
        // A logarithmic axis has no zero.
        if p50 > 0 && size > 0 {
            let point = Point { size, p50_ns: p50 as f64, p99_ns: p99 as f64 };
            let curves = cases.entry(case.to_owned()).or_default();
            curves.entry(name.to_owned()).or_default().push(point);
        }
    }
    cases
}

fn draw(cases: &BTreeMap<String, Curves>) -> Drawn<String> {
    let n_columns = cases.len().clamp(1, COLUMNS);
    let n_rows = cases.len().div_ceil(COLUMNS).max(1);
    let panels_width = PANEL.0 * n_columns as u32;
    let height = TITLE_HEIGHT + PANEL.1 * n_rows as u32;
    let mut svg = String::new();
    {
        let size = (panels_width + LEGEND_WIDTH, height);
        let whole = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        whole.fill(&WHITE)?;
        let (title, body) = whole.split_vertically(TITLE_HEIGHT);
        title.draw(&Text::new(
            "CPU time of one plan over the problem's size",
            (20, 14),
            ink(24),
        ))?;
        let how = "by the rung that answered; thick: median, thin: 99th percentile";
        title.draw(&Text::new(how, (20, 38), ink(16)))?;
        let (panels, legend) = body.split_horizontally(panels_width);
        let panels = panels.split_evenly((n_rows, n_columns));
        for (area, (case, curves)) in panels.iter().zip(cases) {
            draw_panel(area, case, curves)?;
        }
        draw_legend(&legend, cases)?;
        whole.present()?;
    }
    Ok(svg)
}

fn draw_panel(area: &Area<'_>, case: &str, curves: &Curves) -> Drawn<()> {
    let (sizes, decades) = spans(curves);
    let ends = (sizes.first().copied().unwrap_or(1), sizes.last().copied().unwrap_or(1));
    let margin = (f64::from(ends.1) / f64::from(ends.0)).powf(0.03).max(1.02);
    let sizes_shown = f64::from(ends.0) / margin..f64::from(ends.1) * margin;
    let ticks = ticks(&sizes, &sizes_shown);
    let powers = (decades.start..=decades.end).map(|decade| 10_f64.powi(decade));
    let between = (2..10).flat_map(|n| decades.clone().map(move |d| f64::from(n) * 10_f64.powi(d)));
    let times_shown = 10_f64.powi(decades.start)..10_f64.powi(decades.end);
    let times = times_shown.log_scale().with_key_points(powers.collect());

    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(16)
        .caption(case, ink(20))
        .x_label_area_size(46)
        .y_label_area_size(72)
        .build_cartesian_2d(
            sizes_shown.log_scale().with_key_points(ticks),
            times.with_light_points(between),
        )?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .bold_line_style(GRID)
        .light_line_style(GRID.mix(0.35))
        .axis_style(INK)
        .label_style(ink(16))
        .x_desc("size of the problem")
        .y_desc("CPU time")
        .x_label_formatter(&|size| format!("{size:.0}"))
        .y_label_formatter(&|ns| duration(*ns))
        .draw()?;
    for (name, points) in curves {
        let colour = colour(name);
        let of = |value: fn(&Point) -> f64| {
            points.iter().map(move |point| (f64::from(point.size), value(point)))
        };
        let (median, high) = (of(|point| point.p50_ns), of(|point| point.p99_ns));
        chart.draw_series(LineSeries::new(high, colour.mix(0.6).stroke_width(1)))?;
        chart.draw_series(LineSeries::new(median.clone(), colour.stroke_width(2)))?;
        chart.draw_series(median.map(|at| Circle::new(at, 3, colour.filled())))?;
    }
    Ok(())
}

/// The sizes of all points, and the decades of nanoseconds that hold them.
fn spans(curves: &Curves) -> (BTreeSet<u32>, Range<i32>) {
    let points = || curves.values().flatten();
    let low = points().map(|point| point.p50_ns).fold(f64::INFINITY, f64::min);
    let high = points().map(|point| point.p99_ns).fold(1.0, f64::max);
    let low = low.min(high).log10().floor() as i32;
    (points().map(|point| point.size).collect(), low..(high.log10().ceil() as i32).max(low + 1))
}

/// The sizes that are labelled: as many as stand clear of each other.
fn ticks(sizes: &BTreeSet<u32>, shown: &Range<f64>) -> Vec<f64> {
    let apart = TICK_SHARE_MIN * (shown.end / shown.start).ln();
    let mut ticks: Vec<f64> = Vec::new();
    for size in sizes.iter().copied().map(f64::from) {
        if ticks.last().is_none_or(|last| (size / last).ln() >= apart) {
            ticks.push(size);
        }
    }
    ticks
}

fn draw_legend(area: &Area<'_>, cases: &BTreeMap<String, Curves>) -> Drawn<()> {
    let names: BTreeSet<&str> = cases.values().flat_map(|c| c.keys().map(String::as_str)).collect();
    let known = RUNGS.iter().map(|(name, _)| *name).filter(|name| names.contains(name));
    let others = names.iter().copied().filter(|n| RUNGS.iter().all(|(known, _)| known != n));
    for (name, row) in known.chain(others).zip(0..) {
        let (colour, y) = (colour(name), 44 + 22 * row);
        area.draw(&PathElement::new([(4, y), (30, y)], colour.stroke_width(2)))?;
        area.draw(&Circle::new((17, y), 3, colour.filled()))?;
        let style = left(16);
        area.draw(&Text::new(name.to_owned(), (38, y), style))?;
    }
    Ok(())
}

fn colour(name: &str) -> RGBColor {
    RUNGS.iter().find(|(known, _)| *known == name).map_or(OTHER, |(_, colour)| *colour)
}

/// A power of ten of nanoseconds, for people.
fn duration(ns: f64) -> String {
    let (unit_ns, unit) = match ns {
        ..1e3 => (1.0, "ns"),
        ..1e6 => (1e3, "µs"),
        ..1e9 => (1e6, "ms"),
        _ => (1e9, "s"),
    };
    format!("{:.0} {unit}", ns / unit_ns)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(size: u32, ns: f64) -> Point {
        Point { size, p50_ns: ns, p99_ns: 2.0 * ns }
    }

    /// The centres (x, y) of the points of a colour, in the order of their sizes.
    fn centres(svg: &str, colour: &str) -> Vec<[f64; 2]> {
        let value = |line: &str, key: &str| -> f64 {
            let (_, rest) = line.split_once(&format!(" {key}=\"")).unwrap();
            rest.split_once('"').unwrap().0.parse().unwrap()
        };
        let circles = svg.lines().filter(|line| line.starts_with("<circle "));
        let of_colour = circles.filter(|line| line.contains(&format!("fill=\"{colour}\"")));
        of_colour.map(|line| [value(line, "cx"), value(line, "cy")]).collect()
    }

    #[test]
    fn decades_are_told_in_units_that_people_use() {
        let told = [0, 2, 3, 5, 6, 9, 10].map(|decade| duration(10_f64.powi(decade)));
        assert_eq!(told, ["1 ns", "100 ns", "1 µs", "100 µs", "1 ms", "1 s", "10 s"]);
    }

    #[test]
    fn more_is_higher_and_further_right() {
        let points = vec![point(4, 1e3), point(8, 1e3), point(40, 1e6)];
        let curves = BTreeMap::from([("search".to_owned(), points)]);
        let svg = draw(&BTreeMap::from([("blocks & <rings>".to_owned(), curves)])).unwrap();
        // The last one belongs to the legend.
        let at = centres(&svg, "#FF7F0E");
        assert_eq!(at.len(), 4);
        assert!(at[0][0] < at[1][0] && at[1][0] < at[2][0], "{at:?}");
        assert!(at[0][1] == at[1][1] && at[2][1] < at[1][1] - 100.0, "{at:?}");
        assert!(svg.contains("blocks &amp; &lt;rings&gt;"), "{svg}");
    }

    #[test]
    fn labelled_sizes_stand_clear_of_each_other() {
        let sizes = BTreeSet::from([1, 2, 3, 4, 100, 101, 200]);
        assert_eq!(ticks(&sizes, &(1.0..200.0)), [1.0, 2.0, 3.0, 100.0, 200.0]);
        assert_eq!(ticks(&BTreeSet::from([7]), &(6.9..7.1)), [7.0]);
    }

    #[test]
    fn nothing_and_one_point_are_drawn_too() {
        assert!(draw(&BTreeMap::new()).unwrap().trim_end().ends_with("</svg>"));
        let curves = BTreeMap::from([("other".to_owned(), vec![point(7, 5.0)])]);
        let svg =
            draw(&BTreeMap::from([("one".to_owned(), curves), ("two".to_owned(), Curves::new())]));
        assert_eq!(centres(&svg.unwrap(), "#8C8C8C").len(), 2);
    }
}
