//! Disturbances of a picture, one line of [`TRANSFORMS`] each: other light, another lens, another
//! angle, another ground, something in the way.
//!
//! Every one is seeded: the same picture and seed give the same pixels. Boxes go with the pixels.

use image::RgbImage;
use image::imageops::{self, FilterType};

use super::draw::{Shape, fill, halves, recolour_ground};
use crate::draws::Draws;
use crate::geometry::PixelBox;
use crate::perception::model::ObjectBox;

/// A picture with its labels.
#[derive(Debug, Clone)]
pub struct LabelledPicture {
    /// The pixels.
    pub image: RgbImage,
    /// Every object that is there, hidden or not.
    pub objects: Vec<ObjectBox>,
}

/// One disturbance.
#[derive(Debug, Clone, Copy)]
pub struct Transform {
    /// Its name in reports and flags; unique.
    pub name: &'static str,
    /// What it does, with its numbers.
    pub help: &'static str,
    /// Whether objects may be hidden: then *unknown* is as good as right.
    pub hides: bool,
    apply: fn(&mut LabelledPicture, &mut Draws),
}

const fn shown(
    name: &'static str,
    help: &'static str,
    apply: fn(&mut LabelledPicture, &mut Draws),
) -> Transform {
    Transform { name, help, hides: false, apply }
}

const fn hiding(
    name: &'static str,
    help: &'static str,
    apply: fn(&mut LabelledPicture, &mut Draws),
) -> Transform {
    Transform { name, help, hides: true, apply }
}

/// Every disturbance, in the order of the report.
pub const TRANSFORMS: &[Transform] = &[
    shown("none", "the picture as it is", |_, _| {}),
    shown("darker", "every value × 0.6", |p, _| values(p, |v| v * 0.6)),
    shown("brighter", "every value × 1.4", |p, _| values(p, |v| v * 1.4)),
    shown("underexposed", "half the light (linear)", |p, _| values(p, |v| exposed(v, 0.5))),
    shown("overexposed", "1.6 times the light (linear)", |p, _| values(p, |v| exposed(v, 1.6))),
    shown("warm", "red × 1.15, blue × 0.8", |p, _| gains(p, [1.15, 1.0, 0.8])),
    shown("cool", "red × 0.8, blue × 1.2", |p, _| gains(p, [0.8, 1.0, 1.2])),
    shown("tungsten", "red × 1.25, green × 0.95, blue × 0.55", |p, _| {
        gains(p, [1.25, 0.95, 0.55]);
    }),
    shown("contrast up", "× 1.5 around middle grey", |p, _| {
        values(p, |v| (v - 128.0) * 1.5 + 128.0);
    }),
    shown("contrast down", "× 0.6 around middle grey", |p, _| {
        values(p, |v| (v - 128.0) * 0.6 + 128.0);
    }),
    shown("noise 10", "Gaussian, standard deviation 10 in every channel", |p, r| noise(p, 10.0, r)),
    shown("noise 25", "Gaussian, standard deviation 25 in every channel", |p, r| noise(p, 25.0, r)),
    shown("jpeg 20", "JPEG of quality 20", |p, _| jpeg(p, 20)),
    shown("blur 3", "Gaussian, standard deviation 3 pixels", |p, _| {
        p.image = imageops::blur(&p.image, 3.0);
    }),
    shown("rotated", "by 3 to 5 degrees, either way", |p, r| {
        let angle = (3.0 + 2.0 * r.unit()).copysign(r.unit() - 0.5);
        rotate(p, angle.to_radians());
    }),
    shown("half size", "scaled by 0.5", |p, _| scale(p, 0.5)),
    shown("larger", "scaled by 1.5", |p, _| scale(p, 1.5)),
    shown("cropped", "to what the objects need, and a seeded margin", crop),
    shown("mirrored", "left and right exchanged", |p, _| mirror(p)),
    shown("beige ground", "the ground's pixels recoloured", |p, _| {
        recolour_ground(&mut p.image, &p.objects, [205, 190, 160]);
    }),
    shown("blue ground", "the ground's pixels recoloured", |p, _| {
        recolour_ground(&mut p.image, &p.objects, [52, 78, 140]);
    }),
    shown("clutter", "two coloured things far from the objects", clutter),
    hiding("shadow", "one side at 0.4 of the light, with a soft edge", shadow),
    hiding("pole", "a grey pole, a third of an object wide, in front of one", pole),
    hiding("hand", "a skin-coloured hand that covers a part of one object", hand),
];

