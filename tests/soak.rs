//! Long runs: the serial and the parallel loop produce the same frames, and memory does not grow.
//! All frames are hashed, validation layers are on, and resident memory is sampled.
//!
//! The long run (docs/reference/measured.md) is `NIMBUS_SOAK_FRAMES=100000 cargo test --release
//! --test soak -- --nocapture`.

use std::fs;
use std::path::Path;
use std::time::Instant;

use nimbus::frame::FrameTimes;
use nimbus::frame::plan::Pass;
use nimbus::frame::render::Renderer;
use nimbus::frame::stage::{DeviceChoice, Stage};
use nimbus::io::scene_file;
use nimbus::model::scene::Threading;
use sha2::{Digest, Sha256};

/// Frames of each loop unless `NIMBUS_SOAK_FRAMES` is set.
const N_FRAMES: u32 = 600;
/// Number of memory samples of a run.
const N_SAMPLES: u32 = 60;
/// Largest growth of resident memory after the first fifth of a run. A leak of 100 bytes a frame is
/// 8 MB over the other four fifths of 100 000 frames; a leak of 1 KB shows in 5000 frames. The
/// allocator and the validation layers themselves grow by some hundred kilobytes.
const MAX_GROWTH_KIB: i64 = 4096;

/// The result of one loop.
struct Soaked {
    /// SHA-256 of the previous hash and the frame's bytes.
    chain: [u8; 32],
    /// Resident memory in KiB, sampled evenly over the run.
    resident_kib: Vec<i64>,
    wall_s: f64,
}

fn n_frames() -> u32 {
    std::env::var("NIMBUS_SOAK_FRAMES")
        .map_or(N_FRAMES, |n| n.parse().expect("NIMBUS_SOAK_FRAMES: a number"))
}

fn resident_kib() -> i64 {
    let status = fs::read_to_string("/proc/self/status").expect("this process' status");
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("VmRSS");
    line.trim().trim_end_matches(" kB").parse().expect("a number")
}

/// Runs `n` frames through one loop on a new device.
fn soak(threading: Threading, skip: bool, n: u32) -> Soaked {
    let scene =
        scene_file::load(Path::new("tests/data/soak.toml"), &[], None).expect("the scene").scene;
    let choice = DeviceChoice { validation: true, ..DeviceChoice::default() };
    let mut stage = Stage::new(scene, &choice, skip).expect("a stage");
    let mut soaked = Soaked { chain: [0; 32], resident_kib: vec![], wall_s: 0.0 };
    let begin = Instant::now();
    let (mut n_seen, mut last) = (0, vec![]);
    let on_frame = &mut |times: FrameTimes, renderer: &mut Renderer| {
        assert_eq!(times.i_frame, n_seen, "frames end in their order");
        // The frame that has just ended; its picture is not overwritten before this returns.
        let bytes = renderer.image_bytes()?;
        assert!(bytes != last, "frame {n_seen} is the one before it");
        assert!([Pass::Place, Pass::Second, Pass::Tiles].iter().all(|pass| times.plan.runs(*pass)));
        soaked.chain =
            Sha256::new().chain_update(soaked.chain).chain_update(&bytes).finalize().into();
        last = bytes;
        n_seen += 1;
        if n_seen % n.div_ceil(N_SAMPLES) == 0 {
            soaked.resident_kib.push(resident_kib());
        }
        Ok(true)
    };
    stage.run(threading, 0..n, on_frame).expect("the frames run");
    assert_eq!(n_seen, n);
    soaked.wall_s = begin.elapsed().as_secs_f64();
    // Closing reports validation messages and leaks.
    stage.close().expect("no validation messages or leaks");
    soaked
}

/// Returns the growth from the second to the last fifth of the samples, by medians, which ignore
/// single bursts.
fn growth_kib(samples: &[i64]) -> i64 {
    let fifth = samples.len() / 5;
    let median = |part: &[i64]| {
        let mut sorted = part.to_vec();
        sorted.sort_unstable();
        sorted[sorted.len() / 2]
    };
    median(&samples[samples.len() - fifth..]) - median(&samples[fifth..2 * fifth])
}

fn check(skip: bool) {
    let n = n_frames();
    let runs = [("serial", Threading::Serial), ("parallel", Threading::Parallel)];
    let soaked = runs.map(|(name, threading)| (name, soak(threading, skip, n)));
    for (name, of) in &soaked {
        let samples = &of.resident_kib;
        let [start, middle, end] =
            [0, samples.len() / 2, samples.len() - 1].map(|i| samples[i] as f64 / 1024.0);
        let hash: String = of.chain.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
        println!(
            "{name}, skip {skip}: {n} frames in {:.1} s, resident {start:.2}, {middle:.2}, \
             {end:.2} MiB, growth {} KiB, \
             chain {hash}…",
            of.wall_s,
            growth_kib(samples)
        );
    }
    for (name, of) in &soaked {
        let growth = growth_kib(&of.resident_kib);
        assert!(
            growth <= MAX_GROWTH_KIB,
            "{name}: resident memory grew by {growth} KiB: {:?}",
            of.resident_kib
        );
    }
    assert!(soaked[0].1.chain == soaked[1].1.chain, "the loops differ");
}

/// One test, because both loops share the process's memory.
#[test]
fn loops_agree_and_memory_does_not_grow() {
    [true, false].iter().for_each(|skip| check(*skip));
}

#[test]
fn growth_detects_a_leak() {
    let leak = |kib_a_sample: i64| {
        (0..60).map(|i| 80_000 + kib_a_sample * i + (i % 3) * 50).collect::<Vec<i64>>()
    };
    assert!(growth_kib(&leak(0)).abs() <= 100);
    // 100 bytes a frame over 100 000 frames: 163 KiB between samples.
    assert!(growth_kib(&leak(163)) > MAX_GROWTH_KIB);
    // A burst is not growth.
    let mut burst = leak(0);
    burst[59] += 9000;
    assert!(growth_kib(&burst).abs() <= 100);
}
