//! Time of the radix sort with keys of 16 and 32 bits, and of the standard library's stable sort on
//! one thread. `cargo bench --bench sort` prints a table of CPU times first, then divan's wall
//! times.

mod cpu;

use std::hint::black_box;

use divan::Bencher;
use nimbus::gpu::{Buffer, Commands, Compiler, Device, Instance, MemoryUsage};
use nimbus::measure::stats::Summary;
use nimbus::model::philox::philox4x32_10;
use nimbus::passes::{
    self,
    sort::{Count, Sort},
};

const COUNTS: [u32; 4] = [10_000, 50_000, 100_000, 1_000_000];
const BITS: [u32; 2] = [16, 32];

/// Random keys: the sort's cost does not depend on them but for memory's caches, which random ones
/// treat worst.
fn entries(n: u32, n_bits: u32) -> Vec<[u32; 2]> {
    (0..n).map(|i| [philox4x32_10([1, 2], [i, 0, 0, 0])[0] >> (32 - n_bits), i]).collect()
}

struct OnGpu {
    sort: Sort,
    input: Buffer,
    entries: Buffer,
    n: u32,
    n_bits: u32,
    commands: Commands,
    device: Device,
}

impl OnGpu {
    fn new(n: u32, n_bits: u32) -> OnGpu {
        let instance = Instance::new(false).expect("an instance");
        let device = Device::open(&instance, None).expect("a device");
        let compiler =
            Compiler::new(passes::sources(), Compiler::default_cache()).expect("shaderc");
        let commands = Commands::new(&device, "bench").expect("commands");
        let place =
            |name, place| Buffer::new::<[u32; 2]>(&device, name, n.into(), place).expect("buffer");
        let (mut input, to) = (
            place("bench.input", MemoryUsage::Upload),
            place("bench.entries", MemoryUsage::Device),
        );
        input.write(&entries(n, n_bits)).expect("write");
        let sort = Sort::new(&device, &compiler, n).expect("sort");
        OnGpu { sort, input, entries: to, n, n_bits, commands, device }
    }

    /// The copy of unsorted entries is in the time: 8 bytes an entry read and written, against 16
    /// each of the passes.
    fn run(&mut self) {
        let (sort, input, entries) = (&self.sort, &self.input, &self.entries);
        let (n, n_bits) = (self.n, self.n_bits);
        let run = self.commands.run(|rec| {
            rec.copy(input, entries);
            sort.record(rec, entries, n_bits, Count::Known(n)).map(|_| ())
        });
        run.expect("sort runs");
    }
}

fn std_sort(entries: &[[u32; 2]]) {
    let mut entries = entries.to_vec();
    entries.sort_by_key(|e| e[0]);
    black_box(entries);
}

fn main() {
    if cpu::is_bench() {
        table();
    }
    divan::main();
}

fn table() {
    println!("device: {}", OnGpu::new(1, 32).device.info().name);
    println!("process CPU time a call, ms (p50 [min, max] of n = {})", cpu::N_SAMPLES);
    println!(
        "{:>9} {:>4}  {:>28}  {:>28}  {:>8}",
        "entries", "bits", "GPU pass", "std stable sort", "GPU/std"
    );
    for n in COUNTS {
        for n_bits in BITS {
            let mut gpu = OnGpu::new(n, n_bits);
            let on_gpu = cpu::samples(|| gpu.run());
            let unsorted = entries(n, n_bits);
            let on_cpu = cpu::samples(|| std_sort(&unsorted));
            match (Summary::of(&on_gpu), Summary::of(&on_cpu)) {
                (Some(g), Some(c)) => {
                    let show = |s: &Summary| format!("{:.3} [{:.3}, {:.3}]", s.p50, s.min, s.max);
                    println!(
                        "{n:>9} {n_bits:>4}  {:>28}  {:>28}  {:>8.3}",
                        show(&g),
                        show(&c),
                        g.p50 / c.p50
                    );
                }
                _ => println!("{n:>9} {n_bits:>4}  no process CPU time on this system"),
            }
        }
    }
}

#[divan::bench(args = COUNTS, consts = BITS, max_time = 2)]
fn gpu<const N_BITS: u32>(bencher: Bencher<'_, '_>, n: u32) {
    let mut gpu = OnGpu::new(n, N_BITS);
    bencher.counter(divan::counter::ItemsCount::new(n)).bench_local(|| gpu.run());
}

#[divan::bench(args = COUNTS, max_time = 2)]
fn std_stable(bencher: Bencher<'_, '_>, n: u32) {
    let unsorted = entries(n, 32);
    bencher.counter(divan::counter::ItemsCount::new(n)).bench_local(|| std_sort(&unsorted));
}
