//! The shares that facets have in a picture's pixels: a thin picture is linear in the radiance of
//! its facets, so that errors of the light and of the drawing can be told apart.

use std::collections::HashSet;

use glam::{DVec2, DVec3};

use super::background::{solid_radiance, view};
use super::frame::FrameReference;
use super::local_scene;
use super::pixels::Pixels;
use super::sprites::{drawn_blobs, drawn_radiance, raster, set_order, with_textures};
use crate::model::parallel::parallel_map;
use crate::model::scene::{DrawPath, LightingMode, Scene};
use crate::model::terrain::Terrain;
use crate::reference::Blob;
use crate::reference::composite::{OpaquePixel, Rounding};
use crate::reference::sprites::{self, Bounded, Sprites};
use crate::reference::surfaces;
use crate::reference::terrain::ByRow;
use crate::reference::tiles::off_alpha;
use crate::reference::view::View;

/// The shares of one pixel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PixelShares {
    /// Emitters and the share of each one's radiance in the pixel; an emitter may occur again.
    pub of: Vec<(u32, f64)>,
    /// Opacity.
    pub alpha: f64,
}

impl PixelShares {
    /// Returns the pixel [r, g, b, opacity] where emitters have `radiance`.
    pub fn color(&self, radiance: &[DVec3]) -> [f64; 4] {
        let sum: DVec3 = self.of.iter().map(|&(i, share)| share * radiance[i as usize]).sum();
        sum.extend(self.alpha).to_array()
    }
}

/// What has a radiance: the facets in their order, or, where nothing is lit, the facets of surfaces
/// and ground and then the particles.
pub struct Emitters {
    /// Emitter of every particle.
    of_particle: Vec<u32>,
}

impl Emitters {
    /// Returns the emitters of a frame.
    pub fn new(scene: &Scene, frame: &FrameReference) -> Emitters {
        let n_before = scene.n_solid_facets() as u32;
        let of_particle = match scene.lighting.mode {
            LightingMode::None => (n_before..n_before + frame.blobs.len() as u32).collect(),
            _ => frame.particle_facets(scene),
        };
        Emitters { of_particle }
    }

    /// Returns the radiance of every emitter in `frame`.
    pub fn radiance(scene: &Scene, frame: &FrameReference) -> Vec<DVec3> {
        if scene.lighting.mode != LightingMode::None {
            return (0..frame.facets.len()).map(|i| frame.facet_radiance(i)).collect();
        }
        let placed = local_scene::surfaces(scene, frame.state.light_origin);
        let of_solids = solid_radiance(scene, frame, &placed);
        of_solids.into_iter().chain(frame.colors.iter().copied()).collect()
    }

    /// Returns the radiance of every particle where emitters have `radiance`.
    pub fn of_particles(&self, radiance: &[DVec3]) -> Vec<DVec3> {
        self.of_particle.iter().map(|&i| radiance[i as usize]).collect()
    }
}

/// Returns the shares of emitters in `pixels`, drawn as thin sprites with the drawing settings of
/// `scene`.
pub fn pixel_shares(
    scene: &Scene,
    frame: &FrameReference,
    emitters: &Emitters,
    pixels: &Pixels,
) -> Vec<PixelShares> {
    let view = view(scene, frame);
    let (opaque, behind) = solid_shares(scene, frame, &view, pixels);
    let (blobs, order) = drawn_blobs(scene, frame);
    let (raster, shades) = (raster(pixels), frame.particle_shades(scene, &blobs));
    let cells = frame.particle_cells(scene);
    let found = with_textures(scene, frame, &view, |factor| {
        let (shades, cells) = (shades.as_deref(), cells.as_ref());
        let sprites =
            Sprites { blobs: &blobs, radiance: &[], order: &order, factor, shades, cells };
        sprites::shares_at(&view, &raster, &opaque, &sprites)
    });
    let all = found.iter().zip(&opaque).zip(behind);
    all.map(|((found, opaque), behind)| pixel_of(emitters, found, opaque, &behind)).collect()
}

/// Returns the shares of a pixel in which blobs have the shares `found`, over an opaque one with
/// the shares `behind`.
fn pixel_of(
    emitters: &Emitters,
    found: &sprites::Shares,
    opaque: &OpaquePixel,
    behind: &[(u32, f64)],
) -> PixelShares {
    let of_blob = |&(j, share): &(u32, f64)| (emitters.of_particle[j as usize], share);
    let of_solids = behind.iter().map(|&(i, share)| (i, share * found.behind));
    let all = of_solids.chain(found.blobs.iter().map(of_blob));
    PixelShares {
        of: all.filter(|(_, share)| *share != 0.0).collect(),
        alpha: 1.0 - found.behind * (1.0 - opaque.color[3]),
    }
}

