//! `nimbus devices`.

use std::borrow::Cow;
use std::path::Path;

use serde_json::json;

use super::args::DevicesArgs;
use super::{clock_locks, kernels, output, roof};
use crate::error::{Error, Result};
use crate::gpu::{DeviceInfo, Instance, no_permission};
use crate::io::console::say;

/// Runs `nimbus devices`.
///
/// # Errors
/// Fails if there is no Vulkan or no such device, or with `--validation` if there are messages.
pub fn run(args: &DevicesArgs) -> Result<()> {
    if !args.kernels.is_empty() {
        return kernels::run(args);
    }
    if args.roof {
        return roof::run(args);
    }
    let instance = Instance::new(args.validation)?;
    let devices = DeviceInfo::list(&instance)?;
    let used = DeviceInfo::choose(devices.clone(), args.device.as_deref());
    let i_used = used.as_ref().ok().map(|d| d.index);
    if args.lock {
        output::text(&clock_locks::text(&devices, Path::new("/sys")))?;
    } else if args.json {
        let list: Vec<_> = devices.iter().map(|d| to_json(d, i_used)).collect();
        output::object(&list)?;
    } else {
        let advice = no_permission().map_or(String::new(), |advice| format!("note: {advice}\n"));
        let all: String = devices.iter().map(|d| describe(d, i_used)).collect();
        output::text(&(all + &advice))?;
    }
    let used = used?;
    if args.verbose {
        let why = match &args.device {
            Some(choice) => format!("named by --device \"{choice}\""),
            None => "the first of the best kind: discrete, integrated, virtual, cpu".to_owned(),
        };
        say!("device {}: {} is used: {why}", used.index, used.name);
    }
    let messages = instance.messages().take();
    if messages.is_empty() {
        return Ok(());
    }
    let (n, text) = (messages.len(), messages.join("\n"));
    Err(Error::Check { what: format!("{n} validation messages:\n{text}") })
}

fn version(d: &DeviceInfo) -> String {
    let (major, minor, patch) = d.api_version;
    format!("{major}.{minor}.{patch}")
}

fn describe(d: &DeviceInfo, i_used: Option<usize>) -> String {
    let l = &d.limits;
    let mark = if Some(d.index) == i_used { "  <- used" } else { "" };
    let mib = |bytes: u64| format!("{} MiB", bytes >> 20);
    let mut out = format!("{}: {} ({}){mark}\n", d.index, d.name, d.kind);
    if let Some(why) = &d.unusable {
        out += &format!("   not usable: {why}\n");
    }
    out += &format!("   driver {}, Vulkan {}, uuid {}\n", d.driver, version(d), d.uuid);
    out += &format!(
        "   memory {}, storage buffer {}, {} texels of a buffer\n",
        mib(l.device_memory_bytes),
        mib(l.max_storage_buffer_bytes),
        l.max_texels
    );
    out += &format!(
        "   workgroups {} along x, {} invocations each, {} KiB shared; subgroup {}; push \
         constants {} B\n",
        l.max_workgroups_x,
        l.max_workgroup_invocations,
        l.max_shared_memory_bytes >> 10,
        l.subgroup_size,
        l.max_push_constant_bytes
    );
    let timestamps = match l.timestamp_valid_bits {
        0 => "no timestamps: passes are not timed".to_owned(),
        bits => format!("timestamps {bits} bits, {} ns a tick", l.timestamp_period_ns),
    };
    out += &format!("   images up to {} a side; {timestamps}\n", l.max_image_extent);
    out + &match calibration(d) {
        Some(name) => format!("   clock calibrated with the host's by {name}\n"),
        None => {
            "   clock not calibrated with the host's: VK_KHR_ and VK_EXT_calibrated_timestamps \
             are missing, or lack the clock of this system\n"
                .to_owned()
        }
    }
}

/// Returns the extension that calibrates the device's clock.
fn calibration(d: &DeviceInfo) -> Option<Cow<'static, str>> {
    d.clock_calibration.map(|calibration| calibration.extension.to_string_lossy())
}

fn to_json(d: &DeviceInfo, i_used: Option<usize>) -> serde_json::Value {
    let l = &d.limits;
    json!({
        "index": d.index, "name": d.name, "driver": d.driver, "api": version(d),
        "type": d.kind, "uuid": d.uuid,
        "used": Some(d.index) == i_used, "unusable": d.unusable,
        "calibrated_timestamps": calibration(d),
        "limits": {
            "device_memory_bytes": l.device_memory_bytes,
            "max_storage_buffer_bytes": l.max_storage_buffer_bytes,
            "max_storage_buffers": l.max_storage_buffers,
            "max_texels": l.max_texels,
            "max_workgroups_x": l.max_workgroups_x,
            "max_workgroup_invocations": l.max_workgroup_invocations,
            "max_shared_memory_bytes": l.max_shared_memory_bytes,
            "max_push_constant_bytes": l.max_push_constant_bytes,
            "max_image_extent": l.max_image_extent,
            "subgroup_size": l.subgroup_size,
            "max_loop_iterations": l.max_loop_iterations,
            "timestamp_valid_bits": l.timestamp_valid_bits,
            "timestamp_period_ns": l.timestamp_period_ns,
        },
    })
}
