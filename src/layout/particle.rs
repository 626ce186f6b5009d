//! Records of particles, of their groups, and of the boxes they are generated from.

use glam::DVec3;

use crate::layout::record;
use crate::model::boxes::{BoxLaw, CloudBox, Form, radius_factor};
use crate::model::cloud::{Group, Particle, SIGMA_PER_RADIUS, box_kappa};
use crate::model::count::DrawnCount;
use crate::model::gust::Mode;
pub use crate::model::shape::Shapes;
use crate::model::shape::{Shape, Turn};
use crate::model::texture::Texture;

record! {
    /// A Gaussian blob; lengths in scene units.
    pub struct ParticleRecord {
        /// Centre relative to its group's origin.
        position: [f32; 3],
        /// σ along the first axis of its shape.
        sigma: f32,
        /// Factor on K_d, linear RGB.
        color: [f32; 3],
        /// Extinction at the centre, per scene unit.
        kappa: f32,
        /// Length of the second axis over σ; of an upright blob σ along y over that along x and z.
        aspect: f32,
        /// Length of the third axis over σ.
        aspect_z: f32,
        /// How the axes are turned from x, y and z (`Turn::words`).
        turn: [u32; 2],
    }
}

record! {
    /// A box to generate particles in: P Table 1, with the constants of its laws.
    pub struct BoxRecord {
        /// Edges X_L, Y_L, Z_L.
        extent: [f32; 3],
        /// Greatest radius R_max.
        radius_max: f32,
        /// σ of a particle over its radius of P (11): the form's factor, `radius_scale` and 1/3.
        sigma_factor: f32,
        /// κ of its particles.
        kappa: f32,
        /// Philox key: the cloud's seed.
        seed: u32,
        /// Philox key: the number of the box in its cloud.
        i_box: u32,
        /// Number of the box's first particle in the buffer.
        i_first: u32,
        /// Number of particles.
        n_particles: u32,
        /// `FORM_CENTRED`, `FORM_PRINTED`, or `FORM_GIVEN` for a group that is no box.
        form: u32,
        /// Padding.
        unused: u32,
    }
}

/// [`BoxRecord::form`] of offsets about the centre. The shaders' `FORM_*` have the same values.
pub const FORM_CENTRED: u32 = 0;
/// [`BoxRecord::form`] of P's formulas as printed.
pub const FORM_PRINTED: u32 = 1;
/// [`BoxRecord::form`] of a group whose particles are uploaded.
pub const FORM_GIVEN: u32 = 2;

impl ParticleRecord {
    /// Returns `particle` relative to `group`.
    pub fn new(particle: &Particle, group: &Group) -> Self {
        ParticleRecord {
            position: (particle.position - group.center).as_vec3().to_array(),
            sigma: particle.sigma as f32,
            color: particle.color.as_vec3().to_array(),
            kappa: particle.kappa as f32,
            aspect: particle.shape.aspect as f32,
            aspect_z: particle.shape.aspect_z as f32,
            turn: particle.shape.turn.words(),
        }
    }

    /// Returns the shape of the particle.
    pub fn shape(&self) -> Shape {
        Shape {
            aspect: f64::from(self.aspect),
            aspect_z: f64::from(self.aspect_z),
            turn: Turn::of_words(self.turn),
        }
    }
}

impl BoxRecord {
    /// Returns the record of box `i_box` of a cloud with `seed`; its particles start at `i_first`.
    pub fn new(b: &CloudBox, law: &BoxLaw, seed: u32, i_box: u32, i_first: u32) -> Self {
        BoxRecord {
            extent: b.extent.as_vec3().to_array(),
            radius_max: b.radius_max as f32,
            sigma_factor: (radius_factor(law.form, b.radius_max)
                * law.radius_scale
                * SIGMA_PER_RADIUS) as f32,
            kappa: box_kappa(b, law) as f32,
            seed,
            i_box,
            i_first,
            n_particles: b.n_particles,
            form: match law.form {
                Form::Centred => FORM_CENTRED,
                Form::Printed => FORM_PRINTED,
            },
            unused: 0,
        }
    }

    /// Returns the record of a group whose particles are uploaded, not generated.
    pub fn given() -> Self {
        BoxRecord { form: FORM_GIVEN, ..BoxRecord::default() }
    }
}

