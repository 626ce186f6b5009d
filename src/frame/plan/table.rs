//! The table of passes: name, input, and reasons for skipping.

use super::decision::{Decision, Reason};
use super::unchanged::Unchanged;
use crate::frame::features::{SceneFeatures, Tensors};
use crate::model::scene::DrawPath;

/// The records that a pass works on; without any, it is skipped.
#[derive(Clone, Copy)]
enum Over {
    Particles,
    Facets,
    Picture,
}

/// A pass's row of the table.
#[derive(Clone, Copy)]
pub(super) struct Row {
    over: Over,
    /// Returns why the frame does not need the pass.
    unused: fn(&SceneFeatures, &Unchanged) -> Option<Reason>,
    /// Returns whether the input of the pass is unchanged.
    is_unchanged: fn(&Unchanged) -> bool,
    /// The reason for skipping it then.
    reason: &'static str,
}

impl Row {
    /// Decides whether the pass runs.
    pub fn decide(&self, features: &SceneFeatures, unchanged: &Unchanged) -> Decision {
        let missing = match self.over {
            Over::Particles if features.n_particles == 0 => Some(Reason::Of("no particles")),
            Over::Facets if features.n_facets == 0 => Some(Reason::Of("no facets")),
            _ => (self.unused)(features, unchanged),
        };
        match missing {
            Some(reason) => Decision { run: false, reason },
            None if (self.is_unchanged)(unchanged) => Decision::skip(self.reason),
            None => Decision::RUN,
        }
    }
}

/// Declares the passes, in the order in which they run.
macro_rules! passes {
    ($($(#[$doc:meta])* $Pass:ident $name:literal, $Over:ident,
        needs $unused:expr, unless $is_unchanged:expr => $reason:literal;)*) => {
        /// A pass of a frame; the variants are in the order in which the passes run.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Pass { $($(#[$doc])* $Pass),* }

        impl Pass {
            /// All passes in their order.
            pub const ALL: [Pass; [$($name),*].len()] = [$(Pass::$Pass),*];

            /// Returns the pass's name: timer label and column in the results.
            pub fn name(self) -> &'static str {
                [$($name),*][self as usize]
            }
        }

        /// The table, by pass.
        pub(super) const ROWS: [Row; Pass::ALL.len()] = [$(Row {
            over: Over::$Over,
            unused: $unused,
            is_unchanged: $is_unchanged,
            reason: $reason,
        }),*];
    };
}

