//! A scene against a device's limits, before anything is allocated, and what it will cost where
//! that is easily too much.

use glam::DVec3;

use crate::error::{Error, Result};
use crate::gpu::BindingKind;
use crate::gpu::Limits;
use crate::gpu::{DEPTH_BYTES_PER_PIXEL, TargetFormat, storage_bytes};
use crate::layout::disc::DiscRecord;
use crate::layout::facet::{FacetRecord, LitRecord, RegionRecord};
use crate::layout::frame::LightRecord;
use crate::layout::particle::TexturedRecord;
use crate::layout::particle::{
    BoxRecord, DrawnRecord, GroupRecord, ModeRecord, ParticleRecord, PlacedRecord,
};
use crate::layout::second::{PackedRecord, SourceRecord};
use crate::model::basis::N_NODES;
use crate::model::cloud::Group;
use crate::model::film::FilmFormat;
use crate::model::grid::{DEPOSIT_CUT_SIGMA, MAX_CELLS};
use crate::model::resolution::{LowResLayout, Resolution};
use crate::model::scene::{Chunks, DrawPath, Impostors, LightingMode, MAX_CHUNKS, Scene};
use crate::model::sums::Precision;
use crate::model::terrain::Terrain;
use crate::passes::second::LEAST_BLOCK;
use crate::passes::texture::POOL_TEXELS;

use super::buffers::has_second;
use super::culling::culls;
use super::feed::IN_FLIGHT;
use super::grouping::is_grouped;
use super::lives::{discs, lives_on_host};
use super::plan::Tensors;
use super::shells::shell_size;
use super::tensor::Shape;

const TEXTURES: &str = "the pool of textures";
const SHELL: &str = "the shell's picture (draw.impostors)";
const BLOBS: &str = "the blobs' smaller picture";
const UNDER: &str = "the surfaces under it";
const COMPOSED: &str = "what is composed in chunks (draw.chunks)";
/// Not of light: read in every scene that has them.
const ALWAYS_READ: [&str; 5] = [TEXTURES, SHELL, BLOBS, UNDER, COMPOSED];

/// Of the buffers that grow with the scene those that shaders read by texels.
const READ_BY_TEXELS: [(&str, BindingKind); 11] = [
    (TEXTURES, BindingKind::Texels),
    (SHELL, BindingKind::Texels),
    (BLOBS, BindingKind::Texels),
    (UNDER, BindingKind::Texels),
    (COMPOSED, BindingKind::Texels),
    ("the second reflection's sources", BindingKind::Texels),
    ("their flux by light", BindingKind::Texels),
    ("their light by points", BindingKind::Texels),
    ("the regions", BindingKind::Texels),
    ("the density grid", BindingKind::Floats),
    ("the lobes of materials and basis", BindingKind::Floats),
];

