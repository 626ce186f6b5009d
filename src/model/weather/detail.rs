//! Detail of clouds below the cells of a weather file (model.md §15). A turbulent noise modulates
//! the masses of a cell's blobs, which keep the cell's mass, and displaces blobs. The detail is
//! invented; only its spectrum is that of turbulence.

use glam::DVec3;

use super::flow::{Carrier, Noise};
use super::grid::Grid;
use super::noise_space::NoiseSpace;
use super::particles::{Layout, WeatherBlob};
use crate::model::noise::turbulences;
use crate::model::parallel::parallel_map;

/// Strength of the modulation with `detail` = 1, over the mean extinction.
const STRENGTH: f64 = 1.6;
/// Decrease of the noise where the extinction is half of the cell's mean. Elsewhere it is in
/// proportion to 1/extinction − 1, so that clouds fray at their edges.
const FRAY: f64 = 0.35;
/// Least extinction over the mean that counts there.
const THINNEST: f64 = 0.25;
/// Standard deviation of the displacement with `detail` = 1, cells.
const SHIFT: f64 = 0.57;
/// "deta": a Philox stream of its own.
const STREAM: u32 = 0x6465_7461;
/// Blobs of one piece of work.
const BLOBS_A_JOB: usize = 4096;

/// The wind that takes detail along.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wind {
    /// A velocity: m/s, x east, y up, z south.
    Given(DVec3),
    /// The winds of the file, which deform the detail.
    OfFile,
}

/// A modulation of blobs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detail {
    /// Strength: 0 is none, 1 much.
    pub strength: f64,
    /// The wind that takes it along.
    pub wind: Wind,
    /// Seed.
    pub seed: u32,
}

/// Returns which column around its own a blob comes to, eastward and southward from 0 to 2 with 1
/// for its own, and where it is there. `even`: its place in its own column, from −½ to ½, if
/// extinction were even; `shift` in columns; `is_open` tells which columns it may enter. It is
/// turned back at the face of another. It enters a column across a corner only if those on both
/// sides are open, too. If those are open and that across is not, it is turned about the corner
/// into one of the three others. So its place is continuous in the shift.
fn displaced(
    even: [f64; 2],
    shift: [f64; 2],
    is_open: impl Fn(usize, usize) -> bool,
) -> ([usize; 2], [f64; 2]) {
    let mut to = [0, 1].map(|k| (even[k] + shift[k]).clamp(-1.49, 1.49));
    let column_at = |to: [f64; 2]| to.map(|v| if v < -0.5 { 0 } else { 1 + usize::from(v > 0.5) });
    let [x, z] = column_at(to);
    let column = match (is_open(x, 1), is_open(1, z)) {
        (true, true) if is_open(x, z) => [x, z],
        (true, true) => {
            to = about_corner(to);
            column_at(to)
        }
        (true, false) => [x, 1],
        (false, true) => [1, z],
        (false, false) => [1, 1],
    };
    let within = [0, 1].map(|k| match (column[k], to[k]) {
        // Turned back at the face.
        (1, v) if v.abs() > 0.5 => v.signum() - v,
        (of, v) => v + 1.0 - of as f64,
    });
    (column, within)
}

/// Turns a place beyond a corner of its column about that corner: the quarter beyond it is spread
/// over the three others, and its edges stay. No place comes farther than the next column.
fn about_corner(to: [f64; 2]) -> [f64; 2] {
    let beyond = to.map(|v| v.abs() - 0.5);
    let (radius, angle) = (beyond[0].hypot(beyond[1]), -3.0 * beyond[1].atan2(beyond[0]));
    let turned = [angle.cos(), angle.sin()].map(|part| 0.5 + radius.min(0.99) * part);
    [to[0].signum() * turned[0], to[1].signum() * turned[1]]
}

impl Detail {
    /// No detail.
    pub const NONE: Detail = Detail { strength: 0.0, wind: Wind::Given(DVec3::ZERO), seed: 0 };

