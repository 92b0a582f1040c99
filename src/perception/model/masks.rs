//! Pixel masks, as they are written beside labelled boxes.

use serde::Deserialize as _;

use super::exemplar::{entries, fault};
use crate::geometry::MaskRun;
use crate::pddl::SourceText;
use crate::perception::model::{Exemplar, ExemplarError};

impl Exemplar {
    /// Gives each object its mask.
    pub(super) fn add_masks(&mut self, text: &SourceText) -> Result<(), ExemplarError> {
        let [width, height] = self.image_size;
        for (name, value) in entries(text)? {
            let fail = fault(&text.name, &name);
            let written = Vec::<[u32; 3]>::deserialize(&value)
                .map_err(|e| fail("a list of [y, x1, x2]", e.to_string()))?;
            let run = |&[y, x_start, x_end]: &[u32; 3]| MaskRun { y, x_start, x_end };
            let runs: Vec<MaskRun> = written.iter().map(run).collect();
            let is_run = |r: &&MaskRun| r.x_start < r.x_end && r.x_end <= width && r.y < height;
            if let Some(bad) = runs.iter().find(|run| !is_run(run)) {
                let expected = format!("[y, x1, x2] with x1 < x2 inside {width} x {height}");
                let got = format!("[{}, {}, {}]", bad.y, bad.x_start, bad.x_end);
                return Err(fail(&expected, got));
            }
            let in_order = |a: &MaskRun, b: &MaskRun| (a.y, a.x_end) <= (b.y, b.x_start);
            if runs.is_empty() || !runs.is_sorted_by(in_order) {
                return Err(fail("runs from top to bottom and left to right", "others".to_owned()));
            }
            let Some(object) = self.objects.iter_mut().find(|object| object.name == name) else {
                return Err(fail("an object that has a box", "none".to_owned()));
            };
            if object.mask.replace(runs.into()).is_some() {
                return Err(fail("one mask per object", "two".to_owned()));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::geometry::PixelBox;
    use crate::pddl::Typed;

    #[test]
    fn bad_masks_name_file_and_object() {
        let boxes = [("a".into(), PixelBox::from([1.0, 1.0, 5.0, 5.0]))];
        let declared = [Typed::new("a", "block")];
        let made = Exemplar::new("b.json", [8, 6], &boxes, (&declared, BTreeSet::new())).unwrap();
        let read = |text: &str| made.clone().add_masks(&SourceText::new("m.json", text));
        read(r#"{"a": [[1, 1, 3], [1, 4, 5], [2, 1, 5]]}"#).unwrap();
        for (text, expect) in [
            (r#"{"a": [[1, 1, 9]]}"#, "m.json: a: expected [y, x1, x2] with x1 < x2 inside 8 x 6"),
            (r#"{"a": [[6, 1, 2]]}"#, "got [6, 1, 2]"),
            (r#"{"a": [[2, 1, 2], [1, 1, 2]]}"#, "from top to bottom"),
            (r#"{"a": []}"#, "from top to bottom"),
            (r#"{"b": [[1, 1, 2]]}"#, "m.json: b: expected an object that has a box"),
            (r#"{"a": [[1, -1, 2]]}"#, "m.json: a: expected a list of [y, x1, x2]"),
            (r#"{"a": [[1, 1, 2]], "a": [[1, 1, 2]]}"#, "m.json: a: expected one mask per object"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(expect), "{error}");
        }
    }
}
