//! How blocks are dealt to rounds: whole buffers against a serial walk through the blocks.

use nimbus::gpu::{Compiler, Kernel};
use nimbus::layout::cull::KeptRecord;
use nimbus::layout::tiles::RoundRecord;
use nimbus::passes;
use nimbus::passes::tiles::{BLOCK, RoundsPush};

use crate::bounded::Random;
use crate::harness::Gpu;

/// The most pairs of a block: each of its splats reaches all of the most bins.
const MOST: u32 = BLOCK << 15;
/// The word behind the blocks and rounds, and in rounds before they are written.
const UNTOUCHED: u32 = 0xdead_beef;
const UNTOUCHED_ROUND: RoundRecord = {
    let four = [UNTOUCHED; 4];
    RoundRecord { extent: four, blocks: four, bins: four, tiles: four, alone: four }
};

/// Blocks to deal, and how.
struct Case {
    what: String,
    n_splats: u32,
    /// Pairs of each block.
    n_pairs: Vec<u32>,
    capacity: u32,
    most_blocks: u32,
}

/// Pairs before each block in its round, and the rounds.
type Dealt = (Vec<u32>, Vec<RoundRecord>);

impl Case {
    fn push(&self, n_rounds: u32) -> RoundsPush {
        let Case { capacity, most_blocks, .. } = *self;
        RoundsPush { n_rounds, capacity, most_blocks, sort_tile: 1024, bin_groups: 5 }
    }

    /// The law: a round ends before the first block that it has no room for. Three empty rounds
    /// follow.
    fn truth(&self) -> Dealt {
        let mut before = vec![];
        let mut rounds: Vec<[u32; 3]> = vec![];
        let (mut first, mut n) = (0, 0u32);
        for (i, &of_block) in (0..).zip(&self.n_pairs) {
            let sum = n.checked_add(of_block).expect("no sum of a round and a block wraps");
            if sum > self.capacity || i - first == self.most_blocks {
                rounds.push([first, i, n]);
                (first, n) = (i, 0);
            }
            before.push(n);
            n += of_block;
        }
        rounds.push([first, self.n_pairs.len() as u32, n]);
        let last = rounds.len() - 1;
        let record = |(k, [first, end, n]): (usize, [u32; 3])| {
            assert!(n <= self.capacity, "{}", self.what);
            RoundRecord {
                extent: [n.div_ceil(1024), 1, 1, n],
                blocks: [end - first, 1, 1, first],
                bins: [if n > 0 { 5 } else { 0 }, 1, 1, u32::from(k < last)],
                tiles: [0, 0, 1, 0],
                alone: [0, 0, 1, 0],
            }
        };
        rounds.extend([[0; 3]; 3]);
        (before, rounds.into_iter().enumerate().map(record).collect())
    }

    /// Whether the device's buffers are the reference's. There is room for a round a block, as a
    /// faulty kernel may need.
    fn holds(&self, gpu: &mut Gpu, kernel: &Kernel) -> bool {
        let (mut before, mut rounds) = self.truth();
        let push = self.push(rounds.len() as u32);
        before.push(UNTOUCHED);
        rounds.resize(self.n_pairs.len() + 5, UNTOUCHED_ROUND);
        let pairs = gpu.upload(&[&self.n_pairs[..], &[UNTOUCHED]].concat());
        let dealt = gpu.upload(&vec![UNTOUCHED_ROUND; rounds.len()]);
        let kept = gpu.upload(&[KeptRecord::of(self.n_splats, BLOCK)]);
        gpu.run(|rec| rec.dispatch_groups(kernel, &[&pairs, &dealt, &kept], &push, 1));
        let found: Dealt = (gpu.download(&pairs, before.len()), gpu.download(&dealt, rounds.len()));
        found == (before, rounds)
    }
}

