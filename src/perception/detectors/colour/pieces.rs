//! Pieces of one body: what a thin thing in front cuts up, and what drifts from one colour name to
//! the next.
//!
//! Two pieces side by side are one body when they begin and end in the same rows, are no wider
//! together than a labelled object, and nothing says that there are two: no ground between them, and
//! no edge where they touch.

use super::blob_filters::middle_colour;
use super::outline::enlargement;
use crate::geometry::PixelBox;
use crate::pddl::Name;
use crate::perception::ImageView;
use crate::perception::detectors::lab::{Hue, Lab};
use crate::perception::detectors::light::Ground;
use crate::perception::detectors::regions::Region;

/// Top and bottom rows of two pieces differ by at most this share of their height.
const ROWS_SHARE_MAX: f64 = 0.25;
/// Pieces are together at most this many times as wide as the widest labelled object.
const WIDTH_MULTIPLE_MAX: f64 = 1.15;
/// What cuts a body up is at most this share of the whole.
const GAP_SHARE_MAX: f64 = 0.45;
/// Pieces this near touch, in pixels (see [`enlargement`]).
const TOUCH_MAX: f64 = 3.0;
/// Colours on both sides of a border that differ by more are two bodies (in Lab units).
const EDGE_MIN: f32 = 16.0;
/// Most of the pixels between two pieces that may be ground, as a share.
const GROUND_SHARE_MAX: f64 = 0.3;
/// Top and front of a body are this much as wide as both,
const FACE_WIDTH_MIN: f64 = 0.65;
/// together at most so many times as high as the highest labelled object,
const FACES_HEIGHT_MAX: f64 = 1.35;
/// meet within this share of their height,
const FACE_OVERLAP_MAX: f64 = 0.35;
/// and differ by at most this hue, in degrees.
pub(super) const HUE_MAX: f32 = 12.0;
/// What is before the rests of one object fills this share of the box around them that is not theirs.
const BEHIND_SHARE_MIN: f64 = 0.7;
/// About how many pixels of a border or a gap are looked at.
const SAMPLES: f64 = 24.0;

/// A region of one colour class, with the class and its name.
pub(super) type Piece<'a> = (u8, &'a Name, Region);

/// Joins the pieces of bodies. `width_max` is the width of the widest labelled object, in pixels. A
/// body has the name of its largest piece, and the place of its first one.
pub(super) fn joined<'a>(
    pieces: Vec<Piece<'a>>,
    (image, ground): (&ImageView<'_>, &Ground),
    width_max: f64,
) -> Vec<Piece<'a>> {
    let place = |(place, piece): (usize, Piece<'a>)| (place, piece.2.pixel_box(), piece);
    let mut pieces: Vec<(usize, PixelBox, Piece<'a>)> =
        pieces.into_iter().enumerate().map(place).collect();
    pieces.sort_by(|a, b| a.1.x1.total_cmp(&b.1.x1));
    let is_ground = ground.is_near();
    let touch_max = TOUCH_MAX * enlargement(image.height());
    let mut bodies: Vec<(usize, PixelBox, Piece<'a>)> = Vec::new();
    for (place, right, piece) in pieces {
        let of_one = |(_, left, body): &(usize, PixelBox, Piece<'a>)| {
            are_one_size((left, &right), width_max, touch_max)
                && if right.x1 - left.x2 <= touch_max {
                    body.0 != piece.0 && has_no_edge(image, left, &right)
                } else {
                    body.0 == piece.0 && hides(image, left, &right, &is_ground)
                }
        };
        match bodies.iter().position(of_one) {
            Some(i) => {
                let (of_body, left, (class, name, region)) = bodies.remove(i);
                let is_larger = piece.2.area() > region.area();
                let (class, name) = if is_larger { (piece.0, piece.1) } else { (class, name) };
                let body = (class, name, region.joined(piece.2));
                bodies.push((of_body.min(place), left.hull(&right), body));
            }
            None => bodies.push((place, right, piece)),
        }
    }
    bodies.sort_by_key(|(place, ..)| *place);
    bodies.into_iter().map(|(.., body)| body).collect()
}

/// Joins the lit top of a body and its front in shade where they have two colour names: one upon the
/// other, as wide, together no higher than a labelled object, and of one hue. The one that has the
/// shade of a labelled object of its colour names the body; where that tells nothing, the larger one.
pub(super) fn joined_faces<'a>(
    pieces: Vec<Piece<'a>>,
    image: &ImageView<'_>,
    height_max: f64,
    is_learnt: &dyn Fn(u8, Lab) -> bool,
) -> Vec<Piece<'a>> {
    let mut bodies: Vec<Piece<'a>> = Vec::new();
    for piece in pieces {
        let b = piece.2.pixel_box();
        let of_one = |body: &Piece<'a>| {
            let other = body.2.pixel_box();
            body.0 != piece.0
                && are_faces(&b, &other, height_max)
                && hue_of(image, &piece.2)
                    .zip(hue_of(image, &body.2))
                    .is_some_and(|(a, b)| a.turn_to(b).abs() <= HUE_MAX)
        };
        match bodies.iter().position(of_one) {
            Some(i) => {
                let (class, name, region) = bodies.remove(i);
                let told = |class: u8, region: &Region| {
                    let lab = middle_colour(image, region);
                    (lab.is_some_and(|lab| is_learnt(class, lab)), region.area())
                };
                let is_paint = told(piece.0, &piece.2) > told(class, &region);
                let (class, name) = if is_paint { (piece.0, piece.1) } else { (class, name) };
                bodies.insert(i, (class, name, region.joined(piece.2)));
            }
            None => bodies.push(piece),
        }
    }
    bodies
}

