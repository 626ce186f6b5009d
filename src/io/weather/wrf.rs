//! WRF's output: which variables mean what, and a step of them as a grid with extinction
//! (docs/model.md §15).

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::container::{Container, number, text};
use super::netcdf;
use super::wrf_clock;
use super::wrf_fields::{Extent, Field, place};
use crate::error::{Error, Place, Result};
use crate::model::weather::air::{self, PRESSURES_PA, TEMPERATURES_K};
use crate::model::weather::diagnosed::{self, Air};
use crate::model::weather::extinction::{
    ICE, InvalidCounts, LIQUID, Phase, SNOW, add, single_moment_phase,
};
use crate::model::weather::grid::{Grid, Ground, Shape};

/// Cells of a step at most: 500 × 500 × 67. A step takes 40 bytes of memory a cell, and 12 more
/// while it is read: less than 1 GiB.
pub const MOST_CELLS: u64 = 1 << 24;
/// m; sizes of WRF's cells, from a large eddy to a globe's degree.
const SPACINGS_M: (f64, f64) = (1.0, 500_000.0);
/// m above sea level: no model's level lies beyond.
const HEIGHTS_M: (f64, f64) = (-1000.0, 200_000.0);
/// WSM3, whose cloud water is ice where it is cold.
const SINGLE_MOMENT_SCHEME: f64 = 3.0;

/// kg/kg: there is no more water than air.
const GREATEST_RATIO: f64 = 1.0;

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
/// Map factors have none, and WRF writes none or a blank.
const NO_UNIT: &[(&str, f64)] = &[("1", 1.0)];

/// Condensate that clouds are made of, and what of it is known.
const CLOUDS: [(&str, Phase); 3] = [("QCLOUD", LIQUID), ("QICE", ICE), ("QSNOW", SNOW)];
/// Precipitation, which falls out of clouds: large drops that take little light a gram.
pub const LEFT_OUT: [&str; 3] = ["QRAIN", "QGRAUP", "QHAIL"];
const NEEDED: [&str; 5] = ["P", "PB", "T", "PH", "PHB"];

/// Where the clouds come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clouds {
    /// The file's mixing ratios.
    Given,
    /// Relative humidity: the file has no cloud water.
    Diagnosed,
}

pub struct WeatherFile {
    container: Box<dyn Container>,
    path: PathBuf,
    pub shape: Shape,
    pub n_steps: usize,
    /// Seconds from 1970-01-01 UTC, rising; None of a single step without a time.
    pub times_s: Option<Vec<f64>>,
    pub spacing_m: (f64, f64),
    /// Without a map: MAP_PROJ is 0.
    pub is_idealised: bool,
    pub clouds: Clouds,
    /// What was taken otherwise than the file says, and what is not in it.
    pub notes: Vec<String>,
    fields: Fields,
}

struct Fields {
    p: Field,
    pb: Field,
    t: Field,
    ph: Field,
    phb: Field,
    vapour: Option<Field>,
    condensates: Vec<(Field, Phase)>,
    factors: [Option<Field>; 2],
    /// What is wrong with it is told to those who ask for it.
    terrain: std::result::Result<Option<Field>, String>,
    latitude: Option<Field>,
    longitude: Option<Field>,
    /// WSM3 without QICE: cloud water is ice where it is cold.
    is_single_moment: bool,
}

/// A moment of the file.
pub struct Step {
    pub grid: Grid,
    /// m⁻¹, a cell each.
    pub extinction: Vec<f64>,
    pub pressure_pa: Vec<f64>,
    pub temperature_k: Vec<f64>,
    /// kg/kg.
    pub vapour: Vec<f64>,
    /// Radians north and east in the domain's middle, which moves where a nest follows a storm;
    /// None of an idealised file, whose are 0.
    pub middle: Option<(f64, f64)>,
    pub oddities: InvalidCounts,
}

/// Opens a WRF file; no step is read.
///
/// # Errors
/// What is no WRF file, or one that clouds cannot be made of, and what was expected.
pub fn open(path: &Path) -> Result<WeatherFile> {
    from_container(Box::new(netcdf::open(path)?), path)
}

/// The same of a container that is open; `path` is its name in messages.
///
/// # Errors
/// As [`open`].
pub fn from_container(container: Box<dyn Container>, path: &Path) -> Result<WeatherFile> {
    understand(container, path).map_err(|what| Error::scene(Place::file(path), what))
}

