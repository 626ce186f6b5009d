//! `plan.json`: what there is to do, cut into shards, each with a key that names its result.

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::json;
use sha2::{Digest, Sha256};

use super::{bench, cost, reference, study, synced};
use crate::error::{Error, Result};
use crate::frame::DeviceChoice;
use crate::io::scene_file::{self, LoadedScene};
use crate::io::text_file::{RECORD_LIMIT, read_result};
use crate::model::scene::Impostors;
use crate::timing::machine;

pub const SCHEMA_VERSION: u32 = 1;
pub const PLAN_FILE: &str = "plan.json";
/// Of a key's hex digits: 128 bits, so that no two of 10⁹ shards have the same by chance (10¹⁸/2¹²⁹
/// = 10⁻²¹).
const KEY_DIGITS: usize = 32;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    pub schema: u32,
    pub nimbus: String,
    pub revision: String,
    /// Digest of the sources that were built. What another build makes is another result.
    pub code: String,
    /// UTC, ISO 8601.
    pub date: String,
    pub command: Vec<String>,
    pub scene: SceneSource,
    /// Device of every run, by index or part of its name; each node's best where nobody said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<String>,
    pub work: Work,
    /// For whom the shards' seconds are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_for: Option<Class>,
    pub shards: Vec<Shard>,
}

/// Devices and processors that take the same time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Class {
    /// [`machine::Device::class`]
    pub device: String,
    /// [`machine::Cpu::class`]
    pub cpu: String,
}

/// What is drawn, and by which shaders.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneSource {
    /// Absolute: every node has to see it there.
    pub file: PathBuf,
    /// `key=value`, as `--set` has it.
    pub set: Vec<String>,
    pub seed: Option<u32>,
    /// SHA-256 of the resolved scene and of the files that it names.
    pub hash: String,
    /// Folder of shaders in place of the built-in ones.
    pub shaders: Option<PathBuf>,
    /// SHA-256 of all shaders.
    pub shaders_hash: String,
}

/// What is made of the scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Work {
    /// Pictures of frames `first` … `first + n − 1`.
    Frames { first: u32, n: u32, format: PictureFormat },
    /// An error study's configurations, and what `nimbus error` is told of it.
    Error { arguments: Vec<String>, configurations: Vec<String> },
    /// A sweep's cases, and what `nimbus bench` is told of it.
    Bench { arguments: Vec<String>, cases: Vec<String> },
    /// A picture in f64, in tiles and ranges of samples.
    Reference(reference::Cut),
}

impl Work {
    /// Its items: frames, or configurations or cases from 0.
    pub fn items(&self) -> Range<u64> {
        match self {
            Work::Frames { first, n, .. } => u64::from(*first)..u64::from(*first) + u64::from(*n),
            Work::Error { configurations, .. } => 0..configurations.len() as u64,
            Work::Bench { cases, .. } => 0..cases.len() as u64,
            Work::Reference(cut) => 0..cut.n_pieces(),
        }
    }

    /// What kind of work it is, as far as it takes other time than others.
    pub fn kind(&self) -> String {
        match self {
            Work::Frames { .. } => "frames".into(),
            Work::Error { .. } => "error study".into(),
            Work::Bench { .. } => "bench".into(),
            Work::Reference(cut) => format!("reference {}", cut.of),
        }
    }

    /// What an item is called.
    pub fn noun(&self) -> &'static str {
        match self {
            Work::Frames { .. } => "frames",
            Work::Error { .. } => "configurations",
            Work::Bench { .. } => "cases",
            Work::Reference(_) => "pieces",
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PictureFormat {
    Png,
    Exr,
}

impl PictureFormat {
    pub fn extension(self) -> &'static str {
        match self {
            PictureFormat::Png => "png",
            PictureFormat::Exr => "exr",
        }
    }
}

/// A part that is done at once, by one run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shard {
    pub index: usize,
    /// Hash of all that its result follows from; names the result's folder.
    pub key: String,
    /// Its part of the work: frames from `first`.
    pub first: u32,
    pub n: u32,
    /// What takes time in it, where that is known before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counted: Option<cost::Work>,
    /// What it will take, where the plan was made with a cost model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_s: Option<f64>,
}

impl Shard {
    pub fn items(&self) -> Range<u32> {
        self.first..self.first + self.n
    }
}

/// What a plan is made from.
#[derive(Debug, Clone)]
pub struct Wish {
    pub scene: PathBuf,
    pub set: Vec<String>,
    pub seed: Option<u32>,
    pub shaders: Option<PathBuf>,
    pub device: Option<String>,
    pub work: Work,
    /// Items of a shard, in the work's order: frames. Their sum is the work's.
    pub sizes: Vec<u32>,
    /// What takes time in each of those; nothing where it is not known.
    pub counted: Vec<cost::Work>,
    /// What each of those will take, s.
    pub predicted_s: Option<Vec<f64>>,
    /// On what.
    pub predicted_for: Option<Class>,
}

