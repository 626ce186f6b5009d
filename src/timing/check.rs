//! The records of a check: are the pictures that a bench timed right?

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::measure::figure::Figure;
use crate::model::scene::Scene;
use crate::model::shade::FacetSlope;

/// The picture at the end of a block, as the device holds it.
#[derive(Debug, Clone)]
pub struct DevicePicture {
    /// Number of the case.
    pub i_case: usize,
    /// The loop that drew it.
    pub loop_name: String,
    /// SHA-256 of its bytes.
    pub hash: String,
    /// The scene with the settings that "auto" chose.
    pub scene: Arc<Scene>,
    /// Number of the frame.
    pub i_frame: u32,
    /// Time of the frame in seconds.
    pub time_s: f64,
    /// Premultiplied linear [r, g, b, opacity] at the pixels that are checked.
    pub rgba: Vec<[f64; 4]>,
    /// First and second reflection of every facet, W m⁻² sr⁻¹; empty if nothing is lit.
    pub light: Vec<[[f32; 3]; 2]>,
    /// Their radiance behind the air; empty where there is none.
    pub hazed: Vec<[f32; 3]>,
    /// Change of the light that is drawn inside of blobs, by facet; empty where there is none.
    pub slopes: Vec<FacetSlope>,
}

/// The stages of pictures, checked with values at the limits of the accepted input.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stages {
    /// Cases of `nimbus stress` that were run.
    pub n_cases: usize,
    /// Names of those that failed.
    pub failed: Vec<String>,
    /// Time that they took, in seconds.
    pub seconds: f64,
    /// Whether they had passed on this device, with these shaders, before.
    pub from_cache: bool,
}

/// The answer of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CheckVerdict {
    /// The picture differs from its reference by no more than the bounds.
    Right,
    /// The picture differs by more.
    Wrong,
    /// There is no reference of this scene, or none was asked for.
    NotChecked,
}

/// A root mean square over the checked pixels, and what it may be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bounded {
    /// Root mean square, over premultiplied linear red, green, blue and alpha.
    pub rms: f64,
    /// The greatest value that is right.
    pub bound: f64,
}

/// The drawing of a picture, compared with its light drawn in f64 with the scene's own settings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DrawingCheck {
    /// Root mean square difference.
    pub rms: f64,
    /// Root mean square of the bounds, one a number.
    pub bound: f64,
    /// Pixels that show something.
    pub n_shown: usize,
    /// Shown pixels of which a number differs by more than its bound.
    pub n_beyond: usize,
    /// The greatest number of such pixels in a right picture.
    pub most_beyond: usize,
}

/// The pictures of a case, compared with their reference in f64.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// The answer.
    pub verdict: CheckVerdict,
    /// The fault of a wrong picture; or why a picture, or its light, was not checked.
    pub reason: Option<String>,
    /// Number of the frame, the last of a block; null if nothing was checked.
    pub frame: Option<u32>,
    /// Pixels that were compared.
    pub n_pixels: usize,
    /// Root mean square difference from the reference "thin" of `nimbus error`: the scene's light
    /// in f64, drawn without the approximations of `draw`. Its 95 % interval is over parts of the
    /// picture.
    pub rmse: Option<Figure>,
    /// Greatest difference of a number.
    pub max: Option<f64>,
    /// Root mean square of the reference itself.
    pub magnitude: Option<f64>,
    /// Difference from the same light, drawn in f64 with the scene's own settings.
    pub drawing: Option<DrawingCheck>,
    /// The change that the scene's settings of `draw` make, in f64.
    pub settings_rms: Option<f64>,
    /// Difference of the light from that in f64, in the picture; null if nothing is lit, or the
    /// light has no reference. `rmse` is then that of the drawing.
    pub light: Option<Bounded>,
    /// Facets whose second reflection was computed in f64.
    pub n_second: usize,
    /// Whether those are all facets that the pixels show.
    pub is_light_whole: bool,
    /// Time that the check took, in seconds.
    pub seconds: f64,
    /// Whether the light in f64 was kept from an earlier check.
    pub from_cache: bool,
}

impl Check {
    /// Returns a check that was not made.
    pub fn none(reason: &str) -> Check {
        Check {
            verdict: CheckVerdict::NotChecked,
            reason: Some(reason.to_owned()),
            frame: None,
            n_pixels: 0,
            rmse: None,
            max: None,
            magnitude: None,
            drawing: None,
            settings_rms: None,
            light: None,
            n_second: 0,
            is_light_whole: false,
            seconds: 0.0,
            from_cache: false,
        }
    }

    /// Returns whether the picture is wrong.
    pub fn is_wrong(&self) -> bool {
        self.verdict == CheckVerdict::Wrong
    }
}
