//! What disturbed pictures are worth as a picture: one panel for each set of pictures, one stacked bar
//! for each disturbance.

use plotters::prelude::{
    Color as _, IntoDrawingArea as _, IntoFont as _, PathElement, RGBColor, Rectangle, SVGBackend,
    Text, WHITE,
};
use plotters::style::text_anchor::HPos;

use super::report::{RobustnessReport, RobustnessRow};
use crate::plots::{Area, Drawn, GRID, INK, PlotError, at, ink, left};

/// One part of a bar.
struct Part {
    name: &'static str,
    colour: RGBColor,
    /// The colour of a number on it.
    ink: RGBColor,
    count: fn(&RobustnessRow) -> u32,
}

/// From good to bad. Hues along blue and yellow, which colour-blind people tell apart too (Okabe and
/// Ito, 2008), and neighbours of different lightness; the numbers say the same.
const PARTS: [Part; 4] = [
    Part { name: "right", colour: RGBColor(0x00, 0x72, 0xb2), ink: WHITE, count: |r| r.right },
    Part { name: "unknown", colour: RGBColor(0xbf, 0xe0, 0xf3), ink: INK, count: |r| r.unknown },
    Part {
        name: "wrong, doubted",
        colour: RGBColor(0xf7, 0xc9, 0x4b),
        ink: INK,
        count: |r| r.doubted,
    },
    Part {
        name: "wrong, silent",
        colour: RGBColor(0xb8, 0x47, 0x00),
        ink: WHITE,
        count: |r| r.silent,
    },
];

/// Panels side by side.
const COLUMNS: usize = 2;
/// Width of one panel, in pixels.
const PANEL_WIDTH: u32 = 600;
/// Height of title and legend.
const HEAD_HEIGHT: u32 = 96;
/// Height of a panel's caption.
const CAPTION_HEIGHT: i32 = 34;
/// Height of the axis below the bars.
const AXIS_HEIGHT: i32 = 36;
/// Height of one bar with the space below it, and of the bar alone.
const ROW: (i32, i32) = (22, 17);
/// Width of the names of disturbances.
const NAMES_WIDTH: i32 = 150;
/// Width of the bars.
const BAR_WIDTH: i32 = 420;
/// A part that is narrower shows no number.
const NUMBERED_WIDTH_MIN: i32 = 16;

/// Draws a report as SVG.
///
/// # Errors
/// [`PlotError`] when a panel cannot be laid out.
pub fn plot(report: &RobustnessReport) -> Result<String, PlotError> {
    draw(report).map_err(PlotError::of("disturbed pictures"))
}

fn draw(report: &RobustnessReport) -> Drawn<String> {
    let panels: Vec<(String, Vec<RobustnessRow>)> =
        report.sets().into_iter().map(|set| (set.to_owned(), rows(report, set))).collect();
    let n_columns = panels.len().clamp(1, COLUMNS);
    let n_lines = panels.len().div_ceil(COLUMNS).max(1) as u32;
    let n_bars = panels.iter().map(|(_, rows)| rows.len()).max();
    let n_bars = pixels(n_bars.unwrap_or(0));
    let panel_height = (CAPTION_HEIGHT + ROW.0 * n_bars + AXIS_HEIGHT) as u32;
    let size = (PANEL_WIDTH * n_columns as u32, HEAD_HEIGHT + panel_height * n_lines);
    let mut svg = String::new();
    {
        let whole = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        whole.fill(&WHITE)?;
        let (head, body) = whole.split_vertically(HEAD_HEIGHT);
        draw_head(&head, report)?;
        let areas = body.split_evenly((n_lines as usize, n_columns));
        for (area, (set, rows)) in areas.iter().zip(&panels) {
            draw_panel(area, set, rows)?;
        }
        whole.present()?;
    }
    Ok(svg)
}

/// The bars of a set: every disturbance, then their sum where there are several.
fn rows(report: &RobustnessReport, set: &str) -> Vec<RobustnessRow> {
    let of_set = || report.rows.iter().filter(|row| row.pictures == set);
    let known = report.transforms().filter_map(|name| report.row(set, name));
    // A saved report may have disturbances that this version does not know.
    let others = of_set().filter(|row| report.transforms().all(|name| name != row.transform));
    let mut rows: Vec<RobustnessRow> = known.chain(others).cloned().collect();
    if rows.len() > 1 {
        rows.push(report.total(set));
    }
    rows
}

/// A count, for a product with pixels.
fn pixels(count: usize) -> i32 {
    i32::try_from(count).unwrap_or(i32::MAX)
}

fn draw_head(area: &Area<'_>, report: &RobustnessReport) -> Drawn<()> {
    area.draw(&Text::new("What is read off disturbed pictures", (16, 24), left(27)))?;
    let RobustnessReport { detector, grounder, seed, .. } = report;
    let how = format!(
        "share of states by disturbance, with their numbers; (hides): unknown is as good as right. \
         Detector {detector}, grounder {grounder}, seed {seed}"
    );
    area.draw(&Text::new(how, (16, 50), left(16)))?;
    let mut x = 16;
    for part in &PARTS {
        area.draw(&Rectangle::new([(x, 70), (x + 16, 86)], part.colour.filled()))?;
        area.draw(&Text::new(part.name, (x + 22, 78), left(18)))?;
        x += 50 + 8 * pixels(part.name.len());
    }
    Ok(())
}

