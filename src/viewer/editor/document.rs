//! The edited document: the boxes of one cloud and its seed.

use crate::io::box_file;
use crate::model::boxes::CloudBox;

/// Largest number of boxes: as many fit the file limit of 64 MiB. A line of a box file has at most
/// 192 bytes: 10 digits, seven numbers of at most 24 characters, and 14 characters of separators.
pub const MAX_BOXES: usize = 1 << 18;

/// The boxes of a cloud, and its seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Document {
    /// Boxes in the order of the file.
    pub boxes: Vec<CloudBox>,
    /// Seed of the cloud's particles. It belongs to the scene, not to the box file, so a changed
    /// seed is not an unsaved change.
    pub seed: u32,
}

impl Document {
    /// Creates a document with seed 1.
    pub fn new(boxes: Vec<CloudBox>) -> Self {
        Document { boxes, seed: 1 }
    }

    /// Returns the number of particles of all boxes.
    pub fn n_particles(&self) -> u64 {
        self.boxes.iter().map(|b| u64::from(b.n_particles)).sum()
    }

    /// Returns whether both documents are bitwise equal, so that 0 differs from −0.
    pub fn is_same(&self, other: &Document) -> bool {
        self.seed == other.seed && are_same_boxes(&self.boxes, &other.boxes)
    }

    /// Checks that a box file can hold the document. A document that had too many boxes `before`
    /// may keep as many.
    ///
    /// # Errors
    /// The first value that a box file's reader rejects, or too many boxes.
    pub(super) fn check(&self, before: &Document) -> Result<(), String> {
        let n = self.boxes.len();
        if n > MAX_BOXES.max(before.boxes.len()) {
            return Err(format!("expected at most {MAX_BOXES} boxes, found {n}"));
        }
        let mut faults = self
            .boxes
            .iter()
            .enumerate()
            .filter_map(|(i, b)| box_file::wrong(b).map(|what| format!("box {i}: {what}")));
        faults.next().map_or(Ok(()), Err)
    }

    /// Returns the boxes whose particles must be generated again after a change from `before`.
    ///
    /// The particles of a box follow from the cloud's seed, the index of the box, and the box.
    /// Their places relative to the box's centre do not depend on that centre (model.md §1). A box
    /// that only moves therefore keeps its particles. A deleted box changes the indices of later
    /// boxes.
    pub fn regenerated_since(&self, before: &Document) -> Vec<usize> {
        let is_kept = |i: &usize| {
            let was = before.boxes.get(*i);
            self.seed == before.seed
                && was.is_some_and(|was| has_same_particles(was, &self.boxes[*i]))
        };
        (0..self.boxes.len()).filter(|i| !is_kept(i)).collect()
    }
}

/// Returns whether both lists are bitwise equal.
pub fn are_same_boxes(a: &[CloudBox], b: &[CloudBox]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_same(a, b))
}

/// Returns whether both boxes are bitwise equal.
pub fn is_same(a: &CloudBox, b: &CloudBox) -> bool {
    has_same_particles(a, b) && bits(a.center.to_array()) == bits(b.center.to_array())
}

fn has_same_particles(a: &CloudBox, b: &CloudBox) -> bool {
    let shape = |b: &CloudBox| (b.n_particles, bits(b.extent.to_array()), b.radius_max.to_bits());
    shape(a) == shape(b)
}

fn bits(v: [f64; 3]) -> [u64; 3] {
    v.map(f64::to_bits)
}

/// Returns the volume of a box in cubic scene units.
pub fn volume(b: &CloudBox) -> f64 {
    b.extent.element_product()
}

/// Returns the particles per cubic scene unit; `None` where the volume is 0 in f64.
pub fn density(b: &CloudBox) -> Option<f64> {
    let density = f64::from(b.n_particles) / volume(b);
    density.is_finite().then_some(density)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::fixtures::{document, unit_box};
    use super::*;
    use crate::model::boxes::{BoxLaw, Form};
    use crate::reference::generate::generate_box;

    #[test]
    fn only_the_listed_boxes_have_new_particles() {
        let old = document(4);
        let mut new = old.clone();
        new.boxes[1].center.y += 1.0;
        new.boxes[2].extent.z *= 1.25;
        new.boxes.push(CloudBox { center: DVec3::X, ..unit_box() });
        assert_eq!(new.regenerated_since(&old), [2, 4]);
        let particles = |d: &Document, i: usize| {
            generate_box(&d.boxes[i], i as u32, d.seed, &BoxLaw::new(Form::Centred))
        };
        for i in [0, 3] {
            assert_eq!(particles(&old, i), particles(&new, i));
        }
        assert_ne!(particles(&old, 2), particles(&new, 2));
    }

    #[test]
    fn a_deleted_box_changes_the_later_ones_unless_they_are_equal() {
        let mut old = document(5);
        old.boxes[3] = old.boxes[2];
        let mut new = old.clone();
        new.boxes.remove(1);
        assert_eq!(new.regenerated_since(&old), [1, 3]);
        let mut other_seed = old.clone();
        other_seed.seed += 1;
        assert_eq!(other_seed.regenerated_since(&old), [0, 1, 2, 3, 4]);
        assert!(old.regenerated_since(&old).is_empty());
    }

    #[test]
    fn density_is_particles_by_volume_if_there_is_any() {
        let b = CloudBox { n_particles: 12, extent: DVec3::new(2.0, 3.0, 0.5), ..unit_box() };
        assert_eq!((volume(&b), density(&b)), (3.0, Some(4.0)));
        assert_eq!(density(&CloudBox { extent: DVec3::new(1.0, 0.0, 1.0), ..b }), None);
        assert_eq!(density(&CloudBox { extent: DVec3::splat(1e-120), ..b }), None);
    }

    #[test]
    fn the_longest_line_has_the_length_that_the_limit_assumes() {
        let v = -1.234_567_890_123_456_7e-300;
        let b = CloudBox {
            n_particles: u32::MAX,
            extent: DVec3::splat(-v),
            center: DVec3::splat(v),
            radius_max: -v,
        };
        let line = box_file::format(&[b]).lines().nth(2).map(str::len);
        assert!(line.is_some_and(|n| n < 192), "{line:?}");
        const { assert!(MAX_BOXES as u64 * 192 + 64 <= crate::io::text_file::DATA_LIMIT) };
    }
}