impl Transform {
    /// The disturbed picture. Objects that are no longer in it are left out.
    pub fn of(&self, picture: &LabelledPicture, seed: u64) -> LabelledPicture {
        let mut disturbed = picture.clone();
        (self.apply)(&mut disturbed, &mut Draws::stream(seed, 0));
        let (width, height) = disturbed.image.dimensions();
        disturbed.objects.retain_mut(|object| {
            let b = &mut object.pixel_box;
            *b = PixelBox::from([
                b.x1.max(0.0),
                b.y1.max(0.0),
                b.x2.min(f64::from(width)),
                b.y2.min(f64::from(height)),
            ]);
            b.is_valid()
        });
        disturbed
    }
}

fn byte(value: f64) -> u8 {
    value.round().clamp(0.0, 255.0) as u8
}

fn values(picture: &mut LabelledPicture, of: impl Fn(f64) -> f64) {
    for v in picture.image.iter_mut() {
        *v = byte(of(f64::from(*v)));
    }
}

fn gains(picture: &mut LabelledPicture, gains: [f64; 3]) {
    for pixel in picture.image.pixels_mut() {
        for (v, gain) in pixel.0.iter_mut().zip(gains) {
            *v = byte(f64::from(*v) * gain);
        }
    }
}

/// An sRGB value under that much of the light (IEC 61966-2-1).
fn exposed(value: f64, light: f64) -> f64 {
    let v = value / 255.0;
    let linear = if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
    let linear = (linear * light).min(1.0);
    255.0
        * if linear <= 0.003_130_8 {
            linear * 12.92
        } else {
            1.055 * linear.powf(1.0 / 2.4) - 0.055
        }
}

fn noise(picture: &mut LabelledPicture, sigma: f64, rng: &mut Draws) {
    for v in picture.image.iter_mut() {
        *v = byte(f64::from(*v) + sigma * rng.normal());
    }
}

fn jpeg(picture: &mut LabelledPicture, quality: u8) {
    let mut bytes = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, quality);
    let written = picture.image.write_with_encoder(encoder);
    match written.and_then(|()| image::load_from_memory(&bytes)) {
        Ok(read) => picture.image = read.into_rgb8(),
        Err(error) => tracing::error!(%error, "the picture stays as it is"),
    }
}

fn scale(picture: &mut LabelledPicture, factor: f64) {
    let (width, height) = picture.image.dimensions();
    let size = |side: u32| (f64::from(side) * factor).round().max(1.0) as u32;
    picture.image =
        imageops::resize(&picture.image, size(width), size(height), FilterType::Triangle);
    moved(picture, |[x, y]| [x * factor, y * factor]);
}

fn mirror(picture: &mut LabelledPicture) {
    let width = f64::from(picture.image.width());
    imageops::flip_horizontal_in_place(&mut picture.image);
    moved(picture, |[x, y]| [width - x, y]);
}

/// Crops to the objects' common box and at least a fifth of the picture around it.
fn crop(picture: &mut LabelledPicture, rng: &mut Draws) {
    let (width, height) = picture.image.dimensions();
    let (w, h) = (f64::from(width), f64::from(height));
    let Some(hull) = picture.objects.iter().map(|o| o.pixel_box).reduce(|a, b| a.hull(&b)) else {
        return;
    };
    let mut margin = |side: f64| side * (0.1 + 0.2 * rng.unit());
    let x1 = (hull.x1 - margin(w)).max(0.0).floor();
    let y1 = (hull.y1 - margin(h)).max(0.0).floor();
    let x2 = (hull.x2 + margin(w)).min(w).ceil();
    let y2 = (hull.y2 + margin(h)).min(h).ceil();
    let view = imageops::crop_imm(
        &picture.image,
        x1 as u32,
        y1 as u32,
        (x2 - x1) as u32,
        (y2 - y1) as u32,
    );
    picture.image = view.to_image();
    moved(picture, |[x, y]| [x - x1, y - y1]);
}

