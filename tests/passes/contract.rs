//! contract: sums of random tensors, every facet against the f64 reference, within the bound of its
//! roundings.

use crate::bounded::{Random, U, greatest_ratio};
use crate::harness::{Gpu, assert_within_and_say};
use crate::sums::{KAHAN, PAIRWISE, PLAIN, has_doubles, ways_of};
use glam::DVec3;
use nimbus::gpu::Compiler;
use nimbus::layout::facet::{
    FacetRecord, LitRecord, NO_LOBE, REGION_CLOUD, REGION_COLORED, REGION_SURFACE,
};
use nimbus::layout::facet::{RegionRecord, lobe_width};
use nimbus::layout::frame::LightRecord;
use nimbus::model::sums::{Precision, Sums};
use nimbus::passes::contract::{Contract, ContractBuffers, Push, TILE};
use nimbus::reference::contract::{Receiver, Reflected, Tensors, contract};
use nimbus::reference::rounding::sum_error;

const N_BASES: u32 = 5;
/// Columns that each region can receive light from, of 16: (first, number).
const SPANS: [&[[u32; 2]]; 4] = [&[[0, 16]], &[[1, 3], [7, 6]], &[], &[[15, 1]]];

/// Regions without and with a lobe, with and without colours, whose facets' number is no multiple
/// of a workgroup's.
struct Case {
    facets: Vec<FacetRecord>,
    regions: Vec<RegionRecord>,
    lights: Vec<LightRecord>,
    coefficients: Vec<[f32; 4]>,
    t1: Vec<f32>,
    /// [light][column][row]; 0 where no span lies.
    t2: Vec<f32>,
    spans: Vec<[u32; 2]>,
    n_rows: u32,
    n_columns: u32,
}

fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

fn case(n_lights: usize, two_reflections: bool) -> Case {
    let mut r = Random(n_lights as u64);
    let color = |r: &mut Random| [0; 3].map(|_| r.within(0.0, 1.0));
    let (mut facets, mut regions) = (vec![], vec![]);
    let (mut i_row, mut i_column) = (0, 0);
    let kinds = [
        (REGION_SURFACE, true, 83),
        (REGION_COLORED, true, 70),
        (REGION_CLOUD, false, 129),
        (REGION_COLORED, false, 1),
    ];
    for (i_region, (kind, glossy, n_facets)) in (0u32..).zip(kinds) {
        let n_vectors = if glossy { N_BASES - 1 } else { 0 };
        regions.push(RegionRecord {
            kd: color(&mut r),
            kind,
            i_lobe: if glossy { 0 } else { NO_LOBE },
            i_first_facet: facets.len() as u32,
            n_facets,
            lobe_width: lobe_width(8.0),
            i_column,
            i_row,
            ..RegionRecord::default()
        });
        facets.extend((0..n_facets).map(|_| FacetRecord {
            i_region,
            color: color(&mut r),
            ..FacetRecord::default()
        }));
        i_row += n_facets * (1 + n_vectors);
        i_column += n_vectors + if kind == REGION_COLORED { 3 } else { 1 };
    }
    let mut lights: Vec<LightRecord> = (0..n_lights)
        .map(|_| LightRecord { energy: color(&mut r), ..LightRecord::default() })
        .collect();
    if n_lights > 2 {
        lights[1].energy = [0.0; 3];
    }
    let i_row = i_row.next_multiple_of(TILE);
    let n_columns = i_column;
    let mut signed = |n: usize| (0..n).map(|_| r.within(-1.0, 1.0)).collect::<Vec<f32>>();
    let t1 = signed(n_lights * i_row as usize);
    let mut t2 = signed(n_lights * (i_row * n_columns) as usize);
    let mut spans = vec![[0, 0]; regions.len()];
    for (i, own) in SPANS.iter().enumerate().filter(|_| two_reflections) {
        spans[i] = [spans.len() as u32, own.len() as u32];
        spans.extend(*own);
    }
    // Row by row, and the rest rows of no facet.
    let of_row =
        |row: u32| regions.iter().rposition(|r: &RegionRecord| r.i_row <= row).unwrap_or(0);
    for (k, value) in t2.iter_mut().enumerate() {
        let (row, column) = (k as u32 % i_row, k as u32 / i_row % n_columns);
        if !two_reflections
            || !SPANS[of_row(row)].iter().any(|s| (s[0]..s[0] + s[1]).contains(&column))
        {
            *value = 0.0;
        }
    }
    let coefficients = (0..i_column).map(|_| [0; 4].map(|_| signed(1)[0])).collect();
    Case { facets, regions, lights, coefficients, t1, t2, spans, n_rows: i_row, n_columns }
}

