//! Light of the sun at sea level through clear air.
//!
//! *Source*: Preetham, Shirley and Smits, "A Practical Analytic Model for Daylight", SIGGRAPH 1999,
//! appendix A.1 (air mass of Kasten, Rayleigh, Ångström's aerosol, ozone of 0.35 cm). Water vapour
//! and mixed gases absorb little of visible light and are left out. Colours by the fits of Wyman,
//! Sloan and Shirley, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions",
//! JCGT 2 (2013). Outside of the air the sun is a black body of 5778 K with 133.1 klx.

use glam::{DMat3, DVec3};

use super::units::{UNIT_LX, luminance};

/// Illuminance of the sun outside of the air, lx.
const OUTSIDE_LX: f64 = 133_100.0;
/// Temperature of the sun, K.
const SUN_K: f64 = 5778.0;
/// Second radiation constant, µm K.
const C2: f64 = 14_387.77;
/// Thickness of the ozone, cm.
const OZONE_CM: f64 = 0.35;

/// Wavelengths of the sums, µm: first, step, number.
const FIRST: f64 = 0.38;
const STEP: f64 = 0.005;
const N: u32 = 81;

/// Absorption of ozone from 0.45 to 0.76 µm in steps of 0.01 µm, cm⁻¹ (Preetham et al., table 2).
const OZONE: [f64; 32] = [
    0.003, 0.006, 0.009, 0.014, 0.021, 0.03, 0.04, 0.048, 0.063, 0.075, 0.085, 0.103, 0.12, 0.12,
    0.115, 0.125, 0.12, 0.105, 0.09, 0.079, 0.067, 0.057, 0.048, 0.036, 0.028, 0.023, 0.018, 0.014,
    0.011, 0.01, 0.009, 0.007,
];

/// Returns the vertical optical depth of the molecules of the air at a wavelength, µm.
pub fn molecules(wavelength: f64) -> f64 {
    0.008_735 * wavelength.powf(-4.08)
}

/// Returns the vertical optical depth of the aerosol at a wavelength, µm.
pub fn aerosol(turbidity: f64, wavelength: f64) -> f64 {
    (0.046_08 * turbidity - 0.045_86).max(0.0) * wavelength.powf(-1.3)
}

fn ozone(wavelength: f64) -> f64 {
    let at = (wavelength - 0.45) / 0.01;
    let i = at.floor().max(0.0) as usize;
    let of = |i: usize| if at < -0.5 { 0.0 } else { OZONE.get(i).copied().unwrap_or(0.0) };
    let share = (at - i as f64).clamp(0.0, 1.0);
    OZONE_CM * (of(i) * (1.0 - share) + of(i + 1) * share)
}

/// Returns how much more air light from `up`, the sine of the elevation, goes through than light
/// from the zenith (Kasten 1965).
fn air_mass(up: f64) -> f64 {
    let from_zenith = up.clamp(0.0, 1.0).acos().to_degrees();
    1.0 / (up.max(0.0) + 0.15 * (93.885 - from_zenith).powf(-1.253))
}

/// Returns the illuminance across the sun's light at an elevation whose sine is `up`, linear RGB,
/// scene units.
pub fn sunlight(up: f64, turbidity: f64) -> DVec3 {
    let mass = air_mass(up);
    let through = |l: f64| (-mass * (molecules(l) + aerosol(turbidity, l) + ozone(l))).exp();
    let outside = luminance(seen(|_| 1.0));
    // A very low sun is redder than sRGB holds.
    (seen(through) * (OUTSIDE_LX / UNIT_LX / outside)).max(DVec3::ZERO)
}

/// Returns the sun's colour behind something of that transmittance, linear RGB without a unit.
fn seen(through: impl Fn(f64) -> f64) -> DVec3 {
    let planck = |l: f64| l.powi(-5) / (C2 / (l * SUN_K)).exp_m1();
    let sum: DVec3 = (0..N)
        .map(|i| FIRST + STEP * f64::from(i))
        .map(|l| planck(l) * through(l) * matched(1000.0 * l))
        .sum();
    to_rgb() * sum
}

