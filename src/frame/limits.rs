//! The check of a scene against a device's limits before anything is allocated, and advice about
//! scenes that take long.

use glam::DVec3;

use super::buffers::{SceneBuffers, diffusion_room, grid_room};
use super::culling::Culling;
use super::features::{has_lod, has_second, is_grouped, is_lit};
use super::gather::IndirectGather;
use super::live;
use super::merging::Merging;
use super::morton_sort::FacetRuns;
use super::picture::Picture;
use crate::error::{Error, Result};
use crate::gpu::{BufferSpec, Limits};
use crate::model::cloud::{Cloud, CloudSource, Group, aspects_of};
use crate::model::grid::{DEPOSIT_CUT_SIGMA, GridSpec, NARROW_BELOW, NARROW_SIGMA, NARROW_UPDATES};
use crate::model::resolution::Resolution;
use crate::model::scene::{Draw, Scene};
use crate::model::sums::Precision;
use crate::model::terrain::Terrain;
use crate::passes::second::MIN_BLOCK;
use crate::passes::{diffusion, grid, sort, texture};

/// Most pixels of a picture: 8192 x 4096. Reading one back takes 20 bytes a pixel on the host.
const MOST_DRAWN_PIXELS: u64 = 1 << 25;

/// Returns the bytes of the buffers and images that grow with the scene. Light tensors and the
/// scratch of the tile passes are not among them; they are checked when they are made.
///
/// # Errors
/// Fails if one of them, or their sum, exceeds a limit of the device.
pub fn check(scene: &Scene, limits: &Limits) -> Result<u64> {
    let n = scene.n_particles();
    if u32::try_from(n).is_err() {
        return Err(Error::limit(format!(
            "the scene's {n} particles; nimbus numbers them with 32 bits"
        )));
    }
    let pixels = u64::from(scene.film.width) * u64::from(scene.film.height);
    if pixels > MOST_DRAWN_PIXELS {
        return Err(Error::limit(format!(
            "a picture of {} x {} pixels; expected at most {MOST_DRAWN_PIXELS} pixels in all; \
             reduce film.width or film.height, or --size",
            scene.film.width, scene.film.height
        )));
    }
    if scene.lighting.sums.precision == Precision::F64 && !limits.has_float64 {
        return Err(Error::limit(
            "lighting.precision = \"f64\": this device's shaders have no doubles (shaderFloat64); \
             expected \"f32\"",
        ));
    }
    let bytes: Result<Vec<u64>> = specs(scene).iter().map(|spec| spec.bytes(limits)).collect();
    let total: u64 = bytes?.iter().sum();
    // The last block of each region need not be full.
    let n_blocks = scene.n_facets() / u64::from(MIN_BLOCK) + scene.n_regions() as u64;
    if has_second(scene) && n_blocks > u64::from(limits.max_workgroups_x) {
        return Err(Error::limit(format!(
            "the second reflection of {} facets: {n_blocks} workgroups, this device takes {} \
             (maxComputeWorkGroupCount); expected a lower lighting.facets_per_cloud, or \"auto\"",
            scene.n_facets(),
            limits.max_workgroups_x
        )));
    }
    if total > limits.device_memory_bytes {
        return Err(Error::limit(format!(
            "the scene needs {total} bytes, this device has {}",
            limits.device_memory_bytes
        )));
    }
    Ok(total)
}

/// Lists the sizes of the buffers and images of a scene.
fn specs(scene: &Scene) -> Vec<BufferSpec> {
    let exact = scene.exact();
    let when = |is_used: bool, specs: fn(&Scene) -> Vec<BufferSpec>| {
        if is_used { specs(&exact) } else { vec![] }
    };
    // With "auto" the two smaller pictures are tried beside the full one.
    let tried = [Resolution::Half, Resolution::Quarter].map(|resolution| {
        let draw = Draw { resolution, ..exact.draw };
        let is_tried = scene.draw.resolution == Resolution::Auto;
        if is_tried { Picture::specs(&Scene { draw, ..(*exact).clone() }) } else { vec![] }
    });
    [
        SceneBuffers::specs(&exact),
        live::specs(&exact),
        grid::specs(grid_room(&exact)),
        diffusion_room(&exact).map_or(vec![], diffusion::specs),
        when(is_grouped(&exact), FacetRuns::specs),
        when(has_second(&exact), IndirectGather::specs),
        when(has_lod(&exact), Merging::specs),
        Culling::specs(&exact),
        sort::Scratch::specs_of_bytes(exact.n_particles()),
        when(exact.is_textured(), |_| texture::Scratch::specs()),
        Picture::specs(&exact),
        tried.concat(),
    ]
    .concat()
}

