//! Which of several boxes a position word means.

use super::super::GoalObject;
use super::super::language::Pick;
use crate::geometry::PixelBox;
use crate::pddl::Name;

/// Two objects count as side by side in an order only when they differ by this part of their size.
const ORDER_MARGIN: f64 = 0.2;
/// Two areas count as different when they differ by this part.
const AREA_MARGIN: f64 = 0.04;
/// An object with the number that a position orders by.
#[derive(Debug)]
pub(super) struct Keyed<'a> {
    name: &'a Name,
    key: f64,
    /// How far the keys of two objects must be apart.
    margin: f64,
}

impl<'a> Keyed<'a> {
    pub(super) fn new(object: &'a GoalObject, pick: Pick) -> Option<Self> {
        let pixel_box = object.pixel_box.filter(PixelBox::is_valid)?;
        let (column, row) = pixel_box.centre();
        let (key, margin) = match pick {
            Pick::Left | Pick::Right | Pick::Middle | Pick::FromLeft(_) => {
                (column, ORDER_MARGIN * pixel_box.width())
            }
            Pick::Top | Pick::Bottom => (row, ORDER_MARGIN * pixel_box.height()),
            Pick::Smallest | Pick::Largest => (pixel_box.area(), AREA_MARGIN * pixel_box.area()),
        };
        Some(Self { name: &object.name, key, margin })
    }

    fn differs(&self, other: &Self) -> bool {
        (self.key - other.key).abs() > f64::midpoint(self.margin, other.margin)
    }
}

/// Why no object is chosen.
#[derive(Debug)]
pub(super) enum Miss {
    /// There is no fourth of three and no middle of two.
    NoSuchPlace,
    /// These objects stand too close to each other to be told apart by this word.
    Equal(Vec<Name>),
}

/// The object that the word means; sorts the objects by it.
pub(super) fn choose(keyed: &mut [Keyed<'_>], pick: Pick) -> Result<Name, Miss> {
    keyed.sort_by(|a, b| a.key.total_cmp(&b.key).then_with(|| a.name.cmp(b.name)));
    let chosen_idx = match pick {
        Pick::Middle if keyed.len() % 2 == 1 => keyed.len() / 2,
        Pick::FromLeft(number) if number > 0 => number - 1,
        Pick::Middle | Pick::FromLeft(_) => return Err(Miss::NoSuchPlace),
        Pick::Left | Pick::Top | Pick::Smallest => 0,
        Pick::Right | Pick::Bottom | Pick::Largest => keyed.len().saturating_sub(1),
    };
    let chosen = keyed.get(chosen_idx).ok_or(Miss::NoSuchPlace)?;
    let neighbours = [chosen_idx.checked_sub(1), Some(chosen_idx + 1)];
    let beside = neighbours.into_iter().flatten().filter_map(|idx| keyed.get(idx));
    let mut equal: Vec<Name> =
        beside.filter(|other| !chosen.differs(other)).map(|other| other.name.clone()).collect();
    if equal.is_empty() {
        return Ok(chosen.name.clone());
    }
    equal.push(chosen.name.clone());
    equal.sort();
    Err(Miss::Equal(equal))
}
