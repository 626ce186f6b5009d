//! Output of WRF: the meaning of its variables, and a step of them as a grid with extinction
//! (model.md §15).

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::container::{Checked, Variable, number, text};
use super::netcdf::{self, NetCdf};
use super::wrf_clock;
use super::wrf_fields::{Extent, Field};
use super::wrf_variables::Fields;
use crate::error::{Error, Place, Result};
use crate::model::weather::air::{self, PRESSURES_PA, TEMPERATURES_K};
use crate::model::weather::diagnosed::{self, Air};
use crate::model::weather::extinction::{InvalidCounts, single_moment_phase};
use crate::model::weather::flow::Winds;
use crate::model::weather::grid::{Grid, Ground, Shape};

/// Most cells of a step: 500 × 500 × 67. A step takes 40 bytes of memory a cell, and 12 more
/// while it is read: less than 1 GiB. Winds take 16 bytes a cell, and 16 more while they are read.
pub const MOST_CELLS: u64 = 1 << 24;
/// Range of the sizes of cells, m: from large-eddy simulation to a degree of the globe.
const SPACINGS_M: (f64, f64) = (1.0, 500_000.0);
/// Range of the heights of levels, m above sea level.
const HEIGHTS_M: (f64, f64) = (-1000.0, 200_000.0);
/// Range of winds, m/s, faster than any on earth.
const SPEEDS: (f64, f64) = (-1000.0, 1000.0);

const NEEDED: [&str; 5] = ["P", "PB", "T", "PH", "PHB"];

/// Source of the clouds of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clouds {
    /// Mixing ratios of the file.
    Given,
    /// Relative humidity, in a file without cloud water.
    Diagnosed,
}

/// An open WRF file.
pub struct WeatherFile {
    /// The file, with its format, variables and attributes.
    pub container: NetCdf,
    path: PathBuf,
    /// Numbers of cells along each axis.
    pub shape: Shape,
    /// Number of steps.
    pub n_steps: usize,
    /// Times of the steps, s from 1970-01-01 UTC; `None` for a single step without a time.
    pub times_s: Option<Vec<f64>>,
    /// Sizes of cells to the east and to the north, DX and DY.
    pub spacing_m: (f64, f64),
    /// Whether the file is of an idealised case without a map: MAP_PROJ is 0.
    pub is_idealised: bool,
    /// Source of the clouds.
    pub clouds: Clouds,
    /// Notes on conversions and on variables that are missing.
    pub notes: Vec<String>,
    fields: Fields,
}

/// Weather at one step, with a number for each cell.
pub struct Step {
    /// Places of the cells.
    pub grid: Grid,
    /// Extinction of the clouds, m⁻¹.
    pub extinction: Vec<f64>,
    /// Pressure, temperature and vapour.
    pub air: Air,
    /// Latitude and longitude of the domain's middle, radians, which moves where a nest follows a
    /// storm; `None` for an idealised case.
    pub middle: Option<(f64, f64)>,
    /// Numbers of values that were no mixing ratio.
    pub oddities: InvalidCounts,
}

/// Opens a WRF file and reads no step.
///
/// # Errors
/// When the file is no WRF file or has no variables that clouds can be made of.
pub fn open(path: &Path) -> Result<WeatherFile> {
    from_container(netcdf::open(path)?, path)
}

/// Reads the declarations of an open container; `path` is its name in messages.
///
/// # Errors
/// As [`open`].
pub fn from_container(container: NetCdf, path: &Path) -> Result<WeatherFile> {
    understand(container, path).map_err(|what| Error::scene(Place::file(path), what))
}

