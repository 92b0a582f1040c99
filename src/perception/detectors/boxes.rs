//! Boxes from outside: what of them can be used.

use crate::geometry::PixelBox;

use crate::perception::ImageView;

/// A side of a box that is shorter than this after clipping shows nothing, pixels.
const SIDE_MIN: f64 = 1.0;

/// A box that a service or a model gave, cut off at the edges of the image.
///
/// # Errors
/// Why it is unusable: not finite, without an inside, or outside the image.
pub(super) fn clipped(edges: [f64; 4], image: &ImageView<'_>) -> Result<PixelBox, &'static str> {
    let pixel_box = PixelBox::from(edges);
    if !edges.iter().all(|v| v.is_finite()) {
        return Err("not finite");
    }
    if !pixel_box.is_valid() {
        return Err("without an inside");
    }
    let inside = whole(image).intersection(&pixel_box);
    if inside.width() < SIDE_MIN || inside.height() < SIDE_MIN {
        return Err("outside the image");
    }
    Ok(inside)
}

/// Whether a box that somebody has written down lies in the image.
pub(super) fn is_inside(pixel_box: &PixelBox, image: &ImageView<'_>) -> bool {
    pixel_box.is_valid() && whole(image).intersection(pixel_box) == *pixel_box
}

fn whole(image: &ImageView<'_>) -> PixelBox {
    PixelBox::from([0.0, 0.0, image.width() as f64, image.height() as f64])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_cut_off_at_the_edge_or_refused_with_a_reason() {
        let rgb = [0; 3 * 40 * 30];
        let image = ImageView::new(40, 30, &rgb).unwrap();
        let inside = PixelBox::from([0.0, 5.0, 10.0, 30.0]);
        assert_eq!(clipped([-3.0, 5.0, 10.0, 31.5], &image), Ok(inside));
        for (edges, reason) in [
            ([f64::NAN, 1.0, 2.0, 3.0], "not finite"),
            ([1.0, 1.0, f64::INFINITY, 3.0], "not finite"),
            ([5.0, 1.0, 2.0, 3.0], "without an inside"),
            ([1.0, 1.0, 1.0, 3.0], "without an inside"),
            ([40.0, 1.0, 50.0, 3.0], "outside the image"),
            ([39.5, 1.0, 50.0, 3.0], "outside the image"),
        ] {
            assert_eq!(clipped(edges, &image), Err(reason), "{edges:?}");
        }
        assert!(is_inside(&inside, &image));
        assert!(!is_inside(&PixelBox::from([0.0, 5.0, 10.0, 30.5]), &image));
    }
}