impl Case {
    fn run(&self, gpu: &mut Gpu, compiler: Option<&Compiler>) -> Vec<f64> {
        self.run_as(gpu, compiler, PLAIN)
    }

    fn run_as(&self, gpu: &mut Gpu, compiler: Option<&Compiler>, sums: Sums) -> Vec<f64> {
        let compiler = compiler.unwrap_or(&gpu.compiler);
        let pass = Contract::new(&gpu.device, compiler, N_BASES, &sums.into()).expect("contract");
        // The counts of `second` must stay.
        let lit: Vec<_> = (0..self.facets.len())
            .map(|j| LitRecord { n_unresolved: j as f32, unresolved: 0.5, ..LitRecord::default() })
            .collect();
        let buffers = [
            gpu.upload(&self.facets),
            gpu.upload(&self.lights),
            gpu.upload(&self.regions),
            gpu.upload(&self.coefficients),
            gpu.upload(&self.t1),
            gpu.upload(&self.tiled()),
            gpu.upload(&self.spans),
            gpu.upload(&lit),
        ];
        let push = Push {
            n_facets: self.facets.len() as u32,
            n_lights: self.lights.len() as u32,
            n_rows: self.n_rows,
            n_columns: self.n_columns,
        };
        let [facets, lights, regions, coefficients, t1, t2, spans, lit] = buffers.each_ref();
        let named = ContractBuffers { facets, lights, regions, coefficients, t1, t2, spans, lit };
        gpu.run(|rec| pass.record(rec, &named, &push));
        let lit: Vec<LitRecord> = gpu.download(&buffers[7], self.facets.len());
        assert!((0..).zip(&lit).all(|(j, l)| (l.n_unresolved, l.unresolved) == (j as f32, 0.5)));
        lit.iter()
            .flat_map(|l| [l.direct, l.indirect, l.first, l.second].concat())
            .map(f64::from)
            .collect()
    }

    /// T2 as the GPU has it: [light][row / TILE][column][row % TILE].
    fn tiled(&self) -> Vec<f32> {
        let (n_rows, n_columns, tile) =
            (self.n_rows as usize, self.n_columns as usize, TILE as usize);
        let at = |k: usize| {
            let (lane, column, tile_of_all) =
                (k % tile, k / tile % n_columns, k / tile / n_columns);
            let (l, row) = (tile_of_all * tile / n_rows, tile_of_all * tile % n_rows + lane);
            let value = self.t2[(l * n_columns + column) * n_rows + row];
            // Columns outside all spans are not read.
            if value == 0.0 { f32::NAN } else { value }
        };
        (0..self.t2.len()).map(at).collect()
    }