/// Returns the opaque background of every pixel, without colours, and the shares of facets in it.
pub(super) fn solid_shares(
    scene: &Scene,
    frame: &FrameReference,
    view: &View,
    pixels: &Pixels,
) -> (Vec<OpaquePixel>, Vec<Vec<(u32, f64)>>) {
    let placed = local_scene::surfaces(scene, frame.state.light_origin);
    let first: Vec<u64> = placed
        .iter()
        .scan(0, |n, surface| {
            *n += surface.n_facets();
            Some(*n - surface.n_facets())
        })
        .collect();
    let terrains = scene.terrains.iter().map(|t| {
        let origin = t.origin - frame.state.light_origin;
        Terrain { origin, ..t.clone() }
    });
    let terrains: Vec<Terrain> = terrains.collect();
    let rows: HashSet<u32> = pixels.at.iter().map(|at| at[1]).collect();
    let grounds: Vec<ByRow<'_>> =
        terrains.iter().map(|t| ByRow::new(t, view, |j| rows.contains(&j))).collect();
    let seen = parallel_map(pixels.at.len(), |k| {
        let ray = view.ray(pixels.at[k][0], pixels.at[k][1]);
        let (mut depth, mut shares) = (f64::INFINITY, vec![]);
        if let Some((i, hit)) = surfaces::seen(view, &placed, ray) {
            depth = hit.depth;
            let weights = surfaces::weights(&placed[i], &hit);
            shares = weights.map(|(f, share)| (first[i] as u32 + f as u32, share)).to_vec();
        }
        let mut n_before = scene.n_surface_facets();
        for (terrain, ground) in terrains.iter().zip(&grounds) {
            let found = ground.weights(pixels.at[k]);
            if let Some((at, weights)) = found.filter(|(at, _)| *at <= depth) {
                depth = at;
                shares = weights.map(|(f, share)| (n_before as u32 + f as u32, share)).to_vec();
            }
            n_before += terrain.n_facets();
        }
        let alpha = if depth.is_finite() { 1.0 } else { 0.0 };
        (OpaquePixel { color: [0.0, 0.0, 0.0, alpha], depth, ..OpaquePixel::EMPTY }, shares)
    });
    seen.into_iter().unzip()
}

/// Returns the picture of `pixels` with the drawing settings of `scene` where emitters have
/// `radiance`, and by how much a device's picture may differ because of rounding. `shift` moves the
/// pixels to the right and down.
pub fn drawn_by_settings(
    scene: &Scene,
    frame: &FrameReference,
    (emitters, radiance): (&Emitters, &[DVec3]),
    pixels: &Pixels,
    shift: DVec2,
) -> Bounded {
    let view = View { shift, ..view(scene, frame) };
    let (mut opaque, behind) = solid_shares(scene, frame, &view, pixels);
    let (blobs, _) = drawn_blobs(scene, frame);
    let order = 2.0 * frame.state.radius / 65536.0;
    let rounding = Rounding { order, ..rounding(scene, &view, &blobs) };
    for (pixel, shares) in opaque.iter_mut().zip(behind) {
        let alpha = pixel.color[3];
        pixel.color = PixelShares { of: shares, alpha }.color(radiance);
        // Interpolation between four facets, and the store.
        let relative = 2.0 * rounding.unit + INTERPOLATED;
        pixel.bound = pixel.color.map(|v| relative * v.abs());
        pixel.depth_bound = INTERPOLATED * pixel.depth;
        *pixel = rounding.stored(*pixel);
    }
    let order = set_order(scene, frame, &blobs);
    let radiance = drawn_radiance(scene, frame, emitters.of_particles(radiance));
    let (raster, shades) = (raster(pixels), frame.particle_shades(scene, &blobs));
    let cells = frame.particle_cells(scene);
    with_textures(scene, frame, &view, |factor| {
        let (shades, cells) = (shades.as_deref(), cells.as_ref());
        let sprites =
            Sprites { blobs: &blobs, radiance: &radiance, order: &order, factor, shades, cells };
        sprites::render_over_at(&view, &raster, &opaque, &sprites, &rounding)
    })
}

/// Relative error of a value that is interpolated between facets, and of the depth of a surface:
/// some hundred roundings of f32.
pub(super) const INTERPOLATED: f64 = 1e-5;
/// Roundings of f32 in the place of a particle (of its offset in the group, the group's and the
/// cloud's place), and in its offset from a ray.
const N_ROUNDINGS: f64 = 8.0;
/// Error of 1 − e^{−τ}.
const ONE_MINUS_EXP: f64 = 3.5e-7;
/// Relative error of a texture's factor, e to the power of at most some 8: some 100 roundings of
/// f32 in the place and the sum.
const TEXTURED: f64 = 1e-4;
/// Share of the blobs that are narrower than the one whose σ bounds the effect of errors of place.
const NARROWER: f64 = 0.01;

/// Returns the rounding of a device that draws `blobs`. The error of a particle's place relative to
/// its σ moves the distance of a ray by that share: τ changes by up to b/σ at the blob's end times
/// the share.
pub(super) fn rounding(scene: &Scene, view: &View, blobs: &[Blob]) -> Rounding {
    let mut sigmas: Vec<f64> = blobs.iter().map(|b| b.narrowest()).collect();
    sigmas.retain(|sigma| *sigma > 0.0);
    sigmas.sort_by(f64::total_cmp);
    let narrow = sigmas.get((NARROWER * sigmas.len() as f64) as usize).copied();
    let reach = |b: &Blob| b.position.length() + (b.position - view.pose.position).length();
    let farthest = blobs.iter().map(reach).fold(0.0, f64::max);
    let unit = f64::from(f32::EPSILON) / 2.0;
    let off = N_ROUNDINGS * unit * farthest / narrow.unwrap_or(1.0);
    let texture = if scene.is_textured() { TEXTURED } else { 0.0 };
    let reach = blobs.iter().map(|b| view.edge.reach(b.deepest())).fold(0.0, f64::max);
    let format = scene.film.format;
    let by_tiles = if scene.draw.path == DrawPath::Sprites { 0.0 } else { off_alpha(format) };
    let alpha = ONE_MINUS_EXP + reach * off + texture + by_tiles;
    let stored = Rounding::of(format, alpha, off);
    // Besides the store there are four roundings: L1 + L2, α L, (1 − α) C and their sum.
    Rounding { depth: N_ROUNDINGS * unit, unit: stored.unit + 2.0 * unit, ..stored }
}
