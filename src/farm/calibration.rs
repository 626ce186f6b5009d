//! A cost model with its calibration, as a file.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::cost::{Amounts, Fit, TimedRun, fit};
use super::journal;
use super::manifest::{Class, Manifest};
use super::work::Work;
use crate::error::{Error, Result};
use crate::timing::json::{self, ResultFile};
use crate::timing::machine::{self, Cpu, Device};

/// A fitted cost model, the hardware that it holds for, and the runs that it was fitted to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Version of this form.
    pub schema: u32,
    /// Version of nimbus.
    pub nimbus: String,
    /// Git revision of the build.
    pub revision: String,
    /// Time of calibration: UTC, ISO 8601.
    pub date: String,
    /// The device of all runs. The model holds for its class.
    pub device: Device,
    /// The processor of all runs. The model holds for its class.
    pub cpu: Cpu,
    /// The environment variables that affect times.
    pub environment: BTreeMap<String, String>,
    /// [`Work::kind`] of all runs.
    pub of: String,
    /// The model.
    pub fit: Fit,
    /// The runs.
    pub rows: Vec<Row>,
}

/// A run of a calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// The scene and the part of it that was run.
    pub what: String,
    /// Amounts and duration.
    pub timed: TimedRun,
}

impl ResultFile for Calibration {
    const FILE: &'static str = "calibration";
    const SCHEMA: u32 = 1;
}

impl Calibration {
    /// Fits a model to runs of one kind of work on the machine that `made` one of them.
    ///
    /// # Errors
    /// When the runs do not determine a model.
    pub fn new(of: String, rows: Vec<Row>, made: Manifest) -> Result<Calibration> {
        let runs: Vec<TimedRun> = rows.iter().map(|row| row.timed).collect();
        let Manifest { device, cpu, environment, .. } = made;
        Ok(Calibration {
            schema: Calibration::SCHEMA,
            nimbus: env!("CARGO_PKG_VERSION").into(),
            revision: machine::revision().into(),
            date: machine::utc_now(),
            device,
            cpu,
            environment,
            of,
            fit: fit(&runs).map_err(Error::usage)?,
            rows,
        })
    }

    /// Writes the calibration to a file.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        journal::write(path, self)
    }
}

impl fmt::Display for Calibration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let runs = if self.fit.n == 1 { "run" } else { "runs" };
        let (device, cpu) = (&self.device.name, &self.cpu.model);
        write!(f, "{} {runs} of {}, {device} ({cpu})\n{}", self.fit.n, self.of, self.fit)
    }
}

/// A cost model that was read from a file, whose name is in its errors.
#[derive(Debug, Clone)]
pub struct FileModel {
    file: PathBuf,
    calibration: Calibration,
}

impl FileModel {
    /// Reads the file of a calibration.
    ///
    /// # Errors
    /// When there is none, it has another schema, or its model is impossible.
    pub fn read(file: &Path) -> Result<FileModel> {
        let calibration: Calibration = json::read(file)?;
        let model = &calibration.fit.model;
        model.check().map_err(|what| Error::io(file, format!("not a calibration: {what}")))?;
        Ok(FileModel { file: file.to_owned(), calibration })
    }

    /// Refuses work of another kind than was timed.
    ///
    /// # Errors
    /// When the kinds differ.
    pub fn check(&self, work: &dyn Work) -> Result<()> {
        let (of, kind) = (&self.calibration.of, work.kind());
        if *of == kind {
            return Ok(());
        }
        Err(Error::io(&self.file, format!("it was calibrated by {of}; expected one of {kind}")))
    }

    /// Predicts the duration of some work with so many set-ups, s.
    ///
    /// # Errors
    /// When the work has an amount that was not measured.
    pub fn seconds(&self, setups: f64, work: &Amounts) -> Result<f64> {
        let seconds = self.calibration.fit.model.seconds(setups, work);
        seconds.map_err(|what| Error::io(&self.file, what))
    }

    /// Returns the hardware that the model holds for.
    pub fn class(&self) -> Class {
        Class::new(&self.calibration.device, &self.calibration.cpu)
    }
}