    /// Returns whether the winds of the file carry it.
    pub fn is_in_winds(&self) -> bool {
        self.strength > 0.0 && self.wind == Wind::OfFile
    }

    /// Returns where the blobs of a layout are without detail; nothing if there is none.
    pub fn spots(&self, layout: &Layout, grid: &Grid) -> Vec<Spot> {
        if self.strength == 0.0 {
            return vec![];
        }
        let (space, places) = (NoiseSpace::new(grid), layout.places());
        of_blobs(places.len(), |i| {
            let even = layout.even(places[i]);
            let room = layout.size(grid, places[i]).room;
            Spot {
                i_cell: places[i].i_cell as usize,
                at: layout.place_in_cell(places[i]),
                in_noise: space.of(layout, grid, places[i]),
                fray: FRAY * (1.0 / layout.relative(places[i]).clamp(THINNEST, 1.0) - 1.0),
                even: [even.x, even.z],
                room: [room.x, room.z],
            }
        })
    }

    /// Returns the effect on the blobs of a layout at their [`Detail::spots`] of what `carrier` has
    /// brought. It depends on the ground, but not on the heights of `grid`.
    pub fn effects(
        &self,
        spots: &[Spot],
        layout: &Layout,
        grid: &Grid,
        carrier: &Carrier,
    ) -> Vec<Effect> {
        let ground = &grid.ground;
        let (nx, n_columns) = (grid.shape().nx, grid.shape().n_columns());
        let (space, noises) = (NoiseSpace::new(grid), carrier.noises());
        of_blobs(spots.len(), |i| {
            let Spot { i_cell, at, in_noise, fray, even, room } = spots[i];
            let velocity = space.in_units(carrier.velocity(i_cell, at));
            let of = |noise: &Noise| {
                let from = in_noise - noise.age_s * velocity;
                noise.factor * DVec3::from(turbulences([self.seed, STREAM], noise.number, from))
            };
            let noise: DVec3 = noises.iter().map(of).sum();
            let weight = (1.0 + STRENGTH * self.strength * (noise.x - fray)).max(0.0);
            let shift = SHIFT * self.strength * noise;
            let open = layout.open(i_cell % n_columns);
            let ([east, south], within) = displaced(even, [shift.y, shift.z], |east, south| {
                open >> (3 * east + south) & 1 == 1
            });
            // Rows run north, and z points south.
            let to = i_cell + east + nx - 1 - nx * south;
            let [x, z] = layout.course(to).across.place(within);
            let column = to % n_columns;
            // Toward an open column a blob comes up to the face, so that it crosses without a step.
            let is_open = |column: usize, to: u32| layout.open(column) >> to & 1 == 1;
            let (to_x, beside_x) =
                if x < 0.0 { (1, column.wrapping_sub(1)) } else { (7, column + 1) };
            let (to_z, beside_z) =
                if z < 0.0 { (3, column + nx) } else { (5, column.wrapping_sub(nx)) };
            // Where two columns meet a blob has the smaller of their extents along their face.
            let extent =
                |size: f64, room: f64, to: u32, (to_side, beside, lean): (u32, usize, f64)| {
                    let of = |column: usize| if is_open(column, to) { size } else { room };
                    let meets = is_open(column, to_side);
                    let least = if meets { of(column).min(of(beside)) } else { of(column) };
                    of(column) + (least - of(column)) * 2.0 * lean.abs()
                };
            let east = extent(ground.dx_m[column], room[0], to_x, (to_z, beside_z, z));
            let south = extent(ground.dy_m[column], room[1], to_z, (to_x, beside_x, x));
            let place = [ground.east_m[column] + east * x, ground.south_m[column] + south * z];
            Effect { weight, place }
        })
    }
}

/// Returns what `of` makes of each of `n` blobs.
fn of_blobs<T: Clone + Send>(n: usize, of: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    let of_job = |job: usize| {
        let range = job * BLOBS_A_JOB..n.min((job + 1) * BLOBS_A_JOB);
        range.map(&of).collect::<Vec<T>>()
    };
    parallel_map(n.div_ceil(BLOBS_A_JOB), of_job).concat()
}

