//! Task success over the rate of faults as a picture: one panel for each run file, one curve for the closed and one
//! for the open loop, each with its 95 % intervals.

use std::io;

use plotters::coord::Shift;
use plotters::prelude::{
    ChartBuilder, Circle, Color as _, DrawingArea, DrawingAreaErrorKind, IntoDrawingArea as _,
    IntoFont as _, LineSeries, PathElement, Polygon, RGBColor, SVGBackend, Text, TextStyle, WHITE,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use thiserror::Error;

use super::report::{FaultsReport, FaultsRow};

/// The modes in the order of the legend, each with its name for people and its colour: blue and orange,
/// which colour-blind people tell apart too (Okabe and Ito, 2008).
const CURVES: [(&str, &str, RGBColor); 2] = [
    ("closed_loop", "closed loop", RGBColor(0x00, 0x72, 0xb2)),
    ("open_loop", "open loop", RGBColor(0xd5, 0x5e, 0x00)),
];
/// Text and axes.
const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
/// Lines across a panel.
const GRID: RGBColor = RGBColor(0xdd, 0xdd, 0xdd);

/// Width and height of one panel with its axes, in pixels.
const PANEL: (u32, u32) = (480, 340);
/// Panels side by side.
const COLUMNS: usize = 2;
/// Height of title and legend.
const HEAD_HEIGHT: u32 = 84;
/// Opacity of an interval.
const BAND_ALPHA: f64 = 0.18;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn<T> = Result<T, DrawingAreaErrorKind<io::Error>>;

/// The picture cannot be laid out.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("the plot of success under faults: {reason}")]
pub struct FaultsPlotError {
    /// What the drawing library says.
    pub reason: String,
}

/// Draws a report as SVG.
///
/// # Errors
/// [`FaultsPlotError`] when a panel cannot be laid out.
pub fn plot(report: &FaultsReport) -> Result<String, FaultsPlotError> {
    draw(report).map_err(|e| FaultsPlotError { reason: e.to_string() })
}

fn draw(report: &FaultsReport) -> Drawn<String> {
    let configs = report.configs();
    let n_columns = configs.len().clamp(1, COLUMNS);
    let n_lines = configs.len().div_ceil(COLUMNS).max(1);
    let size = (PANEL.0 * n_columns as u32, HEAD_HEIGHT + PANEL.1 * n_lines as u32);
    let mut svg = String::new();
    {
        let whole = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        whole.fill(&WHITE)?;
        let (head, body) = whole.split_vertically(HEAD_HEIGHT);
        draw_head(&head, report)?;
        let areas = body.split_evenly((n_lines, n_columns));
        for (area, config) in areas.iter().zip(configs) {
            let rows = report.rows.iter().filter(|row| row.config == config);
            draw_panel(area, config, &rows.collect::<Vec<_>>())?;
        }
        whole.present()?;
    }
    Ok(svg)
}

fn draw_head(area: &Area<'_>, report: &FaultsReport) -> Drawn<()> {
    area.draw(&Text::new("Task success over the rate of faults", (16, 24), left(25)))?;
    let [first, last] = report.seeds;
    let n = report.rows.iter().map(|row| row.episodes).max().unwrap_or(0);
    let how = format!("{n} episodes a point (seeds {first} to {last}); bands: 95 % intervals");
    area.draw(&Text::new(how, (16, 46), left(16)))?;
    let mut x = 16;
    for (_, name, colour) in CURVES {
        area.draw(&PathElement::new([(x, 68), (x + 26, 68)], colour.stroke_width(3)))?;
        area.draw(&Circle::new((x + 13, 68), 4, colour.filled()))?;
        area.draw(&Text::new(name, (x + 34, 68), left(18)))?;
        x += 150;
    }
    Ok(())
}

fn draw_panel(area: &Area<'_>, config: &str, rows: &[&FaultsRow]) -> Drawn<()> {
    let rate_max = rows.iter().map(|row| row.fault_rate).fold(0.0, f64::max);
    let rate_max = if rate_max > 0.0 { rate_max } else { 1.0 };
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(20)
        .caption(config, ink(19))
        .x_label_area_size(44)
        .y_label_area_size(62)
        .build_cartesian_2d(0.0..rate_max * 1.02, 0.0..1.03)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .bold_line_style(GRID)
        .light_line_style(WHITE)
        .axis_style(INK)
        .label_style(ink(16))
        .y_labels(6)
        .x_labels(7)
        .x_desc("faults per step")
        .y_desc("goal holds in the simulator")
        .x_label_formatter(&|rate| format!("{rate:.2}"))
        .y_label_formatter(&|share| format!("{:.0} %", share * 100.0))
        .draw()?;
    for (mode, _, colour) in CURVES {
        let mut of_mode: Vec<&&FaultsRow> = rows.iter().filter(|r| r.executive == mode).collect();
        of_mode.sort_by(|a, b| a.fault_rate.total_cmp(&b.fault_rate));
        let edge = |idx: usize| {
            let edges = of_mode.iter().map(move |r| (r.fault_rate, r.success_share_95[idx]));
            edges.collect::<Vec<_>>()
        };
        let band: Vec<(f64, f64)> = edge(0).into_iter().chain(edge(1).into_iter().rev()).collect();
        chart.draw_series(std::iter::once(Polygon::new(band, colour.mix(BAND_ALPHA))))?;
        let points = of_mode.iter().filter_map(|row| Some((row.fault_rate, row.share()?)));
        chart.draw_series(LineSeries::new(points.clone(), colour.stroke_width(2)))?;
        chart.draw_series(points.map(|at| Circle::new(at, 4, colour.filled())))?;
    }
    Ok(())
}

/// Text; sizes are those of the drawing library, a quarter larger than pixels.
fn ink(size: u32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&INK)
}

fn left(size: u32) -> TextStyle<'static> {
    ink(size).pos(Pos::new(HPos::Left, VPos::Center))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(config: &str, executive: &str, fault_rate: f64, successes: u32) -> FaultsRow {
        let success_share_95 = crate::eval::wilson_95(successes, 10);
        FaultsRow {
            episodes: 10,
            successes,
            success_share_95,
            ..FaultsRow::new(config, executive, fault_rate)
        }
    }

    #[test]
    fn each_run_file_has_a_panel_with_a_curve_for_each_mode() {
        let rows = [("a & b", "open_loop", 0.0), ("a & b", "open_loop", 0.2)]
            .into_iter()
            .chain([("a & b", "closed_loop", 0.0), ("c", "closed_loop", 0.1)]);
        let rows = rows.map(|(config, mode, rate)| row(config, mode, rate, 5)).collect();
        let svg = plot(&FaultsReport { seeds: [1, 10], rows }).unwrap();
        let points = |colour: &str| {
            let circles = svg.lines().filter(|line| line.starts_with("<circle "));
            circles.filter(|line| line.contains(&format!("fill=\"{colour}\""))).count() - 1
        };
        assert_eq!([points("#0072B2"), points("#D55E00")], [2, 2], "and one in the legend");
        assert!(svg.contains("a &amp; b"), "{svg}");
        assert!(svg.contains("10 episodes a point (seeds 1 to 10)"));
    }

    #[test]
    fn a_report_of_nothing_is_drawn_too() {
        let svg = plot(&FaultsReport::default()).unwrap();
        assert!(svg.trim_end().ends_with("</svg>"));
        let rows = vec![FaultsRow::new("a", "open_loop", 0.0)];
        plot(&FaultsReport { seeds: [1, 1], rows }).unwrap();
    }
}
