//! Ground that no file describes: level, or with hills (model.md §16).

use std::sync::Arc;

use glam::DVec3;

use super::noise::turbulence;
use super::terrain::Terrain;

/// A rectangle of ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hills {
    /// Its middle, at the mean height.
    pub position: DVec3,
    /// Lengths eastward (x) and southward (z).
    pub size: [f64; 2],
    /// Points along both; each at least 2.
    pub points: [u32; 2],
    /// Standard deviation of the heights.
    pub relief: f64,
    /// Length of the widest hills.
    pub length: f64,
    /// Seed.
    pub seed: u32,
}

/// Most points along a side.
pub const MAX_POINTS: u32 = 4096;
/// Deviation of the noise in the plane y = 0. It is a lattice plane of the first octave, which has
/// 0.851 of its variance there (by a Monte Carlo sum); √((0.851 + Σ of the others)/Σ of all).
const LEVEL: f64 = 0.967;
/// Greatest height: no place of a scene is farther.
const GREATEST: f64 = 1e15;
/// "hill": a Philox stream of its own.
const STREAM: u32 = 0x6869_6c6c;

impl Hills {
    /// Returns the ground: rows run east and follow each other northward.
    pub fn terrain(&self, i_material: usize) -> Terrain {
        let [n_east, n_north] = self.points;
        let along = |i: u32, n: u32| f64::from(i) / f64::from(n - 1) - 0.5;
        let place = |k: u32| {
            let (x, north) = (along(k % n_east, n_east), along(k / n_east, n_north));
            let (x, z) = (x * self.size[0], -north * self.size[1]);
            let place = DVec3::new(x, self.height(x, z), z);
            place.clamp(DVec3::splat(-GREATEST), DVec3::splat(GREATEST))
        };
        Terrain {
            origin: self.position,
            points: Arc::new((0..n_east * n_north).map(place).collect()),
            n: self.points,
            i_material,
            ..Terrain::default()
        }
    }

    fn height(&self, x: f64, z: f64) -> f64 {
        if self.relief == 0.0 {
            return 0.0;
        }
        let at = DVec3::new(x, 0.0, z) / self.length;
        self.relief / LEVEL * turbulence([self.seed, STREAM], 0, at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLAT: Hills = Hills {
        position: DVec3::new(1.0, 2.0, 3.0),
        size: [8.0, 6.0],
        points: [5, 3],
        relief: 0.0,
        length: 2.0,
        seed: 1,
    };

    #[test]
    fn level_ground_has_its_corners_where_they_are_asked_for() {
        let ground = FLAT.terrain(4);
        let (low, high) = ground.bounds();
        assert_eq!((low, high), (DVec3::new(-3.0, 2.0, 0.0), DVec3::new(5.0, 2.0, 6.0)));
        // East along a row, then north: toward −z.
        assert_eq!(ground.points[1] - ground.points[0], DVec3::new(2.0, 0.0, 0.0));
        assert_eq!(ground.points[5] - ground.points[0], DVec3::new(0.0, 0.0, -3.0));
        assert!(ground.facets().all(|f| f.normal == DVec3::Y) && ground.i_material == 4);
    }

    #[test]
    fn hills_have_the_heights_that_they_are_given() {
        let hills =
            Hills { size: [400.0, 400.0], points: [201, 201], relief: 0.5, length: 7.3, ..FLAT };
        let of = |hills: Hills| hills.terrain(0).points.iter().map(|p| p.y).collect::<Vec<f64>>();
        let all = of(hills);
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let square = all.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / all.len() as f64;
        assert!(mean.abs() < 0.02 && (square.sqrt() - 0.5).abs() < 0.01, "{mean} {square}");
        assert_ne!(all, of(Hills { seed: 2, ..hills }));
    }
}
