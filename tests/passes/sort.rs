//! sort: the order against the reference's stable sort, exactly; the keys against depths in f64.

use crate::bounded::{Bounded, Random, U, dot, exact3};
use crate::harness::Gpu;
use glam::DVec3;
use nimbus::gpu::{Compiler, DeviceCount};
use nimbus::layout::particle::{DrawnRecord, PlacedRecord};
use nimbus::passes;
use nimbus::passes::blobs::{DepthFrom, Depths};
use nimbus::passes::sort::{Count, Form, Sort, TILE};
use nimbus::reference::sort::{depths, distances, key16, key32, order};

type Entry = [u32; 2];

/// The GPU's order of (key, index) entries.
fn sorted(gpu: &mut Gpu, sort: &Sort, keys: &[u32], n_bits: u32) -> Vec<Entry> {
    let entries: Vec<Entry> = keys.iter().zip(0..).map(|(&key, i)| [key, i]).collect();
    let buffer = gpu.upload(&entries);
    let n = Count::Known(keys.len() as u32);
    gpu.run(|rec| sort.record(rec, &buffer, n_bits, n).map(|_| ()));
    gpu.download(&buffer, keys.len())
}

/// The first place where `found` is not the stable order of the keys' low `n_bits`.
fn misplaced(found: &[Entry], keys: &[u32], n_bits: u32) -> Option<usize> {
    let low = |&key: &u32| if n_bits < 32 { key & ((1 << n_bits) - 1) } else { key };
    let expected = order(&keys.iter().map(low).collect::<Vec<_>>());
    assert_eq!(found.len(), expected.len());
    (0..found.len()).find(|&k| found[k] != [keys[expected[k] as usize], expected[k]])
}

/// The forms of a sort: as a CPU sorts, and as GPUs do.
fn forms(gpu: &Gpu) -> [Form; 2] {
    // A device without subgroup operations can scan by blocks, too.
    let limits = gpu.device.limits();
    let ballots = limits.is_one_subgroup(limits.subgroup_size.clamp(8, 64));
    [Form { ballots: false, blocks: false }, Form { ballots, blocks: true }]
}

/// Keys of many kinds: random; equal; sorted; reversed; of few digits; the greatest ones.
fn kinds(n: u32) -> Vec<(&'static str, Vec<u32>)> {
    let mut random = Random(u64::from(n) + 1);
    vec![
        ("random", (0..n).map(|_| random.word() as u32).collect()),
        ("equal", vec![0x1234_5678; n as usize]),
        ("sorted", (0..n).map(|i| i * 7).collect()),
        ("reversed", (0..n).map(|i| u32::MAX - i * 7).collect()),
        ("few digits", (0..n).map(|_| (random.word() as u32 & 0x0301_0203) | 0xff00).collect()),
        ("greatest", (0..n).map(|i| u32::MAX - (i & 1)).collect()),
    ]
}

