//! WRF's variables that clouds are made of: their names, units and meaning.

use super::container::{Checked, number};
use super::netcdf::NetCdf;
use super::wrf_fields::{Extent, Field};
use crate::model::weather::extinction::{ICE, LIQUID, Phase, SNOW};
use crate::model::weather::grid::Shape;

/// MP_PHYSICS of WSM3, whose cloud water is ice where it is cold.
const SINGLE_MOMENT_SCHEME: f64 = 3.0;

const PASCAL: &[(&str, f64)] = &[("Pa", 1.0)];
const KELVIN: &[(&str, f64)] = &[("K", 1.0)];
const GEOPOTENTIAL: &[(&str, f64)] = &[("m2 s-2", 1.0), ("m2/s2", 1.0), ("m**2 s**-2", 1.0)];
const RATIO: &[(&str, f64)] = &[
    ("kg kg-1", 1.0),
    ("kg/kg", 1.0),
    ("kg kg**-1", 1.0),
    ("g kg-1", 1e-3),
    ("g/kg", 1e-3),
    ("g kg**-1", 1e-3),
];
const METRE: &[(&str, f64)] = &[("m", 1.0)];
const DEGREE: &[(&str, f64)] = &[
    ("degree_north", 1.0),
    ("degree_east", 1.0),
    ("degrees_north", 1.0),
    ("degrees_east", 1.0),
    ("degree", 1.0),
];
const SPEED: &[(&str, f64)] = &[("m s-1", 1.0), ("m/s", 1.0), ("m s**-1", 1.0)];
/// Units of map factors, for which WRF writes none or a blank.
const NO_UNIT: &[(&str, f64)] = &[("1", 1.0)];

/// Mixing ratios of the condensate that clouds are made of, and its phase.
const CLOUDS: [(&str, Phase); 3] = [("QCLOUD", LIQUID), ("QICE", ICE), ("QSNOW", SNOW)];
/// Mixing ratios of precipitation, which are left out: large drops have little extinction for their
/// mass.
const LEFT_OUT: [&str; 3] = ["QRAIN", "QGRAUP", "QHAIL"];

/// Variables that clouds are made of.
pub struct Fields {
    pub p: Field,
    pub pb: Field,
    pub t: Field,
    pub ph: Field,
    pub phb: Field,
    pub vapour: Option<Field>,
    pub condensates: Vec<(Field, Phase)>,
    pub factors: [Option<Field>; 2],
    /// A fault of this variable is reported only when the ground is asked for.
    pub terrain: Checked<Option<Field>>,
    /// U and V, whose faults are reported only when the winds are asked for.
    pub winds: Checked<Option<[Field; 2]>>,
    pub latitude: Option<Field>,
    pub longitude: Option<Field>,
    /// Whether cloud water is ice where it is cold: WSM3 without QICE.
    pub is_single_moment: bool,
}

impl Fields {
    /// Finds the variables and checks their shapes and units. Notes on conversions and on missing
    /// variables go to `notes`.
    pub fn find(
        file: &NetCdf,
        shape: Shape,
        n_steps: usize,
        notes: &mut Vec<String>,
    ) -> Checked<Self> {
        let optional = |name, extent, units| Field::find(file, name, extent, units, shape, n_steps);
        let needed = |name: &'static str, extent, units| {
            optional(name, extent, units)?.ok_or_else(|| format!("variable {name} is missing"))
        };
        let vapour = optional("QVAPOR", Extent::Cells, RATIO)?;
        if vapour.is_none() {
            notes.push("QVAPOR is missing: the air is taken to be dry".to_owned());
        }
        let mut condensates = Vec::new();
        for (name, phase) in CLOUDS {
            match optional(name, Extent::Cells, RATIO)? {
                Some(field) => condensates.push((field, phase)),
                None => notes.push(format!("{name} is missing")),
            }
        }
        let has = |name: &str| condensates.iter().any(|(field, _)| field.name == name);
        let scheme = number(&file.attributes, "MP_PHYSICS");
        let is_single_moment =
            scheme == Some(SINGLE_MOMENT_SCHEME) && has("QCLOUD") && !has("QICE");
        if is_single_moment {
            notes.push("MP_PHYSICS is 3: QCLOUD is ice below 273.15 K".to_owned());
        }
        if condensates.is_empty() {
            notes.push("clouds are diagnosed from relative humidity".to_owned());
        }
        for field in condensates
            .iter()
            .map(|(field, _)| field)
            .chain(&vapour)
            .filter(|field| field.scale != 1.0)
        {
            notes.push(format!("{} is in g/kg: converted", field.name));
        }
        for name in LEFT_OUT.into_iter().filter(|name| file.variable(name).is_some()) {
            notes.push(format!("{name} is left out: precipitation, not cloud"));
        }
        let factor = |names: [&'static str; 2]| -> Checked<Option<Field>> {
            for name in names {
                if let Some(field) = optional(name, Extent::Columns, NO_UNIT)? {
                    return Ok(Some(field));
                }
            }
            Ok(None)
        };
        let factors = [factor(["MAPFAC_MX", "MAPFAC_M"])?, factor(["MAPFAC_MY", "MAPFAC_M"])?];
        if factors.iter().any(Option::is_none) {
            notes.push("map factors are missing: cells are as large as DX and DY".to_owned());
        }
        let winds = optional("U", Extent::EastFaces, SPEED).and_then(|u| {
            Ok(u.zip(optional("V", Extent::NorthFaces, SPEED)?).map(<[Field; 2]>::from))
        });
        Ok(Fields {
            p: needed("P", Extent::Cells, PASCAL)?,
            pb: needed("PB", Extent::Cells, PASCAL)?,
            t: needed("T", Extent::Cells, KELVIN)?,
            ph: needed("PH", Extent::Levels, GEOPOTENTIAL)?,
            phb: needed("PHB", Extent::Levels, GEOPOTENTIAL)?,
            vapour,
            condensates,
            factors,
            terrain: optional("HGT", Extent::Columns, METRE),
            winds,
            latitude: optional("XLAT", Extent::Columns, DEGREE)?,
            longitude: optional("XLONG", Extent::Columns, DEGREE)?,
            is_single_moment,
        })
    }
}