/// Numbers of pairs of many kinds for `n` blocks, each with a capacity that the host may choose.
fn cases(n: usize) -> Vec<Case> {
    let mut random = Random(n as u64);
    let mut below = |most: u32| (random.word() % u64::from(most)) as u32;
    let kinds: Vec<(&str, Vec<u32>, u32)> = vec![
        ("empty", vec![0; n], 2),
        ("ones", vec![1; n], 100),
        ("greatest", vec![MOST; n], 2 * MOST),
        ("greatest, one pair short of three", vec![MOST; n], 3 * MOST - 1),
        ("greatest, in the greatest rounds", vec![MOST; n], u32::MAX - MOST),
        ("random", (0..n).map(|_| below(MOST + 1)).collect(), 1 << 26),
        ("random, of the least capacity", (0..n).map(|_| below(1001)).collect(), 2000),
        ("few, in one round", (0..n).map(|_| below(900)).collect(), 1 << 26),
        (
            "most are empty",
            (0..n).map(|_| if below(20) == 0 { below(500_000) } else { 0 }).collect(),
            1 << 20,
        ),
        (
            "some more than half of a round",
            (0..n).map(|i| if i % 37 == 5 { 700 + below(300) } else { below(40) }).collect(),
            1300,
        ),
    ];
    // llvmpipe ends loops after 65 535 turns, and there the host lets a round have 127 blocks.
    let least = if n < 60_000 { 1 } else { 2 };
    let of_kind = |(what, n_pairs, capacity): (&str, Vec<u32>, u32)| {
        [65_535, 255, least].map(|most_blocks| Case {
            what: format!("{n} blocks, {what}, {most_blocks} a round"),
            // The last block is full, nearly, or has one splat.
            n_splats: (n as u32 * BLOCK).saturating_sub([0, 3, BLOCK - 1][n % 3]),
            n_pairs: n_pairs.clone(),
            capacity,
            most_blocks,
        })
    };
    kinds.into_iter().flat_map(of_kind).collect()
}

fn kernel(gpu: &Gpu, compiler: &Compiler, [invocations, is_one_subgroup]: [u32; 2]) -> Kernel {
    let macros = [("INVOCATIONS", invocations), ("ONE_SUBGROUP", is_one_subgroup)];
    let fields = RoundsPush::FIELDS;
    Kernel::with_macros(&gpu.device, compiler, "tiles.rounds", fields, &[], &macros)
        .expect("rounds")
}

/// Invocations of a workgroup, and whether it is one subgroup.
fn forms(gpu: &Gpu) -> Vec<[u32; 2]> {
    let limits = gpu.device.limits();
    let invocations = passes::tiles::invocations(limits);
    let mut forms = vec![[8, 0], [64, 0]];
    forms.extend(limits.is_one_subgroup(invocations).then_some([invocations, 1]));
    forms
}

#[test]
fn rounds_are_those_of_a_serial_walk() {
    let mut gpu = Gpu::new();
    // About the windows of 8, 32 and 64 invocations; a million splats, four, and the most.
    let around = [128, 512, 1024].into_iter().flat_map(|n| [n - 1, n, n + 1]);
    for n in [0, 1, 2, 3, 17, 300].into_iter().chain(around).chain([3907, 15_625, 65_535]) {
        let cases = cases(n);
        for form in forms(&gpu) {
            let kernel = kernel(&gpu, &gpu.compiler, form);
            for case in &cases {
                assert!(case.holds(&mut gpu, &kernel), "{}, by {form:?}", case.what);
            }
        }
    }
}

#[test]
fn wrong_rounds_are_noticed() {
    let mut gpu = Gpu::new();
    let cases = cases(1025);
    for (from, to) in [
        ("of_block[j] > push.capacity", "of_block[j] >= push.capacity"),
        ("first >= push.most_blocks", "first > push.most_blocks"),
        ("i + j > first &&", "i + j > first + 1u &&"),
        ("uint sum = n + found.x;", "uint sum = found.x;"),
        ("n -= end.y;", ""),
        (">= end.x ? end.y : 0u", "> end.x ? end.y : 0u"),
        ("t >= reach ? left : 0u", "left"),
        ("subgroupBallotFindLSB", "subgroupBallotFindMSB"),
        ("atomicMin(least, block)", "atomicExchange(least, block)"),
        ("k += 1u + t", "k += 2u + t"),
        ("(kept[0].sort.w + BLOCK - 1u)", "kept[0].sort.w"),
    ] {
        let wrong = Gpu::wrong_compiler("tiles_rounds.comp", from, to);
        for form in forms(&gpu) {
            let is_of_subgroups = from.contains("subgroup") || from.contains("left");
            let is_shared = from.contains("atomic");
            if if form[1] == 1 { is_shared } else { is_of_subgroups } {
                continue;
            }
            let kernel = kernel(&gpu, &wrong, form);
            let noticed = cases.iter().any(|case| !case.holds(&mut gpu, &kernel));
            assert!(noticed, "{from} as {to}, by {form:?}");
        }
    }
}
