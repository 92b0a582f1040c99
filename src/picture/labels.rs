//! Name labels beside their boxes, placed so that they hide as little as possible.

use super::area::{Area, Point};
use super::canvas::{Canvas, Line};
use super::edges::Curve;
use super::text::{Face, Fonts, Style};
use super::{Item, palette};
use crate::scene::Visibility;

const NAME: Style = Style { face: Face::Mono, size: 23.0, colour: palette::TEXT };
const FACTS: Style = Style { face: Face::Mono, size: 18.0, colour: palette::MUTED };
/// Widest text of a label.
const WIDTH_MAX: f32 = 320.0;
/// Space around a label's text, and left of it for the bar of colour.
const PAD: f32 = 8.0;
const BAR: f32 = 7.0;
/// How often every label may move once all others have a place.
const ROUNDS: usize = 4;
/// Distances from the box that are tried.
const GAPS: [f32; 6] = [16.0, 34.0, 60.0, 100.0, 150.0, 210.0];
/// Steps along a side of the box that are tried, in heights or half widths of the label.
const SHIFTS: [f32; 9] = [0.0, -0.6, 0.6, -1.2, 1.2, -2.0, 2.0, -3.0, 3.0];

/// A label with its place.
#[derive(Debug, Clone)]
pub(super) struct Label {
    pub(super) area: Area,
    name: String,
    facts: String,
}

/// Places one label per item: first one after the other, then each again with the others in place.
pub(super) fn layout(
    items: &[Item<'_>],
    curves: &[Curve],
    fonts: &Fonts,
    frame: &Area,
) -> Vec<Label> {
    let mut labels: Vec<Label> = Vec::new();
    for item in items {
        let mut label = unplaced(item, fonts);
        label.area = best(item, &label.area, items, &Obstacles { curves, labels: &labels, frame });
        labels.push(label);
    }
    for _ in 0..ROUNDS {
        for (idx, item) in items.iter().enumerate() {
            let mut others = labels.clone();
            let size = others.remove(idx).area;
            let obstacles = Obstacles { curves, labels: &others, frame };
            labels[idx].area = best(item, &size, items, &obstacles);
        }
    }
    labels
}

/// What a label should keep off.
#[derive(Debug)]
struct Obstacles<'a> {
    curves: &'a [Curve],
    labels: &'a [Label],
    frame: &'a Area,
}

fn unplaced(item: &Item<'_>, fonts: &Fonts) -> Label {
    let name = fonts.cut(item.mark.name.as_str(), NAME, WIDTH_MAX);
    let mut facts = item.mark.facts.clone();
    match item.mark.visibility {
        Visibility::Hidden => facts.insert(0, "hidden".to_owned()),
        Visibility::Held if facts.is_empty() => facts.push("held".to_owned()),
        Visibility::Held | Visibility::Visible | Visibility::Implied => {}
    }
    let facts = fonts.cut(&facts.join(" · "), FACTS, WIDTH_MAX);
    let text_width = fonts.width(&name, NAME).max(fonts.width(&facts, FACTS));
    let height = if facts.is_empty() { 32.0 } else { 54.0 };
    Label { area: Area::new(0.0, 0.0, text_width + 2.0 * PAD + BAR, height), name, facts }
}

/// The cheapest place for a label of that size; the first of equals.
fn best(item: &Item<'_>, size: &Area, items: &[Item<'_>], obstacles: &Obstacles<'_>) -> Area {
    let mut found = (f32::INFINITY, *size);
    for area in places(&item.area, size.width(), size.height()) {
        let area = pushed_inside(&area, obstacles.frame);
        let cost = cost(&area, item, items, obstacles);
        if cost < found.0 {
            found = (cost, area);
        }
    }
    found.1
}

fn places(object: &Area, width: f32, height: f32) -> impl Iterator<Item = Area> {
    let (cx, cy) = object.centre();
    let object = *object;
    GAPS.into_iter().flat_map(move |gap| {
        SHIFTS.into_iter().flat_map(move |shift| {
            let (x, y) =
                (cx - width / 2.0 + shift * width / 2.0, cy - height / 2.0 + shift * height);
            [
                Area::new(object.x2 + gap, y, width, height),
                Area::new(object.x1 - gap - width, y, width, height),
                Area::new(x, object.y1 - gap - height, width, height),
                Area::new(x, object.y2 + gap, width, height),
            ]
        })
    })
}

