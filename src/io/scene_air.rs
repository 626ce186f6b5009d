//! The scene's air, and the clouds' bases in it (docs/model.md §4).

use serde_json::json;

use super::magnitude::{COORDINATE, DIVISOR, GREATEST, shortest};
use super::toml_section::{Bounds, Section};
use super::toml_tree::Value;
use crate::error::Result;
use crate::model::air::Air;
use crate::model::cloud::Cloud;
use crate::model::moisture::{Parcel, Saturation, T0_K, Vapour};

/// What the laws are made for, and more: colder, and Bolton's fit has little to do with water;
/// hotter, and it boils.
const CELSIUS: Bounds = Bounds::Within(-80.0, 60.0);
/// More than e is at 60 °C, 200 hPa: else the air would be vapour alone.
const HECTOPASCAL: Bounds = Bounds::Within(250.0, 2000.0);
/// Drier air has no clouds that a scene could hold.
const HUMIDITY: Bounds = Bounds::Within(0.001, 1.0);

pub fn read_air(root: &mut Section) -> Result<Air> {
    let mut s = root.section("air")?;
    s.expect_keys(
        &[
            "temperature_c",
            "humidity",
            "dew_point_c",
            "pressure_hpa",
            "saturation",
            "ice",
            "metres_per_unit",
            "ground",
        ],
        &[],
    )?;
    let fair = Air::FAIR;
    let t_k = T0_K + s.f64("temperature_c", fair.parcel.t_k - T0_K, CELSIUS)?;
    let law = Vapour {
        saturation: s.choice("saturation", "bolton", &Saturation::NAMES, &[])?,
        ice: s.bool("ice", fair.law.ice)?,
    };
    let humidity = match s.has("dew_point_c") {
        true => read_dew_point(&mut s, law, t_k)?,
        false => s.f64("humidity", fair.parcel.humidity, HUMIDITY)?,
    };
    let pressure_pa =
        100.0 * s.f64("pressure_hpa", fair.parcel.pressure_pa / 100.0, HECTOPASCAL)?;
    let air = Air {
        parcel: Parcel { t_k, pressure_pa, humidity },
        law,
        metres_per_unit: s.f64("metres_per_unit", fair.metres_per_unit, DIVISOR)?,
        ground: s.f64("ground", fair.ground, COORDINATE)?,
    };
    let base = air.base();
    if base.abs() > GREATEST {
        let what = format!(
            "puts the clouds' bases at {base:.3e}: expected at most {}",
            shortest(GREATEST)
        );
        return Err(s.fault("metres_per_unit", what));
    }
    root.record("air", s.finish());
    Ok(air)
}

/// f by the temperature at which the air would be saturated.
fn read_dew_point(s: &mut Section, law: Vapour, t_k: f64) -> Result<f64> {
    if s.has("humidity") {
        return Err(s.fault("humidity", "air has either a `humidity` or a `dew_point_c`, not both"));
    }
    let dew_c = s.f64("dew_point_c", 0.0, CELSIUS)?;
    let humidity = law.relative_humidity(law.saturation(T0_K + dew_c), t_k);
    match humidity {
        f if (0.001..=1.0).contains(&f) => Ok(f),
        f if f > 1.0 => {
            Err(s.fault("dew_point_c", format!("expected at most the temperature, found {dew_c}")))
        }
        f => Err(
            s.fault("dew_point_c", format!("makes a humidity of {f:.2e}: expected at least 0.001"))
        ),
    }
}

/// A height that a cloud's key `base` says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Base {
    None,
    /// Of the scene.
    At(f64),
    /// Where the air's parcel condenses.
    Condensation,
}

pub fn read_base(s: &mut Section) -> Result<Base> {
    let given = s.value("base").map(|node| &node.value);
    let base = match given {
        None => Base::None,
        Some(Value::String(text)) if text == "none" => Base::None,
        Some(Value::String(text)) if text == "lcl" => Base::Condensation,
        Some(value @ Value::String(_)) => {
            let found = value.describe();
            return Err(s.fault(
                "base",
                format!("expected {COORDINATE}, \"lcl\" or \"none\", found {found}"),
            ));
        }
        Some(_) => return Ok(Base::At(s.f64("base", 0.0, COORDINATE)?)),
    };
    s.record("base", json!(if base == Base::None { "none" } else { "lcl" }));
    Ok(base)
}

impl Base {
    pub fn height(self, air: &Air) -> Option<f64> {
        match self {
            Base::None => None,
            Base::At(y) => Some(y),
            Base::Condensation => Some(air.base()),
        }
    }
}

/// Moves `cloud` up or down, so that the lowest centres that its particles may have at time 0 are
/// at `base`.
pub fn put_on_base(cloud: &mut Cloud, base: f64) {
    let groups = cloud.groups(0, 0);
    let lows = groups.iter().filter(|g| g.n_particles > 0).map(|g| g.center.y - g.half_extent.y);
    if let Some(low) = lows.reduce(f64::min) {
        cloud.position.y = base - low;
    }
}
