//! Table `[air]`, and the heights of clouds' bases in it (model.md §4).

use super::key::{Keys, keys, read_table};
use super::spec::{Spec, choice, flag, number, one_of};
use crate::error::Result;
use crate::io::bounds::{Bounds, COORDINATE, DIVISOR, GREATEST, rounded, shortest};
use crate::io::document::section::Section;
use crate::model::air::Air;
use crate::model::cloud::Cloud;
use crate::model::moisture::{Parcel, Saturation, T0_K, Vapour};

/// Range of temperatures, more than the laws are made for. Below it Bolton's fit has little to do
/// with water, and above it water boils.
const CELSIUS: Bounds = Bounds::Within(-80.0, 60.0);
/// Range of pressures, above the 200 hPa of saturated vapour at 60 °C: the air has to be more than
/// vapour.
const HECTOPASCAL: Bounds = Bounds::Within(250.0, 2000.0);
/// Range of relative humidity. The bases of drier air lie beyond any scene.
const HUMIDITY: Bounds = Bounds::Within(0.001, 1.0);

keys! { AIR: fn air(s, parcel: Parcel, law: Vapour) -> Air { Air;
    parcel => parcel;
    law => law;
    /// Length of a scene unit.
    metres_per_unit: number(250.0, DIVISOR), "m";
    /// Height of the ground, where the parcel starts.
    ground: number(0.0, COORDINATE), "unit";
}}

keys! {
    /// Temperature at the ground.
    TEMPERATURE: fn temperature_k(s) -> f64 = "temperature_c":
        number(20.0, CELSIUS).map(|t| T0_K + t), "°C";
}

keys! { VAPOUR: fn vapour(s) -> Vapour { Vapour;
    /// Law of the saturation vapour pressure: C's with constant latent heat, with linear latent
    /// heat, or Bolton's fit (1980, eq. 10).
    saturation: choice("bolton", &Saturation::NAMES);
    /// Whether saturation is over ice below 0 °C.
    ice: flag(false);
}}

keys! { PARCEL: fn parcel(s, t_k: f64, law: Vapour) -> Parcel { Parcel;
    t_k => t_k;
    /// Relative humidity at the ground.
    humidity: number(0.6, HUMIDITY) => |humidity| match s.has("dew_point_c") {
        true => from_dew_point(s, law, t_k),
        false => humidity.take(s, "humidity"),
    };
    /// Pressure at the ground.
    pressure_pa ["pressure_hpa"]: number(1013.25, HECTOPASCAL).map(|p| 100.0 * p), "hPa";
}}

// A default of NaN is none, and the key is read only where it is given.
keys! {
    /// Temperature at which the air would be saturated, in place of `humidity`.
    DEW_POINT: fn dew_point_c(s) -> f64 = "dew_point_c": number(f64::NAN, CELSIUS), "°C";
}

/// Keys of `[air]`.
pub const KEYS: [Keys; 5] = [TEMPERATURE, VAPOUR, PARCEL, DEW_POINT, AIR];

/// Reads `[air]`.
pub fn read_air(root: &mut Section) -> Result<Air> {
    read_table(root, "air", &KEYS, |s| {
        let (t_k, law) = (temperature_k(s)?, vapour(s)?);
        let parcel = parcel(s, t_k, law)?;
        let air = air(s, parcel, law)?;
        let base = air.base();
        if base.abs() <= GREATEST {
            return Ok(air);
        }
        let (base, most) = (rounded(base), shortest(GREATEST));
        let what = format!("puts the clouds' bases at {base}: expected at most {most}");
        Err(s.fault("metres_per_unit", what))
    })
}

/// Returns the relative humidity of air with the dew point that the table sets.
fn from_dew_point(s: &mut Section, law: Vapour, t_k: f64) -> Result<f64> {
    if s.has("humidity") {
        return Err(s.fault("humidity", "air has either a `humidity` or a `dew_point_c`, not both"));
    }
    let dew_c = dew_point_c(s)?;
    let humidity = law.relative_humidity(law.saturation(T0_K + dew_c), t_k);
    let what = match humidity {
        f if HUMIDITY.contains(f) => return Ok(f),
        f if f > 1.0 => format!("expected at most the temperature, found {dew_c}"),
        f => format!("makes a humidity of {f:.2e}: expected at least 0.001"),
    };
    Err(s.fault("dew_point_c", what))
}

/// Height that a cloud's key `base` sets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Base {
    /// None: the cloud stays where its position puts it.
    None,
    /// A height of the scene.
    At(f64),
    /// The height at which the air's parcel condenses.
    Condensation,
}

fn base_height() -> Spec<Base> {
    let words = [("lcl".into(), Base::Condensation), ("none".into(), Base::None)];
    one_of("none", words, Some(number(0.0, COORDINATE).map(Base::At)))
}

keys! {
    /// Height of the cloud's base: of the lowest centre of its particles at time 0, or of a disc,
    /// where particles condense. "lcl" is the height at which the air condenses.
    BASE: pub fn read_base(s) -> Base = "base": base_height(), "unit";
}

impl Base {
    /// Returns the height, scene units.
    pub fn height(self, air: &Air) -> Option<f64> {
        match self {
            Base::None => None,
            Base::At(y) => Some(y),
            Base::Condensation => Some(air.base()),
        }
    }
}

/// Moves `cloud` up or down, so that the lowest place that a particle's centre may have at time 0
/// is at `base`.
pub fn put_on_base(cloud: &mut Cloud, base: f64) {
    let groups = cloud.groups(0, 0);
    let lows = groups.iter().filter(|g| g.n_particles > 0).map(|g| g.center.y - g.half_extent.y);
    if let Some(low) = lows.reduce(f64::min) {
        cloud.position.y = base - low;
    }
}
