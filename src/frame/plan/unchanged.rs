//! The inputs of passes that are unchanged since the last frame.

use crate::frame::features::{SceneFeatures, Tensors};
use crate::frame::packet::Packet;
use crate::layout::facet::RegionRecord;
use crate::layout::frame::LightRecord;
use crate::layout::particle::DrawnRecord;

/// The results of earlier frames that a frame may reuse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Skipping {
    /// Passes are skipped if their input is unchanged; false with `--no-skip`.
    pub is_on: bool,
    /// With skipping off, the particles of boxes and the pool of textures are still made once: no
    /// frame of a run can change them.
    pub keeps_made: bool,
    /// The particles of boxes and the pool of textures exist before the first frame.
    pub is_made: bool,
}

impl Skipping {
    /// Returns the start of a run, with skipping on or off.
    pub fn new(is_on: bool) -> Skipping {
        Skipping { is_on, keeps_made: false, is_made: false }
    }
}

/// Whether inputs of passes are the same as in the last frame, to the bit.
pub(super) struct Unchanged {
    /// There is a last frame.
    has_last: bool,
    /// Earlier pictures may be used again.
    pub may_reuse: bool,
    /// Particles of boxes and the pool of textures.
    pub made: bool,
    /// Particles of discs.
    pub live: bool,
    /// Places of particles.
    pub places: bool,
    /// Colours of particles that change with the direction of view.
    pub colors: bool,
    /// Blobs that stand for others.
    pub merged: bool,
    /// Density grid.
    pub grid: bool,
    /// Morton order of particles.
    pub morton: bool,
    geometry: bool,
    /// Facets.
    pub facets: bool,
    /// Ways from the ground's points to lights.
    pub relief: bool,
    /// Rays from facets to lights, and what hides them.
    pub rays: bool,
    /// Position of the eye, as far as light depends on it.
    pub eye: bool,
    /// Facets, lights and materials, as far as the first two reflections depend on them.
    pub response: bool,
    /// Density grid, medium and lights.
    pub diffusion: bool,
    /// Facets, lights and materials.
    pub light: bool,
    /// Light and eye.
    pub hazed: bool,
    drawn: bool,
    /// Particles that can show.
    pub kept: bool,
    /// Sorted entries.
    pub sorted: bool,
    /// The picture.
    pub picture: bool,
}

impl Unchanged {
    /// Compares `next` with `last`.
    pub fn new(
        features: &SceneFeatures,
        skipping: Skipping,
        last: Option<&Packet>,
        next: &Packet,
    ) -> Unchanged {
        let has_made = last.is_some() || skipping.is_made;
        let last = last.filter(|_| skipping.is_on);
        let same = |f: &dyn Fn(&Packet, &Packet) -> bool| last.is_some_and(|last| f(last, next));
        let live = same(&|a, b| a.discs == b.discs && a.live == b.live);
        let same_groups = |a: &Packet, b: &Packet| a.groups == b.groups && a.modes == b.modes;
        let places =
            live && same(&|a, b| a.placed == b.placed && (b.placed.is_some() || same_groups(a, b)));
        let same_eye = same(&|a, b| a.camera.eye == b.camera.eye);
        let colors = places && same_eye;
        let grid = places && same(&|a, b| a.grid == b.grid);
        let morton = places && same(&|a, b| a.bounds == b.bounds);
        let geometry = same(&|a, b| {
            let geometry = RegionRecord::geometry;
            a.regions.iter().map(geometry).eq(b.regions.iter().map(geometry))
        });
        let facets = grid
            && geometry
            && same(&|a, b| a.groups == b.groups)
            && (morton || !features.is_grouped);
        // Without a lobe, radiance is the same in all directions.
        let eye = !features.is_glossy || same_eye;
        let materials = same(&|a, b| {
            a.regions == b.regions && a.table == b.table && a.coefficients == b.coefficients
        });
        let lights = same(&|a, b| a.lights == b.lights);
        let media = same(&|a, b| a.media == b.media && a.diffusion == b.diffusion);
        let light = facets && materials && media && lights;
        // With tensors, the first two reflections depend on neither energies nor materials.
        let response = match features.tensors {
            Tensors::Kept => facets && same(&|a, b| shine_alike(&a.lights, &b.lights)),
            _ => light,
        };
        let drawn = same(&|a, b| a.drawn == b.drawn);
        let order = places
            && same(&|a, b| {
                // The density of particles does not order them.
                let range = |d: &DrawnRecord| (d.shift, d.end);
                a.drawn.iter().map(range).eq(b.drawn.iter().map(range))
                    && match features.is_sliced {
                        true => a.camera.eye == b.camera.eye,
                        false => a.camera.forward == b.camera.forward,
                    }
                    && (a.radius, a.sort_bits) == (b.radius, b.sort_bits)
            });
        // Whether a particle can show depends on all of the camera, and on its density.
        let kept = order && drawn && same(&|a, b| a.camera == b.camera);
        Unchanged {
            has_last: last.is_some(),
            may_reuse: skipping.is_on,
            made: has_made && (skipping.is_on || skipping.keeps_made),
            live,
            places,
            colors,
            merged: places && (colors || !features.has_harmonics),
            grid,
            morton,
            geometry,
            facets,
            relief: same(&|a, b| shines_alike_on_ground(features, a, b)),
            rays: facets && same(&has_same_rays),
            eye,
            response,
            hazed: light && same_eye,
            diffusion: grid && geometry && media && lights && (materials || !features.has_solids()),
            light,
            drawn,
            kept,
            sorted: if features.culls { kept } else { order },
            picture: kept && (light || !features.is_lit),
        }
    }

