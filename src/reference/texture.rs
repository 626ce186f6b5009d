//! The pool of textures and the part of it that a splat shows: model.md §9, passes.md "texture".
//! The fields are sums of waves term by term, not fast transforms.
//!
//! In: a seed; a particle. Out: n at every texel of every level; ln of the factor on τ.

use std::f64::consts::{PI, TAU};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use glam::DVec2;

use crate::model::parallel::parallel_map;
use crate::model::philox::{philox4x32_10, uniform};
use crate::model::texture::N_FIELDS;

/// Philox stream "text".
const STREAM: u32 = 0x7465_7874;
/// Exponent of the spectrum: |F| ∝ |k|^−SLOPE.
const SLOPE: f64 = 1.7;
/// Least |k| of a wave.
const LEAST_WAVE: i32 = 2;
/// Side of level 0, texels.
pub const SIDE: usize = 256;
/// Number of levels.
pub const N_LEVELS: usize = 6;
/// Period of the field, σ.
pub const PERIOD_SIGMA: f64 = 6.0;
/// Quantum of n in the pool.
pub const QUANTUM: f64 = 1.0 / 4096.0;
/// Greatest number of quanta.
const MOST_QUANTA: f64 = 32767.0;

/// A level of a field, with n at the texels' corners. *Shape*: row j, column i at i + side·j.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Side, texels.
    pub side: usize,
    /// n_l.
    pub own: Vec<f64>,
    /// n_{l+1} interpolated at the same places.
    pub above: Vec<f64>,
}

/// Levels of every field. *Shape*: [field][level].
#[derive(Debug, Clone, PartialEq)]
pub struct Pool(pub Vec<Vec<Level>>);

/// Returns the side of level `l`.
pub fn side(l: usize) -> usize {
    SIDE >> l
}

/// Returns the greatest |k| in level `l`.
fn most(l: usize) -> i32 {
    (side(l) / 4) as i32
}

/// Returns all waves of |k| from 2 to `most`.
fn waves(most: i32) -> impl Iterator<Item = (i32, i32)> {
    let range = move || -most..=most;
    range().flat_map(move |x| range().map(move |y| (x, y))).filter(move |k| is_wave(*k, most))
}

fn is_wave((x, y): (i32, i32), most: i32) -> bool {
    (LEAST_WAVE.pow(2)..=most.pow(2)).contains(&(x * x + y * y))
}

/// Returns |F| of a wave without the normalising factor.
fn shape((x, y): (i32, i32)) -> f64 {
    f64::from(x * x + y * y).powf(-0.5 * SLOPE)
}

/// Returns the factor that makes the field's mean square 1: by Parseval Σ|F|² = 1.
pub fn amplitude() -> f64 {
    waves(most(0)).map(|k| shape(k).powi(2)).sum::<f64>().powf(-0.5)
}

/// Returns Σ|F| over all waves.
pub fn sum_of_amplitudes() -> f64 {
    amplitude() * waves(most(0)).map(shape).sum::<f64>()
}

/// [`mean_squares`] of every level.
static MEAN_SQUARES: LazyLock<[[f64; 3]; N_LEVELS]> =
    LazyLock::new(|| std::array::from_fn(mean_squares));

/// Returns the mean squares ⟨n_l²⟩, ⟨n_l n_{l+1}⟩ and ⟨n_{l+1}²⟩ of a level over all places, as
/// bilinear interpolation has them. It is the closed form for a wave e^{iθj} between nodes j, by
/// axis.
pub fn mean_squares(l: usize) -> [f64; 3] {
    let amplitude = amplitude();
    let mut sums = [0.0; 3];
    for k in waves(most(l)) {
        let energy = (amplitude * shape(k)).powi(2);
        let cosines = [k.0, k.1].map(|k| (TAU * f64::from(k) / side(l) as f64).cos());
        let over = |f: &dyn Fn(f64) -> f64| energy * f(cosines[0]) * f(cosines[1]);
        sums[0] += over(&|c| (2.0 + c) / 3.0);
        if l + 1 < N_LEVELS && is_wave(k, most(l + 1)) {
            // Every other node of n_{l+1} lies midway between its neighbours, where the wave is cos
            // θ times as high.
            sums[1] += over(&|c| (1.0 + c) * (2.0 + c) / 6.0);
            sums[2] += over(&|c| (1.0 + 2.0 * c * c) / 3.0);
        }
    }
    sums
}

