//! The roofs of a device: its bandwidth and arithmetic, as `nimbus devices --roof` measured them,
//! and the share of them that a pass reaches.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::machine::{self, Cpu, Device};
use crate::error::Result;
use crate::frame::Work;
use crate::gpu::{DeviceInfo, cache_folder, hex};
use crate::io::atomic::write_atomic;

/// The measured roofs of a device.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Roofs {
    /// Version of this record and of the kernels that measure.
    pub schema: u32,
    /// Version of nimbus.
    pub nimbus: String,
    /// Start of the measurement, UTC, ISO 8601.
    pub date: String,
    /// Vulkan device.
    pub device: Device,
    /// Processor.
    pub cpu: Cpu,
    /// Environment variables that change what drivers do.
    pub environment: BTreeMap<String, String>,
    /// Bytes of the last cache level, or their bound.
    pub cache_bytes: u64,
    /// Time that the measurement took, in seconds.
    pub seconds: f64,
    /// The roofs.
    pub roofs: Vec<Roof>,
    /// The roofs that the device does not have, and why.
    pub absent: Vec<String>,
}

/// One roof.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Roof {
    /// What is done: "read", "write", "copy", "f32", "atomics, one address", and so on.
    pub name: String,
    /// How memory is accessed: "storage", "texels" or "transfer"; null for arithmetic.
    pub way: Option<String>,
    /// Bytes that are accessed again and again; null for arithmetic. A copy reads half of them.
    pub set_bytes: Option<u64>,
    /// "B/s" or "op/s". A copied byte counts twice, a multiply-add is two operations.
    pub unit: String,
    /// Number of samples.
    pub n: usize,
    /// Median rate.
    pub p50: f64,
    /// 5th percentile.
    pub p5: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Greatest rate. Noise only slows a sample down, so that this is the nearest to the roof.
    pub max: f64,
    /// Whether the samples agreed within the bound before the time was up.
    pub is_stable: bool,
}

/// The roofs that the times of passes are compared with, in a result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ceilings {
    /// Start of their measurement, UTC, ISO 8601.
    pub date: String,
    /// Bandwidths by the size of the data, the smallest first.
    pub bandwidths: Vec<Bandwidth>,
    /// Operations on 32-bit floats in a second.
    pub operations_per_s: f64,
}

/// The greatest bandwidth for data of some size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bandwidth {
    /// Bytes of the data.
    pub set_bytes: u64,
    /// Bytes in a second that are read, written or both.
    pub bytes_per_s: f64,
}

/// The name of the roof of 32-bit floats.
pub const F32: &str = "f32";
/// The unit of bandwidths.
pub const BYTES_PER_S: &str = "B/s";
/// The unit of arithmetic.
pub const OPERATIONS_PER_S: &str = "op/s";

impl Roofs {
    /// The version of the record and of the kernels that measure.
    pub const SCHEMA: u32 = 1;

    /// Returns the roofs that were measured on a device with this driver, environment and version
    /// of nimbus, if they were.
    pub fn kept(info: &DeviceInfo) -> Option<Roofs> {
        let text = fs::read_to_string(cache_folder("roofs")?.join(file(info))).ok()?;
        let roofs: Roofs = serde_json::from_str(&text).ok()?;
        (roofs.schema == Roofs::SCHEMA).then_some(roofs)
    }

    /// Keeps the roofs for later runs on `info`, the device that they are of.
    ///
    /// # Errors
    /// Fails if the cache folder cannot be written.
    pub fn keep(&self, info: &DeviceInfo) -> Result<()> {
        let Some(folder) = cache_folder("roofs") else { return Ok(()) };
        let path = folder.join(file(info));
        let text = super::json::text(&path, self)?;
        fs::create_dir_all(&folder).map_err(|e| crate::error::Error::io(&folder, e))?;
        write_atomic(&path, |to| to.write_all(text.as_bytes()))
    }

    /// Returns what times of passes are compared with; none without a bandwidth or without 32-bit
    /// floats.
    pub fn ceilings(&self) -> Option<Ceilings> {
        let mut greatest: BTreeMap<u64, f64> = BTreeMap::new();
        for roof in self.roofs.iter().filter(|roof| roof.max.is_finite() && roof.max > 0.0) {
            if let (Some(set), BYTES_PER_S) = (roof.set_bytes, roof.unit.as_str()) {
                let at = greatest.entry(set).or_insert(0.0);
                *at = at.max(roof.max);
            }
        }
        let bandwidths: Vec<Bandwidth> = greatest
            .into_iter()
            .map(|(set_bytes, bytes_per_s)| Bandwidth { set_bytes, bytes_per_s })
            .collect();
        let f32 = self.roofs.iter().find(|roof| roof.name == F32 && roof.max > 0.0)?;
        let date = self.date.clone();
        (!bandwidths.is_empty()).then_some(Ceilings { date, bandwidths, operations_per_s: f32.max })
    }
}

