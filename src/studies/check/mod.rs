//! Compares the pictures that a bench timed with their reference in f64, within seconds.
//!
//! The reference is "thin" ([`crate::reference::picture::ReferenceKind`]). A picture is linear in
//! the radiance of its facets, so its difference from the reference is the sum of two:
//!
//! - the drawing: the picture less the device's own light, drawn in f64. It costs little.
//! - the light: the device's light less that in f64, both drawn in f64. It needs the second
//!   reflection of every facet that is seen, which may take hours.
//!
//! Where time is short, the light is estimated. Two facets of a pixel are picked at random, each
//! with its share in the pixel as probability, and give two estimates of the difference. The mean
//! of their product is the square of the difference, so that the root mean square is unbiased.

mod bound;
mod cache;
mod light;
mod numbers;

use std::path::Path;
use std::time::{Duration, Instant};

use glam::{DVec2, DVec3};

use self::light::{Light, Plan};
use self::numbers::{differences, rms, sums};
use super::picture_error::{Samples, rmse_of};
use crate::error::Result;
use crate::model::scene::{LightingMode, Scene};
use crate::reference::picture::{
    Emitters, FrameReference, PixelShares, Pixels, ReferenceKind, drawn_by_settings, pixel_shares,
};
use crate::timing::check::{Bounded, Check, CheckVerdict, DevicePicture};

/// Pixels of a check.
pub const N_PIXELS: usize = 2048;

/// How a check is made.
#[derive(Debug, Clone, Copy)]
pub struct CheckPlan<'a> {
    /// Time for the second reflection in f64.
    pub budget: Duration,
    /// Folder in which the light in f64 is kept.
    pub folder: Option<&'a Path>,
}

/// Returns the pixels at which the pictures of a film are checked.
pub fn checked_pixels(width: u32, height: u32) -> Pixels {
    Pixels::sample(width, height, N_PIXELS)
}

/// Checks a device's picture.
///
/// # Errors
/// Fails if the scene has no state at the time of the frame.
pub fn check(device: &DevicePicture, plan: &CheckPlan<'_>) -> Result<Check> {
    let begin = Instant::now();
    let film = device.scene.film;
    let pixels = checked_pixels(film.width, film.height);
    let exact = &ReferenceKind::drawn_by(&device.scene).without_approximations(&device.scene);
    if let Err(error) = ReferenceKind::Thin.check(&device.scene, device.time_s) {
        let mut frame = FrameReference::unlit(exact, device.time_s)?;
        // The device's light and slopes are those behind the air.
        frame.slopes.clone_from(&device.slopes);
        frame.sky = None;
        if exact.has_light_of_cells() {
            frame.cells = FrameReference::new(exact, device.time_s)?.cells;
        }
        let found = Drawing::new(device, exact, &frame, &pixels).compare(None);
        let reason = found.reason.or(Some(format!("the light is not checked: {error}")));
        let seconds = begin.elapsed().as_secs_f64();
        return Ok(Check { reason, seconds, ..found });
    }
    let cached = plan.folder.map(|folder| cache::path(folder, exact, device.time_s, &pixels));
    // The kept file has neither light of cells nor places of facets.
    let cached = cached.filter(|_| !exact.has_light_of_cells() && !exact.has_haze());
    let kept = cached.as_deref().and_then(|path| cache::read(path, exact.n_facets()));
    let from_cache = kept.is_some();
    let mut found = match kept {
        Some(light) => {
            let slopes = light.slopes.clone();
            let frame = FrameReference { slopes, ..FrameReference::unlit(exact, device.time_s)? };
            let drawing = Drawing::new(device, exact, &frame, &pixels);
            drawing.compare(Some(&light))
        }
        None => FrameReference::with_second(exact, device.time_s, |frame, second| {
            let drawing = Drawing::new(device, exact, frame, &pixels);
            let light = Light::compute(frame, &drawing.plan, second, plan.budget);
            if let Some(path) = &cached {
                cache::write(path, &light);
            }
            drawing.compare(Some(&light))
        })?,
    };
    found.seconds = begin.elapsed().as_secs_f64();
    found.from_cache = from_cache;
    Ok(found)
}

/// A device's picture beside the same frame in f64.
struct Drawing<'a> {
    device: &'a DevicePicture,
    exact: &'a Scene,
    frame: &'a FrameReference,
    pixels: &'a Pixels,
    emitters: Emitters,
    shares: Vec<PixelShares>,
    plan: Plan,
}