/// Returns the density grid at the start; `None` without particles.
fn start_grid(scene: &Scene) -> Option<GridSpec> {
    let groups = scene.groups();
    let (low, high) = scene.bounds(&groups, scene.time.start_s, DEPOSIT_CUT_SIGMA)?;
    Some(scene.density_grid(&groups, 0.5 * (high - low)))
}

/// Returns the cell updates of one deposit of all blobs into the density grid: particles × cells
/// that a blob covers.
pub fn n_deposits(scene: &Scene) -> f64 {
    let Some(grid) = start_grid(scene) else { return 0.0 };
    let groups = scene.groups();
    let has_narrow = grid.has_narrow(scene.n_particles(), aspects_of(&groups));
    let blob = |g: &Group| {
        let sigma = g.sigma_mean * DVec3::new(1.0, g.aspects[1], 1.0);
        // All blobs of a group count as if they had its mean σ.
        let is_narrowed = (NARROW_SIGMA..NARROW_BELOW).contains(&(g.sigma_mean / grid.cell));
        if has_narrow && is_narrowed {
            return f64::from(g.n_particles) * NARROW_UPDATES;
        }
        let level = grid.level_of(sigma, grid.n_levels(scene.n_particles()));
        let (sigma, grid) = (grid.deposited(sigma, level), grid.level(level));
        let covered =
            (2.0 * DEPOSIT_CUT_SIGMA * sigma / grid.edges() + 1.0).min(grid.n_cells.as_dvec3());
        f64::from(g.n_particles) * covered.x * covered.y * covered.z
    };
    scene.grown(&groups, scene.time.start_s).iter().map(blob).sum()
}

/// Returns sentences about a demanding scene for the user to read before it runs; none for most
/// scenes.
pub fn advice(scene: &Scene) -> Vec<String> {
    let all = [grid_advice(scene), ground_advice(scene), color_advice(scene)];
    all.into_iter().flatten().collect()
}

fn color_advice(scene: &Scene) -> Option<String> {
    let has_harmonics = |cloud: &Cloud| match &cloud.source {
        CloudSource::Particles(list) => list.harmonics().is_some(),
        _ => false,
    };
    (is_lit(scene) && scene.clouds.iter().any(has_harmonics)).then(|| {
        "light falls on the mean colours of the splats; those that change with the view (f_rest) \
         are drawn with lighting.mode = \"none\""
            .to_owned()
    })
}

fn ground_advice(scene: &Scene) -> Option<String> {
    /// Some seconds a frame on two cores of a software device, from clusters.
    const MANY: u64 = 4096;
    let n: u64 = scene.terrains.iter().map(Terrain::n_facets).sum();
    (has_second(scene) && n > MANY).then(|| {
        format!(
            "the ground has {n} points, and each receives a second reflection: seconds a frame \
             without a GPU; lighting.mode = \"first\" has its shadows without"
        )
    })
}

fn grid_advice(scene: &Scene) -> Option<String> {
    /// Some ten seconds on two cores of a software device.
    const MANY: f64 = 1e9;
    let (n, grid) = (n_deposits(scene), scene.lighting.grid);
    (is_lit(scene) && n >= MANY).then(|| {
        format!(
            "lighting.grid = {grid} makes its cells smaller than the blobs: {n:.1e} cell updates \
             each time they move; half the cells a side take an eighth to a quarter of that"
        )
    })
}