impl Plan {
    /// Of what is wished for, by this build, as the files are now.
    pub fn new(wish: Wish) -> Result<Plan> {
        let absolute =
            |path: &Path| std::path::absolute(path).map_err(|cause| Error::io(path, cause));
        let Wish {
            scene,
            set,
            seed,
            shaders,
            device,
            work,
            sizes,
            counted,
            predicted_s,
            predicted_for,
        } = wish;
        let mut source = SceneSource {
            file: absolute(&scene)?,
            set,
            seed,
            hash: String::new(),
            shaders: shaders.as_deref().map(absolute).transpose()?,
            shaders_hash: String::new(),
        };
        let loaded = source.load()?;
        check(&loaded, &work)?;
        source.hash = loaded.hash;
        source.shaders_hash = source.hash_shaders()?;
        let mut plan = Plan {
            schema: SCHEMA_VERSION,
            nimbus: env!("CARGO_PKG_VERSION").into(),
            revision: machine::revision().into(),
            code: env!("NIMBUS_CODE").into(),
            date: machine::utc_now(),
            command: std::env::args().collect(),
            scene: source,
            device,
            work,
            predicted_for,
            shards: Vec::new(),
        };
        let mut first = plan.work.items().start as u32;
        for (index, n) in sizes.into_iter().enumerate() {
            let key = plan.key(first, n);
            let predicted_s = predicted_s.as_ref().and_then(|all| all.get(index).copied());
            let counted = counted.get(index).copied();
            plan.shards.push(Shard { index, key, first, n, counted, predicted_s });
            first += n;
        }
        Ok(plan)
    }

    /// Of a shard's part: whatever changes the result changes it.
    fn key(&self, first: u32, n: u32) -> String {
        let SceneSource { hash, shaders_hash, .. } = &self.scene;
        let work = match &self.work {
            Work::Frames { format, .. } => json!({"kind": "frames", "format": format.extension()}),
            // What the items are called says what they are.
            work @ (Work::Error { .. } | Work::Bench { .. } | Work::Reference(_)) => json!(work),
        };
        let of = json!({
            "schema": SCHEMA_VERSION, "scene": hash, "shaders": shaders_hash, "code": self.code, "work": work,
            "first": first, "n": n,
        });
        let mut key = format!("{:x}", Sha256::digest(of.to_string()));
        key.truncate(KEY_DIGITS);
        key
    }

    /// Names of the files that `shard` makes, sorted; pictures of a study come on top.
    pub fn outputs(&self, shard: &Shard) -> Vec<String> {
        match &self.work {
            Work::Frames { format, .. } => shard.items().map(|i| output(i, *format)).collect(),
            Work::Error { .. } => study::FILES.map(str::to_owned).to_vec(),
            Work::Bench { .. } => bench::files(shard),
            Work::Reference(_) => shard.items().map(reference::Cut::sums_file).collect(),
        }
    }

    /// Whether a result of `shard` has these files.
    pub fn are_outputs(&self, shard: &Shard, names: &[&str]) -> bool {
        let outputs = self.outputs(shard);
        match self.work {
            Work::Frames { .. } | Work::Reference(_) => outputs.iter().eq(names),
            Work::Error { .. } | Work::Bench { .. } => {
                outputs.iter().all(|name| names.contains(&name.as_str()))
            }
        }
    }

    /// Whether two results of a shard are the same: pictures are, times are not.
    pub fn is_exact(&self) -> bool {
        matches!(self.work, Work::Frames { .. } | Work::Reference(_))
    }

    pub fn shard(&self, index: usize) -> Result<&Shard> {
        self.shards.get(index).ok_or_else(|| {
            Error::usage(format!(
                "shard {index}: this plan has {}, expected 0 to {}",
                self.shards.len(),
                self.last()
            ))
        })
    }

    fn last(&self) -> usize {
        self.shards.len().saturating_sub(1)
    }

    /// The scene, if it is still what was planned and this is the build that planned it.
    pub fn scene_as_planned(&self) -> Result<LoadedScene> {
        let stale = |what: String| {
            Err(Error::usage(format!("the plan of {} is stale: {what}; plan again", self.date)))
        };
        let code = env!("NIMBUS_CODE");
        if self.code != code {
            let (theirs, ours) = (&self.revision, machine::revision());
            return stale(format!(
                "it was made by another build of nimbus ({theirs}, code {}; this is {ours}, \
                 code {code})",
                self.code
            ));
        }
        let loaded = self.scene.load()?;
        let file = self.scene.file.display();
        if loaded.hash != self.scene.hash {
            return stale(format!("{file} or a file that it names has changed since"));
        }
        if self.scene.hash_shaders()? != self.scene.shaders_hash {
            return stale("the shaders have changed since".to_owned());
        }
        Ok(loaded)
    }

