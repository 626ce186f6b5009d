//! `plan.json`: the work of a farm in shards, each with a key that names its result.

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use super::cost::Amounts;
use super::cut::{Cut, Part};
use super::manifest::Class;
use super::scene_source::SceneSource;
use super::work::AnyWork;
use crate::error::{Error, Result};
use crate::io::atomic;
use crate::io::process_info::command_line;
use crate::io::scene_file::LoadedScene;
use crate::io::text_file::RECORD_LIMIT;
use crate::timing::json::{self, ResultFile};
use crate::timing::machine;

/// Hexadecimal digits of a key: 128 bits, so that two of 10⁹ shards share a key with a probability
/// of 10¹⁸/2¹²⁹ = 10⁻²¹.
const KEY_DIGITS: usize = 32;
/// Digest of the sources of this build. Results of another build are other results.
const CODE: &str = env!("NIMBUS_CODE");

/// Work cut into shards, with all that its results follow from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Version of this form.
    pub schema: u32,
    /// Version of nimbus.
    pub nimbus: String,
    /// Git revision of the build.
    pub revision: String,
    /// Digest of the build's sources.
    pub code: String,
    /// Time of planning: UTC, ISO 8601.
    pub date: String,
    /// The command that made the plan.
    pub command: Vec<String>,
    /// The scene and shaders.
    pub scene: SceneSource,
    /// The device of every run, by index or part of its name. Without it each node uses its best.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<String>,
    /// The work on the scene.
    pub work: AnyWork,
    /// The hardware that the shards' seconds are predicted for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_for: Option<Class>,
    /// The parts, in the order of their items.
    pub shards: Vec<Shard>,
}

/// A part of the work that a single run does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shard {
    /// Its number in the plan.
    pub index: usize,
    /// A hash of all that its result follows from, and the name of the result's folder.
    pub key: String,
    /// Its first item.
    pub first: u32,
    /// The number of its items.
    pub n: u32,
    /// Amounts of what takes time in it, where they were computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counted: Option<Amounts>,
    /// Predicted duration, where a cost model was given, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_s: Option<f64>,
}

impl Shard {
    /// Returns the numbers of its items.
    pub fn items(&self) -> Range<u32> {
        self.first..self.first + self.n
    }
}

/// The input of a new plan.
#[derive(Debug, Clone)]
pub struct PlanRequest {
    /// The scene file.
    pub scene: PathBuf,
    /// Settings as `--set` takes them: `key=value`.
    pub set: Vec<String>,
    /// The seed of the first cloud, in place of the scene's own.
    pub seed: Option<u32>,
    /// The folder of shaders that replace the built-in ones.
    pub shaders: Option<PathBuf>,
    /// The device of every run.
    pub device: Option<String>,
    /// The work and its division into shards.
    pub cut: Cut,
}

impl ResultFile for Plan {
    const FILE: &'static str = "plan.json";
    const SCHEMA: u32 = 1;
}

impl Plan {
    /// Makes a plan for this build and the present content of all files.
    ///
    /// # Errors
    /// When the scene cannot be read or does not fit the work.
    pub fn new(request: PlanRequest) -> Result<Plan> {
        let PlanRequest { scene, set, seed, shaders, device, cut } = request;
        let (scene, loaded) = SceneSource::new(&scene, set, seed, shaders.as_deref())?;
        cut.work.check_scene(&loaded)?;
        let mut plan = Plan {
            schema: Plan::SCHEMA,
            nimbus: env!("CARGO_PKG_VERSION").into(),
            revision: machine::revision().into(),
            code: CODE.into(),
            date: machine::utc_now(),
            command: command_line(),
            scene,
            device,
            work: cut.work,
            predicted_for: cut.predicted_for,
            shards: Vec::new(),
        };
        let mut first = plan.work.items().start as u32;
        for (index, Part { n, counted, predicted_s }) in cut.parts.into_iter().enumerate() {
            let key = plan.key(first, n);
            plan.shards.push(Shard { index, key, first, n, counted, predicted_s });
            first += n;
        }
        Ok(plan)
    }

