//! The amounts of work in the pieces of a reference picture.

use super::amounts::Amounts;
use super::cell_visits::CellVisits;
use super::layers::Layers;
use crate::error::Result;
use crate::farm::work::ReferenceWork;
use crate::io::scene_file::LoadedScene;
use crate::model::edge::Edge;
use crate::model::scene::{LightingMode, Scene};
use crate::reference::picture::{FrameReference, ReferenceKind, n_reflections};

/// Where blobs end in references that integrate without an end: they keep all but a thousandth of
/// their optical depth within.
const VOLUME_EDGE: Edge = Edge::at(4.0);

/// Counts that hold for every division of a picture into pieces.
pub struct PieceAmounts {
    scene: Scene,
    of: ReferenceKind,
    layers: Layers,
    visits: CellVisits,
}

impl PieceAmounts {
    /// Counts layers and grid cells of a picture.
    ///
    /// # Errors
    /// When the scene cannot be placed at the frame's time.
    pub fn new(work: &ReferenceWork, loaded: &LoadedScene) -> Result<PieceAmounts> {
        let (scene, of) = (work.scene(loaded), work.reference()?);
        let truth = FrameReference::unlit(&scene, scene.time.at(work.frame))?;
        let is_drawn = matches!(of, ReferenceKind::Thin | ReferenceKind::Slices);
        let edge = if is_drawn { scene.draw.edge() } else { VOLUME_EDGE };
        // The light of the other references uses no grid.
        let has_grid = is_drawn || of == ReferenceKind::Volume;
        let visits = if has_grid { CellVisits::new(&scene, &truth) } else { CellVisits::default() };
        let layers = Layers::new(&scene, &truth, edge);
        Ok(PieceAmounts { scene, of, layers, visits })
    }

    /// Returns the amounts of each piece.
    pub fn each(&self, work: &ReferenceWork) -> Vec<Amounts> {
        let PieceAmounts { scene, of, layers, visits } = self;
        let n_particles = scene.n_particles() as f64;
        let by_model = matches!(of, ReferenceKind::Model | ReferenceKind::Reflections(_));
        // Paths in a medium know no facets.
        let n_facets = match of {
            ReferenceKind::Transport => 0.0,
            _ if by_model => n_particles,
            _ => scene.n_facets() as f64,
        };
        // Light comes from particles' facets, and from the areas of surfaces.
        let n_emitters = n_facets + scene.surfaces.len() as f64;
        let n_reflected =
            if let ReferenceKind::Reflections(k) = of { *k } else { n_reflections(scene) };
        let is_lit = scene.lighting.mode != LightingMode::None;
        let n_ranges = work.n_ranges();
        let n_tiles = work.n_pieces() as u32 / n_ranges;
        let of_tile = |i: u32| {
            let (tile, _) = work.piece(i * n_ranges);
            [layers.n_within(tile), layers.n_solid_within(tile)]
        };
        let tiles: Vec<[f64; 2]> = (0..n_tiles).map(of_tile).collect();
        let of_piece = |k: u32| {
            let n = work.piece(k).1.len() as f64;
            let [n_layers, n_solid] = tiles[(k / n_ranges) as usize];
            // Light of later reflections is sampled again for every sample of a pixel.
            let n_lit = if n_reflected >= 3 { n } else { 1.0 };
            let n_receivers = n_lit * n_facets + if by_model { n * n_solid } else { 0.0 };
            Amounts {
                steps: n,
                particle_steps: n_particles,
                cells: visits.filled + visits.marched,
                pixel_samples: n * n_layers,
                facet_pairs: if is_lit { n_receivers * n_emitters } else { 0.0 },
                // The processor makes them once, as a part of the set-up.
                textures: 0.0,
            }
        };
        (0..work.n_pieces() as u32).map(of_piece).collect()
    }
}
