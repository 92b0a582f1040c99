//! Success over the factors of a sweep as a picture: curves with their 95 % intervals over a factor of numbers,
//! bars for the levels of any other.

use plotters::prelude::{
    ChartBuilder, Circle, Color as _, IntoDrawingArea as _, LineSeries, PathElement, Polygon,
    RGBColor, Rectangle, SVGBackend, Text, WHITE,
};
use plotters::style::text_anchor::HPos;

use super::record::SweepRecord;
use super::report::{SweepLevel, SweepReport, SweepTally};
use crate::plots::{Area, COLOURS, Drawn, GRID, INK, PlotError, at, ink, left};

/// Width and height of one panel with its axes, in pixels.
const PANEL: (u32, u32) = (480, 340);
/// Panels side by side.
const COLUMNS: usize = 2;
/// Height of title and legend.
const HEAD_HEIGHT: u32 = 84;
/// Opacity of an interval.
const BAND_ALPHA: f64 = 0.18;
/// Width of the names of levels beside bars.
const NAMES_WIDTH: i32 = 150;
/// Width of the bars.
const BAR_WIDTH: i32 = 230;
/// Height of a bar with the space below it, at most.
const BAR_ROW_MAX: i32 = 24;
/// Height of a panel's caption and of the axis below bars.
const CAPTION_HEIGHT: i32 = 40;
const AXIS_HEIGHT: i32 = 36;
/// Characters of a level's name that are shown.
const NAME_CHARS_MAX: usize = 20;

/// One curve.
struct Curve {
    name: String,
    colour: RGBColor,
    points: Vec<(f64, SweepTally)>,
}

/// What one panel shows.
enum Panel {
    Curves { caption: String, x: String, curves: Vec<Curve> },
    Bars { caption: String, levels: Vec<SweepLevel> },
}

/// Draws a report as SVG. `records` are those that it counts.
///
/// # Errors
/// [`PlotError`] when a panel cannot be laid out.
pub fn plot_sweep(report: &SweepReport, records: &[SweepRecord]) -> Result<String, PlotError> {
    draw(report, &panels(report, records)).map_err(PlotError::of("a sweep"))
}

/// One panel for each level of the factor `panel`, with curves over `x`; without `x`, one for each factor.
fn panels(report: &SweepReport, records: &[SweepRecord]) -> Vec<Panel> {
    let layout = &report.layout;
    let of = |factor: &str| -> Vec<SweepLevel> {
        report.levels.iter().filter(|level| level.factor == factor).cloned().collect()
    };
    if layout.x.is_empty() {
        let mut factors: Vec<&str> = report.levels.iter().map(|l| l.factor.as_str()).collect();
        factors.dedup();
        let bars = |factor: &str| Panel::Bars { caption: factor.to_owned(), levels: of(factor) };
        return factors.into_iter().map(bars).collect();
    }
    let one = || vec![String::new()];
    let names = |factor: &str| match factor {
        "" => one(),
        factor => of(factor).into_iter().map(|level| level.level).collect(),
    };
    let has = |record: &&SweepRecord, factor: &str, level: &str| {
        factor.is_empty() || record.factors.get(factor).is_some_and(|known| known == level)
    };
    let panel = |panel: String| {
        let curve = |(name, colour): (String, RGBColor)| {
            let of_x = of(&layout.x).into_iter();
            let mut points: Vec<(f64, SweepTally)> = of_x
                .filter_map(|level| {
                    let mine = records.iter().filter(|r| {
                        has(r, &layout.panel, &panel)
                            && has(r, &layout.by, &name)
                            && has(r, &layout.x, &level.level)
                    });
                    Some((level.level.parse().ok()?, SweepTally::of(mine)))
                })
                .collect();
            points.sort_by(|(a, _), (b, _)| a.total_cmp(b));
            Curve { name, colour, points }
        };
        let colours = COLOURS.iter().copied().cycle();
        let curves = names(&layout.by).into_iter().zip(colours).map(curve).collect();
        Panel::Curves { caption: panel.clone(), x: layout.x.clone(), curves }
    };
    names(&layout.panel).into_iter().map(panel).collect()
}

fn draw(report: &SweepReport, panels: &[Panel]) -> Drawn<String> {
    let n_columns = panels.len().clamp(1, COLUMNS);
    let n_lines = panels.len().div_ceil(COLUMNS).max(1);
    let size = (PANEL.0 * n_columns as u32, HEAD_HEIGHT + PANEL.1 * n_lines as u32);
    let mut svg = String::new();
    {
        let whole = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        whole.fill(&WHITE)?;
        let (head, body) = whole.split_vertically(HEAD_HEIGHT);
        draw_head(&head, report, panels)?;
        let areas = body.split_evenly((n_lines, n_columns));
        for (area, panel) in areas.iter().zip(panels) {
            match panel {
                Panel::Curves { caption, x, curves } => draw_curves(area, (caption, x), curves)?,
                Panel::Bars { caption, levels } => draw_bars(area, caption, levels)?,
            }
        }
        whole.present()?;
    }
    Ok(svg)
}