    /// The reference's sums, of the numbers as they are or (`magnitudes`) of their absolute values.
    fn truth(&self, magnitudes: bool) -> Vec<f64> {
        let of = |v: f64| if magnitudes { v.abs() } else { v };
        let of3 = |v: DVec3| if magnitudes { v.abs() } else { v };
        let doubles = |v: &[f32]| v.iter().map(|v| of(f64::from(*v))).collect::<Vec<f64>>();
        let (t1, t2) = (doubles(&self.t1), doubles(&self.t2));
        let (n_rows, n_columns) = (self.n_rows as usize, self.n_columns as usize);
        let tensors = Tensors { t1: &t1, t2: &t2, n_rows, n_columns };
        let energies: Vec<DVec3> = self.lights.iter().map(|l| double(l.energy)).collect();
        let columns: Vec<DVec3> =
            self.coefficients.iter().map(|c| of3(double([c[0], c[1], c[2]]))).collect();
        let lit = |(j, facet): (usize, &FacetRecord)| {
            let region = &self.regions[facet.i_region as usize];
            let n_plain = if region.kind == REGION_COLORED { 3 } else { 1 };
            let n_vectors = if region.i_lobe == NO_LOBE { 0 } else { N_BASES as usize - 1 };
            let first = region.i_column as usize + n_plain;
            let receiver = Receiver {
                row: region.i_row as usize + j - region.i_first_facet as usize,
                stride: region.n_facets as usize,
                albedo: double(region.kd) * double(facet.color),
                lobe: columns[first..first + n_vectors].to_vec(),
            };
            let Reflected { direct, indirect, first, second } =
                contract(&tensors, &energies, &columns, &receiver);
            [direct, indirect, first, second].map(|v| v.to_array()).concat()
        };
        self.facets.iter().enumerate().flat_map(lit).collect()
    }

    /// Whatever the order of the sums, a term passes at most a rounding for each column, light and
    /// basis, and one for each of its products (C T, E, K_d c twice or c_b, π) and of π's own;
    /// f64's are 2⁻²⁹ of them. A flushed number costs less than 2⁻¹²⁰.
    fn bounds(&self) -> Vec<f64> {
        let n = (self.n_columns as usize + self.lights.len()) as f64 + f64::from(N_BASES) + 6.0;
        self.truth(true).into_iter().map(|m| n * U / (1.0 - n * U) * m + 2f64.powi(-100)).collect()
    }

    /// Of sums that are no plain f32 ones: one over all lights, bases and columns, of products of
    /// four (K_d c, E, C, T), which in f32 are rounded four times, as are π and the product by it;
    /// in f64 2⁻²⁹ of that.
    fn bounds_as(&self, sums: Sums) -> Vec<f64> {
        if sums == PLAIN {
            return self.bounds();
        }
        let n_terms = self.n_columns as usize * self.lights.len() * N_BASES as usize;
        let of_terms = if sums.precision == Precision::F32 { 6.01 * U } else { 1e-6 * U };
        let share = of_terms + (1.0 + of_terms) * sum_error(sums, n_terms as u64);
        self.truth(true).into_iter().map(|m| share * m + 2f64.powi(-100)).collect()
    }
}

/// Diffuse facets that receive from thousands of columns, the first of which brings all but what by
/// itself is rounded away.
fn long() -> Case {
    const N_COLUMNS: usize = 4096;
    let mut r = Random(3);
    let region =
        RegionRecord { kd: [0.5; 3], i_lobe: NO_LOBE, n_facets: 64, ..RegionRecord::default() };
    let facet = FacetRecord { color: [1.0; 3], ..FacetRecord::default() };
    let light = LightRecord { energy: [1.0, 2.0, 0.5], ..LightRecord::default() };
    let of_column = |c: usize| if c == 0 { 1.0 } else { f64::from(r.within(0.3, 0.45)) * U };
    let columns: Vec<f32> = (0..N_COLUMNS).map(of_column).map(|v| v as f32).collect();
    Case {
        facets: vec![facet; 64],
        regions: vec![region],
        lights: vec![light],
        coefficients: vec![[1.0; 4]; N_COLUMNS],
        t1: vec![0.5; 64],
        t2: columns.iter().flat_map(|v| [*v; 64]).collect(),
        spans: vec![[1, 1], [0, N_COLUMNS as u32]],
        n_rows: 64,
        n_columns: N_COLUMNS as u32,
    }
}