/// Whether two boxes could be the top and the front of one object.
fn are_faces(a: &PixelBox, b: &PixelBox, height_max: f64) -> bool {
    let (upper, lower) = if a.y1 <= b.y1 { (a, b) } else { (b, a) };
    let whole = upper.hull(lower);
    let common = upper.x2.min(lower.x2) - upper.x1.max(lower.x1);
    (upper.y2 - lower.y1).abs() <= FACE_OVERLAP_MAX * whole.height()
        && common >= FACE_WIDTH_MIN * whole.width()
        && whole.height() <= FACES_HEIGHT_MAX * height_max
}

/// The hue of a region's middle colour.
fn hue_of(image: &ImageView<'_>, region: &Region) -> Option<Hue> {
    middle_colour(image, region).map(Hue::of)
}

/// Joins pieces of one colour that are the rests of one object behind another body: together no
/// larger than an object, and what lies between them is the body.
pub(super) fn joined_behind<'a>(
    pieces: Vec<Piece<'a>>,
    [width_max, height_max]: [f64; 2],
    is_body: &dyn Fn(u8, u32, u32) -> bool,
) -> Vec<Piece<'a>> {
    let mut bodies: Vec<Piece<'a>> = Vec::new();
    for piece in pieces {
        let of_one = |body: &Piece<'a>| {
            let hull = body.2.pixel_box().hull(&piece.2.pixel_box());
            let fits = hull.width() <= WIDTH_MULTIPLE_MAX * width_max
                && hull.height() <= WIDTH_MULTIPLE_MAX * height_max;
            if body.0 != piece.0 || !fits {
                return false;
            }
            let [x1, y1, x2, y2] = <[f64; 4]>::from(hull).map(|v| v as u32);
            let pixels = (y1..y2).flat_map(|y| (x1..x2).map(move |x| (x, y)));
            let hidden = pixels.filter(|(x, y)| is_body(piece.0, *x, *y)).count();
            let seen = (body.2.area() + piece.2.area()) as f64;
            hidden as f64 >= BEHIND_SHARE_MIN * (hull.area() - seen)
        };
        match bodies.iter().position(of_one) {
            Some(i) => {
                let (class, name, region) = bodies.remove(i);
                bodies.insert(i, (class, name, region.joined(piece.2)));
            }
            None => bodies.push(piece),
        }
    }
    bodies
}

/// Whether two boxes side by side could be one object's.
fn are_one_size((left, right): (&PixelBox, &PixelBox), width_max: f64, touch_max: f64) -> bool {
    let whole = left.hull(right);
    let rows = ROWS_SHARE_MAX * whole.height();
    let gap = right.x1 - left.x2;
    (left.y1 - right.y1).abs() <= rows
        && (left.y2 - right.y2).abs() <= rows
        && whole.width() <= WIDTH_MULTIPLE_MAX * width_max
        && (-touch_max..=GAP_SHARE_MAX * whole.width()).contains(&gap)
}

/// Rows that both boxes have, thinned out.
fn rows(left: &PixelBox, right: &PixelBox) -> impl Iterator<Item = f64> {
    let (first, last) = (left.y1.max(right.y1), left.y2.min(right.y2));
    let step = ((last - first) / SAMPLES).max(1.0);
    (0..).map(move |i| first + step * f64::from(i)).take_while(move |y| *y < last)
}

/// Whether something in front hides what is between two pieces, rather than ground showing.
fn hides(
    image: &ImageView<'_>,
    left: &PixelBox,
    right: &PixelBox,
    is_ground: &dyn Fn([u8; 3]) -> bool,
) -> bool {
    let middle = f64::midpoint(left.x2, right.x1);
    let between = rows(left, right).filter_map(|y| image.pixel(middle as usize, y as usize));
    let (ground, n) = between.fold((0.0, 0.0), |(ground, n), rgb| {
        (ground + f64::from(u8::from(is_ground(rgb))), n + 1.0)
    });
    n > 0.0 && ground <= GROUND_SHARE_MAX * n
}

/// Whether the colour runs on where two pieces touch: most rows differ little across the border.
fn has_no_edge(image: &ImageView<'_>, left: &PixelBox, right: &PixelBox) -> bool {
    let inside = 0.15 * left.width().min(right.width());
    let pixel = |x: f64, y: f64| image.pixel(x.max(0.0) as usize, y as usize);
    let (mut alike, mut n) = (0, 0);
    for y in rows(left, right) {
        let pair = pixel(left.x2 - 1.0 - inside, y).zip(pixel(right.x1 + inside, y));
        let Some((a, b)) = pair else { continue };
        n += 1;
        alike += i32::from(Lab::of(a).distance(Lab::of(b)) < EDGE_MIN);
    }
    n > 0 && 2 * alike > n
}
