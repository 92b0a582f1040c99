//! Latency over size as a picture: one panel for each case, one curve for each rung, both axes
//! logarithmic. Full curves are medians of thread-CPU time, dashed ones 99th percentiles.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use super::logs::Logs;
use super::measure::{Quantiles, Timing};
use super::report::Report;

/// Rungs with their colours, in the order of the legend; what is not among them is grey.
const COLOURS: &[(&str, &str)] = &[
    ("cold", "#7f7f7f"),
    ("goal", "#bcbd22"),
    ("unchanged", "#c49c94"),
    ("trajectory", "#2ca02c"),
    ("suffix", "#17becf"),
    ("table", "#1f77b4"),
    ("mutex", "#e377c2"),
    ("search", "#ff7f0e"),
    ("improve", "#9467bd"),
    ("none", "#c7c7c7"),
    ("late", "#d62728"),
    ("fast-downward", "#000000"),
];
/// The colour of anything else.
const OTHER: &str = "#555555";

/// Measures of one panel, in pixels.
const PANEL: [f64; 2] = [460.0, 340.0];
/// Room for the axes' figures: left, top, right, bottom.
const ROOM: [f64; 4] = [64.0, 34.0, 14.0, 46.0];
/// Panels side by side.
const COLUMNS: usize = 2;
/// Height of the legend.
const LEGEND: f64 = 58.0;

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
pub fn plot(report: &Report, logs: &Logs) -> String {
    let cases = curves(report, logs);
    let n_rows = cases.len().div_ceil(COLUMNS).max(1);
    let n_columns = cases.len().clamp(1, COLUMNS);
    let (width, height) = (PANEL[0] * n_columns as f64, PANEL[1] * n_rows as f64 + LEGEND);
    let mut svg = Svg::default();
    svg.line(&format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         width=\"{width}\" height=\"{height}\" font-family=\"sans-serif\" font-size=\"12\">"
    ));
    svg.line(&format!("<rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>"));
    for (at, (case, curves)) in cases.iter().enumerate() {
        let corner = [(at % COLUMNS) as f64 * PANEL[0], (at / COLUMNS) as f64 * PANEL[1]];
        Panel::new(corner, curves).draw(case, curves, &mut svg);
    }
    let names: BTreeSet<&str> = cases.values().flat_map(|c| c.keys().map(String::as_str)).collect();
    legend(&names, [16.0, PANEL[1] * n_rows as f64 + 14.0], width, &mut svg);
    svg.line("</svg>");
    svg.0
}

fn curves(report: &Report, logs: &Logs) -> BTreeMap<String, Curves> {
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
        let Quantiles { p50, p99, .. } = Quantiles::of(times.iter().copied());
        if p50 > 0 {
            let point = Point { size, p50_ns: p50 as f64, p99_ns: p99 as f64 };
            let curves = cases.entry(case.to_owned()).or_default();
            curves.entry(name.to_owned()).or_default().push(point);
        }
    }
    cases
}

/// SVG text.
#[derive(Default)]
struct Svg(String);

impl Svg {
    fn line(&mut self, text: &str) {
        self.0.push_str(text);
        self.0.push('\n');
    }

    fn text(&mut self, [x, y]: [f64; 2], anchor: &str, text: &str) {
        let text = text.replace('&', "&amp;").replace('<', "&lt;");
        self.line(&format!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>"
        ));
    }

    fn segment(&mut self, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], style: &str) {
        self.line(&format!(
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" {style}/>"
        ));
    }

    fn curve(&mut self, points: &[[f64; 2]], style: &str) {
        let mut text = String::new();
        for [x, y] in points {
            // Writing to a string cannot fail.
            if write!(text, "{x:.1},{y:.1} ").is_err() {
                return;
            }
        }
        self.line(&format!("<polyline points=\"{}\" fill=\"none\" {style}/>", text.trim_end()));
    }
}

/// One panel: where it lies, and what its axes span.
struct Panel {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
    sizes: Vec<u32>,
    /// Decades of nanoseconds.
    decades: [i32; 2],
}

impl Panel {
    fn new([x, y]: [f64; 2], curves: &Curves) -> Self {
        let points = || curves.values().flatten();
        let sizes: BTreeSet<u32> = points().map(|point| point.size).collect();
        let low = points().map(|p| p.p50_ns.log10()).fold(f64::INFINITY, f64::min);
        let high = points().map(|p| p.p99_ns.log10()).fold(f64::NEG_INFINITY, f64::max);
        let low = if low.is_finite() { low.floor() as i32 } else { 0 };
        let high = if high.is_finite() { high.ceil() as i32 } else { 1 };
        Self {
            left: x + ROOM[0],
            top: y + ROOM[1],
            right: x + PANEL[0] - ROOM[2],
            bottom: y + PANEL[1] - ROOM[3],
            sizes: sizes.into_iter().collect(),
            decades: [low, high.max(low + 1)],
        }
    }