#[test]
fn entries_come_out_in_the_stable_order_of_their_keys() {
    let mut gpu = Gpu::new();
    for n in [0, 1, 2, 31, 32, 33, 1023, 1024, 1025, 5000, 100_000] {
        for form in forms(&gpu) {
            let sort = Sort::with_form(&gpu.device, &gpu.compiler, n, 8, form).expect("sort");
            for (kind, keys) in kinds(n) {
                for n_bits in [16, 32] {
                    let found = sorted(&mut gpu, &sort, &keys, n_bits);
                    assert_eq!(
                        misplaced(&found, &keys, n_bits),
                        None,
                        "{n} {kind} keys of {n_bits} bits by {form:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn keys_of_any_width_come_out_in_order_counted_by_the_device() {
    let mut gpu = Gpu::new();
    let n = 5000u32;
    let mut random = Random(4);
    let (widths, forms) = ([1u32, 5, 8, 9, 10, 15, 18, 27], forms(&gpu));
    for (n_bits, form) in widths.into_iter().flat_map(|n| forms.map(|form| (n, form))) {
        // A scan has an invocation a digit.
        let most: u32 = if gpu.device.limits().max_workgroup_invocations < 512 { 8 } else { 9 };
        let n_passes = n_bits.div_ceil(most);
        let digit_bits = n_bits.div_ceil(n_passes);
        let sort = Sort::with_form(&gpu.device, &gpu.compiler, n, digit_bits, form).expect("sort");
        // Above the key nothing, as above the number of a bin there is nothing up to the next
        // multiple of any digits.
        let entries: Vec<Entry> =
            (0..n).map(|i| [random.word() as u32 & ((1 << n_bits) - 1), i]).collect();
        for n_counted in [0, 1, 1025, n] {
            let (buffer, out) = (gpu.upload(&entries), gpu.buffer::<Entry>(n as usize));
            let counts = gpu.upload(&[7, n_counted, n_counted.div_ceil(TILE), 1, 1]);
            gpu.run(|rec| {
                let counts = DeviceCount { buffer: &counts, i_count: 1, i_groups: 2 };
                let sorted = sort.record(rec, &buffer, n_bits, Count::Counted(counts))?;
                rec.copy(sorted, &out);
                Ok(())
            });
            let found: Vec<Entry> = gpu.download(&out, n_counted as usize);
            let keys: Vec<u32> = entries[..n_counted as usize].iter().map(|e| e[0]).collect();
            let what = format!("{n_counted} keys of {n_bits} bits by {form:?}");
            assert_eq!(misplaced(&found, &keys, n_bits), None, "{what}");
        }
    }
}

#[test]
fn fewer_entries_than_there_is_room_for_leave_the_rest_alone() {
    let mut gpu = Gpu::new();
    let sort = Sort::new(&gpu.device, &gpu.compiler, 5000).expect("sort");
    let mut random = Random(3);
    let entries: Vec<Entry> = (0..5000).map(|i| [random.word() as u32, i]).collect();
    let buffer = gpu.upload(&entries);
    gpu.run(|rec| sort.record(rec, &buffer, 32, Count::Known(1500)).map(|_| ()));
    let found: Vec<Entry> = gpu.download(&buffer, 5000);
    let keys: Vec<u32> = entries[..1500].iter().map(|e| e[0]).collect();
    assert_eq!(misplaced(&found[..1500], &keys, 32), None);
    assert_eq!(found[1500..], entries[1500..]);
}

#[test]
fn a_million_entries_and_the_same_bytes_twice() {
    let mut gpu = Gpu::new();
    let n = 1_000_000;
    let sort = Sort::new(&gpu.device, &gpu.compiler, n).expect("sort");
    let mut random = Random(9);
    let keys: Vec<u32> = (0..n).map(|_| random.word() as u32).collect();
    for n_bits in [16, 32] {
        let found = sorted(&mut gpu, &sort, &keys, n_bits);
        assert_eq!(misplaced(&found, &keys, n_bits), None, "{n_bits} bits");
        assert!(sorted(&mut gpu, &sort, &keys, n_bits) == found, "{n_bits} bits, again");
    }
}

#[test]
fn an_unstable_sort_and_a_swapped_pair_are_noticed() {
    let mut gpu = Gpu::new();
    // Invocations take their runs from the tile's end: every digit lands in its place, ties in the
    // wrong order.
    let mut sources = passes::sources();
    let last_first = "tile * TILE + (TILE_INVOCATIONS - 1u - t) * RUN";
    assert!(sources.replace("sort_scatter.comp", "tile * TILE + t * RUN", last_first));
    // The form with ballots likewise.
    let last_first = "tile * TILE + (RUN - 1u - j) * TILE_INVOCATIONS + t";
    assert!(sources.replace(
        "sort_scatter.comp",
        "tile * TILE + j * TILE_INVOCATIONS + t",
        last_first
    ));
    let compiler = Compiler::new(sources, None).expect("shaderc");
    let unstable = Sort::new(&gpu.device, &compiler, 1024).expect("sort");
    let keys: Vec<u32> = (0..1024).map(|i| i & 3).collect();
    let found = sorted(&mut gpu, &unstable, &keys, 32);
    assert!(misplaced(&found, &keys, 32).is_some(), "an unstable sort");

    let sort = Sort::new(&gpu.device, &gpu.compiler, 1024).expect("sort");
    let mut found = sorted(&mut gpu, &sort, &keys, 32);
    assert_eq!(misplaced(&found, &keys, 32), None);
    found.swap(700, 701);
    assert_eq!(misplaced(&found, &keys, 32), Some(700));
    found.swap(700, 701);
    found[9][0] ^= 1 << 31;
    assert_eq!(misplaced(&found, &keys, 32), Some(9));
}

const N_PLACED: usize = 20_000;
const RADIUS: f64 = 30.0;

fn placed() -> Vec<PlacedRecord> {
    let mut random = Random(11);
    let mut placed: Vec<_> = (0..N_PLACED)
        .map(|_| PlacedRecord { position: [0; 3].map(|_| random.within(-16.0, 16.0)), sigma: 1.0 })
        .collect();
    placed[0].position = [0.0; 3];
    placed
}

/// Keys on the GPU.
fn keys(
    gpu: &mut Gpu,
    sort: &Sort,
    placed: &[PlacedRecord],
    depth_from: DepthFrom,
    radius: f64,
    n_bits: u32,
) -> Vec<u32> {
    let n = placed.len();
    let (from, entries) = (gpu.upload(placed), gpu.buffer::<Entry>(n));
    let all = DrawnRecord { shift: 0, end: n as u32, ..DrawnRecord::default() };
    let (i_group, drawn) = (gpu.upload(&vec![0u32; n]), gpu.upload(&[all]));
    let buffers = [&from, &i_group, &drawn, &entries];
    let depths = Depths { from: depth_from, radius, n_bits };
    gpu.run(|rec| sort.record_keys(rec, buffers, &depths, n as u32));
    let found: Vec<Entry> = gpu.download(&entries, n);
    assert!(found.iter().zip(0..).all(|(e, i)| e[1] == i), "every entry names its particle");
    found.iter().map(|e| e[0]).collect()
}

/// The depth whose key is `key`: the inverse of the reference's `key32`.
fn depth_of(key: u32) -> f32 {
    let m = !key;
    f32::from_bits(if m >> 31 == 1 { m & 0x7fff_ffff } else { !m })
}

fn depth_bounds(placed: &[PlacedRecord], forward: [f32; 3]) -> Vec<Bounded> {
    placed.iter().map(|p| dot(exact3(forward), exact3(p.position))).collect()
}

/// The first key of 32 bits that is no depth within its bound.
fn wrong_depth(keys: &[u32], depths: &[Bounded]) -> Option<usize> {
    let right =
        |i: &usize| (f64::from(depth_of(keys[*i])) - depths[*i].value).abs() <= depths[*i].error;
    (0..keys.len()).find(|i| !right(i))
}

#[test]
fn keys_of_distances_from_the_eye() {
    let mut gpu = Gpu::new();
    let sort = Sort::new(&gpu.device, &gpu.compiler, N_PLACED as u32).expect("sort");
    let placed = placed();
    let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let positions: Vec<DVec3> = placed.iter().map(|p| vector(p.position)).collect();
    for eye in [[0.0, 0.0, 0.0], [0.3, -0.2, 5.0], [700.0, -300.0, 40.0]] {
        let from = DepthFrom::Eye(eye);
        let found = keys(&mut gpu, &sort, &placed, from, RADIUS, 32);
        let exact = distances(vector(eye), &positions);
        // p (p - 2e)/(|p - e| + |e|): some roundings of the products, and of the quotient.
        let bound = |p: DVec3, z: f64| {
            let e = vector(eye);
            let sum = ((p - e).length() + e.length()).max(1e-30);
            let of_products = p.length() * (p - 2.0 * e).length() / sum;
            8.0 * U * (of_products + z.abs())
        };
        for ((key, z), p) in found.iter().zip(&exact).zip(&positions) {
            let off = (f64::from(depth_of(*key)) - z).abs();
            assert!(off <= bound(*p, *z), "{eye:?} {p}: {off:e}");
        }
        let narrow = keys(&mut gpu, &sort, &placed, from, RADIUS, 16);
        let step = 2.0 * RADIUS / 65536.0;
        for ((key, z), p) in narrow.iter().zip(&exact).zip(&positions) {
            let off = bound(*p, *z) + 1e-3 * step;
            let [low, high] = [z - off, z + off].map(|z| key16(z, RADIUS));
            assert!((high..=low).contains(key), "{eye:?} {p}: {key}, {high} to {low}");
        }
    }
    let eye = [0.3, -0.2, 5.0];
    let right = keys(&mut gpu, &sort, &placed, DepthFrom::Eye(eye), RADIUS, 32);
    for (from, to) in [("p - 2.0 * push.from", "p - push.from"), (">= 0.0)", "> 1e9)")] {
        let compiler = Gpu::wrong_compiler("include/depths.glsl", from, to);
        let wrong = Sort::new(&gpu.device, &compiler, N_PLACED as u32).expect("sort");
        assert!(keys(&mut gpu, &wrong, &placed, DepthFrom::Eye(eye), RADIUS, 32) != right, "{to}");
    }
}

#[test]
fn keys_of_32_bits_are_depths() {
    let mut gpu = Gpu::new();
    let sort = Sort::new(&gpu.device, &gpu.compiler, N_PLACED as u32).expect("sort");
    let placed = placed();
    let positions: Vec<DVec3> =
        placed.iter().map(|p| DVec3::from(p.position.map(f64::from))).collect();
    for z in [3.5f32, -3.5, 0.0, 1e-30, f32::MAX] {
        assert_eq!(depth_of(key32(z)), z, "the inverse");
    }
    for forward in [Random(4).direction(), [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]] {
        let bounds = depth_bounds(&placed, forward);
        let keys = keys(&mut gpu, &sort, &placed, DepthFrom::Plane(forward), RADIUS, 32);
        assert_eq!(wrong_depth(&keys, &bounds), None, "{forward:?}");
        let exact = depths(DVec3::from(forward.map(f64::from)), &positions);
        // Far to near, but for depths closer than their bounds.
        let order = order(&keys);
        for pair in order.windows(2) {
            let [far, near] = [pair[0] as usize, pair[1] as usize];
            assert!(
                exact[far] - exact[near] >= -(bounds[far].error + bounds[near].error),
                "{far} before {near}"
            );
        }
    }
}

/// The 16-bit key before it is cut to an integer: (z_hi − z)·65536/(z_hi − z_lo).
fn steps(depth: Bounded, radius: f64) -> Bounded {
    // The host rounds the radius once and the factor, computed in f64, once.
    Bounded::once(radius).minus(depth).times(Bounded::once(65536.0 / (2.0 * radius)))
}

fn wrong_step(keys: &[u32], depths: &[Bounded], radius: f64) -> Option<usize> {
    let cut = |v: f64| v.floor().clamp(0.0, 65535.0) as u32;
    let right = |i: &usize| {
        let s = steps(depths[*i], radius);
        (cut(s.value - s.error)..=cut(s.value + s.error)).contains(&keys[*i])
    };
    (0..keys.len()).find(|i| !right(i))
}

#[test]
fn keys_of_16_bits_are_steps_of_depth() {
    let mut gpu = Gpu::new();
    let sort = Sort::new(&gpu.device, &gpu.compiler, N_PLACED as u32).expect("sort");
    let placed = placed();
    // The second radius is too small for the particles: keys clamp at both ends.
    for radius in [RADIUS, 5.0] {
        let forward = Random(5).direction();
        let bounds = depth_bounds(&placed, forward);
        let found = keys(&mut gpu, &sort, &placed, DepthFrom::Plane(forward), radius, 16);
        assert_eq!(wrong_step(&found, &bounds, radius), None, "{radius}");
        // The uncertainty is far less than a step.
        assert!(bounds.iter().all(|b| steps(*b, radius).error < 0.1));
        let ends = (found.contains(&0), found.contains(&65535));
        assert_eq!(ends, (radius == 5.0, radius == 5.0));
    }
    let found = keys(&mut gpu, &sort, &placed[..1], DepthFrom::Plane([0.0, 0.0, 1.0]), 0.0, 16);
    assert_eq!(found, [0], "a scene without extent");
}

#[test]
fn wrong_keys_are_noticed() {
    let mut gpu = Gpu::new();
    let (placed, forward) = (placed(), Random(4).direction());
    let bounds = depth_bounds(&placed, forward);
    let sort = Sort::new(&gpu.device, &gpu.compiler, N_PLACED as u32).expect("sort");
    let mut found = keys(&mut gpu, &sort, &placed, DepthFrom::Plane(forward), RADIUS, 32);
    found[77] ^= 1 << 4;
    assert_eq!(wrong_depth(&found, &bounds), Some(77));
    let mut found = keys(&mut gpu, &sort, &placed, DepthFrom::Plane(forward), RADIUS, 16);
    found[78] += 1;
    assert_eq!(wrong_step(&found, &bounds, RADIUS), Some(78));

    // Near to far, and negative depths the wrong way round.
    for (from, to) in [("return ~(", "return ("), ("? ~bits :", "? bits :")] {
        let mut sources = passes::sources();
        assert!(sources.replace("include/key.glsl", from, to));
        let compiler = Compiler::new(sources, None).expect("shaderc");
        let wrong = Sort::new(&gpu.device, &compiler, N_PLACED as u32).expect("sort");
        let found = keys(&mut gpu, &wrong, &placed, DepthFrom::Plane(forward), RADIUS, 32);
        assert!(wrong_depth(&found, &bounds).is_some(), "{from} as {to}");
    }
}

/// Runs of particles, some of which are drawn in part, some not at all: what the entries hold
/// before the sort.
#[test]
fn entries_are_those_of_the_drawn_particles() {
    let mut gpu = Gpu::new();
    let sort = Sort::new(&gpu.device, &gpu.compiler, N_PLACED as u32).expect("sort");
    let (placed, forward) = (placed(), Random(6).direction());
    let all = keys(&mut gpu, &sort, &placed, DepthFrom::Plane(forward), RADIUS, 32);
    let (sizes, counts) = ([5000u32, 0, 1, 7999, 3000, 4000], [4999u32, 0, 1, 0, 3000, 17]);
    let (mut i_first, mut n_drawn) = (0, 0);
    let (mut i_group, mut drawn, mut expected) = (vec![], vec![], vec![]);
    for (g, (size, count)) in sizes.into_iter().zip(counts).enumerate() {
        i_group.extend(vec![g as u32; size as usize]);
        let shift = u32::wrapping_sub(n_drawn, i_first);
        drawn.push(DrawnRecord { shift, end: i_first + count, kappa_scale: 1.0, last_weight: 1.0 });
        expected.extend((i_first..i_first + count).map(|i| [all[i as usize], i]));
        (i_first, n_drawn) = (i_first + size, n_drawn + count);
    }
    assert_eq!((i_first as usize, expected.len()), (N_PLACED, n_drawn as usize));
    let wrongs =
        [("i < group.end", "i <= group.end"), ("i + group.shift", "i")].map(|(from, to)| {
            let compiler = Gpu::wrong_compiler("sort_key.comp", from, to);
            (to, Sort::new(&gpu.device, &compiler, N_PLACED as u32).expect("sort"))
        });
    let mut run = |sort: &Sort, n_sorted: u32| {
        let (from, groups, parts) = (gpu.upload(&placed), gpu.upload(&i_group), gpu.upload(&drawn));
        let entries = gpu.upload(&vec![[7u32, u32::MAX]; N_PLACED]);
        gpu.run(|rec| {
            let buffers = [&from, &groups, &parts, &entries];
            let depths = Depths { from: DepthFrom::Plane(forward), radius: RADIUS, n_bits: 32 };
            sort.record_keys(rec, buffers, &depths, N_PLACED as u32)?;
            sort.record(rec, &entries, 32, Count::Known(n_sorted)).map(|_| ())
        });
        gpu.download::<Entry>(&entries, N_PLACED)
    };
    let unsorted = run(&sort, 0);
    assert!(unsorted[..expected.len()] == expected, "the drawn ones in their order");
    assert!(unsorted[expected.len()..].iter().all(|e| *e == [7, u32::MAX]), "and no others");
    let found = run(&sort, n_drawn);
    let of = |e: &Entry| (e[0], e[1]);
    expected.sort_by_key(of);
    assert!(found[..expected.len()] == expected, "sorted, ties by index");
    for (what, wrong) in wrongs {
        assert!(run(&wrong, 0) != unsorted, "{what} was not noticed");
    }
}
