//! The origin of a result: program, command, scene, device and environment.

use std::collections::BTreeMap;

use maud::{Markup, html};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::{Error, Result};
use crate::report::charts::number;
use crate::timing::machine::{Clocks, Cpu, Device};

/// The keys that the records of benches, studies and ledgers have in common.
#[derive(Deserialize)]
struct Origin {
    nimbus: String,
    revision: String,
    tool: Option<String>,
    date: String,
    command: Vec<String>,
    scene_file: Option<String>,
    scene_hash: String,
    scene: Value,
    device: Device,
    cpu: Cpu,
    environment: BTreeMap<String, String>,
    clocks: Clocks,
    interrupted: bool,
}

/// Returns the list of what produced a record.
///
/// # Errors
/// Fails if the record lacks one of the keys.
pub fn section(record: &impl Serialize) -> Result<Markup> {
    let origin: Origin = serde_json::to_value(record)
        .and_then(serde_json::from_value)
        .map_err(|cause| Error::Fault { what: format!("a record without its origin: {cause}") })?;
    let Device { name, driver, api, kind, uuid } = &origin.device;
    let scene = serde_json::to_string_pretty(&origin.scene).unwrap_or_default();
    let period = origin
        .clocks
        .timestamp_period_ns
        .map_or("none".to_owned(), |ns| format!("{} ns a tick", number(ns)));
    let pass = origin
        .clocks
        .timestamp_overhead_ns
        .map(|ns| format!(", {} ns for an empty pass", number(ns)));
    let how = origin.clocks.pass_times.name();
    Ok(html! {
        @if origin.interrupted {
            p class="warning" {
                strong { "Interrupted:" } " the page shows the finished part only."
            }
        }
        dl class="made" {
            dt { "Device" } dd { (name) " (" (kind) ")" }
            dt { "Driver" } dd { (driver) ", Vulkan " (api) }
            dt { "Device UUID" } dd { code { (uuid) } }
            dt { "Processor" } dd {
                (origin.cpu.model) ", " (origin.cpu.logical_cores) " logical cores"
            }
            dt { "Environment" } dd {
                @if origin.environment.is_empty() {
                    "none of the variables that affect drivers is set"
                }
                @for (key, value) in &origin.environment { code { (key) "=" (value) } " " }
            }
            dt { "Clocks" } dd {
                "host: resolution " (number(origin.clocks.resolution_ns)) " ns, "
                (number(origin.clocks.overhead_ns)) " ns a reading; device: " (period)
                @if let Some(pass) = &pass { (pass) }
                "; times of passes: " (how)
            }
            dt { "Date" } dd { time datetime=(origin.date) { (origin.date) } }
            @if let Some(tool) = &origin.tool { dt { "Drawn by" } dd { (tool) } }
            dt { "nimbus" } dd { (origin.nimbus) ", revision " code { (origin.revision) } }
            dt { "Command" } dd { code { (origin.command.join(" ")) } }
            @if let Some(file) = &origin.scene_file { dt { "Scene" } dd { code { (file) } } }
            dt { "Scene hash" } dd { code { (origin.scene_hash) } }
        }
        details { summary { "The scene with every default filled in" } pre { (scene) } }
    })
}