/// Returns the phases of wave `k` of fields 2·`pair` and 2·`pair` + 1. F(−k) is the conjugate of
/// F(k).
fn phases(seed: u32, (x, y): (i32, i32), pair: u32) -> [f64; 2] {
    let drawn = x > 0 || (x == 0 && y > 0);
    let side = if drawn { 1 } else { -1 };
    let words = philox4x32_10([seed, STREAM], [(side * x) as u32, (side * y) as u32, pair, STREAM]);
    [words[0], words[1]].map(|w| f64::from(side) * (TAU * uniform(w) - PI))
}

impl Pool {
    /// Computes the pool of a seed.
    pub fn new(seed: u32) -> Pool {
        let pairs = parallel_map((N_FIELDS / 2) as usize, |pair| {
            (0..N_LEVELS).map(|l| pair_of_fields(seed, pair as u32, l)).collect::<Vec<_>>()
        });
        let mut fields = Vec::new();
        for levels in pairs {
            for part in 0..2 {
                let own = |l: usize| levels.get(l).map(|of| of[part].as_slice());
                let level = |l: usize| Level {
                    side: side(l),
                    own: levels[l][part].clone(),
                    above: own(l + 1)
                        .map_or(vec![0.0; side(l).pow(2)], |n| doubled(n, side(l + 1))),
                };
                fields.push((0..N_LEVELS).map(level).collect());
            }
        }
        Pool(fields)
    }

    /// Returns the rounded pool of a seed. The last one is kept: pictures of a scene share it, and
    /// computing it takes longer than a small picture.
    pub fn on_device(seed: u32) -> Arc<Pool> {
        static LAST: Mutex<Option<(u32, Arc<Pool>)>> = Mutex::new(None);
        let last = || LAST.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, pool)) = last().as_ref().filter(|(of, _)| *of == seed) {
            return Arc::clone(pool);
        }
        // Not under the lock: another task of this thread may ask for it meanwhile.
        let pool = Arc::new(Pool::new(seed).rounded());
        *last() = Some((seed, Arc::clone(&pool)));
        pool
    }

    /// Returns the pool with every n rounded to the 16 bits that shaders read, quanta of
    /// [`QUANTUM`].
    pub fn rounded(&self) -> Pool {
        let round = |n: &f64| QUANTUM * (n / QUANTUM).clamp(-MOST_QUANTA, MOST_QUANTA).round();
        let all = |n: &[f64]| -> Vec<f64> { n.iter().map(round).collect() };
        let level = |l: &Level| Level { side: l.side, own: all(&l.own), above: all(&l.above) };
        Pool(self.0.iter().map(|field| field.iter().map(level).collect()).collect())
    }
}

/// Computes level `l` of two fields: n(i, j) = Σ_k F(k) e^{2πi(k_x i + k_y j)/side}, first over
/// k_x, then over k_y.
///
/// The terms of k and −k are conjugate. Half of the waves are summed up: those with k_y > 0, and
/// those with k_y = 0 and k_x > 0. n is twice the real part of their sum.
fn pair_of_fields(seed: u32, pair: u32, l: usize) -> [Vec<f64>; 2] {
    let (n, most, amplitude) = (side(l), most(l), amplitude());
    let roots: Vec<(f64, f64)> = (0..n).map(|j| (TAU * j as f64 / n as f64).sin_cos()).collect();
    let root = |k: i32, x: usize| roots[(k * x as i32).rem_euclid(n as i32) as usize];
    // Sums over k_x at every column, for each k_y.
    let mut rows = vec![vec![[(0.0, 0.0); 2]; n]; (most + 1) as usize];
    for (row, y) in rows.iter_mut().zip(0..) {
        let first = if y == 0 { 1 } else { -most };
        for x in (first..=most).filter(|x| is_wave((*x, y), most)) {
            let height = 2.0 * amplitude * shape((x, y));
            let spectrum = phases(seed, (x, y), pair)
                .map(|phase| (height * phase.cos(), height * phase.sin()));
            for (i, sums) in row.iter_mut().enumerate() {
                let (sine, cosine) = root(x, i);
                for (sum, (re, im)) in sums.iter_mut().zip(spectrum) {
                    sum.0 += re * cosine - im * sine;
                    sum.1 += re * sine + im * cosine;
                }
            }
        }
    }
    let mut fields = [vec![0.0; n * n], vec![0.0; n * n]];
    for j in 0..n {
        for (row, y) in rows.iter().zip(0..) {
            let (sine, cosine) = root(y, j);
            for (i, sums) in row.iter().enumerate() {
                for (field, (re, im)) in fields.iter_mut().zip(sums) {
                    field[i + n * j] += re * cosine - im * sine;
                }
            }
        }
    }
    fields
}

