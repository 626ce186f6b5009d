//! GPU stages, one module a pass.
//!
//! A pass, its shaders, its f64 reference, its test, its timer label and its column in the results
//! share one name. `new` compiles pipelines and allocates scratch buffers, and can fail; `record`
//! only records commands. A pass receives every buffer that it shares with other passes as an
//! argument, and imports no other pass.

/// Declares a struct of named buffers in the order of the shader's binding numbers.
macro_rules! bindings {
    ($(#[$about:meta])* pub struct $name:ident { $($(#[$doc:meta])* $field:ident),* $(,)? }) => {
        $(#[$about])*
        #[derive(Clone, Copy)]
        pub struct $name<'a> { $($(#[$doc])* pub $field: &'a $crate::gpu::Buffer),* }

        impl<'a> $name<'a> {
            /// Returns the buffers by binding number.
            pub fn by_binding(
                &self,
            ) -> [&'a $crate::gpu::Buffer; [$(stringify!($field)),*].len()] {
                [$(self.$field),*]
            }
        }
    };
}

pub mod blobs;
pub mod chunks;
pub mod contract;
pub mod cull;
pub mod diffusion;
pub mod facets;
pub mod first;
pub mod generate;
pub mod grid;
pub mod harmonics;
pub mod haze;
pub mod impostors;
pub mod live;
pub mod lod;
pub mod morton;
pub mod place;
pub mod present;
pub mod relief;
pub mod scatter;
pub mod second;
pub mod sort;
pub mod sprites;
pub mod surfaces;
pub mod terrain;
pub mod texture;
pub mod tiles;
pub mod transmit;
pub mod upsample;

use crate::gpu::Sources;

macro_rules! shader_texts {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../../shaders/", $name)))),*]
    };
}

/// Name and text of every shader and include file that the binary embeds.
pub const SHADERS: &[(&str, &str)] = shader_texts![
    "chunks.frag",
    "chunks.vert",
    "chunks_order.comp",
    "contract.comp",
    "cull_scan.comp",
    "cull_test.comp",
    "cull_write.comp",
    "diffusion_bounce.comp",
    "diffusion_coarsen.comp",
    "diffusion_cycle.comp",
    "diffusion_faces.comp",
    "diffusion_flux.comp",
    "diffusion_merge.comp",
    "diffusion_patches.comp",
    "diffusion_restrict.comp",
    "diffusion_seen.comp",
    "diffusion_solids.comp",
    "diffusion_sources.comp",
    "diffusion_spread.comp",
    "diffusion_sweep.comp",
    "diffusion_system.comp",
    "diffusion_toward.comp",
    "facets.comp",
    "facets_groups.comp",
    "facets_surfaces.comp",
    "facets_terrain.comp",
    "first.comp",
    "first_tensor.comp",
    "generate.comp",
    "grid_blur.comp",
    "grid_deposit.comp",
    "grid_narrow.comp",
    "grid_resolve.comp",
    "grid_spread.comp",
    "grid_turned.comp",
    "harmonics.comp",
    "haze.comp",
    "impostors.frag",
    "impostors.vert",
    "impostors_part.comp",
    "include/angle.glsl",
    "include/arriving.glsl",
    "include/behind.glsl",
    "include/blob.glsl",
    "include/buffers.glsl",
    "include/camera.glsl",
    "include/cell_samples.glsl",
    "include/cells.glsl",
    "include/clear_sky.glsl",
    "include/cull.glsl",
    "include/density.glsl",
    "include/depths.glsl",
    "include/diffusion.glsl",
    "include/diffusivity.glsl",
    "include/directions.glsl",
    "include/each.glsl",
    "include/eye.glsl",
    "include/equations.glsl",
    "include/faces.glsl",
    "include/field.glsl",
    "include/first.glsl",
    "include/functions.glsl",
    "include/grid_narrow.glsl",
    "include/gather.glsl",
    "include/impostors.glsl",
    "include/iterations.glsl",
    "include/key.glsl",
    "include/light.glsl",
    "include/lobe.glsl",
    "include/lod.glsl",
    "include/march.glsl",
    "include/medium.glsl",
    "include/occlude.glsl",
    "include/occluders.glsl",
    "include/of_suns.glsl",
    "include/one_subgroup.glsl",
    "include/particles.glsl",
    "include/patches.glsl",
    "include/philox.glsl",
    "include/pixels.glsl",
    "include/plane.glsl",
    "include/reach.glsl",
    "include/records.glsl",
    "include/reflect.glsl",
    "include/regions.glsl",
    "include/scan.glsl",
    "include/sea.glsl",
    "include/second.glsl",
    "include/second_order.glsl",
    "include/sectors.glsl",
    "include/seen.glsl",
    "include/shade.glsl",
    "include/shell.glsl",
    "include/sky.glsl",
    "include/sort.glsl",
    "include/sort_blocks.glsl",
    "include/sprites.glsl",
    "include/strip.glsl",
    "include/sum.glsl",
    "include/target.glsl",
    "include/tensor.glsl",
    "include/texture.glsl",
    "include/turn.glsl",
    "include/tile_queue.glsl",
    "include/tile_slices.glsl",
    "include/tile_splats.glsl",
    "include/tile_thin.glsl",
    "include/tiles.glsl",
    "include/upsample.glsl",
    "include/variants.glsl",
    "include/walk.glsl",
    "include/ways.glsl",
    "live.comp",
    "lod_key.comp",
    "lod_merge.comp",
    "morton_key.comp",
    "morton_order.comp",
    "place.comp",
    "present.frag",
    "present.vert",
    "relief.comp",
    "roof_arithmetic.comp",
    "roof_atomics.comp",
    "roof_memory.comp",
    "scatter.comp",
    "second_gather.comp",
    "second_merge.comp",
    "second_sources.comp",
    "second_tensor.comp",
    "sort_bases.comp",
    "sort_count.comp",
    "sort_key.comp",
    "sort_scan.comp",
    "sort_scatter.comp",
    "sort_spread.comp",
    "sort_sums.comp",
    "sprites.frag",
    "sprites.vert",
    "surfaces.frag",
    "surfaces.vert",
    "terrain.frag",
    "terrain.vert",
    "texture_pack.comp",
    "texture_transform.comp",
    "tiles.comp",
    "tiles_clear.comp",
    "tiles_pairs.comp",
    "tiles_ranges.comp",
    "tiles_rounds.comp",
    "tiles_splat.comp",
    "transmit.comp",
    "upsample.comp",
];

/// Returns the embedded shader sources.
pub fn sources() -> Sources {
    Sources::embedded(SHADERS)
}
