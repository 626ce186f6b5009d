//! The view of a scene, and the surfaces and ground behind its blobs.

use glam::{DVec2, DVec3};

use super::frame::FrameReference;
use super::local_scene;
use super::pixels::{Pixels, Tile};
use crate::model::overlap::{n_parts, slice_length};
use crate::model::scene::{LightingMode, Overlap, Scene};
use crate::model::surface::Surface;
use crate::model::terrain::Terrain;
use crate::reference::composite::OpaquePixel;
use crate::reference::view::View;
use crate::reference::{surfaces, terrain};

/// Returns the camera's view relative to the lighting origin, with the scene's drawing settings.
pub fn view(scene: &Scene, frame: &FrameReference) -> View {
    let mut pose = frame.state.pose;
    pose.position -= frame.state.light_origin;
    let slice = match scene.draw.overlap {
        Overlap::Slices => {
            let groups = scene.grown(&frame.groups, frame.state.time_s);
            slice_length(scene.draw.slice, &groups, frame.state.radius)
        }
        Overlap::Thin | Overlap::Auto => 0.0,
    };
    View {
        width: scene.film.width,
        height: scene.film.height,
        pose,
        fov_y_rad: scene.camera.fov_y_rad,
        near: scene.camera.near,
        edge: scene.draw.edge(),
        smallest: scene.draw.smallest.bound(),
        slice,
        n_parts: n_parts(scene.draw.slice),
        shift: DVec2::ZERO,
    }
}

/// Returns the surfaces and ground seen at `pixels`, lit as in `frame`.
pub(super) fn opaque_pixels(
    scene: &Scene,
    frame: &FrameReference,
    view: &View,
    pixels: &Pixels,
) -> Vec<OpaquePixel> {
    let placed = local_scene::surfaces(scene, frame.state.light_origin);
    let facets = solid_radiance(scene, frame, &placed);
    let (of_surfaces, of_ground) = facets.split_at(scene.n_surface_facets() as usize);
    if scene.terrains.is_empty() {
        return surfaces::render_at(view, &placed, of_surfaces, pixels.at.iter().copied());
    }
    let tile = pixels.tile;
    let mut picture = surfaces::render_at(view, &placed, of_surfaces, tile.pixels());
    draw_ground((&mut picture, tile), scene, frame, view, of_ground);
    pixels.pick_tile(&picture)
}

/// Radiance of the facets of surfaces and ground. Without lighting it is their materials' K_d.
pub(super) fn solid_radiance(
    scene: &Scene,
    frame: &FrameReference,
    placed: &[Surface],
) -> Vec<DVec3> {
    if scene.lighting.mode != LightingMode::None {
        return (0..scene.n_solid_facets() as usize).map(|i| frame.facet_radiance(i)).collect();
    }
    let kd = |i_material: usize| scene.materials[i_material].at(scene.time.start_s).kd;
    let of_surfaces = placed.iter().map(|s| (s.i_material, s.n_facets()));
    let even = |(i_material, n): (usize, u64)| std::iter::repeat_n(kd(i_material), n as usize);
    let of_ground = scene
        .terrains
        .iter()
        .flat_map(|t| (0..t.points.len()).map(|i| kd(t.i_material) * t.color(i)));
    of_surfaces.flat_map(even).chain(of_ground).collect()
}

/// Draws the scene's ground over `picture` where it is nearer. `radiance` by the points of all
/// terrains.
pub(super) fn draw_ground(
    (picture, tile): (&mut [OpaquePixel], Tile),
    scene: &Scene,
    frame: &FrameReference,
    view: &View,
    radiance: &[DVec3],
) {
    let window = [(tile.left, tile.left + tile.width), (tile.top, tile.top + tile.height)];
    let mut rest = radiance;
    for terrain in &scene.terrains {
        let (own, others) = rest.split_at(terrain.n_facets() as usize);
        let origin = terrain.origin - frame.state.light_origin;
        let placed = Terrain { origin, ..terrain.clone() };
        terrain::render_over((&mut *picture, window), view, &placed, own);
        rest = others;
    }
}
