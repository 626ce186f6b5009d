//! Blobs that stand for many: many at one place, and sizes and extinctions far apart.

use super::case::{Case, Comparison};
use super::context::StressContext;
use super::scenes::{MIDDLE, PATHS, UNLIT, blob, blob_scene, change_camera, render_blobs};
use crate::error::Result;
use crate::model::cloud::{CloudSource, Particle};
use crate::reference::rounding::U_F32;

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "lod/stack",
        what: "256 to 3000 equal blobs at one place, at most 256 drawn as one: opacity through \
            the centre",
        bound: "1e-6 + 64 u of the depth, 2^-22 a layer",
        check: stack,
    },
    Case {
        name: "lod/scaled",
        what: "a grid of merged blobs with all lengths times 2^-40 to 2^40: the same picture",
        bound: "64 u a layer",
        check: scaled,
    },
    Case {
        name: "lod/extinctions",
        what: "blobs whose extinctions differ by 1e30, in either order: the picture of the \
            denser one",
        bound: "64 u",
        check: extinctions,
    },
];

/// Returns the keys of a path with cells of one σ.
fn merging(path: &str) -> String {
    format!("{path}\nlod = 1.0")
}

fn stack(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for path in PATHS {
        for n in [256, 257, 3000] {
            for tau in [1e-6, 0.1] {
                let all = vec![blob([0.1; 3], 0.6, tau); n];
                let mut scene = blob_scene(UNLIT, &merging(path), all)?;
                change_camera(&mut scene, |v| v + 0.1);
                let frame = ctx.render(&scene, 0)?;
                let depth = n as f64 * tau;
                let layers = n.div_ceil(256) as f64;
                let bound = (1e-6 + 64.0 * U_F32) * depth + layers * 2f64.powi(-22);
                let at = format_args!("{path}, {n} blobs of depth {tau:e}");
                c.add(frame.channel(MIDDLE, 3), -(-depth).exp_m1(), bound, at);
            }
        }
    }
    Ok(())
}

/// Returns blobs of σ 0.55 whose places lie within 0.1 of the centres of cells, whose edge is 0.5.
fn grid() -> Vec<Particle> {
    let places = (0..500u32).map(|i| {
        let cell = [i % 4, i / 4 % 4, i / 16 % 2].map(|k| 0.5 * f64::from(k) - 0.75);
        let off = [0.618, 0.755, 0.57].map(|k| 0.2 * (k * f64::from(i)).fract() - 0.1);
        [0, 1, 2].map(|axis| cell[axis] + off[axis])
    });
    places.map(|at| blob(at, 0.55, 0.02)).collect()
}

fn scaled(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for path in PATHS {
        let one = blob_scene(UNLIT, &merging(path), grid())?;
        let picture = ctx.render(&one, 0)?.rgba;
        for power in [-40, -20, 20, 40] {
            let by = 2f64.powi(power);
            let mut scene = one.clone();
            let all = grid().into_iter().map(|p| Particle {
                position: by * p.position,
                sigma: by * p.sigma,
                kappa: p.kappa / by,
                ..p
            });
            scene.clouds[0].source = CloudSource::Particles(all.collect::<Vec<_>>().into());
            change_camera(&mut scene, |v| by * v);
            scene.camera.near *= by;
            // A power of two changes no digit; only the edges of cells are rounded, and no place
            // is near to one. 500 blobs are drawn as at least 32 layers.
            let bound = |_| 32.0 * 64.0 * U_F32;
            let at = format_args!("{path}, lengths times 2^{power}");
            c.each(ctx.render(&scene, 0)?.rgba, picture.iter().copied(), bound, at);
        }
    }
    Ok(())
}

fn extinctions(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let dense = Particle { kappa: 1e15, ..blob([0.1; 3], 0.6, 1.0) };
    let thin = Particle { kappa: 1e-15, ..blob([0.2; 3], 0.65, 1.0) };
    for path in PATHS {
        // The picture shows where the dense one ends.
        let draw = format!("{}\ncutoff = 3.0", merging(path));
        // Cells are about the middle of all, so that a pair lies on either side of it.
        let both_sides = |all: &[Particle]| -> Vec<Particle> {
            let other = all.iter().map(|p| Particle { position: -p.position, ..*p });
            all.iter().copied().chain(other).collect()
        };
        let alone = render_blobs(ctx, UNLIT, &draw, both_sides(&[dense]))?;
        c.exact(alone.channel(MIDDLE, 3), 1.0, format_args!("{path}, opacity of the denser"));
        let alone = alone.rgba;
        for pair in [[dense, thin], [thin, dense]] {
            let both = render_blobs(ctx, UNLIT, &draw, both_sides(&pair))?.rgba;
            let at =
                format_args!("{path}, extinctions {:e} and {:e}", pair[0].kappa, pair[1].kappa);
            c.each(both, alone.iter().copied(), |_| 64.0 * U_F32, at);
        }
    }
    Ok(())
}
