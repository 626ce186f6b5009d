//! The pipelines that draw opaque geometry: surfaces and terrain.

use super::buffers::SceneBuffers;
use super::plan::Pass;
use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, LoadOp, Recorder, Target, TargetFormat};
use crate::layout::frame::CameraRecord;
use crate::model::scene::Scene;
use crate::passes::surfaces::Surfaces;
use crate::passes::terrain::{Piece, Terrain};

/// The pipelines of a scene's opaque geometry.
pub(super) struct Solids {
    surfaces: Option<Surfaces>,
    terrain: Option<(Terrain, Vec<Piece>)>,
    n_surfaces: u32,
}

impl Solids {
    /// Creates the pipelines; with `depth_only`, color and alpha are 0.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
        format: TargetFormat,
        depth_only: bool,
    ) -> Result<Solids> {
        let surfaces = || Surfaces::new(device, compiler, format, depth_only);
        let terrain = || Ok((Terrain::new(device, compiler, format, depth_only)?, pieces(scene)));
        Ok(Solids {
            surfaces: (!scene.surfaces.is_empty()).then(surfaces).transpose()?,
            terrain: (!scene.terrains.is_empty()).then(terrain).transpose()?,
            n_surfaces: scene.surfaces.len() as u32,
        })
    }

    /// Draws the surfaces or, for the pass `Terrain`, the terrains over them. The first of these
    /// passes clears `target`.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        pass: Pass,
        (SceneBuffers { regions, ground, .. }, lit): (&SceneBuffers, &Buffer),
        target: Target<'_>,
        camera: &CameraRecord,
    ) -> Result<()> {
        if pass == Pass::Surfaces {
            let Some(surfaces) = &self.surfaces else { return Ok(()) };
            return surfaces.record(rec, [regions, lit], target, camera, self.n_surfaces);
        }
        let Target { color, mut depth } = target;
        let mut start = if self.surfaces.is_some() { LoadOp::Load } else { LoadOp::Clear };
        let Some((terrain, pieces)) = &self.terrain else { return Ok(()) };
        for piece in pieces {
            let target = Target { color: &mut *color, depth: depth.as_deref_mut() };
            terrain.record(rec, [regions, ground, lit], (target, start), camera, *piece)?;
            start = LoadOp::Load;
        }
        Ok(())
    }
}

/// Returns the pieces of ground, whose regions follow the surfaces'.
fn pieces(scene: &Scene) -> Vec<Piece> {
    let regions = scene.surfaces.len() as u32..;
    let piece = |(terrain, i_region): (&crate::model::terrain::Terrain, u32)| Piece {
        i_region,
        i_first_ground: scene.n_surface_facets() as u32,
        n_cells: terrain.n_cells() as u32,
    };
    scene.terrains.iter().zip(regions).map(piece).collect()
}