impl<'a> Drawing<'a> {
    fn new(
        device: &'a DevicePicture,
        exact: &'a Scene,
        frame: &'a FrameReference,
        pixels: &'a Pixels,
    ) -> Drawing<'a> {
        let emitters = Emitters::new(exact, frame);
        let shares = pixel_shares(exact, frame, &emitters, pixels);
        let has_second = exact.lighting.mode == LightingMode::TwoReflection;
        let plan = if has_second { Plan::new(&shares) } else { Plan::default() };
        Drawing { device, exact, frame, pixels, emitters, shares, plan }
    }

    /// Compares the picture with the frame in `light`. Without one, the device's light counts as
    /// right.
    fn compare(&self, light: Option<&Light>) -> Check {
        let Drawing { device, exact, frame, pixels, .. } = *self;
        let is_lit = exact.lighting.mode != LightingMode::None;
        let by_device: Vec<[DVec3; 2]> =
            device.light.iter().map(|l| l.map(|l| DVec3::from(l.map(f64::from)))).collect();
        let hazed = || device.hazed.iter().map(|l| DVec3::from(l.map(f64::from))).collect();
        let radiance: Vec<DVec3> = match is_lit {
            true if !device.hazed.is_empty() => hazed(),
            true => by_device.iter().map(|[first, second]| *first + *second).collect(),
            false => Emitters::radiance(exact, frame),
        };
        let drawn: Vec<[f64; 4]> = self.shares.iter().map(|s| s.color(&radiance)).collect();
        let emitters = (&self.emitters, &radiance[..]);
        let (as_set, bounds) =
            drawn_by_settings(&device.scene, frame, emitters, pixels, DVec2::ZERO);
        let allowed = bound::allowed(&device.scene, frame, emitters, pixels, &as_set);
        let drawing =
            bound::drawing(&device.scene, &device.rgba, &as_set, &sums(&bounds, &allowed));
        let settings_rms = rms(&differences(&as_set, &drawn));
        // The light as it is shown behind the air.
        let seen = light.filter(|_| !device.hazed.is_empty()).map(|light| {
            let shown = by_device.iter().zip(&radiance).enumerate();
            let of_device = shown.map(|(i, ([_, second], shown))| {
                let through = frame.air_before(i).through;
                [*shown - through * *second, through * *second]
            });
            (of_device.collect::<Vec<_>>(), light.behind(|i| frame.air_before(i)))
        });
        let (by_device, light) = match &seen {
            Some((of_device, behind)) => (of_device, Some(behind)),
            None => (&by_device, light),
        };
        let light_found = match light {
            Some(light) => light::compare(&self.shares, &self.plan, by_device, light),
            None => vec![None; self.shares.len()],
        };
        let light_bound = light.filter(|_| is_lit).map(|light| {
            let of = (exact, device.time_s, light.grid_error);
            bound::light(of, &self.shares, by_device)
        });
        let off = differences(&device.rgba, &drawn);
        let samples: Vec<Samples> = light_found
            .iter()
            .zip(&off)
            .map(|(found, drawing)| Samples::new(*drawing, *found))
            .collect();
        let reference: Vec<[f64; 4]> = device
            .rgba
            .iter()
            .zip(&samples)
            .map(|(rgba, s)| std::array::from_fn(|k| rgba[k] - s.difference()[k]))
            .collect();
        let rmse = rmse_of(pixels, &samples, light.map_or(0.0, Light::own_error));
        let light_rms = light::rms(&light_found);
        let mut check = Check {
            verdict: CheckVerdict::Right,
            frame: Some(device.i_frame),
            n_pixels: pixels.at.len(),
            max: Some(samples.iter().map(Samples::greatest).fold(0.0, f64::max)),
            magnitude: Some(rms(&reference)),
            drawing: Some(drawing),
            settings_rms: Some(settings_rms),
            light: light_bound.map(|bound| Bounded { rms: light_rms, bound }),
            n_second: light.map_or(0, Light::n_second),
            is_light_whole: light.is_some_and(|light| self.plan.is_whole(light)),
            rmse,
            ..Check::none("")
        };
        check.reason = reason(&check);
        if check.reason.is_some() {
            check.verdict = CheckVerdict::Wrong;
        }
        // JSON has neither NaN nor infinity.
        let is_finite = |rms: f64, bound: f64| rms.is_finite() && bound.is_finite();
        check.drawing = check.drawing.filter(|d| is_finite(d.rms, d.bound));
        check.light = check.light.filter(|l| is_finite(l.rms, l.bound));
        for of in [&mut check.max, &mut check.magnitude, &mut check.settings_rms] {
            *of = of.filter(|v| v.is_finite());
        }
        check
    }
}

/// Returns what is wrong with a picture; none if it is right.
fn reason(check: &Check) -> Option<String> {
    if check.rmse.is_none() {
        return Some("a number of the picture is not finite".to_owned());
    }
    let beyond = |of: &Option<Bounded>, what: &str| {
        // NaN is beyond every bound.
        let is_right = |of: &Bounded| of.rms <= of.bound;
        let wrong = of.filter(|of| !is_right(of));
        wrong.map(|of| format!("{what} by {:.2e}, and {:.2e} is right", of.rms, of.bound))
    };
    let of_drawing = check.drawing.filter(|d| d.n_beyond > d.most_beyond);
    let of_drawing = of_drawing.map(|d| {
        format!(
            "{} of {} pixels differ from their light drawn in f64 by more than rounding, and {} \
             may (root mean square {:.2e})",
            d.n_beyond, d.n_shown, d.most_beyond, d.rms
        )
    });
    let is_rough = check.drawing.map(|d| Bounded { rms: d.rms, bound: d.bound });
    beyond(&check.light, "its light differs from that in f64")
        .or(of_drawing)
        .or_else(|| beyond(&is_rough, "it differs from its light drawn in f64"))
}
