//! Labelled examples as pictures of another ratio of width to height: for proposals that a person looks
//! through, never for a run.
//!
//! Sizes are shares of the image's height, so the height stays. A picture that is too wide loses columns
//! on both sides of its objects; one that is too narrow gets more of the colours at its edges.

use image::RgbImage;

use super::scaled_examples::scaled_example;
use crate::geometry::PixelBox;
use crate::pddl::Name;
use crate::perception::model::{Exemplar, ObjectBox, OtherRatio};

/// An example as a picture of this size. What no longer lies in it is not labelled in it; masks and volumes
/// are left out.
///
/// # Errors
/// [`OtherRatio`] for a size of 0.
pub(super) fn fitted_example(
    picture: &RgbImage,
    exemplar: &Exemplar,
    [width, height]: [u32; 2],
) -> Result<(RgbImage, Exemplar), OtherRatio> {
    let [own_width, own_height] = exemplar.image_size;
    let scaled_width = f64::from(own_width) * f64::from(height) / f64::from(own_height.max(1));
    let (picture, exemplar) =
        scaled_example(picture, exemplar, [scaled_width.round().max(1.0) as u32, height])?;
    let left = left_edge(&exemplar, width);
    let column = |x: u32| (i64::from(x) + left).clamp(0, i64::from(picture.width()) - 1) as u32;
    let fitted = RgbImage::from_fn(width, height, |x, y| *picture.get_pixel(column(x), y));

    let frame = PixelBox::from([0.0, 0.0, f64::from(width), f64::from(height)]);
    let moved = exemplar.objects.iter().map(|object| {
        let b = object.pixel_box;
        let pixel_box = PixelBox { x1: b.x1 - left as f64, x2: b.x2 - left as f64, ..b };
        ObjectBox { pixel_box, mask: None, volume: None, ..object.clone() }
    });
    let objects: Vec<ObjectBox> =
        moved.filter(|o| frame.intersection(&o.pixel_box) == o.pixel_box).collect();
    let is_gone = |name: &Name| {
        exemplar.objects.iter().any(|o| o.name == *name) && objects.iter().all(|o| o.name != *name)
    };
    let init =
        exemplar.init.iter().filter(|atom| !atom.args.iter().any(is_gone)).cloned().collect();
    Ok((fitted, Exemplar { image_size: [width, height], objects, init, ..exemplar }))
}

/// The column of the example at which the fitted picture begins; below 0 it is wider than the example.
fn left_edge(exemplar: &Exemplar, width: u32) -> i64 {
    let own = i64::from(exemplar.image_size[0]);
    let spare = own - i64::from(width);
    if spare <= 0 {
        return spare / 2;
    }
    let hull = exemplar.objects.iter().map(|o| o.pixel_box).reduce(|a, b| a.hull(&b));
    let middle = hull.map_or(own as f64 / 2.0, |hull| f64::midpoint(hull.x1, hull.x2));
    ((middle - f64::from(width) / 2.0).round() as i64).clamp(0, spare)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::pddl::Atom;

    /// A picture of 80x40 whose columns are told by their red, with blocks far left and right of the middle.
    fn example() -> (RgbImage, Exemplar) {
        let picture = RgbImage::from_fn(80, 40, |x, _| image::Rgb([x as u8, 0, 0]));
        let block = |name: &str, edges: [f64; 4]| {
            ObjectBox::new(name.into(), "block".into(), PixelBox::from(edges))
        };
        let objects = vec![
            block("a", [6.0, 10.0, 10.0, 20.0]),
            block("b", [40.0, 10.0, 50.0, 20.0]),
            block("c", [40.0, 20.0, 50.0, 30.0]),
        ];
        let init = BTreeSet::from([Atom::new("on", &["b", "c"]), Atom::new("on", &["a", "c"])]);
        (picture, Exemplar { name: "x".to_owned(), image_size: [80, 40], objects, init })
    }

    #[test]
    fn a_wide_example_loses_what_lies_beside_its_objects() {
        let (picture, exemplar) = example();
        let narrower = |width| fitted_example(&picture, &exemplar, [width, 40]).unwrap();
        let (fitted, whole) = narrower(46);
        assert_eq!(
            fitted.get_pixel(0, 0).0[0],
            5,
            "the middle of the objects, 28, stays the middle"
        );
        assert_eq!(whole.objects[1].pixel_box, PixelBox::from([35.0, 10.0, 45.0, 20.0]));
        assert_eq!((whole.objects.len(), whole.init.len()), (3, 2));
        let (_, cut) = narrower(40);
        assert_eq!((cut.objects.len(), cut.init.len()), (0, 0), "all lie across an edge");
    }

    #[test]
    fn a_narrow_example_is_continued_at_its_edges() {
        let (picture, exemplar) = example();
        let (fitted, exemplar) = fitted_example(&picture, &exemplar, [240, 80]).unwrap();
        assert_eq!(fitted.dimensions(), (240, 80));
        assert_eq!(fitted.get_pixel(0, 0).0[0], 0);
        assert_eq!(fitted.get_pixel(239, 0).0[0], 79);
        assert_eq!(exemplar.objects.len(), 3);
        assert_eq!(exemplar.objects[0].pixel_box, PixelBox::from([52.0, 20.0, 60.0, 40.0]));
        assert_eq!(exemplar.init.len(), 2);
    }
}