passes! {
    /// Generates the particles of boxes.
    Generate "generate", Particles,
        needs |f, _| unless(f.has_boxes, "no boxes to fill"),
        unless |same| same.made => "the boxes are the same";
    /// Recomputes the particles of discs.
    Live "live", Particles,
        needs |f, _| unless(f.has_live, "no discs"),
        unless |same| same.live => "no time has passed";
    /// Places the particles.
    Place "place", Particles,
        needs |_, _| None,
        unless |same| same.places => "nothing moved, or all as one";
    /// Computes the colours that change with the direction of view.
    Harmonics "harmonics", Particles,
        needs |f, _| unless(f.has_harmonics, "no colours change with the view"),
        unless |same| same.colors => "nothing moved, nor did the eye";
    /// Merges blobs that lie close together.
    Lod "lod", Particles,
        needs |f, _| unless(f.has_lod, "draw.lod is 0"),
        unless |same| same.merged => "nothing moved";
    /// Deposits the density grid.
    Grid "grid", Particles,
        needs unlit,
        unless |same| same.grid => "nothing moved, or all as one";
    /// Orders particles along a Morton curve.
    Morton "morton", Particles,
        needs |f, _| unless(f.is_grouped, "a facet a particle"),
        unless |same| same.morton => "nothing moved, or all as one";
    /// Places the facets.
    Facets "facets", Facets,
        needs unlit,
        unless |same| same.facets => "nothing moved, or all as one";
    /// Finds the lights that ground hides from its points.
    Relief "relief", Facets,
        needs |f, _| unless(f.has_relief, "no ground hides a light"),
        unless |same| same.relief => "ground and lights are the same";
    /// Computes the transmittance toward the lights.
    Transmit "transmit", Facets,
        needs unlit,
        unless |same| same.rays => "facets and lights stand still";
    /// Computes the first reflection.
    First "first", Facets,
        needs |f, same| unlit(f, same).or_else(|| unless(!f.is_medium, "clouds are a medium")),
        unless |same| same.response && same.eye => "facets and lights are the same";
    /// Computes the diffuse light by cell.
    Diffusion "diffusion", Particles,
        needs |f, _| unless(f.has_diffusion, "lighting.mode is not \"diffusion\""),
        unless |same| same.diffusion => "the medium and its lights are the same";
    /// Computes the light that clouds scatter as a medium.
    Scatter "scatter", Facets,
        needs |f, _| unless(f.is_medium, "no medium: clouds reflect"),
        unless |same| same.light && same.eye => "facets and lights are the same";
    /// Computes the second reflection.
    Second "second", Facets,
        needs |f, _| unless(f.has_second, "lighting.mode is not \"two-reflection\""),
        unless |same| same.response && same.eye => "facets and lights are the same";
    /// Sums the light tensors.
    Contract "contract", Facets,
        needs |f, same| match f.tensors {
            _ if f.is_medium => Some(Reason::Of("clouds are a medium")),
            Tensors::Kept => unlit(f, same),
            Tensors::Needless => {
                Some(Reason::Of("no edits that tensors could follow: light is gathered at once"))
            }
            Tensors::TooLarge { bytes, most } => Some(Reason::TooLarge { bytes, most }),
        },
        unless |same| same.light && same.eye => "light and materials are the same";
    /// Puts the air before the facets.
    Haze "haze", Facets,
        needs |f, _| unless(f.has_haze, "no air before the scene"),
        unless |same| same.hazed => "the light is the same, nor did the eye move";
    /// Keeps the particles that can show.
    Cull "cull", Particles,
        needs |f, _| match f.has_impostors {
            true if !f.culls => Some(Reason::Of("impostor layers include every particle")),
            _ => unless(f.culls, "draw.cull is \"off\""),
        },
        unless |same| same.kept => "the same can be seen";
    /// Sorts the drawn particles.
    Sort "sort", Particles,
        needs |_, _| None,
        unless |same| same.sorted => "the order cannot have changed";
    /// Makes the pool of textures.
    Texture "texture", Particles,
        needs |f, _| unless(f.is_textured, "no textures"),
        unless |same| same.made => "the pool is the same";
    /// Draws surfaces.
    Surfaces "surfaces", Picture,
        needs |f, _| unless(f.n_surfaces > 0, "no surfaces"),
        unless |same| same.picture => "the picture is the same";
    /// Draws terrain.
    Terrain "terrain", Picture,
        needs |f, _| unless(f.n_terrains > 0, "no terrain"),
        unless |same| same.picture => "the picture is the same";
    /// Shows distant blobs from a picture of them.
    Impostors "impostors", Particles,
        needs |f, same| unless(f.has_impostors, "draw.impostors is \"off\"")
            .or_else(|| unless(same.may_reuse, "nothing is used again with --no-skip")),
        unless |same| same.picture => "the picture is the same";
    /// Draws blobs as sprites.
    Sprites "sprites", Picture,
        needs |f, _| unless(f.path == DrawPath::Sprites, "draw.path is \"tiles\""),
        unless |same| same.picture => "the picture is the same";
    /// Draws blobs by tiles.
    Tiles "tiles", Picture,
        needs |f, _| unless(f.path == DrawPath::Tiles, "draw.path is \"sprites\""),
        unless |same| same.picture => "the picture is the same";
    /// Resamples the blobs' smaller picture.
    Upsample "upsample", Picture,
        needs |f, _| unless(f.is_low_res, "draw.resolution is 1"),
        unless |same| same.picture => "the picture is the same";
}

fn unless(is_needed: bool, reason: &'static str) -> Option<Reason> {
    (!is_needed).then_some(Reason::Of(reason))
}

fn unlit(features: &SceneFeatures, _: &Unchanged) -> Option<Reason> {
    unless(features.is_lit, "lighting.mode is \"none\"")
}