fn pushed_inside(area: &Area, frame: &Area) -> Area {
    let margin = 6.0;
    let x_max = (frame.x2 - margin - area.width()).max(frame.x1);
    let y_max = (frame.y2 - margin - area.height()).max(frame.y1);
    let x = area.x1.clamp((frame.x1 + margin).min(x_max), x_max);
    let y = area.y1.clamp((frame.y1 + margin).min(y_max), y_max);
    Area::new(x, y, area.width(), area.height())
}

/// What a place costs: covering other labels is worst, then objects and edges, then distance.
fn cost(area: &Area, item: &Item<'_>, items: &[Item<'_>], obstacles: &Obstacles<'_>) -> f32 {
    let roomy = area.grown(4.0);
    let labels: f32 = obstacles.labels.iter().map(|label| label.area.overlap(&roomy)).sum();
    let objects: f32 = items.iter().map(|other| other.area.overlap(&roomy)).sum();
    let edges = obstacles.curves.iter().flat_map(|curve| &curve.points);
    let edges = edges.filter(|point| roomy.contains(**point)).count() as f32;
    let leader = leader(&item.area, area);
    let crossed: f32 = (1..8)
        .map(|step| {
            let part = step as f32 / 8.0;
            let mix = |a: f32, b: f32| a + (b - a) * part;
            let point = (mix(leader[0].0, leader[1].0), mix(leader[0].1, leader[1].1));
            let over_label = obstacles.labels.iter().any(|label| label.area.contains(point));
            let over_object = items
                .iter()
                .any(|other| other.mark.name != item.mark.name && other.area.contains(point));
            f32::from(u8::from(over_label)) * 400.0 + f32::from(u8::from(over_object)) * 60.0
        })
        .sum();
    let length = (leader[1].0 - leader[0].0).hypot(leader[1].1 - leader[0].1);
    // Beside is better than above or below: stacks grow upwards.
    let (_, cy) = area.centre();
    let stacked = if (item.area.y1..=item.area.y2).contains(&cy) { 0.0 } else { 25.0 };
    let level = (cy - item.area.centre().1).abs() * 0.3;
    labels * 100.0 + objects * 3.0 + edges * 120.0 + crossed + length + stacked + level
}

/// The shortest line from the object to its label.
fn leader(object: &Area, label: &Area) -> [Point; 2] {
    let from = object.nearest(label.centre());
    [from, label.nearest(from)]
}

/// Draws the lines from objects to labels that stand apart from them.
pub(super) fn draw_leaders(canvas: &mut Canvas, items: &[Item<'_>], labels: &[Label]) {
    for (item, label) in items.iter().zip(labels) {
        let line = leader(&item.area, &label.area);
        canvas.stroke(&line, &Line::unbroken(4.5, palette::SHADE, 0.5));
        canvas.stroke(&line, &Line::unbroken(2.0, palette::lighten(item.colour()), 0.9));
    }
}

/// Draws the labels.
pub(super) fn draw(canvas: &mut Canvas, items: &[Item<'_>], labels: &[Label], fonts: &Fonts) {
    for (item, label) in items.iter().zip(labels) {
        let area = &label.area;
        canvas.shadow(area, 8.0, 6.0, 0.5);
        canvas.fill(area, 8.0, palette::PANEL, 0.88);
        let bar = Area::new(area.x1 + 5.0, area.y1 + 6.0, 5.0, area.height() - 12.0);
        canvas.fill(&bar, 2.5, item.colour(), 1.0);
        let x = area.x1 + PAD + BAR;
        fonts.draw(canvas, &label.name, (x, area.y1 + 3.0), NAME);
        if !label.facts.is_empty() {
            fonts.draw(canvas, &label.facts, (x, area.y1 + 29.0), FACTS);
        }
    }
}
