//! With what, where and of what a result was made.

use std::collections::BTreeMap;

use maud::{Markup, html};

use crate::report::charts::number::number;
use crate::studies::provenance::Provenance;
use crate::timing::machine::{Clocks, Cpu, Device};
use crate::timing::records::Run;

/// What runs, studies and ledgers all say of themselves.
pub struct Made<'a> {
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

impl<'a> Made<'a> {
    pub fn of_run(run: &'a Run) -> Made<'a> {
        Made {
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

    pub fn of(made: &'a Provenance, interrupted: bool) -> Made<'a> {
        Made {
            nimbus: &made.nimbus,
            revision: &made.revision,
            date: &made.date,
            command: &made.command,
            scene_file: Some(&made.scene_file),
            scene_hash: &made.scene_hash,
            scene: &made.scene,
            device: &made.device,
            cpu: &made.cpu,
            environment: &made.environment,
            clocks: &made.clocks,
            interrupted,
        }
    }
}

pub fn section(made: &Made<'_>) -> Markup {
    let Device { name, driver, api, kind, uuid } = made.device;
    let scene = serde_json::to_string_pretty(made.scene).unwrap_or_default();
    let period = made
        .clocks
        .timestamp_period_ns
        .map_or("none".to_owned(), |ns| format!("{} ns a tick", number(ns)));
    let pass = made
        .clocks
        .timestamp_overhead_ns
        .map(|ns| format!(", {} ns for an empty pass", number(ns)));
    html! {
        @if made.interrupted {
            p class="warning" { strong { "Interrupted:" } " what was finished is here, and \
                nothing else." }
        }
        dl class="made" {
            dt { "Device" } dd { (name) " (" (kind) ")" }
            dt { "Driver" } dd { (driver) ", Vulkan " (api) }
            dt { "Device UUID" } dd { code { (uuid) } }
            dt { "Processor" } dd { (made.cpu.model) ", " (made.cpu.logical_cores) " logical cores" }
            dt { "Environment" } dd {
                @if made.environment.is_empty() { "none of the variables that change \
                    what drivers do" }
                @for (key, value) in made.environment { code { (key) "=" (value) } " " }
            }
            dt { "Clocks" } dd {
                "host: resolution " (number(made.clocks.resolution_ns)) " ns, " (number(made.clocks.overhead_ns)) " ns a reading; device: "
                (period) @if let Some(pass) = &pass { (pass) }
            }
            dt { "Date" } dd { time datetime=(made.date) { (made.date) } }
            dt { "nimbus" } dd { (made.nimbus) ", revision " code { (made.revision) } }
            dt { "Command" } dd { code { (made.command.join(" ")) } }
            @if let Some(file) = made.scene_file { dt { "Scene" } dd { code { (file) } } }
            dt { "Scene hash" } dd { code { (made.scene_hash) } }
        }
        details { summary { "The scene with every default filled in" } pre { (scene) } }
    }
}