    /// Reads and checks `plan.json` in `folder`.
    pub fn read(folder: &Path) -> Result<Plan> {
        let path = folder.join(PLAN_FILE);
        let text = read_result(&path, RECORD_LIMIT)?;
        let wrong = |cause: &dyn std::fmt::Display| {
            Error::io(&path, format!("not a plan of nimbus: {cause}"))
        };
        let value: serde_json::Value =
            serde_json::from_str(&text).map_err(|cause| wrong(&cause))?;
        match value.get("schema").and_then(serde_json::Value::as_u64) {
            Some(version) if version == u64::from(SCHEMA_VERSION) => {}
            Some(version) => {
                let what =
                    format!("a plan of schema {version}; this nimbus reads {SCHEMA_VERSION}");
                return Err(Error::io(&path, what));
            }
            None => return Err(wrong(&"it names no schema version")),
        }
        let plan: Plan = serde_json::from_value(value).map_err(|cause| wrong(&cause))?;
        plan.check_shards().map_err(|what| wrong(&what))?;
        Ok(plan)
    }

    /// That shards are what their keys say, and together the whole work.
    fn check_shards(&self) -> std::result::Result<(), String> {
        if let Work::Reference(cut) = &self.work {
            cut.check()?;
        }
        let Range { start: mut next, end } = self.work.items();
        for (i, shard) in self.shards.iter().enumerate() {
            if shard.index != i || u64::from(shard.first) != next || shard.n == 0 {
                return Err(format!("shard {i} does not begin where the one before it ends"));
            }
            next += u64::from(shard.n);
            if next > u64::from(u32::MAX) || shard.key != self.key(shard.first, shard.n) {
                return Err(format!("shard {i} is not what its key says"));
            }
        }
        if next == end {
            Ok(())
        } else {
            Err(format!("its shards end at {next}, its work at {end}"))
        }
    }

    /// Writes it into `folder`, which is made where it is not there; refuses to replace another
    /// plan's.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let path = folder.join(PLAN_FILE);
        let text = serde_json::to_string_pretty(self).map_err(|cause| Error::io(&path, cause))?;
        if text.len() as u64 >= RECORD_LIMIT {
            let n = self.shards.len();
            return Err(Error::limit(format!(
                "a plan of {n} shards is too large to be read again: expected fewer, longer ones"
            )));
        }
        let exists = "exists; a plan is not replaced: name another folder, or remove this one";
        if path.symlink_metadata().is_ok() {
            return Err(Error::io(&path, exists));
        }
        synced::make_folder(folder)?;
        synced::write_new(&path, format!("{text}\n").as_bytes())
    }
}

/// A frame's file. Names sort as the frames do.
pub fn output(i: u32, format: PictureFormat) -> String {
    format!("frame-{i:08}.{}", format.extension())
}

/// Whether a plan of frames makes files of this name.
pub fn is_output(name: &str) -> bool {
    let number = name
        .strip_prefix("frame-")
        .and_then(|rest| rest.strip_suffix(".png").or(rest.strip_suffix(".exr")));
    number.is_some_and(|digits| digits.len() >= 8 && digits.bytes().all(|b| b.is_ascii_digit()))
}

impl SceneSource {
    fn load(&self) -> Result<LoadedScene> {
        scene_file::load(&self.file, &self.set, self.seed)
    }

    fn hash_shaders(&self) -> Result<String> {
        let choice = DeviceChoice { shaders: self.shaders.clone(), ..DeviceChoice::default() };
        choice.sources().map(|sources| sources.hash())
    }
}

/// Refuses what cannot be cut: a frame has to follow from its number alone.
fn check(loaded: &LoadedScene, work: &Work) -> Result<()> {
    let (first, n) = match work {
        Work::Frames { first, n, .. } => (*first, *n),
        Work::Error { .. } | Work::Bench { .. } => return Ok(()),
        Work::Reference(cut) => return reference::check(cut, loaded),
    };
    if n == 0 || first.checked_add(n).is_none() {
        return Err(Error::usage(format!(
            "--frames: expected at least one, up to {}, found {n} from {first}",
            u32::MAX
        )));
    }
    let phases = loaded.phases.iter().map(|phase| &phase.scene);
    if std::iter::once(&loaded.scene)
        .chain(phases)
        .any(|scene| scene.draw.exact().impostors != Impostors::Off)
    {
        let what =
            "a frame with impostors shows what earlier frames have drawn, and no shard has those";
        return Err(Error::usage(format!(
            "{what}: expected draw.impostors = \"off\" (--set draw.impostors=off)"
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
