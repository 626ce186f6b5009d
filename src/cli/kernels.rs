//! `nimbus devices --kernels SCENE…`: what the driver's compiler makes of a scene's pipelines.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::args::DevicesArgs;
use super::output::{self, header, or_dash};
use super::progress::progress;
use crate::error::Result;
use crate::frame::{DeviceChoice, GpuContext, pipelines};
use crate::gpu::{DeviceOptions, PipelineReport, Program};
use crate::io::console::say;
use crate::io::scene_file;

/// Makes the pipelines of all scenes of `args` and prints them. No pipeline runs.
///
/// # Errors
/// Fails if a scene is faulty or exceeds a limit of the device, or a shader does not compile.
pub fn run(args: &DevicesArgs) -> Result<()> {
    let choice = DeviceChoice {
        device: args.device.clone(),
        shaders: args.shaders.clone(),
        validation: args.validation,
        options: DeviceOptions {
            limits: args.limits.clone(),
            reports_pipelines: true,
            ..DeviceOptions::default()
        },
    };
    let context = GpuContext::open(&choice)?;
    let bar = progress(args.kernels.len() as u64, "scenes", args.quiet);
    let mut scenes = Vec::new();
    for path in &args.kernels {
        let scene = scene_file::load(path, &args.set, None)?.scene;
        scenes.push((path, pipelines(&context, &scene)?));
        bar.advance();
    }
    drop(bar);
    let info = context.device.info();
    let is_described = info.has_pipeline_statistics;
    if args.json {
        let json = json!({
            "device": info.name,
            "driver": info.driver,
            "is_described": is_described,
            "scenes": scenes.iter().map(|(path, all)| scene_json(path, all)).collect::<Vec<_>>(),
        });
        output::object(&json)?;
    } else {
        output::text(&table(&scenes))?;
    }
    if !is_described && !args.quiet {
        say!(
            "note: {} does not describe its pipelines (VK_KHR_pipeline_executable_properties)",
            info.name
        );
    }
    context.close()
}

fn scene_json(path: &Path, all: &[PipelineReport]) -> Value {
    json!({ "scene": path, "pipelines": all.iter().map(pipeline_json).collect::<Vec<_>>() })
}

fn pipeline_json(report: &PipelineReport) -> Value {
    let variant: serde_json::Map<String, Value> =
        report.variant.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
    let program = |p: &Program| {
        let statistics: serde_json::Map<String, Value> =
            p.statistics.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
        json!({
            "program": p.name,
            "subgroup_size": p.subgroup_size,
            "registers": p.registers(),
            "spilled": p.spilled(),
            "scratch_bytes": p.scratch_bytes(),
            "shared_bytes": p.shared_bytes(),
            "occupancy": p.occupancy(),
            "code_bytes": p.code_bytes(),
            "statistics": statistics,
        })
    };
    json!({
        "pipeline": report.pipeline,
        "variant": variant,
        "programs": report.programs.iter().map(program).collect::<Vec<_>>(),
    })
}

fn table(scenes: &[(&PathBuf, Vec<PipelineReport>)]) -> String {
    let mut rows = header([
        "scene",
        "pipeline",
        "program",
        "subgroup",
        "registers",
        "spilled",
        "scratch B",
        "shared B",
        "subgroups at once",
        "code B",
    ]);
    for (path, all) in scenes {
        let scene = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        for report in all {
            let name = report.pipeline.clone();
            if report.programs.is_empty() {
                let dashes = std::iter::repeat_n("-".to_owned(), 8);
                rows.push([scene.clone(), name].into_iter().chain(dashes).collect());
                continue;
            }
            for p in &report.programs {
                let number = |value: Option<f64>| or_dash(value, |v| format!("{v}"));
                let size = (p.subgroup_size > 0).then_some(f64::from(p.subgroup_size));
                rows.push(vec![
                    scene.clone(),
                    name.clone(),
                    p.name.clone(),
                    number(size),
                    number(p.registers()),
                    number(p.spilled()),
                    number(p.scratch_bytes()),
                    number(p.shared_bytes()),
                    number(p.occupancy()),
                    number(p.code_bytes()),
                ]);
            }
        }
    }
    output::table(&rows)
}
