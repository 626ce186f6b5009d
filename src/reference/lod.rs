//! The f64 twin of the pass "lod": one blob in place of many, passes.md "lod".
//!
//! In: blobs with the regions that they belong to. Out: as many blobs, of which one of each run
//! stands for all and the others have no extinction. Law: mass, mean place and mean variance.

use glam::DVec3;

use super::Blob;
use crate::model::lod::{CELLS_PER_AXIS, N_CLASSES, RUN, class_of, edge_of};
use crate::model::shape::Shape;

/// The size and cell of a blob: only those that share both are merged. `None` stays alone.
pub type Key = Option<[i32; 4]>;

/// Returns the key of every blob; those of `is_alone` have none. `lod` is the edge of a cell over
/// the least σ of its class.
pub fn keys(blobs: &[Blob], is_alone: impl Fn(usize) -> bool, lod: f64) -> Vec<Key> {
    let widest = blobs.iter().map(|b| b.sigma).fold(0.0, f64::max);
    let key = |(i, b): (usize, &Blob)| {
        let is_blob = b.shape == Shape::BALL && b.kappa > 0.0 && b.sigma > 0.0;
        if !is_blob || is_alone(i) {
            return None;
        }
        let class = class_of(b.sigma);
        let size = class_of(widest) - class;
        let half = f64::from(CELLS_PER_AXIS / 2);
        let cell = (b.position / edge_of(class, lod)).floor() + half;
        let is_in = cell.min_element() >= 0.0 && cell.max_element() < 2.0 * half;
        let [x, y, z] = cell.to_array().map(|v| v as i32);
        (is_in && size < N_CLASSES).then_some([size, z, y, x])
    };
    blobs.iter().enumerate().map(key).collect()
}

/// Returns the order of keys, those without one last, ties by index.
pub fn order(keys: &[Key]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..keys.len() as u32).collect();
    order.sort_by_key(|&i| keys[i as usize].unwrap_or([N_CLASSES; 4]));
    order
}

/// Blobs of which some stand for others.
pub struct Merged {
    /// The blobs; those that others stand for have no extinction.
    pub blobs: Vec<Blob>,
    /// Of each run of several: the blob that stands for it, and its members with their shares of
    /// the mass.
    pub runs: Vec<(u32, Vec<(u32, f64)>)>,
}

impl Merged {
    /// Returns `values` by blob, with the mean of a run for the blob that stands for it.
    pub fn means(&self, values: &[DVec3]) -> Vec<DVec3> {
        let mut means = values.to_vec();
        for (own, members) in &self.runs {
            means[*own as usize] =
                members.iter().map(|(i, share)| *share * values[*i as usize]).sum();
        }
        means
    }
}

/// Merges runs of blobs that follow each other in `order` with one key and region.
pub fn merge(blobs: &[Blob], keys: &[Key], order: &[u32], region: impl Fn(u32) -> u32) -> Merged {
    let mut merged = Merged { blobs: blobs.to_vec(), runs: vec![] };
    let follows = |a: &u32, b: &u32| {
        let key = keys[*a as usize];
        key.is_some() && key == keys[*b as usize] && region(*a) == region(*b)
    };
    for part in order.chunks(RUN as usize) {
        for run in part.chunk_by(follows).filter(|run| run.len() > 1) {
            merged.replace(blobs, run);
        }
    }
    merged
}

