//! An impostor's picture seen from another view, passes.md "impostors": the mapping of points,
//! resampling, and the partition of the sorted particles.
//!
//! In: pictures as [C_r, C_g, C_b, A], rows from the top; sorted entries. Out: the same.

use glam::{DMat3, DVec2, DVec3};

use crate::model::impostor::{Shell, View};

/// Returns the slopes at which `view` sees a point.
pub fn seen(view: &View, point: DVec3) -> DVec2 {
    let c = point - view.eye;
    DVec2::new(c.dot(view.right), c.dot(view.up)) / c.dot(view.forward)
}

/// Returns the slopes at which `shell`'s picture shows a point to `now`: the ray from its own eye,
/// ended at the plane.
pub fn shown(shell: &Shell, now: &View, point: DVec3) -> DVec2 {
    let on_plane =
        shell.view.eye + shell.view.ray(seen(&shell.view, point)) / shell.inverse_depth();
    seen(now, on_plane)
}

/// A picture with the slopes of its edges.
#[derive(Debug, Clone, Copy)]
pub struct Picture<'a> {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Slopes of the right and upper edge.
    pub tangents: DVec2,
    /// Texels, row 0 at the top.
    pub texels: &'a [[f64; 4]],
}

/// Returns the weights of the four texels around a place `t` beyond the second one: Catmull–Rom's
/// cubic.
pub fn weights(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t + 2.0 * t2 - t3),
        1.0 + 0.5 * (-5.0 * t2 + 3.0 * t3),
        0.5 * (t + 4.0 * t2 - 3.0 * t3),
        0.5 * (t3 - t2),
    ]
}

/// Resamples a picture at a place, and bounds the error where the place errs by `place` texels and
/// each sum by a share `rounding` of its terms. Texels count from the first one's centre; places
/// beyond the edges are clamped.
pub fn sample(picture: &Picture<'_>, at: DVec2, place: f64, rounding: f64) -> ([f64; 4], [f64; 4]) {
    let last = DVec2::new(f64::from(picture.width), f64::from(picture.height)) - 1.0;
    let at = at.clamp(DVec2::ZERO, last);
    let low = at.floor();
    let [across, down] = [weights(at.x - low.x), weights(at.y - low.y)];
    let index =
        |v: f64, k: usize, n: u32| (v + k as f64 - 1.0).clamp(0.0, f64::from(n) - 1.0) as usize;
    let (mut sum, mut size) = ([0.0; 4], [0f64; 4]);
    let (mut least, mut most) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
    // One texel more on every side, since rounding may decide which four are used.
    for j in 0..6 {
        for i in 0..6 {
            let [x, y] =
                [index(low.x - 1.0, i, picture.width), index(low.y - 1.0, j, picture.height)];
            let texel = picture.texels[y * picture.width as usize + x];
            for k in 0..4 {
                (least[k], most[k]) = (least[k].min(texel[k]), most[k].max(texel[k]));
                if (1..5).contains(&i) && (1..5).contains(&j) {
                    let term = across[i - 1] * down[j - 1] * texel[k];
                    sum[k] += term;
                    size[k] += term.abs();
                }
            }
        }
    }
    let bound =
        std::array::from_fn(|k| 2.0 * STEEPEST * place * (most[k] - least[k]) + rounding * size[k]);
    let clamped =
        std::array::from_fn(|k| sum[k].clamp(0.0, if k == 3 { 1.0 } else { f64::INFINITY }));
    (clamped, bound)
}

/// Bound on the cubic's change along one axis over a texel, per difference of the greatest and
/// least texel used. It is half of Σ|w'|, as the weights' slopes sum to 0. Σ|w'| is 1 at the texels
/// and at most 3 between them; 1.25 bounds Σ|w| of the other axis.
const STEEPEST: f64 = 0.5 * 3.0 * 1.25;

/// Returns the place in `shell`'s picture of a pixel's centre, by the homography of slopes. Pixels
/// are those of a picture of `size` with `tangents`; places count in texels from the first one's
/// centre.
pub fn place_of(
    to_shell: &DMat3,
    size: [u32; 2],
    tangents: DVec2,
    shell: &Picture<'_>,
    pixel: [u32; 2],
) -> DVec2 {
    let share = |k: usize| 2.0 * (f64::from(pixel[k]) + 0.5) / f64::from(size[k]) - 1.0;
    let at = *to_shell * DVec3::new(share(0) * tangents.x, -share(1) * tangents.y, 1.0);
    let (x, y) = (at.x / at.z / shell.tangents.x, -at.y / at.z / shell.tangents.y);
    0.5 * DVec2::new((x + 1.0) * f64::from(shell.width), (y + 1.0) * f64::from(shell.height)) - 0.5
}

/// Divides the sorted entries [key, particle] into far and near ones; in each list an invalid
/// particle stands in the place of the others. `members` holds 1 for every
/// particle in the impostor. With `cut`, the particles' depths and the least of the impostor's, it
/// is computed first.
pub fn part(
    entries: &[[u32; 2]],
    members: &mut [u32],
    cut: Option<(&[f64], f64)>,
) -> [Vec<[u32; 2]>; 2] {
    if let Some((depths, cut)) = cut {
        members.fill(0);
        let far = entries.iter().map(|e| e[1] as usize).filter(|&i| depths[i] >= cut);
        far.for_each(|i| members[i] = 1);
    }
    let of = |far: bool| {
        let keep =
            |e: &[u32; 2]| if (members[e[1] as usize] == 1) == far { *e } else { [e[0], u32::MAX] };
        entries.iter().map(keep).collect()
    };
    [of(true), of(false)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cubic_passes_its_texels_and_keeps_lines_straight() {
        assert_eq!(weights(0.0), [0.0, 1.0, 0.0, 0.0]);
        assert_eq!(weights(1.0), [0.0, 0.0, 1.0, 0.0]);
        for k in 0..=64 {
            let t = f64::from(k) / 64.0;
            let w = weights(t);
            assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            assert!((-w[0] + w[2] + 2.0 * w[3] - t).abs() < 1e-15);
            let h = 1e-6;
            let slope = |k: usize| (weights(t + h)[k] - weights(t - h)[k]) / (2.0 * h);
            assert!((0..4).map(|k| slope(k).abs()).sum::<f64>() <= 3.0 + 1e-6, "{t}");
            assert!(w.iter().map(|w| w.abs()).sum::<f64>() <= 1.25 + 1e-12, "{t}");
        }
    }

    #[test]
    fn far_particles_are_those_beyond_the_cut_and_stay_members() {
        let entries = [[3, 2], [5, 0], [5, 3], [9, 1]];
        let mut members = [7; 4];
        let [far, near] = part(&entries, &mut members, Some((&[8.0, 4.0, 9.0, 7.0], 7.0)));
        assert_eq!(members, [1, 0, 1, 1]);
        assert_eq!(far, [[3, 2], [5, 0], [5, 3], [9, u32::MAX]]);
        assert_eq!(near, [[3, u32::MAX], [5, u32::MAX], [5, u32::MAX], [9, 1]]);
        let [_, near] = part(&[[1, 1], [2, 0]], &mut members, None);
        assert_eq!(near, [[1, 1], [2, u32::MAX]]);
    }
}
