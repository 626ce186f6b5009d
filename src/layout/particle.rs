//! Particles as the GPU holds them, and the boxes they are generated from.

use glam::DVec3;

use crate::layout::record;
use crate::model::boxes::{CloudBox, Form, radius_factor};
use crate::model::cloud::{Group, Particle, SIGMA_PER_RADIUS, box_kappa};
use crate::model::count::DrawnCount;
use crate::model::gust::Mode;
use crate::model::texture::Texture;

record! {
    /// A Gaussian blob; position relative to its group's origin. Scene units, κ per unit.
    pub struct ParticleRecord {
        position: [f32; 3],
        sigma: f32,
        color: [f32; 3],
        kappa: f32,
        /// σ along y over that along x and z.
        aspect: f32,
        unused: f32,
        unused_too: [f32; 2],
    }
}

record! {
    /// One box to generate from: P Table 1 with the constants of its laws.
    pub struct BoxRecord {
        /// X_L, Y_L, Z_L.
        extent: [f32; 3],
        /// R_max.
        radius_max: f32,
        /// σ of a particle over P (11)'s radius: the form's factor, `radius_scale` and 1/3.
        sigma_factor: f32,
        kappa: f32,
        /// Philox key.
        seed: u32,
        i_box: u32,
        /// Number of the box's first particle in the buffer.
        i_first: u32,
        n_particles: u32,
        /// `FORM_CENTRED`, `FORM_PRINTED`, or `FORM_GIVEN` for a group that is no box.
        form: u32,
        unused: u32,
    }
}

/// In place of a particle's number: an entry that draws nothing; the shaders' NO_PARTICLE.
pub const NO_PARTICLE: u32 = u32::MAX;

/// Values of [`BoxRecord::form`]; the shaders' `FORM_*`.
pub const FORM_CENTRED: u32 = 0;
pub const FORM_PRINTED: u32 = 1;
pub const FORM_GIVEN: u32 = 2;

impl ParticleRecord {
    /// `particle` relative to `group`.
    pub fn new(particle: &Particle, group: &Group) -> Self {
        ParticleRecord {
            position: (particle.position - group.center).as_vec3().to_array(),
            sigma: particle.sigma as f32,
            color: particle.color.as_vec3().to_array(),
            kappa: particle.kappa as f32,
            aspect: particle.aspect as f32,
            unused: 0.0,
            unused_too: [0.0; 2],
        }
    }
}

/// What a cloud says of all its boxes.
#[derive(Debug, Clone, Copy)]
pub struct BoxLaw {
    pub form: Form,
    pub optical_depth: f64,
    pub radius_scale: f64,
    pub seed: u32,
}

impl BoxRecord {
    /// Box `i_box` of its cloud, whose particles start at `i_first`.
    pub fn new(b: &CloudBox, law: &BoxLaw, i_box: u32, i_first: u32) -> Self {
        BoxRecord {
            extent: b.extent.as_vec3().to_array(),
            radius_max: b.radius_max as f32,
            sigma_factor: (radius_factor(law.form, b.radius_max)
                * law.radius_scale
                * SIGMA_PER_RADIUS) as f32,
            kappa: box_kappa(b, law.form, law.optical_depth, law.radius_scale) as f32,
            seed: law.seed,
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

    /// Stands for a group whose particles are uploaded, not generated.
    pub fn given() -> Self {
        BoxRecord { form: FORM_GIVEN, ..BoxRecord::default() }
    }
}

record! {
    /// A particle where the frame has it: position relative to the lighting origin, and its σ.
    pub struct PlacedRecord {
        position: [f32; 3],
        sigma: f32,
    }
}

record! {
    /// What moves a group this frame.
    pub struct GroupRecord {
        /// Cloud origin(t) + group centre, as it has grown, − lighting origin.
        offset: [f32; 3],
        i_region: u32,
        /// What its facets look away from relative to the lighting origin: the cloud's centre, or
        /// far below that.
        cloud_center: [f32; 3],
        /// Mean σ of the group's particles, as they have grown.
        sigma_mean: f32,
        /// The group's centre relative to its cloud's origin, as it has grown.
        center: [f32; 3],
        /// Its cloud's first gust mode.
        i_mode: u32,
        n_modes: u32,
        /// s: lengths over those at time 0.
        scale: f32,
        unused: [u32; 2],
    }
}

impl GroupRecord {
    /// `group`: as it has grown; `origin_from_light`: the cloud's origin at the frame's time minus
    /// the lighting origin, in f64. `i_region`: the cloud's; `modes`: first gust mode of the cloud,
    /// and how many it has.
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
    /// What is drawn of a group this frame.
    pub struct DrawnRecord {
        /// From the number of a drawn particle to that of its entry, modulo 2³².
        shift: u32,
        /// The group's first particle that is not drawn.
        end: u32,
        /// Factor on κ, and on the last drawn particle's beside it.
        kappa_scale: f32,
        last_weight: f32,
    }
}

impl DrawnRecord {
    /// `i_entry`: of the group's first drawn particle.
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
    /// What a group's particles are drawn with (docs/model.md §11 "texture").
    pub struct TexturedRecord {
        /// Philox key of each particle's turn.
        seed: u32,
        i_box: u32,
        /// The group's first particle.
        i_first: u32,
        i_field: u32,
        /// s; 0: plain.
        strength: f32,
    }
}

impl TexturedRecord {
    /// Box `i_box` of a cloud of `seed` and `texture`, whose particles start at `i_first`.
    pub fn new(texture: &Texture, seed: u32, i_box: u32, i_first: u32) -> Self {
        let (i_field, strength) = texture.of_box(i_box);
        TexturedRecord { seed, i_box, i_first, i_field, strength: strength as f32 }
    }
}

record! {
    /// One wave of a cloud's gusts at the frame's time: a sin(k·x + phase).
    pub struct ModeRecord {
        k: [f32; 3],
        phase: f32,
        a: [f32; 3],
        unused: u32,
    }
}

impl ModeRecord {
    pub fn new(mode: &Mode, time_s: f64) -> Self {
        ModeRecord {
            k: mode.k.as_vec3().to_array(),
            phase: mode.phase_at(time_s) as f32,
            a: mode.a.as_vec3().to_array(),
            unused: 0,
        }
    }
}
