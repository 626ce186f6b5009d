//! How far a right picture may be from its reference.

use glam::{DVec2, DVec3};

use super::numbers::{differences, rms};
use crate::model::scene::{Impostors, Scene};
use crate::model::surface::Surface;
use crate::reference::picture::{Emitters, FrameReference, PixelShares, Pixels, drawn_by_settings};
use crate::timing::check::DrawingCheck;

/// Share of the first reflection by which a device's may differ. Transmittance through the density
/// grid, which the reference has too, errs by rounding alone: by up to some 10⁻⁵.
const FIRST: f64 = 1e-4;
/// The same of surfaces with lobes, which devices read from a table.
const FIRST_GLOSSY: f64 = 0.02;
/// The same of surfaces in the shade of clouds. The reference has the closed form in place of the
/// grid, whose cells blur the shadows' edges: with eight cells along the scene by 8 % in the mean.
const FIRST_SHADED: f64 = 0.5;
/// Share of the second reflection: the sum over facets differs from the integral over areas. Over
/// random rooms it does by 1 %, and by up to 5 % in extreme ones (docs/reference/measured.md).
const SECOND: f64 = 0.05;
/// Factor on the mean error of the density grid. Facets of clouds reflect light that has come
/// through the grid; the reference has the closed form in its place. The second reflection of 40
/// particles in eight cells errs by 4.6 times the mean error.
const LOCAL: f64 = 10.0;

/// Share of the shown pixels that may be beyond their bounds: the bounds hold for all blobs but the
/// narrowest.
const BEYOND: f64 = 0.01;
/// Pixels of a smaller picture, to one side, that shape a pixel: half of the six taps' reach of 3,
/// since the outer taps have little weight.
const TAPS: f64 = 1.5;

/// Compares a picture with that in f64, `as_set`, number by number.
pub fn drawing(
    scene: &Scene,
    rgba: &[[f64; 4]],
    as_set: &[[f64; 4]],
    bounds: &[[f64; 4]],
) -> DrawingCheck {
    let off = differences(rgba, as_set);
    let is_shown = |k: &usize| rgba[*k] != [0.0; 4] || as_set[*k] != [0.0; 4];
    let shown: Vec<usize> = (0..rgba.len()).filter(is_shown).collect();
    // NaN is beyond every bound.
    let is_within = |k: &usize| (0..4).all(|i| off[*k][i].abs() <= bounds[*k][i]);
    // The bounds of a smaller picture and of impostors are those of a smooth picture, so that they
    // hold in the mean only.
    let share = if reach(scene) > 0.0 { 1.0 } else { BEYOND };
    DrawingCheck {
        rms: rms(&off),
        bound: rms(bounds),
        n_shown: shown.len(),
        n_beyond: shown.iter().filter(|k| !is_within(k)).count(),
        most_beyond: (share * shown.len() as f64).ceil() as usize,
    }
}

/// Returns how many pixels to one side a pixel of a smaller picture, or of an impostor, stands for.
fn reach(scene: &Scene) -> f64 {
    let of_impostors = match scene.draw.impostors {
        Impostors::Off => 0.0,
        _ => scene.draw.impostor_error.ceil(),
    };
    let of_resolution = match scene.draw.resolution.divisor() {
        1 => 0.0,
        divisor => TAPS * f64::from(divisor),
    };
    of_resolution + of_impostors
}

/// Returns by how much each number may differ, beside rounding, where blobs are drawn in a smaller
/// picture or from impostors. Such a pixel stands for several, and the picture changes over them.
pub fn allowed(
    scene: &Scene,
    frame: &FrameReference,
    (emitters, radiance): (&Emitters, &[DVec3]),
    pixels: &Pixels,
    as_set: &[[f64; 4]],
) -> Vec<[f64; 4]> {
    let reach = reach(scene);
    let mut allowed = vec![[0.0; 4]; as_set.len()];
    if reach == 0.0 {
        return allowed;
    }
    for direction in [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y] {
        let shift = reach * direction;
        let (found, _) = drawn_by_settings(scene, frame, (emitters, radiance), pixels, shift);
        for ((most, here), there) in allowed.iter_mut().zip(as_set).zip(&found) {
            for k in 0..4 {
                most[k] = f64::max(most[k], (here[k] - there[k]).abs());
            }
        }
    }
    allowed
}

/// Returns the greatest root mean square difference of a right light, in the picture.
pub fn light(
    (scene, time_s, grid_error): (&Scene, f64, f64),
    shares: &[PixelShares],
    by_device: &[[DVec3; 2]],
) -> f64 {
    let share_of_second = SECOND + LOCAL * grid_error;
    let is_shaded = scene.n_particles() > 0;
    let of_surface = |surface: &Surface| {
        let material = scene.materials[surface.i_material].at(time_s);
        let share = match (is_shaded, material.ks == DVec3::ZERO) {
            (true, _) => FIRST_SHADED,
            (false, false) => FIRST_GLOSSY,
            (false, true) => FIRST,
        };
        std::iter::repeat_n(share, surface.n_facets() as usize)
    };
    let shares_of_first =
        scene.surfaces.iter().flat_map(of_surface).chain(std::iter::repeat(FIRST));
    let allowed = |([first, second], share): (&[DVec3; 2], f64)| {
        share * first.abs() + share_of_second * second.abs()
    };
    let light: Vec<DVec3> = by_device.iter().zip(shares_of_first).map(allowed).collect();
    let pixel = |s: &PixelShares| PixelShares { alpha: 0.0, ..s.clone() }.color(&light);
    rms(&shares.iter().map(pixel).collect::<Vec<_>>())
}
