//! Colour classes: which of the domain's colour names a pixel would be called, as one table look-up.

use std::collections::BTreeMap;

use super::lab::{CHROMA_MIN, Lab, Shade};
use super::light::{Ground, LIKE_MAX, likeness};
use super::median::median_colour;
use crate::geometry::PixelBox;
use crate::pddl::Name;
use crate::perception::ImageView;
use crate::perception::detectors::DetectorError;
use crate::perception::model::Srgb;

/// Most colour names over all types: classes are bytes, and each has a mask of its own.
pub(super) const COLOURS_MAX: usize = 64;

/// The class of a pixel that has none of the colours.
pub(super) const NONE: u8 = 0;

/// Bits kept of each channel in the table; 3 × 6 bits index 256 KiB, which stays in the cache.
const BITS: u32 = 6;

/// What one unit of lightness counts in a distance of shades. Small: light changes more than paint.
const PER_LIGHTNESS: f32 = 0.006;

/// A pixel farther than this from every shade has no colour name.
const DISTANCE_MAX: f32 = 0.45;

/// A shade learnt from the camera in use counts as nearer than general knowledge by this share of
/// its distance,
const LEARNT_SHARE: f32 = 0.3;
/// but by no more than this: what one object shows of its colour says little about others.
const LEARNT_MAX: f32 = 0.06;

/// Most grounds whose tables are kept: a camera's flicker goes back and forth between few.
const GROUNDS_MAX: usize = 4;

/// Least share of a labelled box's middle that must have the colour for it to be learnt from.
const OWN_SHARE_MIN: f64 = 0.05;

/// The colour names in use with their shades, and the look-up table made of them.
#[derive(Debug, Clone)]
pub(super) struct Palette {
    names: Vec<Name>,
    shades: Vec<(u8, Shade)>,
    learnt: Vec<(u8, Shade)>,
    /// Class by quantised colour; empty until it is needed.
    table: Vec<u8>,
    /// Cells of the table that have a class, with their colours.
    classed: Vec<(usize, Lab)>,
    /// The table without what looks like the ground, for the grounds of the last frames, newest first.
    off_ground: Vec<(Ground, Vec<u8>)>,
}

impl Palette {
    /// Makes a palette of named colours.
    ///
    /// # Errors
    /// [`DetectorError::TooManyColours`].
    pub(super) fn new(colours: &BTreeMap<Name, Vec<Srgb>>) -> Result<Self, DetectorError> {
        if colours.len() > COLOURS_MAX {
            return Err(DetectorError::TooManyColours { limit: COLOURS_MAX, got: colours.len() });
        }
        let shades = colours.values().zip(1..).flat_map(|(shades, class)| {
            shades.iter().map(move |srgb| (class, Shade::of(Lab::of(srgb.0))))
        });
        Ok(Self {
            names: colours.keys().cloned().collect(),
            shades: shades.collect(),
            learnt: Vec::new(),
            table: Vec::new(),
            classed: Vec::new(),
            off_ground: Vec::new(),
        })
    }

    /// The class of a colour name.
    pub(super) fn class(&self, name: &Name) -> Option<u8> {
        self.names.iter().position(|n| n == name).map(|i| i as u8 + 1)
    }

    /// The number of classes, [`NONE`] included.
    pub(super) fn n_classes(&self) -> usize {
        self.names.len() + 1
    }