fn understand(
    container: Box<dyn Container>,
    path: &Path,
) -> std::result::Result<WeatherFile, String> {
    let file = container.as_ref();
    let missing: Vec<&str> =
        NEEDED.into_iter().filter(|name| file.variable(name).is_none()).collect();
    if missing.len() == NEEDED.len() {
        let names: Vec<&str> = file.variables().iter().take(8).map(|v| v.name.as_str()).collect();
        return Err(format!(
            "not a WRF file: none of {} is in it; it has {}",
            NEEDED.join(", "),
            if names.is_empty() {
                "no variables".to_owned()
            } else {
                names.join(", ").escape_default().take(200).collect()
            }
        ));
    }
    if !missing.is_empty() {
        return Err(format!("{} missing: expected {} of WRF", list(&missing), NEEDED.join(", ")));
    }
    let (shape, n_steps) = shape_of(file)?;
    let spacing_m = (spacing(file, "DX")?, spacing(file, "DY")?);
    let is_idealised = number(file.attributes(), "MAP_PROJ") == Some(0.0);
    let mut notes = Vec::new();
    let fields = Fields::find(file, shape, n_steps, &mut notes)?;
    let clouds = if fields.condensates.is_empty() { Clouds::Diagnosed } else { Clouds::Given };
    if clouds == Clouds::Diagnosed && fields.vapour.is_none() {
        return Err(
            "QCLOUD, QICE, QSNOW and QVAPOR are missing: expected one of the first three, \
            or QVAPOR to diagnose clouds from"
                .to_owned(),
        );
    }
    let times_s = wrf_clock::times(file, n_steps)?;
    let path = path.to_owned();
    Ok(WeatherFile {
        container,
        path,
        shape,
        n_steps,
        times_s,
        spacing_m,
        is_idealised,
        clouds,
        notes,
        fields,
    })
}

/// "QICE is", "QICE and QSNOW are".
fn list(names: &[&str]) -> String {
    match names {
        [one] => format!("variable {one} is"),
        many => format!("variables {} are", many.join(", ")),
    }
}

/// Of P, which is on the cells' mass points.
fn shape_of(file: &dyn Container) -> std::result::Result<(Shape, usize), String> {
    let lengths: Vec<u64> = file
        .variable("P")
        .map(|v| v.dimensions.iter().map(|d| d.length).collect())
        .unwrap_or_default();
    let [n_steps, nz, ny, nx] = lengths[..] else {
        return Err(format!(
            "variable P: {} dimensions, expected Time, bottom_top, south_north and west_east",
            lengths.len()
        ));
    };
    let n_cells = [nz, ny, nx].into_iter().try_fold(1u64, u64::checked_mul);
    if n_steps == 0 || n_cells == Some(0) {
        return Err(format!(
            "variable P: {n_steps} steps of {nz} x {ny} x {nx} cells, expected at least one of each"
        ));
    }
    if n_cells.is_none_or(|n| n > MOST_CELLS) {
        return Err(format!(
            "variable P: {nz} x {ny} x {nx} cells, at most {MOST_CELLS} can be held"
        ));
    }
    if n_steps > wrf_clock::MOST_STEPS {
        return Err(format!(
            "variable P: {n_steps} steps, at most {} can be held",
            wrf_clock::MOST_STEPS
        ));
    }
    Ok((Shape { nx: nx as usize, ny: ny as usize, nz: nz as usize }, n_steps as usize))
}

fn spacing(file: &dyn Container, name: &str) -> std::result::Result<f64, String> {
    let expected = format!("expected metres from {} to {}", SPACINGS_M.0, SPACINGS_M.1);
    match number(file.attributes(), name) {
        Some(spacing) if (SPACINGS_M.0..=SPACINGS_M.1).contains(&spacing) => Ok(spacing),
        Some(spacing) => Err(format!("attribute {name} is {spacing}: {expected}")),
        None => Err(format!("attribute {name} is missing: {expected}")),
    }
}

fn condensates(
    file: &dyn Container,
    shape: Shape,
    n_steps: usize,
    notes: &mut Vec<String>,
) -> std::result::Result<Vec<(Field, Phase)>, String> {
    let mut found = Vec::new();
    for (name, phase) in CLOUDS {
        match Field::find(file, name, Extent::Cells, RATIO, shape, n_steps)? {
            Some(field) => found.push((field, phase)),
            None => notes.push(format!("{name} is missing")),
        }
    }
    Ok(found)
}

