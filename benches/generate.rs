//! CPU time of generating the paper's boxes on the GPU, and of the single-thread f64 reference in
//! the same run. `cargo bench --bench generate` prints a table of CPU times first, then divan's
//! wall times.

mod cpu;

use std::hint::black_box;
use std::path::Path;

use divan::Bencher;
use nimbus::gpu::{Buffer, Commands, Compiler, Device, Instance, MemoryUsage};
use nimbus::io::box_file;
use nimbus::layout::particle::{BoxRecord, ParticleRecord};
use nimbus::measure::stats::Summary;
use nimbus::model::boxes::{BoxLaw, CloudBox, Form, MAX_ATTEMPTS};
use nimbus::passes::{self, generate::Generate};
use nimbus::reference::generate::{Acceptance, generate_box};

const COUNTS: [u32; 5] = [1_000, 10_000, 50_000, 100_000, 1_000_000];
const LAW: BoxLaw = BoxLaw { radius_scale: 0.6, ..BoxLaw::new(Form::Centred) };
const SEED: u32 = 1;

/// The paper's seventeen boxes with `n` particles in place of 554, each box its share.
fn boxes(n: u32) -> Vec<CloudBox> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cubes-554.dat");
    let mut boxes = box_file::read(&file).expect("the boxes");
    let before: u64 = boxes.iter().map(|b| u64::from(b.n_particles)).sum();
    let (mut passed, mut given) = (0u64, 0u32);
    for b in &mut boxes {
        passed += u64::from(b.n_particles);
        let upto = (passed * u64::from(n) / before) as u32;
        b.n_particles = upto - given;
        given = upto;
    }
    boxes
}

struct OnGpu {
    pass: Generate,
    buffers: [Buffer; 4],
    n: u32,
    commands: Commands,
    device: Device,
}

impl OnGpu {
    fn new(n: u32) -> OnGpu {
        let instance = Instance::new(false).expect("an instance");
        let device = Device::open(&instance, None).expect("a device");
        let compiler =
            Compiler::new(passes::sources(), Compiler::default_cache()).expect("shaderc");
        let mut commands = Commands::new(&device, "bench").expect("commands");
        let (mut records, mut i_group) = (Vec::new(), Vec::new());
        for (b, i_box) in boxes(n).iter().zip(0u32..) {
            records.push(BoxRecord::new(b, &LAW, SEED, i_box, i_group.len() as u32));
            i_group.resize(i_group.len() + b.n_particles as usize, i_box);
        }
        let mut upload = |words: &[u32]| {
            let n_words = words.len() as u64;
            let mut staging =
                Buffer::new::<u32>(&device, "bench.staging", n_words, MemoryUsage::Upload)
                    .expect("staging");
            let buffer = Buffer::new::<u32>(&device, "bench.input", n_words, MemoryUsage::Device)
                .expect("input");
            staging.write(words).expect("write");
            commands
                .run(|rec| {
                    rec.copy(&staging, &buffer);
                    Ok(())
                })
                .expect("upload");
            buffer
        };
        let buffers = [
            upload(bytemuck::cast_slice(&records)),
            upload(&i_group),
            Buffer::new::<ParticleRecord>(
                &device,
                "bench.particles",
                n.into(),
                MemoryUsage::Device,
            )
            .expect("particles"),
            Buffer::new::<u32>(&device, "bench.status", n.into(), MemoryUsage::Device)
                .expect("status"),
        ];
        let pass = Generate::new(&device, &compiler).expect("generate");
        OnGpu { pass, buffers, n, commands, device }
    }

    fn run(&mut self) {
        let (pass, buffers, n) = (&self.pass, self.buffers.each_ref(), self.n);
        self.commands
            .run(|rec| pass.record(rec, buffers, [0, n], MAX_ATTEMPTS))
            .expect("generate runs");
    }
}

fn loop_f64(boxes: &[CloudBox]) {
    for (b, i_box) in boxes.iter().zip(0u32..) {
        black_box(generate_box(b, i_box, SEED, &LAW));
    }
}

fn main() {
    if cpu::is_bench() {
        table();
    }
    divan::main();
}

fn table() {
    let made: Vec<_> = boxes(50_000)
        .iter()
        .zip(0u32..)
        .flat_map(|(b, i)| generate_box(b, i, SEED, &LAW))
        .collect();
    let rate = Acceptance::of(&made).rate().unwrap_or(f64::NAN);
    println!(
        "attempts a particle: {:.3}; device: {}",
        1.0 / rate,
        OnGpu::new(1).device.info().name
    );
    println!("process CPU time a call, ms (p50 [min, max] of n = {})", cpu::N_SAMPLES);
    println!("{:>9}  {:>28}  {:>28}  {:>9}", "particles", "GPU pass", "f64 loop", "GPU/loop");
    for n in COUNTS {
        let mut gpu = OnGpu::new(n);
        let on_gpu = cpu::samples(|| gpu.run());
        let boxes = boxes(n);
        let on_cpu = cpu::samples(|| loop_f64(&boxes));
        match (Summary::of(&on_gpu), Summary::of(&on_cpu)) {
            (Some(g), Some(c)) => {
                let show = |s: &Summary| format!("{:.3} [{:.3}, {:.3}]", s.p50, s.min, s.max);
                println!("{n:>9}  {:>28}  {:>28}  {:>9.3}", show(&g), show(&c), g.p50 / c.p50);
            }
            _ => println!("{n:>9}  no process CPU time on this system"),
        }
    }
}

#[divan::bench(args = COUNTS, max_time = 2)]
fn gpu(bencher: Bencher<'_, '_>, n: u32) {
    let mut gpu = OnGpu::new(n);
    bencher.counter(divan::counter::ItemsCount::new(n)).bench_local(|| gpu.run());
}

#[divan::bench(args = COUNTS, max_time = 2)]
fn f64_loop(bencher: Bencher<'_, '_>, n: u32) {
    let boxes = boxes(n);
    bencher.counter(divan::counter::ItemsCount::new(n)).bench_local(|| loop_f64(&boxes));
}