    /// Adds the shade that a labelled box shows of a colour: the channel-wise median over the
    /// central half of the box, which leaves out the background at its edges.
    ///
    /// Another object may cover the middle (a disk on a wider one, seen from above). So only pixels
    /// that general knowledge gives this colour count, where there are any to speak of; where there
    /// are none, the box teaches only if its pixels have no other colour either, or if objects of its
    /// type have `one_colour` and most of the middle has one other: then that is what it is called
    /// here.
    pub(super) fn learn(
        &mut self,
        name: &Name,
        one_colour: bool,
        (image, pixel_box): (&ImageView<'_>, &PixelBox),
    ) {
        let Some(class) = self.class(name) else { return };
        let pixels: Vec<[u8; 3]> = middle(image, pixel_box).collect();
        let of_class = |wanted: u8| {
            let own = pixels.iter().filter(|rgb| self.classify_generally(**rgb) == wanted);
            own.copied().collect::<Vec<[u8; 3]>>()
        };
        let enough = |n: usize| n as f64 >= OWN_SHARE_MIN * pixels.len() as f64;
        let own = of_class(class);
        let other = || {
            let classes = (1..=self.names.len() as u8).map(of_class);
            let most = classes.max_by_key(Vec::len).unwrap_or_default();
            Some(most).filter(|most| one_colour && 2 * most.len() > pixels.len())
        };
        let pixels = if enough(own.len()) {
            own
        } else {
            Some(of_class(NONE))
                .filter(|none| enough(none.len()))
                .or_else(other)
                .unwrap_or_default()
        };
        if !enough(pixels.len()) {
            return;
        }
        if let Some(colour) = median_colour(&pixels) {
            self.learnt.push((class, Shade::of(colour)));
            self.table.clear();
            self.off_ground.clear();
        }
    }

    /// The class of a colour by the table; `None` without one, or before [`Palette::prepared`].
    pub(super) fn look_up(&self, rgb: [u8; 3]) -> Option<u8> {
        self.table.get(cell(rgb)).copied().filter(|c| *c != NONE)
    }

    /// Whether a colour is like a learnt shade of a class.
    pub(super) fn is_learnt(&self, class: u8, lab: Lab) -> bool {
        let shade = Shade::of(lab);
        let of_class = self.learnt.iter().filter(|(of, _)| *of == class);
        of_class.into_iter().any(|(_, known)| shade.distance(*known, 0.0) < LIKE_MAX)
    }

    /// How much a colour is like one of the learnt shades, in any brightness: from 0 to 1.
    pub(super) fn likeness(&self, rgb: [u8; 3]) -> f64 {
        likeness(self.learnt.iter().map(|(_, shade)| *shade), rgb)
    }

    /// The classes of colours that differ from a ground's; made by [`Palette::prepare`].
    pub(super) fn table(&self) -> &[u8] {
        self.off_ground.first().map_or(&[], |(_, table)| table)
    }

    /// Makes the table for frames with that ground. What looks like it has no class: the ground may
    /// have the colour of an object.
    pub(super) fn prepare(&mut self, ground: Ground) {
        // The middle of the ground's cell, so that a flicker of the camera needs no other table.
        let ground = ground.with_colour(colour_of(cell(ground.rgb)));
        if let Some(known) = self.off_ground.iter().position(|(of, _)| *of == ground) {
            self.off_ground[..=known].rotate_right(1);
            return;
        }
        let mut table = self.prepared().to_vec();
        let is_ground = ground.is_like();
        for (cell, _) in self.classed.iter().filter(|(_, lab)| is_ground(*lab)) {
            table[*cell] = NONE;
        }
        self.off_ground.truncate(GROUNDS_MAX - 1);
        self.off_ground.insert(0, (ground, table));
    }

    /// The colour name, of those in `among`, that most pixels of the middle of a box have; `None`
    /// when too few have any.
    pub(super) fn name_of<'a>(
        &self,
        image: &ImageView<'_>,
        pixel_box: &PixelBox,
        among: &'a [Name],
    ) -> Option<&'a Name> {
        let mut counts = vec![0_usize; self.n_classes()];
        for rgb in middle(image, pixel_box) {
            counts[usize::from(self.look_up(rgb).unwrap_or(NONE))] += 1;
        }
        let n_pixels: usize = counts.iter().sum();
        let count = |name: &Name| self.class(name).map_or(0, |class| counts[usize::from(class)]);
        let best = among.iter().map(count).max()?;
        let is_enough = best > 0 && best as f64 >= OWN_SHARE_MIN * n_pixels as f64;
        among.iter().find(|name| count(name) == best).filter(|_| is_enough)
    }

    /// The look-up table, made when first asked for after a change.
    pub(super) fn prepared(&mut self) -> &[u8] {
        if self.table.is_empty() {
            self.table = (0..1 << (3 * BITS)).map(|i| self.classify(colour_of(i))).collect();
            let classed = self.table.iter().enumerate().filter(|(_, class)| **class != NONE);
            self.classed = classed.map(|(i, _)| (i, Lab::of(colour_of(i)))).collect();
        }
        &self.table
    }

    /// The name of one colour by general knowledge alone.
    pub(super) fn name_generally(&self, rgb: [u8; 3]) -> Option<&Name> {
        self.names.get(usize::from(self.classify_generally(rgb)).checked_sub(1)?)
    }

    /// The class of one colour by general knowledge alone.
    fn classify_generally(&self, rgb: [u8; 3]) -> u8 {
        let lab = Lab::of(rgb);
        let shade = Shade::of(lab);
        let distances =
            self.shades.iter().map(|(c, known)| (shade.distance(*known, PER_LIGHTNESS), *c));
        let nearest = distances.min_by(|a, b| a.0.total_cmp(&b.0));
        let grey = shade.saturation().min(DISTANCE_MAX);
        nearest.filter(|(d, _)| lab.chroma() >= CHROMA_MIN && *d < grey).map_or(NONE, |(_, c)| c)
    }

    /// The class of one colour.
    fn classify(&self, rgb: [u8; 3]) -> u8 {
        let lab = Lab::of(rgb);
        if lab.chroma() < CHROMA_MIN {
            return NONE;
        }
        let shade = Shade::of(lab);
        let (mut nearest, mut best) = (DISTANCE_MAX, (f32::INFINITY, NONE));
        for (shades, share) in [(&self.shades, 0.0), (&self.learnt, LEARNT_SHARE)] {
            for (class, known) in shades {
                let d = shade.distance(*known, PER_LIGHTNESS);
                nearest = nearest.min(d);
                let counted = d - (share * d).min(LEARNT_MAX);
                if counted < best.0 {
                    best = (counted, *class);
                }
            }
        }
        // Grey of the same lightness competes like a shade: whatever is nearer to it is grey.
        if nearest < shade.saturation().min(DISTANCE_MAX) { best.1 } else { NONE }
    }
}

