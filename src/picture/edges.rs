//! Edges of the graph as curved arrows between objects.

use super::area::{Area, Point};
use super::canvas::{Canvas, Line};
use super::text::{Face, Fonts, Style};
use super::{EdgeKind, EdgeMark, Item, palette};

/// Points per curve.
const SAMPLES: usize = 24;
/// Radius of the dot where a curve starts.
const DOT: f32 = 6.0;
/// Length of an arrow head.
const HEAD: f32 = 15.0;
/// Length of a dash, and of the gap after it with the line's round ends.
const DASH: [f32; 2] = [9.0, 10.0];

/// One edge, laid out.
#[derive(Debug)]
pub(super) struct Curve {
    /// The predicate; of several curves that end at one object only the first is labelled.
    pub(super) label: Option<String>,
    /// Which colour a recognised edge has: its predicate's place in the order of first appearance.
    pub(super) predicate_idx: usize,
    /// What the edge stands for.
    pub(super) kind: EdgeKind,
    /// From the start to the tip.
    pub(super) points: Vec<Point>,
}

impl Curve {
    fn colour(&self) -> [u8; 3] {
        match self.kind {
            EdgeKind::Seen => palette::edge(self.predicate_idx),
            EdgeKind::Wrong => palette::WRONG,
            EdgeKind::Missing => palette::MISSING,
        }
    }
}

/// The predicates of the edges in order of first appearance.
pub(super) fn predicates(edges: &[EdgeMark]) -> Vec<&str> {
    let mut found: Vec<&str> = Vec::new();
    for edge in edges {
        if !found.contains(&edge.predicate.as_str()) {
            found.push(edge.predicate.as_str());
        }
    }
    found
}

/// Lays the edges out. Predicates bow to alternating sides, so that two relations between the same
/// objects stay apart; edges that end at one object bow further each.
pub(super) fn layout(items: &[Item<'_>], edges: &[EdgeMark]) -> Vec<Curve> {
    let predicates = predicates(edges);
    let mut curves = Vec::new();
    let mut ends: Vec<(usize, &str, EdgeKind)> = Vec::new();
    for edge in edges {
        let find = |name: &crate::pddl::Name| items.iter().find(|item| item.mark.name == *name);
        let (Some(from), Some(to)) = (find(&edge.from), find(&edge.to)) else { continue };
        let Some(predicate_idx) = predicates.iter().position(|p| edge.predicate == **p) else {
            continue;
        };
        if from.mark.name == to.mark.name {
            continue;
        }
        let to_name = edge.to.as_str();
        let rank = ends.iter().filter(|end| (end.0, end.1) == (predicate_idx, to_name)).count();
        let is_first = !ends.contains(&(predicate_idx, to_name, edge.kind));
        ends.push((predicate_idx, to_name, edge.kind));
        let side = if predicate_idx % 2 == 0 { 1.0 } else { -1.0 };
        // A second relation starts off the middle, where the first one has its dot.
        let (x, y) = anchor(&from.area);
        let aside = if predicate_idx == 0 { 0.0 } else { -0.22 * side * from.area.width() };
        let points = bow((x + aside, y), anchor(&to.area), side, rank);
        let label = is_first.then(|| edge.predicate.as_str().to_owned());
        curves.push(Curve { label, predicate_idx, kind: edge.kind, points });
    }
    curves
}

/// Where edges meet an object: its middle, or near the top of something tall and thin, which
/// others are likely to stand in front of.
fn anchor(area: &Area) -> Point {
    let (x, y) = area.centre();
    if area.height() > 3.0 * area.width() { (x, area.y1 + 0.1 * area.height()) } else { (x, y) }
}

/// A quadratic curve that leaves the straight line to one side.
fn bow(from: Point, to: Point, side: f32, rank: usize) -> Vec<Point> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = dx.hypot(dy).max(1.0);
    // Downward arrows bow to the left of the picture for side 1, upward ones as well.
    let downward = if dy < 0.0 { -1.0 } else { 1.0 };
    let height = (0.42 * length).clamp(14.0, 110.0) + 22.0 * rank as f32;
    let (nx, ny) = (-dy / length * side * downward, dx / length * side * downward);
    let control =
        (f32::midpoint(from.0, to.0) + nx * height, f32::midpoint(from.1, to.1) + ny * height);
    let at = |t: f32| {
        let mix = |a: f32, b: f32, c: f32| {
            (1.0 - t) * (1.0 - t) * a + 2.0 * t * (1.0 - t) * b + t * t * c
        };
        (mix(from.0, control.0, to.0), mix(from.1, control.1, to.1))
    };
    let mut points: Vec<Point> = (0..=SAMPLES).map(|idx| at(idx as f32 / SAMPLES as f32)).collect();
    // The tip stays outside the dot of the edge that may start there.
    let apart = |p: &Point| (p.0 - to.0).hypot(p.1 - to.1) >= DOT + 3.0;
    let last = points.iter().rposition(apart).unwrap_or(0);
    points.truncate((last + 1).max(2));
    points
}

