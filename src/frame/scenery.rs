//! What hides blobs: surfaces and ground, drawn before them, with their depth.

use super::buffers::Buffers;
use super::plan::Pass;
use super::settings::Settings;
use crate::error::Result;
use crate::gpu::TargetFormat;
use crate::gpu::{Compiler, Device, Image, LoadOp, Recorder, Target};
use crate::layout::frame::CameraRecord;
use crate::model::scene::Scene;
use crate::model::terrain::Terrain as Ground;
use crate::passes::surfaces::Surfaces;
use crate::passes::terrain::{Piece, Terrain};

pub(super) struct Scenery {
    /// None where there are none.
    surfaces: Option<Surfaces>,
    terrain: Option<(Terrain, Vec<Piece>)>,
    pub depth: Image,
}

impl Scenery {
    /// Of `scene`, which has something that hides.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
        format: TargetFormat,
        depth_only: bool,
    ) -> Result<Scenery> {
        let surfaces = || Surfaces::new(device, compiler, format, depth_only);
        let terrain = || Ok((Terrain::new(device, compiler, format, depth_only)?, pieces(scene)));
        Ok(Scenery {
            surfaces: (!scene.surfaces.is_empty()).then(surfaces).transpose()?,
            terrain: (!scene.terrains.is_empty()).then(terrain).transpose()?,
            depth: Image::depth(device, "surfaces.depth", scene.film.width, scene.film.height)?,
        })
    }

    /// What `solids` draws, into `color`, and whether that is anything: what comes first clears it.
    pub fn record(
        &mut self,
        rec: &mut Recorder<'_>,
        solids: Pass,
        b: &Buffers,
        color: &mut Image,
        camera: &CameraRecord,
        s: &Settings,
    ) -> Result<bool> {
        let Scenery { surfaces, terrain, depth } = self;
        match (solids, &surfaces, &terrain) {
            (Pass::Surfaces, Some(surfaces), _) => {
                let target = Target { color, depth: Some(depth) };
                surfaces.record(rec, [&b.regions.buffer, &b.lit], target, camera, s.n_surfaces)?;
                Ok(true)
            }
            (Pass::Terrain, before, Some((terrain, pieces))) => {
                let mut start = if before.is_some() { LoadOp::Load } else { LoadOp::Clear };
                for piece in pieces {
                    let target = Target { color: &mut *color, depth: Some(&mut *depth) };
                    let buffers = [&b.regions.buffer, &b.ground, &b.lit];
                    terrain.record(
                        rec,
                        buffers,
                        (target, std::mem::replace(&mut start, LoadOp::Load)),
                        camera,
                        *piece,
                    )?;
                }
                Ok(true)
            }
            _ => Ok(false),
        }
    }
}

fn pieces(scene: &Scene) -> Vec<Piece> {
    let of = |(terrain, i_region): (&Ground, u32)| Piece {
        i_region,
        i_first_ground: scene.n_surface_facets() as u32,
        n_cells: terrain.n_cells() as u32,
    };
    scene.terrains.iter().zip(scene.surfaces.len() as u32..).map(of).collect()
}