/// The pixels of the central half of a box, which leaves out the background at its edges.
///
/// Only the image is looked at: a detector may give a box that is far larger.
pub(super) fn middle<'a>(
    image: &ImageView<'a>,
    b: &PixelBox,
) -> impl Iterator<Item = [u8; 3]> + use<'a> {
    let (w, h, image) = (b.width(), b.height(), *image);
    let within = |first: f64, last: f64, n: usize| first as usize..(last.ceil() as usize).min(n);
    let columns = within(b.x1 + w / 4.0, b.x2 - w / 4.0, image.width());
    let rows = within(b.y1 + h / 4.0, b.y2 - h / 4.0, image.height());
    rows.flat_map(move |y| columns.clone().filter_map(move |x| image.pixel(x, y)))
}

/// The colour in the middle of a cell of the table.
fn colour_of(index: usize) -> [u8; 3] {
    let side = (1_usize << BITS) - 1;
    let value = |q: usize| ((q << (8 - BITS)) + (1 << (7 - BITS))) as u8;
    [index >> (2 * BITS), index >> BITS & side, index & side].map(value)
}

/// The index of a pixel in the table.
pub(super) fn cell([r, g, b]: [u8; 3]) -> usize {
    let q = |v: u8| usize::from(v >> (8 - BITS));
    q(r) << (2 * BITS) | q(g) << BITS | q(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn palette() -> Palette {
        let colours = [("blue", "#0343df"), ("red", "#e50000")]
            .map(|(name, hex)| (Name::new(name), vec![Srgb::try_from(hex.to_owned()).unwrap()]));
        Palette::new(&BTreeMap::from(colours)).unwrap()
    }

    #[test]
    fn shading_does_not_change_the_name_and_grey_has_none() {
        let mut palette = palette();
        let red = palette.class(&"red".into()).unwrap();
        let table = palette.prepared().to_vec();
        for rgb in [[230, 10, 10], [140, 15, 10], [90, 8, 6]] {
            assert_eq!(table[cell(rgb)], red, "{rgb:?}");
        }
        for rgb in [[0, 0, 0], [40, 42, 46], [128, 128, 128], [255, 255, 255], [40, 32, 44]] {
            assert_eq!(table[cell(rgb)], NONE, "{rgb:?}");
        }
    }

    #[test]
    fn a_learnt_shade_gets_its_name() {
        let mut palette = palette();
        let teal = [20, 120, 130];
        assert_eq!(palette.prepared()[cell(teal)], NONE);
        let rgb: Vec<u8> = teal.iter().copied().cycle().take(3 * 64).collect();
        let image = ImageView::new(8, 8, &rgb).unwrap();
        let pixel_box = PixelBox::from([0.0, 0.0, 8.0, 8.0]);
        palette.learn(&"blue".into(), false, (&image, &pixel_box));
        assert_eq!(Some(palette.prepared()[cell(teal)]), palette.class(&"blue".into()));
    }
}