/// Interpolates `n` bilinearly to twice as many nodes along each axis.
fn doubled(n: &[f64], side: usize) -> Vec<f64> {
    let at = |i: usize, j: usize| 0.5 * DVec2::new(i as f64, j as f64);
    (0..2 * side).flat_map(|j| (0..2 * side).map(move |i| bilinear(n, side, at(i, j)))).collect()
}

/// Interpolates bilinearly between the nodes of a periodic field.
fn bilinear(n: &[f64], side: usize, at: DVec2) -> f64 {
    let low = at.floor();
    let share = at - low;
    let node = |dx: f64, dy: f64| {
        let wrapped = |v: f64| v.rem_euclid(side as f64) as usize % side;
        n[wrapped(low.x + dx) + side * wrapped(low.y + dy)]
    };
    let near = node(0.0, 0.0) + share.x * (node(1.0, 0.0) - node(0.0, 0.0));
    let far = node(0.0, 1.0) + share.x * (node(1.0, 1.0) - node(0.0, 1.0));
    near + share.y * (far - near)
}

/// Texture of the particles of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Textured {
    /// Index of the field.
    pub i_field: u32,
    /// s.
    pub strength: f64,
    /// Seed of the cloud.
    pub seed: u32,
    /// Index of the box within its cloud.
    pub i_box: u32,
}

/// The part of the pool that a splat shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SplatTexture {
    /// Index of the field.
    pub i_field: usize,
    /// s.
    pub strength: f64,
    /// Level l.
    pub level: usize,
    /// Share of n_{l+1}.
    pub fade: f64,
    /// Rotation of the field.
    pub angle: f64,
    /// Shift of the field, periods.
    pub shift: DVec2,
    /// View depth over σ.
    pub z_in_sigma: f64,
}

impl SplatTexture {
    /// Returns the texture of particle `i` of its box. `pixel` is the difference of slopes between
    /// neighbouring pixels.
    pub fn new(of: &Textured, i: u32, z_in_sigma: f64, pixel: f64) -> SplatTexture {
        let words = philox4x32_10([of.seed, of.i_box], [i, 0, 0, STREAM]);
        let [u, v, w, _] = words.map(uniform);
        // Texels of level 0 in a pixel.
        let dense =
            (SIDE as f64 / PERIOD_SIGMA * z_in_sigma * pixel).clamp(1.0, (1 << N_LEVELS) as f64);
        let level = (0..N_LEVELS).rev().find(|l| dense >= (1 << l) as f64).unwrap_or(0);
        let fade = (dense / (1 << level) as f64 - 1.0).min(1.0);
        let (angle, shift) = (TAU * u - PI, DVec2::new(v, w));
        SplatTexture {
            i_field: of.i_field as usize,
            strength: of.strength,
            level,
            fade,
            angle,
            shift,
            z_in_sigma,
        }
    }

    /// Returns the place in texels of the level, where the slopes differ by `delta` from the
    /// centre's.
    pub fn place(&self, delta: DVec2) -> DVec2 {
        let periods = DVec2::from_angle(self.angle).rotate(delta * self.z_in_sigma / PERIOD_SIGMA)
            + self.shift;
        periods * side(self.level) as f64
    }