/// Returns the CIE 1931 colour matching functions at a wavelength, nm.
fn matched(l: f64) -> DVec3 {
    let lobe = |center: f64, below: f64, above: f64| {
        let t = (l - center) / if l < center { below } else { above };
        (-0.5 * t * t).exp()
    };
    DVec3::new(
        1.056 * lobe(599.8, 37.9, 31.0) + 0.362 * lobe(442.0, 16.0, 26.7)
            - 0.065 * lobe(501.1, 20.4, 26.2),
        0.821 * lobe(568.8, 46.9, 40.5) + 0.286 * lobe(530.9, 16.3, 31.1),
        1.217 * lobe(437.0, 11.8, 36.0) + 0.681 * lobe(459.0, 26.0, 13.8),
    )
}

/// XYZ to linear sRGB (IEC 61966-2-1).
fn to_rgb() -> DMat3 {
    DMat3::from_cols(
        DVec3::new(3.2406, -0.9689, 0.0557),
        DVec3::new(-1.5372, 1.8758, -0.2040),
        DVec3::new(-0.4986, 0.0415, 1.0570),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_air_mass_of_kasten() {
        assert!((air_mass(1.0) - 1.0).abs() < 1e-3);
        // Kasten 1965: 1.99 at 30°, 5.6 at 10°; the table has 37 at the horizon.
        assert!((air_mass(0.5) - 1.995).abs() < 0.01);
        assert!((air_mass(10f64.to_radians().sin()) - 5.6).abs() < 0.05);
        assert!((35.0..38.0).contains(&air_mass(0.0)), "{}", air_mass(0.0));
    }

    #[test]
    fn the_matching_functions_at_their_peaks() {
        // CIE 1931: ȳ = 1 at 555 nm, x̄ = 1.0622 at 600 nm, z̄ = 1.7721 at 445 nm; the fits are
        // within some percent of the peaks.
        assert!((matched(555.0).y - 1.0).abs() < 0.02);
        assert!((matched(600.0).x - 1.0622).abs() < 0.02);
        assert!((matched(445.0).z - 1.7721).abs() < 0.05);
    }

    #[test]
    fn full_sunlight_and_its_colours() {
        let lx = |up: f64, turbidity| UNIT_LX * luminance(sunlight(up, turbidity));
        // Clear air, the sun high: 100 klx, as textbooks have it.
        assert!((lx(60f64.to_radians().sin(), 2.5) - 100e3).abs() < 8e3);
        let steps: Vec<f64> = [90.0, 45.0, 20.0, 5.0, 1.0, 0.0].map(f64::to_radians).to_vec();
        let all: Vec<DVec3> = steps.iter().map(|a| sunlight(a.sin(), 3.0)).collect();
        // Lower suns are darker and redder.
        assert!(all.windows(2).all(|w| luminance(w[1]) < luminance(w[0])));
        assert!(all.windows(2).all(|w| w[1].z / w[1].x <= w[0].z / w[0].x), "{all:?}");
        assert!(all.iter().all(|rgb| rgb.min_element() >= 0.0));
        // Without air: 5778 K has x = 0.326, y = 0.335, so XYZ is (0.973, 1, 1.012) and RGB (1.111,
        // 0.975, 0.920).
        let outside = seen(|_| 1.0);
        assert!((outside / outside.y - DVec3::new(1.14, 1.0, 0.94)).abs().max_element() < 0.03);
    }

    #[test]
    fn ozone_is_interpolated() {
        assert!((ozone(0.60) - 0.35 * 0.125).abs() < 1e-12);
        assert!((ozone(0.605) - 0.35 * 0.1225).abs() < 1e-12);
        assert_eq!((ozone(0.38), ozone(0.9)), (0.0, 0.0));
    }
}