    /// Returns the key of the items `first` to `first + n − 1`. Whatever changes their results
    /// changes the key.
    fn key(&self, first: u32, n: u32) -> String {
        let of = json!({
            "schema": Plan::SCHEMA,
            "scene": self.scene.hash,
            "shaders": self.scene.shaders_hash,
            "code": self.code,
            "work": self.work.identity(),
            "first": first,
            "n": n,
        });
        let mut key = format!("{:x}", Sha256::digest(of.to_string()));
        key.truncate(KEY_DIGITS);
        key
    }

    /// Returns a shard by its number.
    ///
    /// # Errors
    /// When the plan has no such shard.
    pub fn shard(&self, index: usize) -> Result<&Shard> {
        self.shards.get(index).ok_or_else(|| {
            let (n, last) = (self.shards.len(), self.shards.len().saturating_sub(1));
            Error::usage(format!("shard {index}: this plan has {n}, expected 0 to {last}"))
        })
    }

    /// Loads the scene.
    ///
    /// # Errors
    /// When the plan is stale: made by another build, or of a scene or shaders that have changed.
    pub fn scene_as_planned(&self) -> Result<LoadedScene> {
        let loaded = if self.code == CODE {
            self.scene.reload()?
        } else {
            let (theirs, ours) = (&self.revision, machine::revision());
            Err(format!(
                "it was made by another build of nimbus ({theirs}, code {}; this is {ours}, \
                 code {CODE})",
                self.code
            ))
        };
        loaded.map_err(|what| {
            Error::usage(format!("the plan of {} is stale: {what}; plan again", self.date))
        })
    }

    /// Returns the plan as JSON. Each shard has, besides, the `arguments` of the `nimbus` that does
    /// it and the names of its files, `outputs`.
    ///
    /// # Errors
    /// When the plan has no form in JSON.
    pub fn to_json(&self, folder: &Path) -> Result<Value> {
        let mut value =
            serde_json::to_value(self).map_err(|cause| Error::io(folder, cause.to_string()))?;
        let shards = value.get_mut("shards").and_then(Value::as_array_mut);
        for (object, shard) in shards.into_iter().flatten().zip(&self.shards) {
            let (folder, index) = (folder.display().to_string(), shard.index.to_string());
            object["arguments"] = json!(["farm", "run", "--plan", folder, "--shard", index]);
            object["outputs"] = json!(self.work.outputs(shard.items()));
        }
        Ok(value)
    }

    /// Reads and checks `plan.json` in `folder`.
    ///
    /// # Errors
    /// When there is none, it has another schema, or its shards contradict their keys.
    pub fn read(folder: &Path) -> Result<Plan> {
        let path = folder.join(Plan::FILE);
        let plan: Plan = json::read(&path)?;
        plan.check().map_err(|what| Error::io(&path, format!("not a plan of nimbus: {what}")))?;
        Ok(plan)
    }

    /// Checks that the shards have the right keys and make up the whole work.
    fn check(&self) -> std::result::Result<(), String> {
        self.work.check()?;
        let Range { start: mut next, end } = self.work.items();
        for (i, shard) in self.shards.iter().enumerate() {
            if shard.index != i || u64::from(shard.first) != next || shard.n == 0 {
                return Err(format!("shard {i} does not begin where the one before it ends"));
            }
            next += u64::from(shard.n);
            if next > u64::from(u32::MAX) || shard.key != self.key(shard.first, shard.n) {
                return Err(format!("shard {i} does not match its key"));
            }
        }
        if next != end {
            return Err(format!("its shards end at {next}, its work at {end}"));
        }
        Ok(())
    }

    /// Writes the plan into `folder`, which is made if there is none.
    ///
    /// # Errors
    /// When the folder has a plan already, the plan is too large to be read again, or the file
    /// cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let path = folder.join(Plan::FILE);
        let text = json::text(&path, self)?;
        if text.len() as u64 > RECORD_LIMIT {
            let n = self.shards.len();
            return Err(Error::limit(format!(
                "a plan of {n} shards is too large to be read again; give each shard more items"
            )));
        }
        if path.symlink_metadata().is_ok() {
            let what = "exists; a plan is not replaced: name another folder, or remove this one";
            return Err(Error::io(&path, what));
        }
        atomic::make_folder(folder)?;
        atomic::write_new_synced(&path, text.as_bytes())
    }
}

#[cfg(test)]
mod tests;