/// A blob before its detail: what stays while noise passes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    i_cell: usize,
    /// Place in its cell, from −½ to ½.
    at: DVec3,
    /// Place in the space of the noise.
    in_noise: DVec3,
    /// Decrease of the noise.
    fray: f64,
    /// Place east and south in its cell, if extinction were even.
    even: [f64; 2],
    /// Extent of the centres of blobs like it, east and south, m.
    room: [f64; 2],
}

/// The change of a blob by its detail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effect {
    /// Share of its cell's mass over that of a blob of the same mass without detail.
    weight: f64,
    /// Place east and south, m.
    place: [f64; 2],
}

/// Gives the blobs of a layout their detail: none without effects. Every cell keeps its mass.
pub fn apply(effects: &[Effect], blobs: &mut [WeatherBlob], layout: &Layout) {
    if effects.is_empty() {
        return;
    }
    let n_cells = layout.places().iter().map(|p| p.i_cell as usize + 1).max().unwrap_or(0);
    let mut sums = vec![[0.0; 2]; n_cells];
    let both = || effects.iter().zip(layout.places());
    for (blob, (effect, place)) in blobs.iter().zip(both()) {
        let (sum, mass) = (&mut sums[place.i_cell as usize], blob.mass());
        *sum = [sum[0] + mass, sum[1] + effect.weight * mass];
    }
    for (blob, (effect, place)) in blobs.iter_mut().zip(both()) {
        (blob.position.x, blob.position.z) = (effect.place[0], effect.place[1]);
        let [mass, weighted] = sums[place.i_cell as usize];
        // A cell of which nothing would be left stays as it is.
        blob.kappa *= if weighted > 1e-3 * mass { effect.weight * mass / weighted } else { 1.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::weather::grid::{Ground, Shape};

    /// Cells of 100 x 100 x 50 m: 8 thick ones in a row, and clear ones around them.
    fn row_of_clouds() -> (Grid, Vec<f64>) {
        let shape = Shape { nx: 10, ny: 3, nz: 2 };
        let ones = vec![1.0; 30];
        let ground = Ground::new(shape, (100.0, 100.0), (&ones, &ones), false).unwrap();
        let heights = (0..90).map(|i| 50.0 * f64::from(i / 30)).collect();
        let extinction = (0..60).map(|i| if (11..19).contains(&(i % 30)) { 1.0 } else { 0.0 });
        (Grid::new(ground, heights).unwrap(), extinction.collect())
    }

    #[test]
    fn every_cell_keeps_its_mass_and_the_wind_takes_the_detail_along() {
        let (grid, extinction) = row_of_clouds();
        let layout = Layout::new(&grid, &[&extinction], 4000, 7);
        let plain = layout.blobs(&grid, &extinction);
        let detail = Detail { strength: 1.0, seed: 3, ..Detail::NONE };
        let wind = DVec3::X * 7.0;
        let of = |detail: &Detail, time_s: f64| {
            let mut all = plain.clone();
            let carrier = Carrier::Evenly(wind, time_s);
            let spots = detail.spots(&layout, &grid);
            let effects = detail.effects(&spots, &layout, &grid, &carrier);
            apply(&effects, &mut all, &layout);
            all
        };
        let found = of(&detail, 0.0);
        let masses = |all: &[WeatherBlob]| {
            let mut masses = vec![0.0; 60];
            let both = layout.places().iter().zip(all);
            both.for_each(|(place, blob)| masses[place.i_cell as usize] += blob.mass());
            masses
        };
        for (a, b) in masses(&found).iter().zip(masses(&plain)) {
            assert!((a - b).abs() <= 1e-12 * b);
        }
        // Some of it is gone, some is several times as dense, and some has changed its column, but
        // none is where it was clear. A quarter would be gone of a large field; the row is four
        // units of the noise long, and has more or less of it.
        let n_gone = found.iter().filter(|b| b.kappa == 0.0).count();
        assert!((200..2400).contains(&n_gone), "{n_gone}");
        let most = plain.iter().map(|b| b.kappa).fold(0.0, f64::max);
        assert!(found.iter().any(|b| b.kappa > 2.0 * most));
        let column = |b: &WeatherBlob| (b.position.x / 100.0).floor();
        let n_elsewhere = plain.iter().zip(&found).filter(|(a, b)| column(a) != column(b)).count();
        assert!(n_elsewhere > 400, "{n_elsewhere}");
        for b in &found {
            assert!(b.position.x.abs() < 400.0 && b.position.z.abs() < 50.0, "{}", b.position);
        }
        // A wind takes it along, steadily; 21 m in 3 s are 0.105 units of 200 m.
        assert!((NoiseSpace::new(&grid).in_units(wind * 3.0).x - 0.105).abs() < 1e-12);
        let (soon, later) = (of(&detail, 0.001), of(&detail, 9.0));
        let change = |all: &[WeatherBlob]| {
            let off = found.iter().zip(all).map(|(a, b)| (a.kappa - b.kappa).abs() / most);
            off.fold(0.0, f64::max)
        };
        assert!(change(&soon) < 0.02 && change(&later) > 0.5);
        assert_eq!(of(&Detail { strength: 0.0, ..detail }, 5.0), plain);
    }

    #[test]
    fn blobs_turn_back_at_closed_columns() {
        let of = |open: &[[usize; 2]], shift: [f64; 2]| {
            displaced([0.4, 0.25], shift, |x, z| [x, z] == [1, 1] || open.contains(&[x, z]))
        };
        let is = |(column, at): ([usize; 2], [f64; 2]), of: [usize; 2], expected: [f64; 2]| {
            column == of && at.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12)
        };
        // 0.3 eastward leads into the next column, 0.2 beyond the face.
        assert!(is(of(&[], [0.3, 0.0]), [1, 1], [0.3, 0.25]));
        assert!(is(of(&[[2, 1]], [0.3, 0.0]), [2, 1], [-0.3, 0.25]));
        // Into the corner: the column beside is open, that of the corner is not.
        assert!(is(of(&[[2, 1]], [0.3, 0.5]), [2, 1], [-0.3, 0.25]));
        // Across the corner alone none is open.
        assert!(is(of(&[[2, 2]], [0.3, 0.5]), [1, 1], [0.3, 0.25]));
        assert!(is(of(&[[2, 1], [1, 2], [2, 2]], [0.3, 0.5]), [2, 2], [-0.3, -0.25]));
        assert!(is(of(&[[1, 2]], [0.3, 0.5]), [1, 2], [0.3, -0.25]));
        // Around a closed corner of two open columns it goes without a step, through its own.
        let sides = [[2, 1], [1, 2]];
        let around = |step: i32| {
            let angle = f64::from(step) * 0.01 - 0.2;
            let at =
                |([x, z], [u, v]): ([usize; 2], [f64; 2])| [x as f64 - 1.0 + u, z as f64 - 1.0 + v];
            at(of(&sides, [0.1 + 0.3 * angle.cos(), 0.25 + 0.3 * angle.sin()]))
        };
        for step in 0..200 {
            let (a, b) = (around(step), around(step + 1));
            assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 0.02, "{step}: {a:?} {b:?}");
            assert!(a[0] < 0.5 + 1e-9 || a[1] < 0.5 + 1e-9, "{a:?}");
        }
        assert!(is(of(&sides, [0.3, 0.45]), [1, 1], [0.3, 0.3]));
        // No blob comes farther than the next column.
        assert!(is(of(&[], [-0.8, -0.7]), [1, 1], [-0.4, -0.45]));
        assert!(is(of(&[[2, 1]], [9.0, 0.0]), [2, 1], [0.49, 0.25]));
    }
}
