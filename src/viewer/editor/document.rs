//! What is edited: the boxes of one cloud and its seed; what can be read off them; which particles
//! a change asks for.

use crate::io::box_file;
use crate::model::boxes::CloudBox;

use super::action::Refusal;

/// So many lines are read again whatever their numbers: none is longer than 192 bytes (10 digits,
/// seven numbers of at most 24 characters, 14 of separators), and a box file may have 64 MiB.
pub const MOST_BOXES: usize = 1 << 18;

#[derive(Debug, Clone, PartialEq)]
pub struct Document {
    pub boxes: Vec<CloudBox>,
    /// Of the cloud's particles. A box file has no place for it: it is the scene's, and not
    /// compared when asked whether there is anything to save.
    pub seed: u32,
}

impl Document {
    pub fn new(boxes: Vec<CloudBox>) -> Self {
        Document { boxes, seed: 1 }
    }

    /// Of all boxes.
    pub fn n_particles(&self) -> u64 {
        self.boxes.iter().map(|b| u64::from(b.n_particles)).sum()
    }

    /// Equal to the bit, where `==` takes 0 and −0 for the same.
    pub fn is_same(&self, other: &Document) -> bool {
        self.seed == other.seed && same_boxes(&self.boxes, &other.boxes)
    }

    /// An error at the first box that has become what the box file's reader refuses, and where
    /// boxes were added beyond [`MOST_BOXES`].
    pub(super) fn check(&self, before: &Document) -> Result<(), Refusal> {
        if self.boxes.len() > MOST_BOXES.max(before.boxes.len()) {
            return Err(Refusal(format!(
                "expected at most {MOST_BOXES} boxes, found {}",
                self.boxes.len()
            )));
        }
        let wrong = self
            .boxes
            .iter()
            .enumerate()
            .find_map(|(i, b)| box_file::wrong(b).map(|what| (i, what)));
        wrong.map_or(Ok(()), |(i, what)| Err(Refusal(format!("box {i}: {what}"))))
    }
}

pub fn same_boxes(a: &[CloudBox], b: &[CloudBox]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_same(a, b))
}

/// To the bit.
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

/// In cubic scene units.
pub fn volume(b: &CloudBox) -> f64 {
    b.extent.element_product()
}

/// Particles in a cubic scene unit; none of a box without a volume, or with one that f64 takes for
/// none.
pub fn density(b: &CloudBox) -> Option<f64> {
    let density = f64::from(b.n_particles) / volume(b);
    density.is_finite().then_some(density)
}

/// What a change asks for. A particle follows from the cloud's seed, its box's number (its place in
/// the list) and the box, its place relative to the box's centre from all but that centre
/// (docs/model.md §1). So boxes are compared by their number: what is added at the end touches
/// nothing else, and what is deleted touches every later box, because they get other numbers, save
/// those that are like the box that had their number. All others keep their particles to the bit.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Touched {
    /// Numbers of boxes whose particles have to be generated anew, rising; new boxes are among
    /// them.
    pub generate: Vec<usize>,
    /// Numbers of boxes whose particles are the same relative to their centre, which has moved.
    pub moved: Vec<usize>,
    /// There are so many boxes now; particles of boxes beyond are no more.
    pub n_boxes: usize,
    /// Boxes were added or taken away: particles of later boxes lie elsewhere in a list of all.
    pub is_resized: bool,
}

impl Touched {
    pub fn between(old: &Document, new: &Document) -> Touched {
        let mut touched = Touched { n_boxes: new.boxes.len(), ..Touched::default() };
        touched.is_resized = old.boxes.len() != new.boxes.len();
        for (i, b) in new.boxes.iter().enumerate() {
            match old.boxes.get(i) {
                Some(was) if old.seed == new.seed && has_same_particles(was, b) => {
                    if !is_same(was, b) {
                        touched.moved.push(i);
                    }
                }
                _ => touched.generate.push(i),
            }
        }
        touched
    }

    /// Whether there is nothing to do.
    pub fn is_nothing(&self) -> bool {
        self.generate.is_empty() && self.moved.is_empty() && !self.is_resized
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::samples::{document, unit_box};
    use super::*;
    use crate::model::boxes::Form;
    use crate::reference::generate::generate_box;

    #[test]
    fn boxes_that_are_not_named_keep_their_particles_and_those_named_do_not() {
        let old = document(4);
        let mut new = old.clone();
        new.boxes[1].center.y += 1.0;
        new.boxes[2].extent.z *= 1.25;
        new.boxes.push(CloudBox { center: DVec3::X, ..unit_box() });
        let touched = Touched::between(&old, &new);
        let expected =
            Touched { generate: vec![2, 4], moved: vec![1], n_boxes: 5, is_resized: true };
        assert_eq!(touched, expected);
        let of = |d: &Document, i: usize| {
            generate_box(&d.boxes[i], i as u32, d.seed, Form::Centred, 1.0, 1.0)
        };
        for i in [0, 1, 3] {
            assert_eq!(of(&old, i), of(&new, i));
        }
        assert_ne!(of(&old, 2), of(&new, 2));
    }

    #[test]
    fn a_deleted_box_touches_those_that_follow_unless_they_are_alike() {
        let mut old = document(5);
        old.boxes[3] = old.boxes[2];
        let mut new = old.clone();
        new.boxes.remove(1);
        // 2 is what 3 was; 3 follows 4.
        let touched = Touched::between(&old, &new);
        assert_eq!((touched.generate, touched.moved, touched.n_boxes), (vec![1, 3], vec![], 4));
        let mut other_seed = old.clone();
        other_seed.seed += 1;
        assert_eq!(Touched::between(&old, &other_seed).generate, [0, 1, 2, 3, 4]);
        assert!(Touched::between(&old, &old).is_nothing());
    }

    #[test]
    fn density_is_particles_by_volume_where_there_is_any() {
        let b = CloudBox { n_particles: 12, extent: DVec3::new(2.0, 3.0, 0.5), ..unit_box() };
        assert_eq!((volume(&b), density(&b)), (3.0, Some(4.0)));
        assert_eq!(density(&CloudBox { extent: DVec3::new(1.0, 0.0, 1.0), ..b }), None);
        assert_eq!(density(&CloudBox { extent: DVec3::splat(1e-120), ..b }), None);
    }

    #[test]
    fn no_line_is_longer_than_is_reckoned_with() {
        let v = -1.234_567_890_123_456_7e-300;
        let b = CloudBox {
            n_particles: u32::MAX,
            extent: DVec3::splat(-v),
            center: DVec3::splat(v),
            radius_max: -v,
        };
        let line = box_file::format(&[b]).lines().nth(2).map(str::len);
        assert!(line.is_some_and(|n| n < 192), "{line:?}");
        const { assert!(MOST_BOXES as u64 * 192 + 64 <= crate::io::text_file::DATA_LIMIT) };
    }
}