fn understand(container: NetCdf, path: &Path) -> Checked<WeatherFile> {
    let file = &container;
    let missing: Vec<&str> =
        NEEDED.into_iter().filter(|name| file.variable(name).is_none()).collect();
    if missing.len() == NEEDED.len() {
        let names: Vec<&str> = file.variables.iter().take(8).map(|v| v.name.as_str()).collect();
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
    let (shape, n_steps) =
        shape_of(&file.variable("P").map(Variable::lengths).unwrap_or_default())?;
    let spacing_m = (spacing(file, "DX")?, spacing(file, "DY")?);
    let is_idealised = number(&file.attributes, "MAP_PROJ") == Some(0.0);
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

/// Returns "variable QICE is" or "variables QICE, QSNOW are".
fn list(names: &[&str]) -> String {
    match names {
        [one] => format!("variable {one} is"),
        many => format!("variables {} are", many.join(", ")),
    }
}

/// Returns the shape and the number of steps of P, which has a value for each cell, from the
/// lengths of its dimensions.
fn shape_of(lengths: &[u64]) -> Checked<(Shape, usize)> {
    let [n_steps, nz, ny, nx] = *lengths else {
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

fn spacing(file: &NetCdf, name: &str) -> Checked<f64> {
    let expected = format!("expected metres from {} to {}", SPACINGS_M.0, SPACINGS_M.1);
    match number(&file.attributes, name) {
        Some(spacing) if (SPACINGS_M.0..=SPACINGS_M.1).contains(&spacing) => Ok(spacing),
        Some(spacing) => Err(format!("attribute {name} is {spacing}: {expected}")),
        None => Err(format!("attribute {name} is missing: {expected}")),
    }
}

impl WeatherFile {
    /// Returns whether the file has water vapour.
    pub fn has_vapour(&self) -> bool {
        self.fields.vapour.is_some()
    }

    /// Returns the text of a global attribute.
    pub fn text(&self, name: &str) -> Option<&str> {
        text(&self.container.attributes, name)
    }

    /// Returns the SHA-256 of the whole file.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn digest(&self) -> Result<[u8; 32]> {
        let lost = |e: std::io::Error| Error::Io { path: self.path.clone(), what: e.to_string() };
        let (mut from, mut hash) = (std::fs::File::open(&self.path).map_err(lost)?, Sha256::new());
        std::io::copy(&mut from, &mut hash).map_err(lost)?;
        Ok(hash.finalize().into())
    }

    /// Reads a step.
    ///
    /// # Errors
    /// When a variable cannot be read or its numbers are not those of air.
    pub fn step(&self, i_step: usize) -> Result<Step> {
        self.of_step(i_step, &|| self.read_step(i_step))
    }

    /// Reads the columns at a step and the height of the ground in each (HGT, m). Returns `None` if
    /// the file has no HGT.
    ///
    /// # Errors
    /// As [`WeatherFile::step`].
    pub fn terrain(&self, i_step: usize) -> Result<Option<(Ground, Vec<f64>)>> {
        let read = |field: &Field| {
            let heights_m = field.read_whole(&self.container, self.shape, i_step)?;
            let what = (Extent::Columns, "HGT", "m");
            within(&heights_m, HEIGHTS_M, what, self.shape, i_step)?;
            Ok((self.ground(i_step)?, heights_m))
        };
        self.of_step(i_step, &|| {
            self.fields.terrain.as_ref().map_err(Clone::clone)?.as_ref().map(read).transpose()
        })
    }

    /// Returns whether the file has U and V, even if they are faulty: [`winds`](Self::winds) says
    /// why.
    pub fn has_winds(&self) -> bool {
        !matches!(self.fields.winds, Ok(None))
    }

    /// Reads the winds at a step, a velocity for each cell.
    ///
    /// # Errors
    /// As [`WeatherFile::step`], and if the file has none.
    pub fn winds(&self, i_step: usize) -> Result<Winds> {
        let read = |field: &Field| {
            let speeds = field.read_whole(&self.container, self.shape, i_step)?;
            within(&speeds, SPEEDS, (field.extent, field.name, "m/s"), self.shape, i_step)?;
            Ok::<_, String>(speeds)
        };
        self.of_step(i_step, &|| match self.fields.winds.as_ref().map_err(Clone::clone)? {
            Some([u, v]) => Ok(Winds::new(self.shape, &read(u)?, &read(v)?)),
            None => Err("variables U, V are missing: expected the winds of WRF".to_owned()),
        })
    }

    fn of_step<T>(&self, i_step: usize, read: &dyn Fn() -> Checked<T>) -> Result<T> {
        if i_step >= self.n_steps {
            return Err(Error::usage(format!(
                "step {i_step}: {} has steps 0 to {}",
                self.path.display(),
                self.n_steps - 1
            )));
        }
        read().map_err(|what| Error::scene(Place::file(&self.path), what))
    }

    fn read_step(&self, i_step: usize) -> Checked<Step> {
        let (file, shape, fields) = (&self.container, self.shape, &self.fields);
        let whole = |field: &Field| field.read_whole(file, shape, i_step);
        let grid = self.grid(i_step)?;
        let mut pressure_pa = whole(&fields.p)?;
        pressure_pa.iter_mut().zip(whole(&fields.pb)?).for_each(|(p, base)| *p += base);
        let what = (Extent::Cells, "P + PB", "Pa");
        within(&pressure_pa, PRESSURES_PA, what, shape, i_step)?;
        let mut temperature_k = whole(&fields.t)?;
        temperature_k.iter_mut().zip(&pressure_pa).for_each(|(t, p)| *t = air::temperature(*t, *p));
        let what = (Extent::Cells, "the temperature of T, P and PB", "K");
        within(&temperature_k, TEMPERATURES_K, what, shape, i_step)?;
        let mut oddities = InvalidCounts::default();
        let mut ratios = |field: &Field| -> Checked<Vec<f64>> {
            let mut ratios = field.read(file, shape, i_step)?;
            oddities.clear(&mut ratios);
            Ok(ratios)
        };
        let vapour = match &fields.vapour {
            Some(field) => ratios(field)?,
            None => vec![0.0; shape.n_cells()],
        };
        let air = Air { pressure_pa, temperature_k, vapour };
        let extinction = match self.clouds {
            Clouds::Given => {
                let mut extinction = vec![0.0; shape.n_cells()];
                for (field, phase) in &fields.condensates {
                    let is_both = fields.is_single_moment && field.name == "QCLOUD";
                    for (i, ratio) in ratios(field)?.into_iter().enumerate() {
                        let phase = if is_both {
                            single_moment_phase(air.temperature_k[i])
                        } else {
                            *phase
                        };
                        extinction[i] += phase.extinction(ratio, air.dry_density(i));
                    }
                }
                extinction
            }
            Clouds::Diagnosed => diagnosed::extinction(&grid, &air),
        };
        Ok(Step { grid, extinction, air, middle: self.middle(i_step)?, oddities })
    }

    fn middle(&self, i_step: usize) -> Checked<Option<(f64, f64)>> {
        let i_middle = self.shape.ny / 2 * self.shape.nx + self.shape.nx / 2;
        let at = |field: &Option<Field>, greatest: f64| match field {
            Some(field) => {
                let degrees = field.read(&self.container, self.shape, i_step)?[i_middle];
                Ok((degrees.abs() <= greatest).then_some(degrees.to_radians()))
            }
            None => Ok::<_, String>(None),
        };
        let (latitude, longitude) =
            (at(&self.fields.latitude, 90.0)?, at(&self.fields.longitude, 360.0)?);
        Ok(latitude.zip(longitude).filter(|_| !self.is_idealised))
    }

    /// Returns the places of a step's columns.
    fn ground(&self, i_step: usize) -> Checked<Ground> {
        let (shape, fields) = (self.shape, &self.fields);
        let factors = |field: &Option<Field>| match field {
            Some(field) => field.read_whole(&self.container, shape, i_step),
            None => Ok(vec![1.0; shape.n_columns()]),
        };
        let [mx, my] = [factors(&fields.factors[0])?, factors(&fields.factors[1])?];
        Ground::new(shape, self.spacing_m, (&mx, &my), self.is_idealised).map_err(|what| {
            format!("variables MAPFAC_M, MAPFAC_MX, MAPFAC_MY, step {i_step}: {what}")
        })
    }

    /// Returns the places of a step's cells.
    fn grid(&self, i_step: usize) -> Checked<Grid> {
        let (file, shape, fields) = (&self.container, self.shape, &self.fields);
        let ground = self.ground(i_step)?;
        let mut heights_m = fields.ph.read_whole(file, shape, i_step)?;
        let base = fields.phb.read_whole(file, shape, i_step)?;
        heights_m.iter_mut().zip(base).for_each(|(h, base)| *h = air::height(*h + base));
        let what = (Extent::Levels, "the height of PH + PHB", "m");
        within(&heights_m, HEIGHTS_M, what, shape, i_step)?;
        Grid::new(ground, heights_m)
            .map_err(|what| format!("variables PH, PHB, step {i_step}: {what}"))
    }
}

fn within(
    numbers: &[f64],
    (least, greatest): (f64, f64),
    (extent, what, unit): (Extent, &str, &str),
    shape: Shape,
    i_step: usize,
) -> Checked<()> {
    match numbers.iter().position(|n| !(least..=greatest).contains(n)) {
        None => Ok(()),
        Some(i) => Err(format!(
            "step {i_step}: {what} is {} {unit} {}, expected {least} to {greatest}",
            numbers[i],
            extent.place(shape, i)
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_memory_holds_is_refused() {
        assert_eq!(
            shape_of(&[1, 60_000, 60_000, 60_000]).unwrap_err(),
            "variable P: 60000 x 60000 x 60000 cells, at most 16777216 can be held"
        );
        assert!(shape_of(&[1, 1 << 40, 1 << 40, 1]).is_err());
        assert!(shape_of(&[wrf_clock::MOST_STEPS + 1, 1, 1, 1]).is_err());
        assert_eq!(shape_of(&[3, 2, 5, 7]), Ok((Shape { nx: 7, ny: 5, nz: 2 }, 3)));
    }
}