    fn x(&self, size: u32) -> f64 {
        let log = |size: u32| f64::from(size.max(1)).ln();
        let (first, last) = (self.sizes.first().copied(), self.sizes.last().copied());
        let (low, high) = (log(first.unwrap_or(1)), log(last.unwrap_or(1)));
        let share = if high > low { (log(size) - low) / (high - low) } else { 0.5 };
        let margin = 14.0;
        self.left + margin + share * (self.right - self.left - 2.0 * margin)
    }

    fn y(&self, ns: f64) -> f64 {
        let [low, high] = self.decades.map(f64::from);
        let share = (ns.max(1.0).log10() - low) / (high - low);
        self.bottom - share.clamp(0.0, 1.0) * (self.bottom - self.top)
    }

    fn draw(&self, case: &str, curves: &Curves, svg: &mut Svg) {
        let middle = f64::midpoint(self.left, self.right);
        svg.text([middle, self.top - 12.0], "middle", case);
        svg.text([middle, self.bottom + 36.0], "middle", "size");
        for decade in self.decades[0]..=self.decades[1] {
            let y = self.y(10_f64.powi(decade));
            svg.segment([self.left, y], [self.right, y], "stroke=\"#dddddd\"");
            svg.text([self.left - 6.0, y + 4.0], "end", &duration(decade));
        }
        let mut free_from = f64::NEG_INFINITY;
        for &size in &self.sizes {
            let x = self.x(size);
            svg.segment([x, self.bottom], [x, self.bottom + 4.0], "stroke=\"#333333\"");
            if x >= free_from {
                svg.text([x, self.bottom + 18.0], "middle", &size.to_string());
                free_from = x + 20.0;
            }
        }
        let corners = [[self.left, self.top], [self.left, self.bottom], [self.right, self.bottom]];
        svg.curve(&corners, "stroke=\"#333333\"");
        for (name, points) in curves {
            let colour = colour(name);
            let of = |value: fn(&Point) -> f64| -> Vec<[f64; 2]> {
                points.iter().map(|point| [self.x(point.size), self.y(value(point))]).collect()
            };
            let style = format!("stroke=\"{colour}\" stroke-width=\"2\"");
            svg.curve(&of(|point| point.p50_ns), &style);
            let style = format!("stroke=\"{colour}\" stroke-dasharray=\"4 3\" opacity=\"0.7\"");
            svg.curve(&of(|point| point.p99_ns), &style);
            for [x, y] in of(|point| point.p50_ns) {
                svg.line(&format!(
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{colour}\"/>"
                ));
            }
        }
    }
}

fn legend(names: &BTreeSet<&str>, [left, top]: [f64; 2], width: f64, svg: &mut Svg) {
    let known = COLOURS.iter().map(|(name, _)| *name).filter(|name| names.contains(name));
    let others = names.iter().copied().filter(|n| COLOURS.iter().all(|(known, _)| known != n));
    let [mut x, mut y] = [left, top];
    for name in known.chain(others) {
        // Letters are about seven pixels wide.
        let wide = 44.0 + 7.0 * name.len() as f64;
        if x + wide > width {
            [x, y] = [left, y + 18.0];
        }
        let style = format!("stroke=\"{}\" stroke-width=\"2\"", colour(name));
        svg.segment([x, y - 4.0], [x + 22.0, y - 4.0], &style);
        svg.text([x + 28.0, y], "start", name);
        x += wide;
    }
    let text = "thread-CPU time of one plan: full median, dashed 99th percentile";
    svg.text([left, y + 20.0], "start", text);
}

fn colour(name: &str) -> &'static str {
    COLOURS.iter().find(|(known, _)| *known == name).map_or(OTHER, |(_, colour)| colour)
}

/// A power of ten of nanoseconds, for people.
fn duration(decade: i32) -> String {
    let units = ["ns", "µs", "ms", "s"];
    let unit = (decade.max(0) / 3).min(3);
    let number = 10_u64.pow(u32::try_from(decade.max(0) - 3 * unit).unwrap_or(0));
    format!("{number} {}", units[unit as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_are_told_in_units_that_people_use() {
        let told = [0, 2, 3, 5, 6, 9, 10].map(duration);
        assert_eq!(told, ["1 ns", "100 ns", "1 µs", "100 µs", "1 ms", "1 s", "10 s"]);
    }

    #[test]
    fn more_is_higher_and_further_right() {
        let point = |size, ns| Point { size, p50_ns: ns, p99_ns: ns };
        let curves = BTreeMap::from([("search".to_owned(), vec![point(4, 1e3), point(40, 1e6)])]);
        let panel = Panel::new([0.0, 0.0], &curves);
        assert!(panel.x(4) < panel.x(8) && panel.x(8) < panel.x(40));
        assert!(panel.y(1e3) > panel.y(1e6) && panel.y(1e6) >= panel.top);
        assert!((panel.x(4) + panel.x(40) - panel.left - panel.right).abs() < 1e-9);
    }
}