    /// Returns s² ⟨n²⟩/2.
    pub fn half_square(&self) -> f64 {
        let ([own, both, above], f) = (MEAN_SQUARES[self.level], self.fade);
        let square = (1.0 - f).powi(2) * own + 2.0 * f * (1.0 - f) * both + f * f * above;
        0.5 * self.strength.powi(2) * square
    }

    /// Returns the factor exp(s n − s² ⟨n²⟩/2) at `delta`.
    pub fn factor(&self, pool: &Pool, delta: DVec2) -> f64 {
        (self.strength * self.n(pool, delta) - self.half_square()).exp()
    }

    /// Returns n at `delta`.
    pub fn n(&self, pool: &Pool, delta: DVec2) -> f64 {
        let (level, at) = (&pool.0[self.i_field][self.level], self.place(delta));
        let of = |n: &[f64]| bilinear(n, level.side, at);
        (1.0 - self.fade) * of(&level.own) + self.fade * of(&level.above)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_coarsest_level_by_hand() {
        // Four waves, (±2, 0) and (0, ±2), a quarter turn from node to node: α = 2/3 along the
        // axis, 1 across.
        assert_eq!(waves(2).count(), 4);
        let energy = amplitude().powi(2) * 4f64.powf(-1.7);
        assert!((mean_squares(5)[0] - 4.0 * energy * 2.0 / 3.0).abs() < 1e-15);
        assert_eq!(mean_squares(5)[1..], [0.0, 0.0]);
        // On level 4 they turn by an eighth, cos ϑ = √½: (2 + √½)/3, (1 + √½)(2 + √½)/6, (1 +
        // 2·½)/3.
        let root = std::f64::consts::FRAC_1_SQRT_2;
        let [_, both, above] = mean_squares(4);
        assert!((both - 4.0 * energy * (1.0 + root) * (2.0 + root) / 6.0).abs() < 1e-15);
        assert!((above - 4.0 * energy * 2.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn between_four_nodes_and_across_the_seam() {
        let n = [0.0, 1.0, 2.0, 6.0];
        assert_eq!(bilinear(&n, 2, DVec2::new(0.5, 0.5)), 2.25);
        assert_eq!(bilinear(&n, 2, DVec2::new(0.25, 0.0)), 0.25);
        // From node 1 on to node 0 of the next period, and from node −1, which is node 1.
        assert_eq!(bilinear(&n, 2, DVec2::new(1.25, 1.0)), 5.0);
        assert_eq!(bilinear(&n, 2, DVec2::new(-0.75, -1.0)), 5.0);
        assert_eq!(doubled(&n, 2)[..5], [0.0, 0.5, 1.0, 0.5, 1.0]);
    }

    #[test]
    fn levels_follow_the_size_on_the_screen() {
        let of = Textured { i_field: 3, strength: 2.0, seed: 1, i_box: 0 };
        // A period is 6 σ: at z = 60 σ a slope of 0.1, of 0.1/pixel pixels, 256 texels.
        let at = |pixels: f64| {
            let sheet = SplatTexture::new(&of, 0, 60.0, 0.1 / pixels);
            (sheet.level, (sheet.fade * 1e9).round() / 1e9)
        };
        assert_eq!([at(1000.0), at(256.0), at(128.0)], [(0, 0.0), (0, 0.0), (1, 0.0)]);
        assert_eq!([at(170.0 + 2.0 / 3.0), at(8.0), at(6.4)], [(0, 0.5), (5, 0.0), (5, 0.25)]);
        assert_eq!([at(4.0), at(0.01)], [(5, 1.0), (5, 1.0)]);
        // At the end nothing is left, and nothing is subtracted.
        assert_eq!(SplatTexture::new(&of, 0, 60.0, 0.1).half_square(), 0.0);
        let sheet = SplatTexture {
            angle: std::f64::consts::FRAC_PI_2,
            shift: DVec2::new(0.5, 0.25),
            ..SplatTexture::new(&of, 0, 60.0, 1e-9)
        };
        // A quarter turn: right becomes up; 0.025 · 60/6 = ¼ of a period.
        assert!((sheet.place(DVec2::new(0.025, 0.0)) - DVec2::new(128.0, 128.0)).length() < 1e-9);
    }
}
