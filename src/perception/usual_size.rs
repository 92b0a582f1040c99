//! How large objects of a type are in the world, where the labelled examples agree about it.

use std::collections::BTreeMap;

use super::model::ObjectBox;
use crate::pddl::Name;

/// Sizes that differ by at most this share are one.
const SAME_SIZE_MAX: f64 = 0.15;
/// So many objects at least,
const ALIKE_MIN: usize = 3;
/// and this share of them, must have one size for others to be taken to have it.
const ALIKE_SHARE_MIN: f64 = 0.8;

/// Sizes of labelled objects in the world, in metres, by type.
#[derive(Debug, Clone, Default)]
pub struct UsualSizes {
    extents: BTreeMap<Name, Vec<[f64; 3]>>,
    /// What they agree about.
    usual: BTreeMap<Name, [f64; 3]>,
}

impl UsualSizes {
    /// Adds labelled objects; those without volume say nothing.
    pub fn learn(&mut self, objects: &[ObjectBox]) {
        for (object, volume) in objects.iter().filter_map(|o| o.volume.map(|volume| (o, volume))) {
            self.extents.entry(object.type_name.clone()).or_default().push(volume.extent);
        }
        let told = |(name, extents): (&Name, &Vec<[f64; 3]>)| Some((name.clone(), usual(extents)?));
        self.usual = self.extents.iter().filter_map(told).collect();
    }

    /// The size that objects of the type have, about; `None` when they differ, or are not as deep as
    /// wide: then nothing says which way one stands.
    pub fn of(&self, type_name: &Name) -> Option<[f64; 3]> {
        self.usual.get(type_name).copied()
    }
}

/// The size that all of them have, about.
fn usual(extents: &[[f64; 3]]) -> Option<[f64; 3]> {
    let middle = [0, 1, 2].map(|axis| {
        let mut values: Vec<f64> = extents.iter().map(|extent| extent[axis]).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    });
    let is_near = |a: f64, b: f64| (a - b).abs() <= SAME_SIZE_MAX * b;
    let near = |extent: &&[f64; 3]| extent.iter().zip(middle).all(|(a, b)| is_near(*a, b));
    let n_alike = extents.iter().filter(near).count();
    let is_told = n_alike as f64 >= ALIKE_SHARE_MIN * extents.len() as f64;
    (n_alike >= ALIKE_MIN && is_told && is_near(middle[0], middle[1])).then_some(middle)
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::geometry::{Aabb, PixelBox};

    fn of(extents: &[[f64; 3]]) -> Option<[f64; 3]> {
        let object = |extent: &[f64; 3]| {
            let volume = Aabb { centre: Point3::origin(), extent: *extent };
            let flat =
                ObjectBox::new("a".into(), "block".into(), PixelBox::from([0.0, 0.0, 1.0, 1.0]));
            ObjectBox { volume: Some(volume), ..flat }
        };
        let mut sizes = UsualSizes::default();
        sizes.learn(&extents.iter().map(object).collect::<Vec<_>>());
        sizes.of(&"block".into())
    }

    #[test]
    fn blocks_of_one_size_have_it_and_a_hidden_one_changes_nothing() {
        let mut blocks = vec![[0.05, 0.05, 0.05]; 9];
        blocks.push([0.007, 0.007, 0.05]);
        assert_eq!(of(&blocks), Some([0.05; 3]));
    }

    #[test]
    fn disks_of_many_sizes_few_objects_and_bars_have_none() {
        let disks: Vec<[f64; 3]> = (1..9).map(|i| [0.02 * f64::from(i); 3]).collect();
        assert_eq!(of(&disks), None);
        assert_eq!(of(&[[0.05; 3]; 2]), None);
        assert_eq!(of(&[[0.1, 0.02, 0.02]; 9]), None);
        assert_eq!(of(&[]), None);
    }
}