#[test]
fn every_facet_is_the_sum_that_the_reference_says() {
    let mut gpu = Gpu::new();
    for (n_lights, two_reflections) in [(1, true), (4, true), (3, false)] {
        let case = case(n_lights, two_reflections);
        let (values, truths, bounds) = (case.run(&mut gpu, None), case.truth(false), case.bounds());
        assert_within_and_say(
            &format!("{n_lights} lights, T2 {two_reflections}"),
            &values,
            &truths,
            &bounds,
        );
        // The bound itself says something: of sums of up to 4 · 16 · 5 numbers below 1, 31
        // roundings of 2⁻²⁴.
        assert!(
            bounds.iter().all(|b| *b < 3e-4),
            "{:?}",
            bounds.iter().cloned().fold(0.0, f64::max)
        );
        if !two_reflections {
            let second = values.chunks(12).flat_map(|c| [&c[3..6], &c[9..12]].concat());
            assert!(second.into_iter().all(|v| v == 0.0));
        }
    }
}

#[test]
fn every_way_to_sum_is_within_its_own_bound() {
    let mut gpu = Gpu::new();
    for case in [case(4, true), long()] {
        let truths = case.truth(false);
        for sums in ways_of(&gpu.device) {
            let (values, bounds) = (case.run_as(&mut gpu, None, sums), case.bounds_as(sums));
            assert_within_and_say(&format!("{sums:?}"), &values, &truths, &bounds);
        }
    }
    // The bounds of the others are not those of plain sums, and these would not keep them.
    let (case, ways) = (long(), [KAHAN, PAIRWISE, Sums { precision: Precision::F64, ..PLAIN }]);
    let (plain, truths) = (case.run(&mut gpu, None), case.truth(false));
    for sums in ways {
        let ratio = greatest_ratio(&plain, &truths, &case.bounds_as(sums));
        assert!(ratio > 10.0, "{sums:?}: {ratio}");
    }
}

#[test]
fn wrong_terms_of_long_sums_are_noticed() {
    let mut gpu = Gpu::new();
    let mut ways = vec![KAHAN];
    if has_doubles(&gpu.device) {
        ways.push(Sums { precision: Precision::F64, ..PLAIN });
    }
    let case = case(3, true);
    let truths = case.truth(false);
    for (from, to) in [
        ("energy * own[b] * FLOAT(t1", "own[b] * FLOAT(t1"),
        ("ADD(sum.second, indirect * own[0])", "ADD(sum.second, indirect)"),
        ("ADD(sum.second, column * own[b]", "ADD(sum.second, column * own[0]"),
        ("REAL3 column = energy * coefficient_of(c)", "REAL3 column = REAL3(energy)"),
        ("3.14159265358979", "3.1415"),
    ] {
        let compiler = Gpu::wrong_compiler("contract.comp", from, to);
        for sums in ways.iter().copied() {
            let values = case.run_as(&mut gpu, Some(&compiler), sums);
            let ratio = greatest_ratio(&values, &truths, &case.bounds_as(sums));
            assert!(ratio > 1.0, "{sums:?}: {from} as {to}");
        }
    }
}

#[test]
fn without_lights_it_is_dark() {
    assert!(case(0, true).run(&mut Gpu::new(), None).iter().all(|v| *v == 0.0));
}

#[test]
fn a_wrong_sum_is_noticed() {
    let mut gpu = Gpu::new();
    let case = case(3, true);
    let (truths, bounds) = (case.truth(false), case.bounds());
    for (from, to) in [
        ("int(at[0] + c * TILE)", "int(at[0] + c)"),
        ("second_at(l, rows", "second_at(0u, rows"),
        ("int(l * push.n_rows + rows[b])", "int(rows[b])"),
        ("region.kind == REGION_COLORED ? 3u : 1u", "1u"),
        ("REAL3(region.kd) * facet.color", "REAL3(region.kd)"),
        ("glossy ? 1u : 0u", "0u"),
        ("rows[b - 1u] + region.n_facets", "rows[b - 1u] + 1u"),
        ("j - region.i_first_facet", "j"),
        ("3.14159265358979", "3.1415"),
        ("sum.second += column * second", "sum.second += column * indirect"),
    ] {
        let compiler = Gpu::wrong_compiler("contract.comp", from, to);
        let values = case.run(&mut gpu, Some(&compiler));
        assert!(greatest_ratio(&values, &truths, &bounds) > 1.0, "{from} as {to}");
    }
}