/// Turns the picture about its middle, counter-clockwise; what comes in repeats the edge.
fn rotate(picture: &mut LabelledPicture, angle: f64) {
    let source = picture.image.clone();
    let (width, height) = source.dimensions();
    let (cx, cy) = (f64::from(width) / 2.0, f64::from(height) / 2.0);
    let (sin, cos) = angle.sin_cos();
    let turned = |[x, y]: [f64; 2], sin: f64| {
        let (dx, dy) = (x - cx, y - cy);
        [cx + cos * dx + sin * dy, cy - sin * dx + cos * dy]
    };
    for (x, y, pixel) in picture.image.enumerate_pixels_mut() {
        let from = turned([f64::from(x) + 0.5, f64::from(y) + 0.5], -sin);
        *pixel = halves(&source, [from[0] - 0.5, from[1] - 0.5]);
    }
    moved(picture, |corner| turned(corner, sin));
}

/// Moves all corners of all boxes, and boxes them again.
fn moved(picture: &mut LabelledPicture, to: impl Fn([f64; 2]) -> [f64; 2]) {
    for object in &mut picture.objects {
        let b = object.pixel_box;
        let corners = [[b.x1, b.y1], [b.x2, b.y1], [b.x1, b.y2], [b.x2, b.y2]].map(&to);
        let bound = |axis: usize, pick: fn(f64, f64) -> f64| {
            corners.iter().map(|corner| corner[axis]).reduce(pick).unwrap_or_default()
        };
        object.pixel_box = PixelBox::from([
            bound(0, f64::min),
            bound(1, f64::min),
            bound(0, f64::max),
            bound(1, f64::max),
        ]);
        object.mask = None;
    }
}

fn clutter(picture: &mut LabelledPicture, rng: &mut Draws) {
    let (w, h) = (f64::from(picture.image.width()), f64::from(picture.image.height()));
    let top = picture.objects.iter().map(|o| o.pixel_box.y1).fold(h, f64::min);
    let side = h / 14.0;
    // High on the wall, where nothing that is stacked can be; on the ground, where there is none.
    let y =
        if top > 3.0 * side { side * (0.5 + rng.unit()) } else { h - side * (1.2 + rng.unit()) };
    let things = [([200, 50, 45], Shape::Ellipse), ([50, 100, 200], Shape::Rectangle)];
    for (i, (rgb, shape)) in things.into_iter().enumerate() {
        let x = w * (0.06 + 0.7 * i as f64 + 0.12 * rng.unit());
        fill(&mut picture.image, PixelBox::from([x, y, x + side, y + side]), rgb, shape);
    }
}

/// One object, chosen by the seed.
fn one_of(picture: &LabelledPicture, rng: &mut Draws) -> Option<PixelBox> {
    let n = picture.objects.len();
    let at = (rng.unit() * n as f64) as usize;
    picture.objects.get(at).map(|object| object.pixel_box)
}

fn pole(picture: &mut LabelledPicture, rng: &mut Draws) {
    let Some(b) = one_of(picture, rng) else { return };
    let half = (b.width() / 6.0).max(2.0);
    let x = b.x1 + b.width() * (0.3 + 0.4 * rng.unit());
    let height = f64::from(picture.image.height());
    let pole = PixelBox::from([x - half, (b.y1 - 3.0 * b.height()).max(0.0), x + half, height]);
    fill(&mut picture.image, pole, [128, 128, 126], Shape::Rectangle);
}