impl Ceilings {
    /// Returns the share of the roof that a pass reaches which does `work` in `ms`: the least time
    /// for its bytes or for its operations, whichever is longer, divided by its time. None where
    /// the pass has no time.
    ///
    /// Data that was used by the pass before may lie in a cache. Its bandwidth is therefore the
    /// greatest that was measured for data of its size or larger. With cold caches all data comes
    /// from memory: its bandwidth is that of the largest data.
    pub fn share(&self, work: &Work, ms: f64, is_cold: bool) -> Option<f64> {
        let largest = self.bandwidths.last()?;
        let fits = self.bandwidths.iter().rev().find(|b| b.set_bytes as f64 <= work.bytes);
        let from = if is_cold { largest } else { fits.unwrap_or(self.bandwidths.first()?) };
        let reach = self.bandwidths.iter().filter(|b| b.set_bytes >= from.set_bytes);
        let bytes_per_s = reach.map(|b| b.bytes_per_s).fold(0.0, f64::max);
        let least_s = (work.bytes / bytes_per_s).max(work.operations / self.operations_per_s);
        Some(1e3 * least_s / ms).filter(|share| ms > 0.0 && share.is_finite())
    }
}

/// Returns the name of the file with a device's roofs: the hash of all that changes them.
fn file(info: &DeviceInfo) -> String {
    let device = machine::device_record(info);
    let machine = (machine::cpu(), machine::environment());
    let version = (env!("CARGO_PKG_VERSION"), Roofs::SCHEMA);
    let text = format!("{device:?}\n{machine:?}\n{version:?}");
    format!("{}.json", hex(&Sha256::digest(text)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn roof(name: &str, set_bytes: Option<u64>, max: f64) -> Roof {
        let unit = if set_bytes.is_some() { BYTES_PER_S } else { OPERATIONS_PER_S };
        Roof {
            name: name.to_owned(),
            way: None,
            set_bytes,
            unit: unit.to_owned(),
            n: 9,
            p50: 0.9 * max,
            p5: 0.8 * max,
            p95: 0.95 * max,
            max,
            is_stable: true,
        }
    }

    fn roofs(roofs: Vec<Roof>) -> Roofs {
        let text = || String::new();
        Roofs {
            schema: Roofs::SCHEMA,
            nimbus: text(),
            date: "2026-01-01T00:00:00Z".to_owned(),
            device: Device {
                name: text(),
                driver: text(),
                api: text(),
                kind: text(),
                uuid: text(),
            },
            cpu: Cpu { model: text(), logical_cores: 1 },
            environment: BTreeMap::new(),
            cache_bytes: 1000,
            seconds: 1.0,
            roofs,
            absent: vec![],
        }
    }

    #[test]
    fn a_share_is_the_least_time_by_the_measured_time() {
        let all = roofs(vec![
            roof("read", Some(1000), 8e3),
            roof("write", Some(1000), 9e3),
            roof("read", Some(100), 5e4),
            roof("copy", Some(10), 2e4),
            roof(F32, None, 1e4),
            roof("f64", None, 1e9),
        ]);
        let ceilings = all.ceilings().expect("all there is to know");
        let sets: Vec<_> =
            ceilings.bandwidths.iter().map(|b| (b.set_bytes, b.bytes_per_s)).collect();
        assert_eq!(sets, [(10, 2e4), (100, 5e4), (1000, 9e3)]);
        assert_eq!(ceilings.operations_per_s, 1e4);
        let share = |bytes, operations, ms, is_cold| {
            ceilings.share(&Work { bytes, operations }, ms, is_cold)
        };
        // 9000 bytes come from memory: a second of two.
        assert_eq!(share(9e3, 0.0, 2e3, false), Some(0.5));
        // As many operations as take a second, too, and the longer of the two counts.
        assert_eq!(share(9e3, 1e4, 2e3, false), Some(0.5));
        assert_eq!(share(9e3, 2e4, 4e3, false), Some(0.5));
        // 500 bytes fit where 100 do and not where 1000 do.
        assert_eq!(share(500.0, 0.0, 20.0, false), Some(0.5));
        // Smaller data is no slower than larger data.
        assert_eq!(share(50.0, 0.0, 2.0, false), Some(0.5));
        assert_eq!(share(5.0, 0.0, 0.2, false), Some(0.5));
        // With cold caches all comes from memory.
        assert_eq!(share(90.0, 0.0, 20.0, true), Some(0.5));
        assert_eq!(share(9e3, 0.0, 0.0, false), None);
        assert_eq!(share(9e3, 0.0, f64::NAN, false), None);
    }

    #[test]
    fn roofs_without_bandwidth_or_floats_give_no_shares() {
        assert_eq!(roofs(vec![roof(F32, None, 1e4)]).ceilings(), None);
        assert_eq!(roofs(vec![roof("read", Some(10), 1e4)]).ceilings(), None);
        let odd = vec![roof("read", Some(10), f64::NAN), roof(F32, None, 1e4)];
        assert_eq!(roofs(odd).ceilings(), None);
    }

    #[test]
    fn roofs_are_read_as_they_were_written() {
        let all = roofs(vec![roof("read", Some(1000), 8e3), roof(F32, None, 1e4)]);
        let text = serde_json::to_string(&all).unwrap();
        assert_eq!(serde_json::from_str::<Roofs>(&text).unwrap(), all);
    }
}
