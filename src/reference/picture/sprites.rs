//! A scene's particles as sprites: which are drawn, in which order, with which textures.

use glam::DVec3;

use super::frame::FrameReference;
use super::pixels::Pixels;
use crate::model::cloud::Group;
use crate::model::count::MIN_DRAWN;
use crate::model::frame_state::FrameState;
use crate::model::scene::{LightingMode, Overlap, Scene};
use crate::reference::lod::{self, Merged};
use crate::reference::sprites::{Factor, Raster};
use crate::reference::texture::{Pool, SplatTexture, Textured};
use crate::reference::view::View;
use crate::reference::{Blob, count, place, sort};

/// Returns the pixels as sprites are drawn into them.
pub(super) fn raster(pixels: &Pixels) -> Raster<'_> {
    let Pixels { tile, cell, ref at, .. } = *pixels;
    Raster { first: [tile.left, tile.top], n_columns: pixels.n_columns(), cell, at }
}

/// Calls `take` with the factor of textures on optical depths; `None` if no cloud is textured.
pub(super) fn with_textures<T>(
    scene: &Scene,
    frame: &FrameReference,
    view: &View,
    take: impl FnOnce(Option<Factor<'_>>) -> T,
) -> T {
    if !scene.is_textured() {
        return take(None);
    }
    let of_box = |(g, i_box): (&Group, u32)| {
        let cloud = &scene.clouds[g.i_cloud];
        let (i_field, strength) = cloud.texture.of_box(i_box);
        let of = Textured { i_field, strength, seed: cloud.seed, i_box };
        let first = g.i_first as usize;
        let blobs = &frame.blobs[first..first + g.n_particles as usize];
        let splat = |(b, i): (&Blob, u32)| {
            let z = (b.position - view.pose.position).dot(view.pose.forward);
            SplatTexture::new(&of, i, z / b.sigma, view.pixel())
        };
        blobs.iter().zip(0u32..).map(splat).collect::<Vec<SplatTexture>>()
    };
    let boxes = frame.groups.chunk_by(|a, b| a.i_cloud == b.i_cloud);
    let splats: Vec<SplatTexture> =
        boxes.flat_map(|boxes| boxes.iter().zip(0u32..).flat_map(of_box)).collect();
    // The device stores the pool in 16 bits.
    let pool = Pool::on_device(scene.draw.texture_seed);
    take(Some(&|j, delta| splats[j].factor(&pool, delta)))
}

/// Returns the blobs of which some stand for others; `None` where each is drawn.
fn merged(scene: &Scene, frame: &FrameReference) -> Option<Merged> {
    if scene.draw.lod == 0.0 {
        return None;
    }
    let regions = place::regions(&frame.groups);
    let boxes = frame.groups.chunk_by(|a, b| a.i_cloud == b.i_cloud);
    let is_textured = |(g, i_box): (&Group, u32)| {
        let (_, strength) = scene.clouds[g.i_cloud].texture.of_box(i_box);
        std::iter::repeat_n(strength != 0.0, g.n_particles as usize)
    };
    let textured: Vec<bool> =
        boxes.flat_map(|boxes| boxes.iter().zip(0u32..).flat_map(is_textured)).collect();
    let keys = lod::keys(&frame.blobs, |i| textured[i], scene.draw.lod);
    let order = lod::order(&keys);
    Some(lod::merge(&frame.blobs, &keys, &order, |i| regions[i as usize]))
}

/// Returns the blobs, merged or with κ scaled by the count law, and the order that the drawn ones
/// are drawn in: far to near by exact depth, ties by index.
pub(super) fn drawn_blobs(scene: &Scene, frame: &FrameReference) -> (Vec<Blob>, Vec<u32>) {
    let (blobs, weights): (Vec<Blob>, Vec<f64>) = match merged(scene, frame) {
        Some(Merged { blobs, .. }) => {
            let weights = blobs.iter().map(|b| if b.kappa > 0.0 { 1.0 } else { 0.0 }).collect();
            (blobs, weights)
        }
        None => {
            let weights = weights(scene, frame);
            let weighed = |(b, w): (&Blob, &f64)| Blob { kappa: b.kappa * w, ..*b };
            (frame.blobs.iter().zip(&weights).map(weighed).collect(), weights)
        }
    };
    let depths = depths(scene, frame, &blobs);
    let mut order: Vec<u32> =
        (0..blobs.len() as u32).filter(|&i| weights[i as usize] > 0.0).collect();
    order.sort_by(|&i, &j| depths[j as usize].total_cmp(&depths[i as usize]));
    (blobs, order)
}

/// Returns the radiance of the drawn blobs, where each has `radiance` alone. What stands for
/// several shows their mean colour, and where it is lit, the light of the one whose place it takes.
pub(super) fn drawn_radiance(
    scene: &Scene,
    frame: &FrameReference,
    radiance: Vec<DVec3>,
) -> Vec<DVec3> {
    match merged(scene, frame) {
        Some(merged) if scene.lighting.mode == LightingMode::None => merged.means(&radiance),
        _ => radiance,
    }
}

/// Returns the depths that blobs are sorted by.
fn depths(scene: &Scene, frame: &FrameReference, blobs: &[Blob]) -> Vec<f64> {
    let positions: Vec<DVec3> = blobs.iter().map(|b| b.position).collect();
    let FrameState { pose, light_origin, .. } = frame.state;
    match scene.draw.overlap {
        Overlap::Slices => sort::distances(pose.position - light_origin, &positions),
        Overlap::Thin | Overlap::Auto => sort::depths(pose.forward, &positions),
    }
}

/// Returns the order in which a device draws `blobs`, those of [`drawn_blobs`], by the keys that
/// `draw.sort_bits` asks for.
pub(super) fn set_order(scene: &Scene, frame: &FrameReference, blobs: &[Blob]) -> Vec<u32> {
    let (_, exact) = drawn_blobs(scene, frame);
    let FrameState { radius, time_s, .. } = frame.state;
    let sigmas = place::sigma_means(&frame.groups, &scene.clouds, time_s);
    let sigmas = sigmas.iter().zip(blobs).map(|(sigma, blob)| sigma * blob.shape.narrowest());
    let sigma = sigmas.fold(f64::INFINITY, f64::min);
    if scene.draw.sort_bits.of(radius, sigma) > 16 {
        return exact;
    }
    let (mut order, depths) = (exact, depths(scene, frame, blobs));
    let key = |i: &u32| sort::key16(depths[*i as usize], radius);
    order.sort_unstable_by_key(|i| (key(i), *i));
    order
}

/// Factor on every particle's κ, model.md §3.
fn weights(scene: &Scene, frame: &FrameReference) -> Vec<f64> {
    let Some(rule) = scene.draw.count else { return vec![1.0; frame.blobs.len()] };
    let (state, clouds) = (&frame.state, &scene.clouds);
    let centers = place::cloud_centers(clouds, state.time_s, DVec3::ZERO);
    let share = |(cloud, center): (_, &DVec3)| {
        let distance = (state.pose.position - *center).length();
        let scale = place::scale(cloud, state.time_s);
        count::printed(distance / rule.d0, scale, rule.a, rule.normalised)
    };
    let shares: Vec<f64> = clouds.iter().zip(&centers).map(share).collect();
    let of_group = |g: &Group| {
        let (n, share) = (g.n_particles, shares[g.i_cloud].min(1.0));
        let is_drawn = f64::from(n) * share >= MIN_DRAWN;
        if is_drawn { count::weights(n, share, rule.conserve) } else { vec![0.0; n as usize] }
    };
    frame.groups.iter().flat_map(of_group).collect()
}
