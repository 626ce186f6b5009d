//! The origin of a result: program, command, scene, device and environment.

use std::collections::BTreeMap;

use maud::{Markup, html};

use crate::report::charts::number;
use crate::studies::provenance::Provenance;
use crate::timing::machine::{Clocks, Cpu, Device};
use crate::timing::records::Run;

/// The origin of a run, a study or a ledger.
pub struct Origin<'a> {
    nimbus: &'a str,
    revision: &'a str,
    date: &'a str,
    command: &'a [String],
    scene_file: Option<&'a str>,
    scene_hash: &'a str,
    scene: &'a serde_json::Value,
    device: &'a Device,
    cpu: &'a Cpu,
    environment: &'a BTreeMap<String, String>,
    clocks: &'a Clocks,
    interrupted: bool,
}

impl<'a> Origin<'a> {
    /// Returns the origin of a bench.
    pub fn of_run(run: &'a Run) -> Origin<'a> {
        Origin {
            nimbus: &run.nimbus,
            revision: &run.revision,
            date: &run.date,
            command: &run.command,
            scene_file: None,
            scene_hash: &run.scene_hash,
            scene: &run.scene,
            device: &run.device,
            cpu: &run.cpu,
            environment: &run.environment,
            clocks: &run.clocks,
            interrupted: run.interrupted,
        }
    }

    /// Returns the origin of a study or a ledger.
    pub fn of(p: &'a Provenance, interrupted: bool) -> Origin<'a> {
        Origin {
            nimbus: &p.nimbus,
            revision: &p.revision,
            date: &p.date,
            command: &p.command,
            scene_file: Some(&p.scene_file),
            scene_hash: &p.scene_hash,
            scene: &p.scene,
            device: &p.device,
            cpu: &p.cpu,
            environment: &p.environment,
            clocks: &p.clocks,
            interrupted,
        }
    }
}

/// Returns the list of what produced a result.
pub fn section(origin: &Origin<'_>) -> Markup {
    let Device { name, driver, api, kind, uuid } = origin.device;
    let scene = serde_json::to_string_pretty(origin.scene).unwrap_or_default();
    let period = origin
        .clocks
        .timestamp_period_ns
        .map_or("none".to_owned(), |ns| format!("{} ns a tick", number(ns)));
    let pass = origin
        .clocks
        .timestamp_overhead_ns
        .map(|ns| format!(", {} ns for an empty pass", number(ns)));
    html! {
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
                @for (key, value) in origin.environment { code { (key) "=" (value) } " " }
            }
            dt { "Clocks" } dd {
                "host: resolution " (number(origin.clocks.resolution_ns)) " ns, "
                (number(origin.clocks.overhead_ns)) " ns a reading; device: " (period)
                @if let Some(pass) = &pass { (pass) }
            }
            dt { "Date" } dd { time datetime=(origin.date) { (origin.date) } }
            dt { "nimbus" } dd { (origin.nimbus) ", revision " code { (origin.revision) } }
            dt { "Command" } dd { code { (origin.command.join(" ")) } }
            @if let Some(file) = origin.scene_file { dt { "Scene" } dd { code { (file) } } }
            dt { "Scene hash" } dd { code { (origin.scene_hash) } }
        }
        details { summary { "The scene with every default filled in" } pre { (scene) } }
    }
}
