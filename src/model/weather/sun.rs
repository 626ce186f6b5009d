//! Position of the sun by the low-precision formulas of the Astronomical Almanac, accurate to 0.01°
//! from 1950 to 2050, without refraction and parallax.
//!
//! *Source*: Michalsky, "The Astronomical Almanac's algorithm for approximate solar position
//! (1950–2050)", Solar Energy 40 (1988).

use glam::DVec3;

/// J2000.0, 2000-01-01 12:00 UT, in days from 1970-01-01.
const J2000_DAYS: f64 = 10_957.5;

/// Returns right ascension and declination, radians, at `time_s` (seconds from 1970-01-01, UTC).
fn equatorial(time_s: f64) -> (f64, f64) {
    let n = time_s / 86_400.0 - J2000_DAYS;
    let longitude = 280.460 + 0.985_647_4 * n;
    let anomaly = (357.528 + 0.985_600_3 * n).to_radians();
    let ecliptic = (longitude + 1.915 * anomaly.sin() + 0.020 * (2.0 * anomaly).sin()).to_radians();
    let obliquity = (23.439 - 0.000_000_4 * n).to_radians();
    let ascension = (obliquity.cos() * ecliptic.sin()).atan2(ecliptic.cos());
    (ascension.rem_euclid(std::f64::consts::TAU), (obliquity.sin() * ecliptic.sin()).asin())
}

/// Returns the unit vector toward the sun, x east, y up, z south, from `latitude` and `longitude`
/// (radians, north and east positive).
pub fn toward(time_s: f64, latitude: f64, longitude: f64) -> DVec3 {
    let (ascension, declination) = equatorial(time_s);
    let n = time_s / 86_400.0 - J2000_DAYS;
    let ut_hours = (time_s / 3600.0).rem_euclid(24.0);
    let sidereal_hours = 6.697_375 + 0.065_709_824_2 * n + ut_hours;
    let hour_angle = (sidereal_hours * 15.0).to_radians() + longitude - ascension;
    let (sin_d, cos_d) = declination.sin_cos();
    let (sin_l, cos_l) = latitude.sin_cos();
    let (sin_h, cos_h) = hour_angle.sin_cos();
    let up = sin_d * sin_l + cos_d * cos_l * cos_h;
    let north = sin_d * cos_l - cos_d * sin_l * cos_h;
    DVec3::new(-cos_d * sin_h, up, -north).normalize()
}

#[cfg(test)]
mod tests {
    use super::super::steps::parse;
    use super::*;

    /// Returns the elevation above the horizon and the azimuth from north over east, degrees.
    fn angles(toward: DVec3) -> (f64, f64) {
        (toward.y.asin().to_degrees(), toward.x.atan2(-toward.z).to_degrees().rem_euclid(360.0))
    }

    #[test]
    fn published_places() {
        // Meeus, "Astronomical Algorithms", example 25.a: 1992 October 13, 0h TD: α = 198.38083°, δ
        // = −7.78507°.
        let (ascension, declination) = equatorial(parse("1992-10-13_00:00:00").unwrap());
        assert!((ascension.to_degrees() - 198.38083).abs() < 0.01, "{}", ascension.to_degrees());
        assert!((declination.to_degrees() + 7.78507).abs() < 0.01, "{}", declination.to_degrees());
        // Reda and Andreas 2004 (NREL/TP-560-34302), appendix A.5: 2003 October 17, 12:30:30 at UT
        // − 7 h, 39.742476° N, 105.1786° W: azimuth 194.34024°, elevation 39.872046° before
        // refraction, which 0.0016° of parallax is in.
        let (latitude, longitude) = (39.742476f64.to_radians(), (-105.1786f64).to_radians());
        let (elevation, azimuth) =
            angles(toward(parse("2003-10-17_19:30:30").unwrap(), latitude, longitude));
        assert!((azimuth - 194.34024).abs() < 0.02, "{azimuth}");
        assert!((elevation - 39.872046).abs() < 0.012, "{elevation}");
    }

    #[test]
    fn the_sun_rises_in_the_east() {
        let of_hour =
            |hour: &str| toward(parse(&format!("2005-03-20_{hour}:00:00")).unwrap(), 0.0, 0.0);
        // The equator at an equinox: east, overhead, west; the equation of time is 7.5 minutes,
        // 1.9°.
        assert!(of_hour("06").x > 0.99 && of_hour("12").y > 0.99 && of_hour("18").x < -0.99);
        // Noon in the northern winter is in the south, which is +z.
        let noon = toward(parse("2005-12-21_12:00:00").unwrap(), 50f64.to_radians(), 0.0);
        let (elevation, azimuth) = angles(noon);
        assert!(
            noon.z > 0.0
                && (azimuth - 180.0).abs() < 2.0
                && (elevation - (90.0 - 50.0 - 23.44)).abs() < 0.1
        );
        assert!((noon.length() - 1.0).abs() < 1e-15);
    }
}