impl Fields {
    fn find(
        file: &dyn Container,
        shape: Shape,
        n_steps: usize,
        notes: &mut Vec<String>,
    ) -> std::result::Result<Self, String> {
        let optional = |name, extent, units| Field::find(file, name, extent, units, shape, n_steps);
        let needed = |name: &'static str, extent, units| {
            optional(name, extent, units)?.ok_or_else(|| format!("variable {name} is missing"))
        };
        let vapour = optional("QVAPOR", Extent::Cells, RATIO)?;
        if vapour.is_none() {
            notes.push("QVAPOR is missing: the air is taken to be dry".to_owned());
        }
        let condensates = condensates(file, shape, n_steps, notes)?;
        let has = |name: &str| condensates.iter().any(|(field, _)| field.name == name);
        let scheme = number(file.attributes(), "MP_PHYSICS");
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
        let factor = |names: [&'static str; 2]| -> std::result::Result<Option<Field>, String> {
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
            latitude: optional("XLAT", Extent::Columns, DEGREE)?,
            longitude: optional("XLONG", Extent::Columns, DEGREE)?,
            is_single_moment,
        })
    }
}

impl WeatherFile {
    /// The format, the variables and the attributes.
    pub fn container(&self) -> &dyn Container {
        self.container.as_ref()
    }

    /// The text of a global attribute.
    pub fn text(&self, name: &str) -> Option<&str> {
        text(self.container.attributes(), name)
    }

    /// SHA-256 of the whole file.
    ///
    /// # Errors
    /// Where it cannot be read.
    pub fn digest(&self) -> Result<[u8; 32]> {
        let lost = |e: std::io::Error| Error::Io { path: self.path.clone(), what: e.to_string() };
        let (mut from, mut hash) = (std::fs::File::open(&self.path).map_err(lost)?, Sha256::new());
        std::io::copy(&mut from, &mut hash).map_err(lost)?;
        Ok(hash.finalize().into())
    }

    /// Reads a step; the others are not touched.
    ///
    /// # Errors
    /// What of it is no weather: variable, step, and what was expected.
    pub fn step(&self, i_step: usize) -> Result<Step> {
        self.of_step(i_step, &|| self.read_step(i_step))
    }

    /// The columns at a step and the ground's height in each, HGT, m; None where the file has no
    /// HGT. Nothing else is read.
    ///
    /// # Errors
    /// As [`WeatherFile::step`].
    pub fn terrain(&self, i_step: usize) -> Result<Option<(Ground, Vec<f64>)>> {
        let read = |field: &Field| {
            let heights_m = field.read_whole(self.container.as_ref(), self.shape, i_step)?;
            within(&heights_m, HEIGHTS_M, "HGT", "m", self.shape, i_step)?;
            Ok((self.ground(i_step)?, heights_m))
        };
        self.of_step(i_step, &|| {
            self.fields.terrain.as_ref().map_err(Clone::clone)?.as_ref().map(read).transpose()
        })
    }

    fn of_step<T>(
        &self,
        i_step: usize,
        read: &dyn Fn() -> std::result::Result<T, String>,
    ) -> Result<T> {
        if i_step >= self.n_steps {
            return Err(Error::usage(format!(
                "step {i_step}: {} has steps 0 to {}",
                self.path.display(),
                self.n_steps - 1
            )));
        }
        read().map_err(|what| Error::scene(Place::file(&self.path), what))
    }