fn draw_panel(area: &Area<'_>, set: &str, rows: &[RobustnessRow]) -> Drawn<()> {
    area.draw(&Text::new(set.to_owned(), (NAMES_WIDTH, 16), left(20)))?;
    let bottom = CAPTION_HEIGHT + ROW.0 * pixels(rows.len());
    for quarter in 0..=4 {
        let x = NAMES_WIDTH + BAR_WIDTH * quarter / 4;
        let line = [(x, CAPTION_HEIGHT - 4), (x, bottom + 2)];
        area.draw(&PathElement::new(line, GRID.stroke_width(1)))?;
        let label = format!("{} %", 25 * quarter);
        area.draw(&Text::new(label, (x, bottom + 12), ink(16).pos(at(HPos::Center))))?;
    }
    for (row, line) in rows.iter().zip(0..) {
        draw_bar(area, row, CAPTION_HEIGHT + ROW.0 * line)?;
    }
    Ok(())
}

fn draw_bar(area: &Area<'_>, row: &RobustnessRow, y: i32) -> Drawn<()> {
    let name = row.label();
    let middle = y + ROW.1 / 2;
    area.draw(&Text::new(name, (NAMES_WIDTH - 8, middle), ink(17).pos(at(HPos::Right))))?;
    let n = f64::from(row.n().max(1));
    let x_of = |states: u32| NAMES_WIDTH + (f64::from(BAR_WIDTH) * f64::from(states) / n) as i32;
    let mut before = 0;
    for part in &PARTS {
        let count = (part.count)(row);
        let (left, right) = (x_of(before), x_of(before + count));
        before += count;
        if count == 0 {
            continue;
        }
        area.draw(&Rectangle::new([(left, y), (right, y + ROW.1)], part.colour.filled()))?;
        area.draw(&Rectangle::new([(left, y), (right, y + ROW.1)], WHITE.stroke_width(1)))?;
        if right - left >= NUMBERED_WIDTH_MIN {
            let style = ("sans-serif", 15).into_font().color(&part.ink).pos(at(HPos::Center));
            area.draw(&Text::new(count.to_string(), (i32::midpoint(left, right), middle), style))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(pictures: &str, transform: &str, counts: [u32; 4]) -> RobustnessRow {
        let [right, unknown, doubted, silent] = counts;
        let (pictures, transform) = (pictures.to_owned(), transform.to_owned());
        let right_share_95 = [0.0, 1.0];
        RobustnessRow {
            hides: transform == "pole",
            pictures,
            transform,
            right,
            unknown,
            doubted,
            silent,
            right_share_95,
        }
    }

    fn report(rows: Vec<RobustnessRow>) -> RobustnessReport {
        RobustnessReport { rows, ..RobustnessReport::new("colour", "s2s-joint", 1) }
    }

    /// Left edge, upper edge and width of every filled rectangle of a colour below the legend.
    fn bars(svg: &str, colour: &str) -> Vec<[i32; 3]> {
        let value = |line: &str, key: &str| -> i32 {
            let (_, rest) = line.split_once(&format!(" {key}=\"")).unwrap();
            rest.split_once('"').unwrap().0.parse().unwrap()
        };
        let lines = svg.lines().filter(|line| line.starts_with("<rect "));
        let of_colour = lines.filter(|line| line.contains(&format!("fill=\"{colour}\"")));
        let bars = of_colour.map(|line| ["x", "y", "width"].map(|key| value(line, key)));
        bars.filter(|[_, y, _]| *y > HEAD_HEIGHT.cast_signed()).collect()
    }

    #[test]
    fn parts_of_a_bar_follow_each_other_and_are_as_wide_as_their_shares() {
        let svg = draw(&report(vec![row("blocks & <rings>", "none", [10, 5, 0, 5])])).unwrap();
        let [right, unknown, silent] =
            ["#0072B2", "#BFE0F3", "#B84700"].map(|colour| bars(&svg, colour));
        let y = HEAD_HEIGHT.cast_signed() + CAPTION_HEIGHT;
        assert_eq!(right, [[NAMES_WIDTH, y, BAR_WIDTH / 2]]);
        assert_eq!(unknown, [[NAMES_WIDTH + BAR_WIDTH / 2, y, BAR_WIDTH / 4]]);
        assert_eq!(silent, [[NAMES_WIDTH + BAR_WIDTH * 3 / 4, y, BAR_WIDTH / 4]]);
        assert_eq!(bars(&svg, "#F7C94B"), [[0; 3]; 0], "none is doubted");
        assert!(svg.contains("blocks &amp; &lt;rings&gt;"), "{svg}");
    }

    #[test]
    fn each_set_has_a_panel_with_every_disturbance_and_their_sum() {
        let rows = [("a", "pole"), ("a", "none"), ("a", "from an older version"), ("b", "none")];
        let rows = rows.map(|(set, transform)| row(set, transform, [4, 0, 0, 0])).to_vec();
        let svg = draw(&report(rows)).unwrap();
        let right = bars(&svg, "#0072B2");
        let in_panel =
            |at: i32| right.iter().filter(|b| b[0] / PANEL_WIDTH.cast_signed() == at).count();
        // Of one disturbance there is no sum.
        assert_eq!([in_panel(0), in_panel(1)], [4, 1]);
        let place = |text: &str| svg.find(text).unwrap_or_else(|| panic!("{text}: {svg}"));
        assert!(place("\nnone\n") < place("\npole (hides)\n"), "in the order of the table");
        assert!(place("\npole (hides)\n") < place("\nfrom an older version\n"));
        assert!(place("\nfrom an older version\n") < place("\nall\n"));
    }

    #[test]
    fn a_report_of_nothing_is_drawn_too() {
        assert!(draw(&report(Vec::new())).unwrap().trim_end().ends_with("</svg>"));
        let svg = draw(&report(vec![row("a", "none", [0; 4])])).unwrap();
        assert_eq!(bars(&svg, "#0072B2"), [[0; 3]; 0]);
    }
}