fn draw_head(area: &Area<'_>, report: &SweepReport, panels: &[Panel]) -> Drawn<()> {
    let title = &report.layout.title;
    let title = if title.is_empty() { &report.name } else { title };
    area.draw(&Text::new(title.clone(), (16, 24), left(25)))?;
    let n = report.all.episodes;
    let how = format!("{n} episodes; bands and whiskers: 95 % intervals (Wilson)");
    area.draw(&Text::new(how, (16, 46), left(16)))?;
    let Some(Panel::Curves { curves, .. }) = panels.first() else { return Ok(()) };
    let mut x = 16;
    for Curve { name, colour, .. } in curves.iter().filter(|curve| !curve.name.is_empty()) {
        area.draw(&PathElement::new([(x, 68), (x + 26, 68)], colour.stroke_width(3)))?;
        area.draw(&Circle::new((x + 13, 68), 4, colour.filled()))?;
        let name = name.replace('_', " ");
        let width = 8 * i32::try_from(name.chars().count()).unwrap_or(0);
        area.draw(&Text::new(name, (x + 34, 68), left(18)))?;
        x += 60 + width;
    }
    Ok(())
}

fn draw_curves(area: &Area<'_>, (caption, x): (&str, &str), curves: &[Curve]) -> Drawn<()> {
    let places = || curves.iter().flat_map(|curve| curve.points.iter().map(|(x, _)| *x));
    // Zero belongs to an axis of rates and counts; of other numbers, the least one begins it.
    let low = places().fold(0.0, f64::min);
    let high = places().fold(low, f64::max);
    let margin = if high > low { 0.02 * (high - low) } else { 1.0 };
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(20)
        .caption(caption, ink(19))
        .x_label_area_size(44)
        .y_label_area_size(62)
        .build_cartesian_2d(low..high + margin, 0.0..1.03)?;
    let x = x.replace('_', " ");
    chart
        .configure_mesh()
        .disable_x_mesh()
        .bold_line_style(GRID)
        .light_line_style(WHITE)
        .axis_style(INK)
        .label_style(ink(16))
        .y_labels(6)
        .x_labels(7)
        .x_desc(x)
        .y_desc("success")
        .y_label_formatter(&|share| format!("{:.0} %", share * 100.0))
        .draw()?;
    for Curve { colour, points, .. } in curves {
        let edge =
            |idx: usize| points.iter().map(move |(x, tally)| (*x, tally.success_share_95[idx]));
        let band: Vec<(f64, f64)> = edge(0).chain(edge(1).rev()).collect();
        chart.draw_series(std::iter::once(Polygon::new(band, colour.mix(BAND_ALPHA))))?;
        let shares = points.iter().filter_map(|(x, tally)| Some((*x, tally.share()?)));
        chart.draw_series(LineSeries::new(shares.clone(), colour.stroke_width(2)))?;
        chart.draw_series(shares.map(|at| Circle::new(at, 4, colour.filled())))?;
    }
    Ok(())
}

fn draw_bars(area: &Area<'_>, caption: &str, levels: &[SweepLevel]) -> Drawn<()> {
    area.draw(&Text::new(caption.replace('_', " "), (NAMES_WIDTH, 20), left(19)))?;
    let room = PANEL.1.cast_signed() - CAPTION_HEIGHT - AXIS_HEIGHT;
    let n = i32::try_from(levels.len()).unwrap_or(i32::MAX).max(1);
    let row = (room / n).clamp(4, BAR_ROW_MAX);
    let x_of = |share: f64| NAMES_WIDTH + (f64::from(BAR_WIDTH) * share) as i32;
    let bottom = CAPTION_HEIGHT + row * n;
    for quarter in 0..=4 {
        let share = f64::from(quarter) / 4.0;
        let line = [(x_of(share), CAPTION_HEIGHT - 4), (x_of(share), bottom + 2)];
        area.draw(&PathElement::new(line, GRID.stroke_width(1)))?;
        let label = format!("{} %", 25 * quarter);
        area.draw(&Text::new(label, (x_of(share), bottom + 12), ink(16).pos(at(HPos::Center))))?;
    }
    for (SweepLevel { level, tally, .. }, line) in levels.iter().zip(0..) {
        let (top, middle) =
            (CAPTION_HEIGHT + row * line, CAPTION_HEIGHT + row * line + row * 2 / 5);
        let name: String = level.chars().take(NAME_CHARS_MAX).collect();
        let right = ink(16).pos(at(HPos::Right));
        area.draw(&Text::new(name, (NAMES_WIDTH - 8, middle), right))?;
        let end = x_of(tally.share().unwrap_or(0.0));
        let bar = [(NAMES_WIDTH, top), (end, top + row * 4 / 5)];
        area.draw(&Rectangle::new(bar, COLOURS[0].mix(0.75).filled()))?;
        let [low, high] = tally.success_share_95.map(x_of);
        area.draw(&PathElement::new([(low, middle), (high, middle)], INK.stroke_width(1)))?;
        for x in [low, high] {
            area.draw(&PathElement::new([(x, middle - 3), (x, middle + 3)], INK.stroke_width(1)))?;
        }
        let count = format!("{}/{}", tally.successes, tally.episodes);
        area.draw(&Text::new(count, (NAMES_WIDTH + BAR_WIDTH + 10, middle), left(16)))?;
    }
    Ok(())
}