    /// Returns the first change of the picture other than the view.
    pub fn first_change(&self, features: &SceneFeatures) -> Option<&'static str> {
        let changes = [
            (self.has_last, "there is no frame before"),
            (self.places, "particles moved"),
            (self.colors || !features.has_harmonics, "colours changed"),
            (self.drawn, "other particles are drawn"),
            (self.geometry, "surfaces moved"),
            ((self.light && self.eye) || !features.is_lit, "light changed"),
            (self.hazed || !features.has_haze, "the air between changed"),
        ];
        changes.into_iter().find(|(is_same, _)| !is_same).map(|(_, change)| change)
    }
}

/// Returns whether the rays from facets to lights are the same; a light without energy has none.
fn has_same_rays(a: &Packet, b: &Packet) -> bool {
    let ray = |l: &LightRecord| (l.toward, l.position, l.kind, l.energy != [0.0; 3]);
    let rectangle = |r: &RegionRecord| (r.kind, r.center, r.u, r.v, r.normal, r.n_u, r.n_v);
    a.lights.iter().map(ray).eq(b.lights.iter().map(ray))
        && a.regions.iter().map(rectangle).eq(b.regions.iter().map(rectangle))
}

/// Returns whether the ways from the ground's points to lights are the same. Where the lighting
/// origin is matters to lamps and to other grounds.
fn shines_alike_on_ground(features: &SceneFeatures, a: &Packet, b: &Packet) -> bool {
    let is_placed = features.has_lamps || features.n_terrains > 1;
    let ray =
        |l: &LightRecord| (l.toward, is_placed.then_some(l.position), l.kind, l.energy != [0.0; 3]);
    let center = |r: &RegionRecord| (r.kind, is_placed.then_some(r.center));
    a.lights.iter().map(ray).eq(b.lights.iter().map(ray))
        && a.regions.iter().map(center).eq(b.regions.iter().map(center))
}

/// Returns whether `next` reaches facets as `last` did except for the lights' energies. A light
/// without energy may have left no tensor behind, so no dark light may have been turned on.
fn shine_alike(last: &[LightRecord], next: &[LightRecord]) -> bool {
    let geometry = |l: &LightRecord| LightRecord { energy: [0.0; 3], ..*l };
    let is_dark = |l: &LightRecord| l.energy == [0.0; 3];
    last.iter().map(geometry).eq(next.iter().map(geometry))
        && last.iter().zip(next).all(|(a, b)| !is_dark(a) || is_dark(b))
}