/// Checks the buffers that grow with the scene, and their sum; what is made beside them (staging,
/// the sort's table, the target) each checks for itself when it is made. The bytes of that sum.
pub fn check(scene: &Scene, limits: &Limits) -> Result<u64> {
    let n = scene.n_particles();
    if u32::try_from(n).is_err() {
        return Err(Error::limit(format!(
            "the scene's {n} particles; nimbus numbers them with 32 bits"
        )));
    }
    if scene.lighting.sums.precision == Precision::F64 && !limits.has_float64 {
        return Err(Error::limit(
            "lighting.precision = \"f64\": this device's shaders have no doubles (shaderFloat64); \
             expected \"f32\"",
        ));
    }
    // A tree has at most a cluster for every three of its facets, and each region a root.
    let n_sources =
        if has_second(scene) { scene.n_facets() * 4 / 3 + scene.n_regions() as u64 } else { 0 };
    let n_lobes = scene.materials.len() as u64 + u64::from(scene.lighting.bases) - 1;
    let is_lit = scene.lighting.mode != LightingMode::None;
    let groups: u64 = scene.clouds.iter().map(|c| c.n_groups()).sum();
    let pixel = target_format(scene.film.format).bytes_per_pixel();
    let n_texels = if scene.is_textured() { u64::from(POOL_TEXELS) } else { 0 };
    let shells = scene.draw.impostors != Impostors::Off;
    let n_shell_texels = match shells {
        true => shell_size([scene.film.width, scene.film.height]).map(u64::from).iter().product(),
        false => 0,
    };
    let size = |record: usize| record as u64;
    let n_pixels = u64::from(scene.film.width) * u64::from(scene.film.height);
    let (n_small, is_auto) = (n_small_pixels(scene), scene.draw.resolution == Resolution::Auto);
    let n_behind = if n_small > 0 && scene.has_solids() { n_pixels } else { 0 };
    // What does not fit is not tried by "auto".
    let in_chunks =
        matches!(scene.draw.chunks, Chunks::Of(1..)) && scene.draw.path == DrawPath::Sprites;
    let n_composed = match in_chunks {
        true if n_small > 0 => n_small,
        true => n_pixels,
        false => 0,
    };
    let wishes = [
        ("the scene's particles", n, size(size_of::<ParticleRecord>())),
        ("the particles' places", n, size(size_of::<PlacedRecord>())),
        (
            "the particles' places, as uploaded",
            IN_FLIGHT as u64 * n,
            size(size_of::<PlacedRecord>()),
        ),
        (
            "the particles, as uploaded",
            if lives_on_host(scene) { IN_FLIGHT as u64 * n } else { 0 },
            size(size_of::<ParticleRecord>()),
        ),
        ("the discs", discs(scene).count() as u64, size(size_of::<DiscRecord>())),
        ("the particles' groups", n, 4),
        ("the particles' generation status", n, 4),
        (
            "the ground",
            scene.n_solid_facets() - scene.n_surface_facets(),
            size(size_of::<FacetRecord>()),
        ),
        ("the facets", scene.n_facets(), size(size_of::<FacetRecord>())),
        ("the facets' light", scene.n_facets(), size(size_of::<LitRecord>())),
        ("the transmittances", scene.n_facets() * scene.lights.len() as u64, 4),
        ("what the clouds let through", n_sources * scene.lights.len() as u64, 4),
        ("the second reflection's sources", n_sources, size(size_of::<SourceRecord>())),
        ("their flux by light", n_sources * scene.lights.len() as u64, 16),
        (
            "their light by points",
            n_sources * scene.lights.len() as u64,
            size(size_of::<PackedRecord>()),
        ),
        ("the regions", scene.n_regions() as u64, size(size_of::<RegionRecord>())),
        ("the sort's entries", 2 * n, 8),
        ("the bits of kept particles", if culls(scene) { n.div_ceil(32) } else { 0 }, 8),
        ("the Morton order's entries", if is_grouped(scene) { 2 * n } else { 0 }, 8),
        (
            "the Morton order and the particles' facets",
            if is_grouped(scene) { 2 * n } else { 0 },
            4,
        ),
        ("the boxes", groups, size(size_of::<BoxRecord>())),
        ("the groups", groups, size(size_of::<GroupRecord>())),
        ("what is drawn of them", groups, size(size_of::<DrawnRecord>())),
        (
            "the gusts",
            scene.clouds.iter().map(|c| u64::from(c.gust.n_waves)).sum(),
            size(size_of::<ModeRecord>()),
        ),
        ("the lights", scene.lights.len() as u64, size(size_of::<LightRecord>())),
        ("the density grid's sums", n_cells_max(scene), 8),
        ("the density grid", n_cells_max(scene), 4),
        ("the lobes of materials and basis", n_lobes * N_NODES as u64, 4),
        (
            "the groups' textures",
            if scene.is_textured() { groups } else { 0 },
            size(size_of::<TexturedRecord>()),
        ),
        ("the textures, as they are made", n_texels, 4),
        (TEXTURES, n_texels, 16),
        ("the depth of surfaces", u64::from(scene.has_solids()) * n_pixels, DEPTH_BYTES_PER_PIXEL),
        ("the film, read back", n_pixels, pixel),
        (SHELL, n_shell_texels, 16),
        ("the shell, as it is drawn", n_shell_texels, 16),
        ("who is in the shell", if shells { n } else { 0 }, 4),
        ("what is far, and what is near", if shells { 2 * n } else { 0 }, 8),
        (COMPOSED, n_composed, 16),
        ("the picture of chunks", n_composed, 16),
        ("its depth", n_composed, DEPTH_BYTES_PER_PIXEL),
        ("the entries of chunks", if in_chunks { n + u64::from(MAX_CHUNKS) } else { 0 }, 8),
        (BLOBS, n_small, pixel),
        // With "auto" the half one beside the quarter, the larger one counted twice.
        (
            "what is drawn in a smaller size",
            n_small * (if is_auto { 6 } else { 3 }),
            pixel + DEPTH_BYTES_PER_PIXEL,
        ),
        (UNDER, n_behind, pixel),
        ("the depths under it", 2 * n_behind, DEPTH_BYTES_PER_PIXEL),
        ("what comes of the two", if n_small > 0 { IN_FLIGHT as u64 * n_pixels } else { 0 }, pixel),
    ];
    let mut total = 0;
    for (name, n, bytes) in wishes {
        total += storage_bytes(limits, name, n, bytes)?;
        let texel =
            READ_BY_TEXELS.iter().find(|(of, _)| *of == name).map(|(_, kind)| kind.texel_bytes());
        if let Some(texel) = texel.filter(|texel| {
            (is_lit || ALWAYS_READ.contains(&name))
                && n * bytes / u64::from(*texel) > limits.max_texels
        }) {
            return Err(Error::limit(format!(
                "{name}: {} texels of {texel} bytes are wanted, this device takes {} at most \
                 (maxTexelBufferElements)",
                n * bytes / u64::from(texel),
                limits.max_texels
            )));
        }
    }
    // Receivers in blocks, and each region's last block need not be full.
    let n_blocks = scene.n_facets() / u64::from(LEAST_BLOCK) + scene.n_regions() as u64;
    if has_second(scene) && n_blocks > u64::from(limits.max_workgroups_x) {
        return Err(Error::limit(format!(
            "the second reflection of {} facets: {n_blocks} workgroups, this device takes {}",
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

/// Pixels of the smaller picture that blobs are drawn into, the largest that may be tried; 0 where
/// there is none.
fn n_small_pixels(scene: &Scene) -> u64 {
    let n = match scene.draw.resolution {
        Resolution::Full => return 0,
        Resolution::Auto => Resolution::Half.divisor(),
        resolution => resolution.divisor(),
    };
    LowResLayout::of([scene.film.width, scene.film.height], n).n_pixels()
}

/// Whether T1 and T2 fit into `free` bytes, and T2, the greater by far, into one binding.
pub fn tensors(shape: &Shape, limits: &Limits, free: u64) -> Tensors {
    let bytes_of = |n: u64| n.max(1).saturating_mul(4);
    let (first, second) = (bytes_of(shape.n_first()), shape.n_second().map_or(u64::MAX, bytes_of));
    // Both are written as buffers and read float by float.
    let binding = limits.max_storage_buffer_bytes.min(limits.max_texels.saturating_mul(4));
    let most = free.saturating_sub(first).min(binding);
    if second <= most && first <= binding {
        Tensors::Kept
    } else {
        Tensors::TooLarge { bytes: second, most }
    }
}

/// Most cells the grid can have at any time. Clouds that drift apart or grow change its
/// proportions, so a scene that moves needs room for a cube.
pub fn n_cells_max(scene: &Scene) -> u64 {
    let side = u64::from(scene.lighting.grid.min(MAX_CELLS));
    let stands_still = scene.clouds.iter().all(|c| c.drift() == DVec3::ZERO && c.growth.is_none());
    let groups = scene.groups();
    match scene.bounds(&groups, scene.time.start_s, DEPOSIT_CUT_SIGMA) {
        Some((low, high)) if stands_still => {
            scene.density_grid(&groups, 0.5 * (high - low)).n_total()
        }
        _ => side * side * side,
    }
}

/// The film's format as a render target.
pub fn target_format(format: FilmFormat) -> TargetFormat {
    match format {
        FilmFormat::Rgba8 => TargetFormat::Rgba8,
        FilmFormat::Rgba16f => TargetFormat::Rgba16f,
        FilmFormat::Rgba32f => TargetFormat::Rgba32f,
    }
}

/// Cell updates of one deposit of all blobs into the density grid: particles × cells a blob covers.
pub fn n_deposits(scene: &Scene) -> f64 {
    let groups = scene.groups();
    let Some((low, high)) = scene.bounds(&groups, scene.time.start_s, DEPOSIT_CUT_SIGMA) else {
        return 0.0;
    };
    let grid = scene.density_grid(&groups, 0.5 * (high - low));
    let blob = |g: &Group| {
        let sigma = g.sigma_mean * DVec3::new(1.0, g.aspects[1], 1.0);
        let covered =
            (2.0 * DEPOSIT_CUT_SIGMA * sigma / grid.edges() + 1.0).min(grid.n_cells.as_dvec3());
        f64::from(g.n_particles) * covered.x * covered.y * covered.z
    };
    scene.grown(&groups, scene.time.start_s).iter().map(blob).sum()
}

/// What a demanding scene should be told before it runs; nothing for most.
pub fn advice(scene: &Scene) -> Vec<String> {
    [grid_advice(scene), ground_advice(scene)].into_iter().flatten().collect()
}

/// Where ground has so many points that each one's second reflection takes long.
fn ground_advice(scene: &Scene) -> Option<String> {
    /// Some seconds a frame on two cores of a software device, from clusters.
    const MANY: u64 = 4096;
    let n: u64 = scene.terrains.iter().map(Terrain::n_facets).sum();
    (has_second(scene) && n > MANY).then(|| {
        format!(
            "the ground has {n} points, and each receives a second reflection: seconds a frame \
             without a GPU; \
             lighting.mode = \"first\" has its shadows without"
        )
    })
}

fn grid_advice(scene: &Scene) -> Option<String> {
    /// Some ten seconds on two cores of a software device.
    const MANY: f64 = 1e9;
    let n = n_deposits(scene);
    if scene.lighting.mode == LightingMode::None || n < MANY {
        return None;
    }
    let grid = scene.lighting.grid;
    Some(format!(
        "lighting.grid = {grid} makes its cells far smaller than the blobs: {n:.1e} cell updates \
         each time they move; \
         half the cells a side take about an eighth of that"
    ))
}