    fn read_step(&self, i_step: usize) -> std::result::Result<Step, String> {
        let (file, shape, fields) = (self.container.as_ref(), self.shape, &self.fields);
        let whole = |field: &Field| field.read_whole(file, shape, i_step);
        let grid = self.grid(i_step)?;
        let mut pressure_pa = whole(&fields.p)?;
        pressure_pa.iter_mut().zip(whole(&fields.pb)?).for_each(|(p, base)| *p += base);
        within(&pressure_pa, PRESSURES_PA, "P + PB", "Pa", shape, i_step)?;
        let mut temperature_k = whole(&fields.t)?;
        temperature_k.iter_mut().zip(&pressure_pa).for_each(|(t, p)| *t = air::temperature(*t, *p));
        within(
            &temperature_k,
            TEMPERATURES_K,
            "the temperature of T, P and PB",
            "K",
            shape,
            i_step,
        )?;
        let mut oddities = InvalidCounts::default();
        let vapour = match &fields.vapour {
            Some(field) => ratios(field.read(file, shape, i_step)?, &mut oddities),
            None => vec![0.0; shape.n_cells()],
        };
        let dry_density = |i: usize| air::dry_density(pressure_pa[i], temperature_k[i], vapour[i]);
        let extinction = match self.clouds {
            Clouds::Given => {
                let mut extinction = vec![0.0; shape.n_cells()];
                for (field, phase) in &fields.condensates {
                    let read = field.read(file, shape, i_step)?;
                    let is_both = fields.is_single_moment && field.name == "QCLOUD";
                    let phase_of = |i: usize| {
                        if is_both { single_moment_phase(temperature_k[i]) } else { *phase }
                    };
                    let odd = add(&mut extinction, &read, dry_density, phase_of, |ratio| {
                        ratio > GREATEST_RATIO
                    });
                    oddities.n_negative += odd.n_negative;
                    oddities.n_missing += odd.n_missing;
                }
                extinction
            }
            Clouds::Diagnosed => {
                let air = Air {
                    pressure_pa: &pressure_pa,
                    temperature_k: &temperature_k,
                    vapour: &vapour,
                };
                diagnosed::extinction(&grid, air)
            }
        };
        let middle = self.middle(i_step)?;
        Ok(Step { grid, extinction, pressure_pa, temperature_k, vapour, middle, oddities })
    }

    fn middle(&self, i_step: usize) -> std::result::Result<Option<(f64, f64)>, String> {
        let i_middle = self.shape.ny / 2 * self.shape.nx + self.shape.nx / 2;
        let at = |field: &Option<Field>, greatest: f64| match field {
            Some(field) => {
                let degrees = field.read(self.container.as_ref(), self.shape, i_step)?[i_middle];
                Ok((degrees.abs() <= greatest).then_some(degrees.to_radians()))
            }
            None => Ok::<_, String>(None),
        };
        let (latitude, longitude) =
            (at(&self.fields.latitude, 90.0)?, at(&self.fields.longitude, 360.0)?);
        Ok(latitude.zip(longitude).filter(|_| !self.is_idealised))
    }

    /// Where a step's columns are.
    fn ground(&self, i_step: usize) -> std::result::Result<Ground, String> {
        let (shape, fields) = (self.shape, &self.fields);
        let factors = |field: &Option<Field>| match field {
            Some(field) => field.read_whole(self.container.as_ref(), shape, i_step),
            None => Ok(vec![1.0; shape.n_columns()]),
        };
        let [mx, my] = [factors(&fields.factors[0])?, factors(&fields.factors[1])?];
        Ground::new(shape, self.spacing_m, (&mx, &my), self.is_idealised).map_err(|what| {
            format!("variables MAPFAC_M, MAPFAC_MX, MAPFAC_MY, step {i_step}: {what}")
        })
    }

    /// Where a step's cells are.
    fn grid(&self, i_step: usize) -> std::result::Result<Grid, String> {
        let (file, shape, fields) = (self.container.as_ref(), self.shape, &self.fields);
        let ground = self.ground(i_step)?;
        let mut heights_m = fields.ph.read_whole(file, shape, i_step)?;
        let base = fields.phb.read_whole(file, shape, i_step)?;
        heights_m.iter_mut().zip(base).for_each(|(h, base)| *h = air::height(*h + base));
        within(&heights_m, HEIGHTS_M, "the height of PH + PHB", "m", shape, i_step)?;
        Grid::new(ground, heights_m)
            .map_err(|what| format!("variables PH, PHB, step {i_step}: {what}"))
    }
}

/// Vapour: what is no ratio is 0 and counted.
fn ratios(mut read: Vec<f64>, oddities: &mut InvalidCounts) -> Vec<f64> {
    for ratio in &mut read {
        if ratio.is_nan() || *ratio > GREATEST_RATIO {
            oddities.n_missing += 1;
            *ratio = 0.0;
        } else if *ratio < 0.0 {
            oddities.n_negative += 1;
            *ratio = 0.0;
        }
    }
    read
}

fn within(
    numbers: &[f64],
    (least, greatest): (f64, f64),
    what: &str,
    unit: &str,
    shape: Shape,
    i_step: usize,
) -> std::result::Result<(), String> {
    match numbers.iter().position(|n| !(least..=greatest).contains(n)) {
        None => Ok(()),
        Some(i) => Err(format!(
            "step {i_step}: {what} is {} {unit} {}, expected {least} to {greatest}",
            numbers[i],
            place(shape, numbers.len(), i)
        )),
    }
}