fn hand(picture: &mut LabelledPicture, rng: &mut Draws) {
    let Some(b) = one_of(picture, rng) else { return };
    let side = b.width().max(b.height()) * 1.5;
    let from_left = rng.unit() < 0.5;
    let x = if from_left { b.x1 + b.width() * 0.35 - side } else { b.x2 - b.width() * 0.35 };
    let y = b.y1 + b.height() * (0.2 * rng.unit()) - side * 0.2;
    let palm = PixelBox::from([x, y, x + side, y + side * 0.8]);
    fill(&mut picture.image, palm, [205, 160, 135], Shape::Ellipse);
    let width = f64::from(picture.image.width());
    let arm_y = [y + side * 0.2, y + side * 0.6];
    let arm = if from_left { [0.0, x + side * 0.4] } else { [x + side * 0.6, width] };
    let arm = PixelBox::from([arm[0], arm_y[0], arm[1], arm_y[1]]);
    fill(&mut picture.image, arm, [205, 160, 135], Shape::Rectangle);
}

fn shadow(picture: &mut LabelledPicture, rng: &mut Draws) {
    let Some(hull) = picture.objects.iter().map(|o| o.pixel_box).reduce(|a, b| a.hull(&b)) else {
        return;
    };
    let edge = hull.x1 + hull.width() * (0.3 + 0.4 * rng.unit());
    let soft = f64::from(picture.image.width()) / 40.0;
    let is_left = rng.unit() < 0.5;
    for (x, _, pixel) in picture.image.enumerate_pixels_mut() {
        let depth = (f64::from(x) - edge) / soft * if is_left { -1.0 } else { 1.0 };
        let light = 1.0 - 0.6 * (0.5 + depth / 2.0).clamp(0.0, 1.0);
        pixel.0 = pixel.0.map(|v| byte(exposed(f64::from(v), light)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> LabelledPicture {
        let image = RgbImage::from_fn(120, 90, |x, y| {
            image::Rgb(if (40..60).contains(&x) && (50..70).contains(&y) {
                [200, 30, 30]
            } else {
                [30, 31, 34]
            })
        });
        let pixel_box = PixelBox::from([40.0, 50.0, 60.0, 70.0]);
        let objects = vec![ObjectBox::new("red_block".into(), "block".into(), pixel_box)];
        LabelledPicture { image, objects }
    }

    /// The box of what is red.
    fn red(image: &RgbImage) -> PixelBox {
        let is_red = |p: &image::Rgb<u8>| i32::from(p.0[0]) - i32::from(p.0[2]) > 60;
        let found = image.enumerate_pixels().filter(|(.., p)| is_red(p));
        let boxes = found.map(|(x, y, _)| {
            let (x, y) = (f64::from(x), f64::from(y));
            PixelBox::from([x, y, x + 1.0, y + 1.0])
        });
        boxes.reduce(|a, b| a.hull(&b)).unwrap()
    }

    #[test]
    fn names_are_unique_and_the_same_seed_gives_the_same_picture() {
        let picture = picture();
        for (i, transform) in TRANSFORMS.iter().enumerate() {
            assert!(TRANSFORMS[..i].iter().all(|other| other.name != transform.name));
            let once = transform.of(&picture, 5);
            assert_eq!(once.image, transform.of(&picture, 5).image, "{}", transform.name);
            let changed = once.image != picture.image;
            assert_eq!(changed, transform.name != "none", "{}", transform.name);
        }
    }

    /// Where nothing hides the object its box is around its pixels, to two pixels.
    #[test]
    fn boxes_go_with_the_pixels() {
        let picture = picture();
        for transform in TRANSFORMS.iter().filter(|t| !t.hides && t.name != "noise 25") {
            if transform.name == "clutter" {
                continue; // something else is red
            }
            for seed in 0..4 {
                let of = transform.of(&picture, seed);
                let (is, says) = (red(&of.image), of.objects[0].pixel_box);
                let off = [is.x1 - says.x1, is.y1 - says.y1, is.x2 - says.x2, is.y2 - says.y2];
                let worst = off.iter().fold(0.0_f64, |worst, v| worst.max(v.abs()));
                assert!(worst <= 3.0, "{} {seed}: {is:?} {says:?}", transform.name);
            }
        }
    }
}
