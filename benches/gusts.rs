//! Time that the gusts of a cloud take on the game thread: for several particles at once, and one
//! by one with the standard library's sine. `cargo bench --bench gusts` prints a table of CPU times
//! first, then divan's wall times.

mod cpu;

use std::hint::black_box;

use divan::Bencher;
use glam::DVec3;
use nimbus::measure::stats::Summary;
use nimbus::model::gust::{Gust, Mode};
use nimbus::model::gust_lanes::{LANES, Lanes, Waves};

const N_WAVES: [u32; 3] = [16, 64, 1024];
/// In eights.
const N_PARTICLES: usize = 4096;
const TIME_S: f64 = 12.5;

fn modes(n_waves: u32) -> Vec<Mode> {
    Gust { amplitude: 0.12, length: 4.0, period_s: 8.0, n_waves }.modes(1)
}

fn positions() -> Vec<DVec3> {
    (0..N_PARTICLES as u32)
        .map(|i| DVec3::new(0.618, 0.414, 0.732) * f64::from(i) % 8.0 - 4.0)
        .collect()
}

fn side_by_side(waves: &Waves, positions: &[DVec3]) {
    for some in positions.chunks_exact(LANES) {
        let along = |axis: usize| -> Lanes { std::array::from_fn(|l| some[l][axis]) };
        black_box(waves.displace(&[along(0), along(1), along(2)]));
    }
}

fn one_by_one(modes: &[Mode], phases: &[f64], positions: &[DVec3]) {
    for x in positions {
        let of = |(m, phase): (&Mode, &f64)| m.a * (m.k.dot(*x) + phase).sin();
        black_box(modes.iter().zip(phases).map(of).sum::<DVec3>());
    }
}

fn phases(modes: &[Mode]) -> Vec<f64> {
    modes.iter().map(|m| m.phase_at(TIME_S)).collect()
}

fn main() {
    if cpu::is_bench() {
        table();
    }
    divan::main();
}

fn table() {
    println!("process CPU time a particle and wave, ns (p50 [min, max] of n = {})", cpu::N_SAMPLES);
    println!("{:>6}  {:>24}  {:>24}  {:>8}", "waves", "side by side", "one by one", "ratio");
    let positions = positions();
    for n_waves in N_WAVES {
        let modes = modes(n_waves);
        let (waves, phases) = (Waves::at(&modes, TIME_S), phases(&modes));
        let together = cpu::samples(|| side_by_side(&waves, &positions));
        let alone = cpu::samples(|| one_by_one(&modes, &phases, &positions));
        let ns = 1e6 / (N_PARTICLES as f64 * f64::from(n_waves));
        match (Summary::of(&together), Summary::of(&alone)) {
            (Some(a), Some(b)) => {
                let show = |s: &Summary| {
                    format!("{:.2} [{:.2}, {:.2}]", ns * s.p50, ns * s.min, ns * s.max)
                };
                println!(
                    "{n_waves:>6}  {:>24}  {:>24}  {:>8.3}",
                    show(&a),
                    show(&b),
                    a.p50 / b.p50
                );
            }
            _ => println!("{n_waves:>6}  no process CPU time on this system"),
        }
    }
}

#[divan::bench(args = N_WAVES, max_time = 2)]
fn lanes(bencher: Bencher<'_, '_>, n_waves: u32) {
    let (waves, positions) = (Waves::at(&modes(n_waves), TIME_S), positions());
    bencher
        .counter(divan::counter::ItemsCount::new(N_PARTICLES))
        .bench_local(|| side_by_side(&waves, &positions));
}

#[divan::bench(args = N_WAVES, max_time = 2)]
fn scalar(bencher: Bencher<'_, '_>, n_waves: u32) {
    let (modes, positions) = (modes(n_waves), positions());
    let phases = phases(&modes);
    bencher
        .counter(divan::counter::ItemsCount::new(N_PARTICLES))
        .bench_local(|| one_by_one(&modes, &phases, &positions));
}