impl Merged {
    fn replace(&mut self, blobs: &[Blob], run: &[u32]) {
        let mass = |b: &Blob| b.kappa * b.sigma.powi(3);
        let members = || run.iter().map(|&i| (i, &blobs[i as usize]));
        let total: f64 = members().map(|(_, b)| mass(b)).sum();
        let shares: Vec<(u32, f64)> = members().map(|(i, b)| (i, mass(b) / total)).collect();
        let of = |i: u32| &blobs[i as usize];
        let position: DVec3 = shares.iter().map(|(i, share)| *share * of(*i).position).sum();
        let square = |i: u32| of(i).position.distance_squared(position);
        let variance = |i: u32| of(i).sigma.powi(2) + square(i) / 3.0;
        let sigma = shares.iter().map(|(i, share)| share * variance(*i)).sum::<f64>().sqrt();
        let nearest = run.iter().copied().min_by(|a, b| square(*a).total_cmp(&square(*b)));
        let Some(own) = nearest else { return };
        run.iter().for_each(|i| self.blobs[*i as usize].kappa = 0.0);
        self.blobs[own as usize] =
            Blob { position, sigma, kappa: total / sigma.powi(3), ..*of(own) };
        self.runs.push((own, shares));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::lod::depth_error;

    fn ball(x: f64, sigma: f64, kappa: f64) -> Blob {
        Blob { position: DVec3::new(x, 0.1, 0.1), sigma, shape: Shape::BALL, kappa }
    }

    #[test]
    fn two_blobs_by_hand() {
        // Masses 1 and 3, 0.2 apart: the mean is a quarter away from the heavier one.
        let blobs = [ball(0.1, 1.0, 1.0), ball(0.3, 1.0, 3.0), ball(0.6, 1.0, 1.0)];
        let keys = keys(&blobs, |_| false, 0.5);
        assert!(keys[0] == keys[1] && keys[1] != keys[2] && keys[0].is_some());
        let Merged { blobs: found, runs } = merge(&blobs, &keys, &order(&keys), |_| 0);
        assert_eq!((found[0].kappa, found[2]), (0.0, blobs[2]));
        assert!((found[1].position.x - 0.25).abs() < 1e-15);
        // (¼ 0.15² + ¾ 0.05²)/3
        let sigma = (1.0 + 0.0075 / 3.0_f64).sqrt();
        assert!((found[1].sigma - sigma).abs() < 1e-15);
        assert!((found[1].kappa * sigma.powi(3) - 4.0).abs() < 1e-14);
        assert_eq!(runs, [(1, vec![(0, 0.25), (1, 0.75)])]);
    }

    #[test]
    fn only_what_is_alike_is_merged() {
        let turned = Blob { shape: Shape::upright(2.0), ..ball(0.1, 1.0, 1.0) };
        let blobs = [
            ball(0.1, 1.0, 1.0),
            ball(0.1, 1.2, 1.0),
            turned,
            ball(0.1, 1.0, 0.0),
            ball(1e4, 1.0, 1.0),
            ball(-0.1, 1.0, 1.0),
            ball(0.1, 1e-3, 1.0),
            ball(0.1, 1.1, 1.0),
        ];
        let keys = keys(&blobs, |i| i == 7, 0.5);
        assert_eq!(keys[0], Some([1, 256, 256, 256]));
        assert_eq!(keys[1], Some([0, 256, 256, 256]));
        assert_eq!(keys[2..5], [None; 3]);
        assert_eq!(keys[5], Some([1, 256, 256, 255]));
        assert_eq!(keys[6..], [None; 2]);
        // One key in two regions stays two blobs.
        let pair = [blobs[0]; 2];
        let keys = super::keys(&pair, |_| false, 0.5);
        assert!(merge(&pair, &keys, &order(&keys), |i| i).runs.is_empty());
        assert_eq!(merge(&pair, &keys, &order(&keys), |_| 0).runs.len(), 1);
        // No run crosses a multiple of RUN.
        let many = vec![blobs[0]; 300];
        let keys = super::keys(&many, |_| false, 0.5);
        let runs = merge(&many, &keys, &order(&keys), |_| 0).runs;
        assert_eq!(runs.iter().map(|(_, of)| of.len()).collect::<Vec<_>>(), [256, 44]);
    }

    /// Returns the greatest change of optical depth along z when all blobs are merged, over the
    /// greatest depth: κ σ e^{−b²/2σ²}.
    fn change_of_depth(blobs: &[Blob], lod: f64) -> f64 {
        let keys = keys(blobs, |_| false, lod);
        let merged = merge(blobs, &keys, &order(&keys), |_| 0);
        assert_eq!(merged.runs.len(), 1);
        let depth = |blobs: &[Blob], x: f64, y: f64| -> f64 {
            let of = |b: &Blob| {
                let square = (x - b.position.x).powi(2) + (y - b.position.y).powi(2);
                b.kappa * b.sigma * (-0.5 * square / b.sigma.powi(2)).exp()
            };
            blobs.iter().map(of).sum()
        };
        let places = (-60..=60).flat_map(|i| (-60..=60).map(move |j| (i, j)));
        let found = places.map(|(i, j)| {
            let (x, y) = (0.25 + 0.05 * f64::from(i), 0.25 + 0.05 * f64::from(j));
            let [before, after] = [blobs, &merged.blobs].map(|of| depth(of, x, y));
            ((before - after).abs(), after)
        });
        let (off, most) = found.fold((0.0, 0.0), |(off, most), (change, depth)| {
            (f64::max(off, change), f64::max(most, depth))
        });
        off / most
    }

    #[test]
    fn the_depth_changes_by_less_than_its_bound() {
        let corner = |k: u32| {
            let at = |bit: u32| if k >> bit & 1 == 1 { 0.49 } else { 0.01 };
            Blob { position: DVec3::new(at(0), at(1), at(2)), ..ball(0.0, 1.0, 1.0) }
        };
        for members in [vec![0, 7], vec![0, 3], vec![0, 1], (0..8).collect()] {
            let blobs: Vec<Blob> = members.into_iter().map(corner).collect();
            let change = change_of_depth(&blobs, 0.5);
            // The sizes are equal.
            assert!(change < depth_error(0.5) - depth_error(0.0), "{change}");
        }
        // Equal masses of the least and the greatest size of a class.
        let sizes = [1.0, 1.189].map(|sigma: f64| ball(0.25, sigma, sigma.powi(-3)));
        let change = change_of_depth(&sizes, 0.5);
        assert!((0.025..depth_error(0.0)).contains(&change), "{change}");
    }
}