record! {
    /// A particle's place in this frame.
    pub struct PlacedRecord {
        /// Centre relative to the lighting origin.
        position: [f32; 3],
        /// σ along x and z, as the particle has grown.
        sigma: f32,
    }
}

record! {
    /// A group's place and motion in this frame.
    pub struct GroupRecord {
        /// Cloud origin(t) + group centre, as it has grown, − lighting origin.
        offset: [f32; 3],
        /// The cloud's region.
        i_region: u32,
        /// The point that its facets face away from, relative to the lighting origin: the cloud's
        /// centre, or a point far below it.
        cloud_center: [f32; 3],
        /// Mean σ of the group's particles, as they have grown.
        sigma_mean: f32,
        /// The group's centre relative to its cloud's origin, as it has grown.
        center: [f32; 3],
        /// Its cloud's first gust mode.
        i_mode: u32,
        /// Number of gust modes.
        n_modes: u32,
        /// Growth s: lengths over those at time 0.
        scale: f32,
        /// Padding.
        unused: [u32; 2],
    }
}

impl GroupRecord {
    /// Returns the record of `group`, as it has grown. `origin_from_light` is the cloud's origin at
    /// the frame's time minus the lighting origin. The last argument is the cloud's first gust mode
    /// and their number.
    pub fn new(
        group: &Group,
        i_region: u32,
        origin_from_light: DVec3,
        (i_mode, n_modes): (u32, u32),
    ) -> Self {
        GroupRecord {
            offset: (origin_from_light + group.center).as_vec3().to_array(),
            i_region,
            cloud_center: (origin_from_light + group.facing_from).as_vec3().to_array(),
            sigma_mean: group.sigma_mean as f32,
            center: group.center.as_vec3().to_array(),
            i_mode,
            n_modes,
            scale: group.scale as f32,
            unused: [0; 2],
        }
    }
}

record! {
    /// The particles of a group that are drawn in this frame.
    pub struct DrawnRecord {
        /// Number of a drawn particle's entry minus the particle's number, modulo 2³².
        shift: u32,
        /// End of the drawn particles: the first one that is not drawn.
        end: u32,
        /// Factor on κ.
        kappa_scale: f32,
        /// Further factor on the last drawn particle's κ.
        last_weight: f32,
    }
}

impl DrawnRecord {
    /// Returns the record of `group`; `i_entry` is the entry of its first drawn particle.
    pub fn new(group: &Group, drawn: &DrawnCount, i_entry: u32) -> Self {
        DrawnRecord {
            shift: i_entry.wrapping_sub(group.i_first),
            end: group.i_first + drawn.n,
            kappa_scale: drawn.kappa_scale as f32,
            last_weight: drawn.last_weight as f32,
        }
    }
}

record! {
    /// The texture of a group's particles (passes.md "texture").
    pub struct TexturedRecord {
        /// Philox key of each particle's rotation and shift: the cloud's seed.
        seed: u32,
        /// Philox key: the number of the box in its cloud.
        i_box: u32,
        /// The group's first particle.
        i_first: u32,
        /// Field of the pool.
        i_field: u32,
        /// Strength s; 0 without a texture.
        strength: f32,
    }
}

impl TexturedRecord {
    /// Returns the record of box `i_box` of a cloud of `seed` and `texture`, whose particles start
    /// at `i_first`.
    pub fn new(texture: &Texture, seed: u32, i_box: u32, i_first: u32) -> Self {
        let (i_field, strength) = texture.of_box(i_box);
        TexturedRecord { seed, i_box, i_first, i_field, strength: strength as f32 }
    }
}

record! {
    /// One wave of a cloud's gusts at the frame's time: a sin(k·x + phase).
    pub struct ModeRecord {
        /// Wave vector k.
        k: [f32; 3],
        /// Phase in radians.
        phase: f32,
        /// Amplitude a.
        a: [f32; 3],
        /// Padding.
        unused: u32,
    }
}

impl ModeRecord {
    /// Returns the record of `mode` at `time_s`.
    pub fn new(mode: &Mode, time_s: f64) -> Self {
        ModeRecord {
            k: mode.k.as_vec3().to_array(),
            phase: mode.phase_at(time_s) as f32,
            a: mode.a.as_vec3().to_array(),
            unused: 0,
        }
    }
}
