//! haze: the air between the eye and facets, in f64.
//!
//! In: places relative to the eye, light and its changes, the sky. Out: the light as the eye sees
//! it. Law: T L + A in closed form (model.md §19). The change inside of a blob belongs to the light
//! that comes through.

use glam::DVec3;

use crate::model::cover::Sea;
use crate::model::sky::{Haze, SkyView};

/// Returns the radiance of a facet at `offset` from the eye as it is seen, and the factor of its
/// relative change. `sea`: the sea that it is part of, and what arrives of the sun.
pub fn seen(
    view: &SkyView,
    offset: DVec3,
    radiance: DVec3,
    sea: Option<(Sea, f64)>,
) -> (DVec3, f64) {
    let haze = view.before(offset);
    let direction = offset.try_normalize().unwrap_or(DVec3::Y);
    let mirrored = sea.map(|(sea, sunlit)| view.in_sea(&sea, direction, sunlit));
    let sent = radiance + mirrored.unwrap_or_default();
    let (through, all) = (haze.through * sent, haze.over(sent));
    let sum = all.element_sum();
    (all, if sum > 0.0 { through.element_sum() / sum } else { 1.0 })
}

/// Bound of the rounding of a device's pixel, over the magnitudes that are added up.
///
/// Exponents of the dome are up to 12 and take (3 + 2 · 12) 2⁻²⁴, by Vulkan's precision of exp. Its
/// halo and the angle from the sun take as much, and some 40 products and sums take 2.4e-6. A
/// difference 1 − e^{−x} from x = 1e-2 on errs by 6e-6 of itself, which shows by 1/e in the depth.
/// All together are 8e-6.
pub const ROUNDING: f64 = 1e-5;

/// Returns the magnitudes that the radiance of the air in a unit direction is the sum of.
pub fn magnitude(view: &SkyView, direction: DVec3) -> DVec3 {
    let [a, b, c, d, e, f, g, h, i] = view.coefficients();
    let cos_sun = direction.dot(view.toward_sun());
    let (angle, up, square) = (cos_sun.clamp(-1.0, 1.0).acos(), direction.y.abs(), cos_sun.powi(2));
    let exp = |v: DVec3| v.map(f64::exp);
    let halo = (1.0 + square) / (1.0 + i * i - 2.0 * cos_sun * i).map(|v| v.powf(1.5));
    let of_height = 1.0 + (a * exp(b / (up + 0.01))).abs();
    let of_sun = c.abs()
        + (d * exp(e * angle)).abs()
        + (f * square).abs()
        + (g * halo).abs()
        + (h * up.sqrt()).abs();
    let taken = view.sky.taken_from_sea(up);
    view.scale() * of_height * of_sun / taken
}

/// Returns the bound of the rounding of a device's [`seen`].
pub fn rounding(view: &SkyView, offset: DVec3, radiance: DVec3, sea: Option<(Sea, f64)>) -> DVec3 {
    let direction = offset.normalize_or_zero();
    let air = magnitude(view, direction);
    let Haze { through, .. } = view.before(offset);
    let of_sea = sea.map(|(sea, sunlit)| sea_rounding(view, &sea, direction, sunlit));
    let mirrored = sea.map(|(sea, sunlit)| view.in_sea(&sea, direction, sunlit));
    let sent = radiance + mirrored.unwrap_or_default();
    ROUNDING * (sent + (1.0 - through + ROUNDING) * air) + through * of_sea.unwrap_or_default()
}

/// Returns the bound of the rounding of what a sea mirrors.
///
/// The dome has its own. The mirrored direction is off by some 1e-6, of which 2e-6 upward count.
///
/// In the glitter, the sum of two unit vectors errs by 2.4e-7, and the wave's slope by that over
/// the sum's height. By Schlick's power, the share that is mirrored errs by 5 times as much as the
/// slope. The exponent errs as the slope's square, and by 5e-7 of itself. All other factors err by
/// 1e-5.
pub fn sea_rounding(view: &SkyView, sea: &Sea, direction: DVec3, sunlit: f64) -> DVec3 {
    let toward_eye = -direction;
    if toward_eye.y <= 0.0 {
        return DVec3::ZERO;
    }
    let (mirrored, share) = sea.mirror(toward_eye);
    let turned = |by: f64| {
        let up = DVec3::new(mirrored.x, (mirrored.y + by).max(0.0), mirrored.z).normalize();
        view.sky.radiance(up)
    };
    let moved = (turned(1e-4) - turned(-1e-4)).abs() * (2e-6 / 2e-4);
    let of_sky = share * (2.0 * ROUNDING * magnitude(view, mirrored) + moved);
    let half = view.toward_sun() + toward_eye;
    let normal = half.normalize();
    let (slope, off) = ((1.0 / normal.y.powi(2) - 1.0).max(0.0).sqrt(), 2.4e-7 / half.y);
    let of_exponent = 2.0 * (2.0 * slope * off + off * off) / sea.slopes;
    // The cosine at the wave errs as its slope, and Schlick's law has 5 (1 − c)⁴ of that.
    let away = 1.0 - normal.dot(toward_eye).clamp(0.0, 1.0);
    let of_mirror = 5.0 * off * (1.0 / away.max(1e-9)).min(50.0);
    let relative = 2.0 * ROUNDING + 5e-7 * sea.exponent(normal) + of_exponent + of_mirror;
    of_sky + sunlit * sea.glitter(view.toward_sun(), toward_eye) * relative.exp_m1() * view.sun
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::sky::{Sky, SkySettings};

    fn view(haze: f64) -> SkyView {
        let settings = SkySettings { haze, ..SkySettings::of_turbidity(2.0) };
        let sky = Sky::new(settings, DVec3::new(0.6, 0.8, 0.0)).unwrap();
        SkyView::new(&sky, DVec3::ZERO, &[], &[], 0.0)
    }

    #[test]
    fn near_light_is_as_it_is_and_far_light_is_lost() {
        let light = DVec3::new(1.0, 2.0, 3.0);
        assert_eq!(seen(&view(0.0), DVec3::X * 1e6, light, None), (light, 1.0));
        let (near, share) = seen(&view(1.0), DVec3::X, light, None);
        assert!((near - light).length() < 1e-3 && share > 0.999);
        let (far, share) = seen(&view(1.0), DVec3::X * 1e7, light, None);
        assert!(share < 1e-9 && (far - view(1.0).behind(DVec3::X)).length() < 1e-9);
    }

    #[test]
    fn a_kilometre_of_level_air_by_hand() {
        // T = 2: molecules 0.008735 · 0.535^{-4.08} = 0.11196 over 8 km, aerosol (0.09216 −
        // 0.04586) · 0.535^{-1.3} = 0.10440 over 1.2 km: 0.013995 + 0.087000 a kilometre.
        let haze = view(1.0).before(DVec3::X * 1000.0);
        assert!((haze.through.y - (-0.100_995f64).exp()).abs() < 1e-4, "{}", haze.through.y);
    }
}
