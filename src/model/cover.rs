//! Covers of ground: one colour, land in patches, or a sea (model.md §16, §19).

use glam::{DVec2, DVec3};

use super::philox::{philox4x32_10, uniform};

/// Cover of ground.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Cover {
    /// The material's colour.
    #[default]
    Plain,
    /// Fields.
    Land(Land),
    /// Water that mirrors the sun and the sky.
    Sea(Sea),
}

impl Cover {
    /// Returns the sea, if it is one.
    pub fn sea(&self) -> Option<Sea> {
        match self {
            Cover::Sea(sea) => Some(*sea),
            _ => None,
        }
    }
}

/// Land in patches of one colour each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Land {
    /// Standard deviation of the brightness over its mean.
    pub contrast: f64,
    /// Mean distance of patches, scene units.
    pub length: f64,
}

/// A sea whose waves are those of a wind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sea {
    /// Mean square of the waves' slopes, over all directions.
    pub slopes: f64,
}

/// "land": a Philox stream of its own.
const STREAM: u32 = 0x6c61_6e64;
/// Deviation of the hue over that of the brightness.
const HUE: f64 = 0.15;
/// Change of the channels by the hue. Its sum weighted by luminance is near 0.
const TOWARD: DVec3 = DVec3::new(1.0, -0.2, -0.7);
/// Least brightness over the mean.
const DARKEST: f64 = 0.2;

impl Land {
    /// Returns the factor on K_d at a place of the scene. Its mean is 1 but for the cut at
    /// [`DARKEST`], and it takes K_d at most to 1.
    pub fn color_at(&self, place: DVec3, kd: DVec3) -> DVec3 {
        let [brightness, hue] = field_at(DVec2::new(place.x, place.z) / self.length);
        let factor = DVec3::ONE + self.contrast * (DVec3::splat(brightness) + HUE * hue * TOWARD);
        let most = (1.0 / kd.max_element().max(f64::MIN_POSITIVE)).max(1.0);
        factor.clamp(DVec3::splat(DARKEST), DVec3::splat(most))
    }
}

/// Returns two numbers of mean 0 and deviation 1 that are the same within a field. Fields are the
/// cells of the nearest of points, one in each unit square (Worley, "A Cellular Texture Basis
/// Function", 1996).
fn field_at(at: DVec2) -> [f64; 2] {
    let square = at.floor();
    let mut nearest = (f64::INFINITY, [0.0; 2]);
    for (i, k) in (0..9).map(|n| (n / 3, n % 3)) {
        let corner = square + DVec2::new(f64::from(i), f64::from(k)) - DVec2::ONE;
        let [x, z] = corner.to_array().map(|v| v as i64 as u32);
        let [a, b, c, d] = philox4x32_10([0, STREAM], [x, z, 0, 0]).map(uniform);
        let far = (corner + DVec2::new(a, b) - at).length_squared();
        if far < nearest.0 {
            // Uniform between −√3 and √3.
            nearest = (far, [c, d].map(|v| (2.0 * v - 1.0) * 3f64.sqrt()));
        }
    }
    nearest.1
}

impl Sea {
    /// Returns the sea under a wind. *Source*: Cox and Munk 1954, clean surface: 0.003 + 0.00512 W.
    pub fn of_wind(wind_m_s: f64) -> Sea {
        Sea { slopes: 0.003 + 0.00512 * wind_m_s }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_have_the_mean_and_the_contrast_that_they_are_given() {
        let land = Land { contrast: 0.2, length: 3.0 };
        let kd = DVec3::new(0.1, 0.2, 0.05);
        let all: Vec<DVec3> = (0..40_000)
            .map(|i| DVec3::new(f64::from(i % 200), 7.0, f64::from(i / 200)))
            .map(|place| land.color_at(place, kd))
            .collect();
        let n = all.len() as f64;
        let mean = all.iter().sum::<DVec3>() / n;
        let deviation = (all.iter().map(|c| (c.y - mean.y).powi(2)).sum::<f64>() / n).sqrt();
        assert!((mean - DVec3::ONE).abs().max_element() < 0.01, "{mean}");
        // √(1 + (0.15 · 0.2)²) · 0.2 in green.
        assert!((deviation - 0.2001).abs() < 0.01, "{deviation}");
        assert_eq!(land.color_at(DVec3::ZERO, kd), land.color_at(DVec3::Y * 99.0, kd));
        let strong = Land { contrast: 1.0, ..land };
        let bright = DVec3::splat(0.8);
        let all = (0..1000).map(|i| strong.color_at(DVec3::X * f64::from(i), bright));
        for color in all {
            assert!(
                color.min_element() >= DARKEST && (bright * color).max_element() <= 1.0 + 1e-12
            );
        }
    }

    #[test]
    fn waves_grow_with_the_wind() {
        // 10 m/s: a mean square slope of 0.0542.
        assert!((Sea::of_wind(10.0).slopes - 0.0542).abs() < 1e-12);
    }
}
