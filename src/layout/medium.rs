//! Records of clouds as a medium.

use crate::layout::record;
use crate::model::medium::{Medium, without};
use crate::model::phase::Phase;
use crate::model::scene::Lighting;

record! {
    /// The medium of a cloud (model.md §18).
    pub struct MediumRecord {
        /// K_d, or the given albedo of white particles, linear RGB.
        reflected: [f32; 3],
        /// 1: the albedo is given.
        is_given: u32,
        /// Mean cosine g of the phase function.
        g: f32,
        /// f: share of what is scattered that counts as not scattered.
        straight: f32,
        /// Mean cosine of Henyey and Greenstein's part of the phase function of the rest.
        lobe: f32,
        /// Mean cosine of the phase function of the rest.
        mean: f32,
        /// g of Draine's part.
        draine_lobe: f32,
        /// α of Draine's part.
        draine_alpha: f32,
        /// Share of Draine's part.
        draine_share: f32,
        /// Padding.
        unused: u32,
    }
}

impl MediumRecord {
    /// Returns the record of `medium` in a mode of lighting.
    pub fn new(medium: &Medium, lighting: &Lighting) -> Self {
        let straight = medium.straight(lighting);
        let rest = without(medium.phase, straight);
        let record = MediumRecord {
            reflected: medium.given.unwrap_or(medium.kd).as_vec3().to_array(),
            is_given: u32::from(medium.given.is_some()),
            g: medium.phase.mean_cosine() as f32,
            straight: straight as f32,
            mean: rest.mean_cosine() as f32,
            ..MediumRecord::default()
        };
        match rest {
            Phase::HenyeyGreenstein { g } => MediumRecord { lobe: g as f32, ..record },
            Phase::Droplets { mixture: m } => MediumRecord {
                lobe: m.g as f32,
                draine_lobe: m.g_draine as f32,
                draine_alpha: m.alpha as f32,
                draine_share: m.share as f32,
                ..record
            },
        }
    }
}
