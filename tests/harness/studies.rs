//! Imaginary studies and ledgers.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::collections::BTreeMap;

use nimbus::gpu::PassTimes;
use nimbus::measure::figure::Figure;
use nimbus::studies::error::blocks::TimeKind;
use nimbus::studies::error::front::{Front, Metric};
use nimbus::studies::error::records::{Best, Budget, Configuration, Study};
use nimbus::studies::ledger::records::{Ledger, Row};
use nimbus::studies::picture_error::PictureError;
use nimbus::studies::provenance::{Provenance, ReferenceRecord};
use nimbus::timing::json::ResultFile;
use nimbus::timing::machine::{Clocks, Cpu, Device};
use nimbus::timing::names::Setting;
use serde_json::json;

pub fn provenance() -> Provenance {
    Provenance {
        schema: Study::SCHEMA,
        nimbus: "0.1.0".to_owned(),
        revision: "0123456789ab".to_owned(),
        code: "0123456789abcdef".to_owned(),
        date: "2024-02-29T12:34:56Z".to_owned(),
        command: ["nimbus", "error", "a.toml", "--out", "a"].map(str::to_owned).to_vec(),
        scene_file: "scenes/cubes-554.toml".to_owned(),
        scene_hash: "ab".repeat(32),
        scene: json!({ "lighting": { "grid": 64 } }),
        device: Device {
            name: "llvmpipe".to_owned(),
            driver: "Mesa 22.3.6".to_owned(),
            api: "1.3.230".to_owned(),
            kind: "cpu".to_owned(),
            uuid: "00".repeat(16),
        },
        cpu: Cpu { model: "a processor".to_owned(), logical_cores: 2 },
        environment: BTreeMap::from([("LP_NUM_THREADS".to_owned(), "1".to_owned())]),
        clocks: Clocks {
            resolution_ns: 40.0,
            overhead_ns: 22.5,
            timestamp_period_ns: Some(1.0),
            pass_times: PassTimes::Drained,
            timestamp_overhead_ns: Some(19_309.0),
        },
    }
}

/// Returns a value with an interval of ±`part` of it.
pub fn about(value: f64, part: f64) -> Figure {
    Figure { value, low: Some(value * (1.0 - part)), high: Some(value * (1.0 + part)) }
}

/// Returns a configuration with the given GPU time, ms, and RMSE.
pub fn configuration(settings: &[(&str, &str)], ms: f64, rmse: f64, front: Front) -> Configuration {
    let setting = |(key, value): &(&str, &str)| Setting {
        key: (*key).to_owned(),
        value: (*value).to_owned(),
    };
    let settings: Vec<Setting> = settings.iter().map(setting).collect();
    let name =
        settings.iter().map(|s| format!("{}={}", s.key, s.value)).collect::<Vec<_>>().join(", ");
    Configuration {
        name: if name.is_empty() { "as it stands".to_owned() } else { name },
        settings,
        hash: "cd".repeat(32),
        gpu_ms: Some(about(ms, 0.05)),
        frame_ms: Some(about(1.2 * ms, 0.05)),
        by_base: Some(about(ms / 40.0, 0.05)),
        n_turns: 8,
        error: Some(PictureError {
            rmse: about(rmse, 0.2),
            max: 10.0 * rmse,
            relmse: rmse * rmse,
            is_resolved: rmse > 1e-4,
            cloud: None,
        }),
        front,
        failure: None,
        picture: None,
        error_map: None,
    }
}

pub fn study(configurations: Vec<Configuration>) -> Study {
    Study {
        made: provenance(),
        reference: ReferenceRecord {
            against: "thin".to_owned(),
            hash: "ef".repeat(32),
            own_error: Some(1e-6),
            accuracy: "arithmetic in f64".to_owned(),
            magnitude: 0.4,
            from_cache: false,
            seconds: 3.5,
            width: 200,
            height: 150,
            n_pixels: 30_000,
            frame: 0,
            time_s: 0.0,
        },
        metric: Metric::Rmse,
        time: TimeKind::Gpu,
        rounds: 8,
        frames: 10,
        configurations,
        as_played: false,
        own_shaders: false,
        best: vec![],
        interrupted: false,
    }
}

/// Returns some twenty configurations of three knobs: four on the front, two near it.
pub fn usual_study() -> Study {
    let mut all = vec![configuration(&[], 40.0, 2.0e-4, Front::Off)];
    let front = [(4.0, 0.06), (7.5, 0.02), (13.0, 0.0031), (26.0, 1.9e-4)];
    for (i, (ms, rmse)) in front.into_iter().enumerate() {
        let settings = [
            ("draw.resolution", ["0.25", "0.5", "1", "1"][i]),
            ("draw.threshold", ["0.05", "0.02", "0.01", "0"][i]),
        ];
        all.push(configuration(&settings, ms, rmse, Front::On));
    }
    for (cutoff, ms, rmse) in [("2", 7.8, 0.0205), ("3", 13.4, 0.0032)] {
        all.push(configuration(&[("draw.cutoff", cutoff)], ms, rmse, Front::Near));
    }
    for i in 0..16 {
        let (a, b) = (f64::from(i % 4), f64::from(i / 4));
        let (value, grid) = (format!("0.0{i}"), format!("{}", 32 << (i % 3)));
        let settings = [("draw.smallest", value.as_str()), ("lighting.grid", grid.as_str())];
        all.push(configuration(
            &settings,
            9.0 + 6.0 * a + b,
            0.05 * 10f64.powf(-0.6 * a) * (1.0 + 0.4 * b),
            Front::Off,
        ));
    }
    let mut study = study(all);
    let best = |budget, value, configuration| Best { budget, value, configuration };
    study.best = vec![
        best(Budget::Ms, 8.0, Some(2)),
        best(Budget::Error, 0.005, Some(3)),
        best(Budget::Ms, 1.0, None),
    ];
    study
}

pub fn row(name: &str, error: f64, is_resolved: bool) -> Row {
    Row {
        name: name.to_owned(),
        from: format!("{name} as it is drawn"),
        to: format!("no {name}"),
        error: about(error, 0.2),
        relative: error / 0.4,
        share: 0.1,
        own_error: 0.02 * error,
        is_resolved,
        time_ratio: Some(about(0.7, 0.1)),
    }
}

pub fn ledger(rows: Vec<Row>) -> Ledger {
    let sum = rows.iter().map(|r| r.error.value).sum::<f64>();
    let quadrature = rows.iter().map(|row| row.error.value.powi(2)).sum::<f64>().sqrt();
    Ledger {
        made: provenance(),
        frame: 0,
        time_s: 0.0,
        width: 200,
        height: 150,
        n_pixels: 4096,
        magnitude: 0.4,
        rows,
        total: about(0.8 * sum, 0.1),
        sum,
        quadrature,
        holds: true,
        interrupted: false,
    }
}

pub fn usual_ledger() -> Ledger {
    ledger(vec![
        row("arithmetic", 2.1e-5, false),
        row("threshold", 0.0012, true),
        row("cutoff", 0.0094, true),
        row("impostors", 0.0, true),
        row("thin sprites for the volume", 0.031, true),
        row("one more reflection", 0.0065, true),
    ])
}