/// Draws all curves, then their labels where there is room beside what is `taken`.
pub(super) fn draw(canvas: &mut Canvas, curves: &[Curve], mut taken: Vec<Area>, fonts: &Fonts) {
    // What is missing lies below what was recognised, what is wrong above.
    for kind in [EdgeKind::Missing, EdgeKind::Seen, EdgeKind::Wrong] {
        for curve in curves.iter().filter(|curve| curve.kind == kind) {
            draw_curve(canvas, curve);
        }
    }
    for curve in curves {
        if let Some(&start) = curve.points.first() {
            canvas.disc(start, DOT, curve.colour(), 1.0);
        }
    }
    for curve in curves {
        let Some(label) = &curve.label else { continue };
        if let Some(area) = place_label(label, curve, curves, &taken, fonts) {
            canvas.fill(&area, 7.0, palette::SHADE, 0.78);
            let style = Style { colour: curve.colour(), ..LABEL };
            fonts.draw(canvas, label, (area.x1 + 6.0, area.y1 + 1.0), style);
            taken.push(area);
        }
    }
}

fn draw_curve(canvas: &mut Canvas, curve: &Curve) {
    let colour = curve.colour();
    let (Some(&start), Some(&tip)) = (curve.points.first(), curve.points.last()) else { return };
    let reach = (start.0 - tip.0).hypot(start.1 - tip.1);
    let head = HEAD.min(0.45 * reach);
    let before = curve.points.iter().rev().find(|p| (p.0 - tip.0).hypot(p.1 - tip.1) > head * 0.8);
    let back = before.copied().unwrap_or(start);
    let length = (tip.0 - back.0).hypot(tip.1 - back.1).max(1e-3);
    let direction = ((tip.0 - back.0) / length, (tip.1 - back.1) / length);
    // The line ends inside the head, so that its round end does not show at the tip.
    let inside = |p: &&Point| (p.0 - tip.0).hypot(p.1 - tip.1) > head * 0.6;
    let line: Vec<Point> = curve.points.iter().filter(inside).copied().collect();
    let ahead = (tip.0 + direction.0 * 2.5, tip.1 + direction.1 * 2.5);

    let dash = match curve.kind {
        EdgeKind::Seen | EdgeKind::Wrong => None,
        EdgeKind::Missing => Some(DASH),
    };
    let shade = Line { width: 7.0, colour: palette::SHADE, alpha: 0.55, dash };
    canvas.stroke(&line, &shade);
    canvas.disc(start, DOT + 2.0, palette::SHADE, 0.55);
    canvas.arrow_head(ahead, direction, head + 5.5, palette::SHADE, 0.55);
    canvas.stroke(&line, &Line { width: 3.2, colour, alpha: 1.0, dash });
    canvas.arrow_head(tip, direction, head, colour, 1.0);
}

const LABEL: Style = Style { face: Face::Mono, size: 19.0, colour: palette::TEXT };

/// A place for the edge's label beside its curve: near the middle, off everything else.
fn place_label(
    label: &str,
    curve: &Curve,
    curves: &[Curve],
    taken: &[Area],
    fonts: &Fonts,
) -> Option<Area> {
    let (width, height) = (fonts.width(label, LABEL) + 12.0, 24.0);
    let (first, last) = (curve.points.first()?, curve.points.last()?);
    let chord = (f32::midpoint(first.0, last.0), f32::midpoint(first.1, last.1));
    let middle = curve.points.len() / 2;
    let tries = [0_isize, -3, 3, -6, 6, -8, 8];
    let candidates = tries.iter().filter_map(|step| {
        let &(x, y) = curve.points.get(middle.checked_add_signed(*step)?)?;
        let (ox, oy) = (x - chord.0, y - chord.1);
        let out = ox.hypot(oy).max(1.0);
        // Far enough outward for the pill to clear the line.
        let reach = (ox / out).abs() * width / 2.0 + (oy / out).abs() * height / 2.0 + 6.0;
        let (cx, cy) = (x + ox / out * reach, y + oy / out * reach);
        Some(Area::new(cx - width / 2.0, cy - height / 2.0, width, height))
    });
    candidates.into_iter().find(|area| {
        let is_free = taken.iter().all(|other| other.overlap(area) <= 0.0);
        let crossed = curves.iter().flat_map(|c| &c.points).filter(|p| area.contains(**p)).count();
        is_free && crossed == 0
    })
}
