//! The second reflection of a frame in f64, and bounds on the device's error.

#![allow(dead_code, reason = "each test binary uses its own part")]

use glam::DVec3;
use nimbus::gpu::Compiler;
use nimbus::layout::facet::{FacetRecord, KeyBits, RegionBoundsRecord};
use nimbus::model::basis::Basis;
use nimbus::model::frame_state::FrameState;
use nimbus::model::grid::DEPOSIT_CUT_SIGMA;
use nimbus::model::light::Light;
use nimbus::model::pairings::pairings;
use nimbus::model::parallel::parallel_map;
use nimbus::model::scene::{Gather, Scene};
use nimbus::reference::deposit::deposit;
use nimbus::reference::occlude::Rectangle;
use nimbus::reference::transmit::{Obstacles, Receiver};
use nimbus::reference::{morton, place, sort};

use crate::emulation::{Exchange, Facet, Gathered, Region};
use crate::harness::{Gpu, assert_within_and_say, check_within};
use crate::rooms::{Frame, frame_by};

/// Returns every facet's light in f64, from the device's facets and the scene.
pub fn reference(f: &Frame) -> Vec<Gathered> {
    let scene = &*f.scene;
    let setting = FrameState::at(scene, &scene.groups(), 0.0).unwrap();
    let origin = setting.light_origin;
    let basis = Basis::new(scene.lighting.exponents, scene.lighting.bases, scene.lighting.sampling);
    let region = |i: usize| {
        let brdf = scene.region_material(i).at(0.0);
        let has_lobe = brdf.ks != DVec3::ZERO && scene.lighting.bases > 1;
        let lobe = has_lobe.then(|| basis.lobe(brdf.ns));
        Region { rectangle: scene.surfaces.get(i).map(|s| Rectangle::new(s, origin)), brdf, lobe }
    };
    let regions: Vec<Region> = (0..scene.n_regions()).map(region).collect();
    let rectangles: Vec<Rectangle> = regions.iter().filter_map(|r| r.rectangle).collect();
    let double = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let facets: Vec<Facet> = f
        .facets
        .iter()
        .map(|r| Facet {
            position: double(r.position),
            normal: double(r.normal),
            area: f64::from(r.area),
            i_region: r.i_region as usize,
            color: double(r.color),
        })
        .collect();
    let groups = scene.groups();
    let generated: Vec<_> =
        scene.clouds.iter().flat_map(|c| nimbus::reference::live::cloud(c, 0.0)).collect();
    let offsets = place::offsets(&groups, &scene.clouds, 0.0, origin);
    let rest: Vec<DVec3> = generated.iter().map(|g| g.position).collect();
    let blobs = place::blobs(&generated, &place::place(&rest, &groups, &offsets));
    let cells = deposit(&setting.grid, &blobs);
    let forward = if blobs.is_empty() { 1.0 } else { scene.lighting.forward };
    let lights: Vec<Light> = scene.lights.iter().map(|l| l.relative_to(origin)).collect();
    let step = scene.lighting.step;
    let obstacles =
        Obstacles { spec: &setting.grid, cells: &cells, rectangles: &rectangles, step, forward };
    let receivers: Vec<Receiver> = facets
        .iter()
        .map(|f| Receiver { position: f.position, i_region: f.i_region as u32 })
        .collect();
    let transmittance = obstacles.transmittance(&receivers, &lights);
    let through = obstacles.through(&receivers, &lights);
    let pairings = pairings(&scene.surfaces, scene.clouds.len());
    let exchange = Exchange {
        facets: &facets,
        regions: &regions,
        lights: &lights,
        transmittance: &transmittance,
        through: &through,
        spec: &setting.grid,
        cells: &cells,
        forward,
        step,
        pairs: scene.lighting.pairs,
        eye: f.eye,
        pairings: &pairings,
        reach: setting.radius.max(2.0),
    };
    let senders = exchange.senders();
    if scene.lighting.gather != Gather::Tree {
        return parallel_map(facets.len(), |j| exchange.gather(j, &senders));
    }
    let clusters = exchange.clusters(&order(f), &senders, scene.lighting.theta);
    parallel_map(facets.len(), |j| exchange.gather_from(j, &senders, &clusters))
}

/// The facet of each position. Keys are computed in f32 by a difference and a product, which Vulkan
/// rounds correctly.
fn order(f: &Frame) -> Vec<u32> {
    let (scene, bits) = (&*f.scene, KeyBits::of(f.scene.n_regions() as u32));
    let bounds = scene.region_bounds(&scene.groups(), 0.0, DEPOSIT_CUT_SIGMA);
    let records: Vec<_> =
        bounds.into_iter().map(|b| RegionBoundsRecord::new(b, f.origin, bits)).collect();
    let key = |facet: &FacetRecord| {
        let r = &records[facet.i_region as usize];
        let cells = [0, 1, 2].map(|k| {
            morton::cell(f64::from((facet.position[k] - r.low[k]) * r.scale[k]), bits.axis)
        });
        morton::key(facet.i_region, cells, bits.region)
    };
    sort::order(&f.facets.iter().map(key).collect::<Vec<_>>())
}

/// I_i and L2, channel by channel.
pub fn values(f: &Frame) -> [Vec<f64>; 2] {
    let of = |k: usize| {
        f.lit
            .iter()
            .flat_map(|l| if k == 0 { l.indirect } else { l.second })
            .map(f64::from)
            .collect()
    };
    [of(0), of(1)]
}

/// Returns I_i and L2 with their bounds.
pub type Truths = ([Vec<f64>; 2], [Vec<f64>; 2]);

pub fn truths(found: &[Gathered]) -> Truths {
    let flat = |of: &dyn Fn(&Gathered) -> DVec3| {
        found.iter().flat_map(|g| of(g).to_array()).collect::<Vec<f64>>()
    };
    (
        [flat(&|g| g.indirect), flat(&|g| g.second)],
        [flat(&|g| g.indirect_error), flat(&|g| g.second_error)],
    )
}

pub fn assert_agrees(what: &str, f: &Frame) {
    let found = reference(f);
    let (values, (truths, bounds)) = (values(f), truths(&found));
    for (k, quantity) in ["I_i", "L2"].into_iter().enumerate() {
        assert_within_and_say(&format!("{what}, {quantity}"), &values[k], &truths[k], &bounds[k]);
        // The bound is meaningful: for all but a few facets it is a thousandth of the largest
        // light.
        let greatest = truths[k].iter().cloned().fold(0.0, f64::max);
        let n_loose = bounds[k].iter().filter(|b| **b > 1e-3 * greatest).count();
        println!("  greatest {greatest:.3e}, {n_loose} of {} loose", bounds[k].len());
        assert!(
            greatest > 0.0 && n_loose * 20 <= bounds[k].len(),
            "{what}: {n_loose} loose bounds"
        );
    }
    let mut n = 0.0;
    for (j, (lit, truth)) in f.lit.iter().zip(&found).enumerate() {
        let off = (f64::from(lit.n_unresolved) - truth.n_unresolved).abs();
        assert!(
            off <= truth.n_doubted,
            "{what}: facet {j} counts {} for {truth:?}",
            lit.n_unresolved
        );
        n += truth.n_unresolved;
    }
    println!("  {n} cells unresolved");
}

/// Returns whether the results of `compiler`'s shaders exceed their bounds.
pub fn is_noticed(
    gpu: &Gpu,
    compiler: &Compiler,
    scene: &Scene,
    (truths, bounds): &Truths,
) -> bool {
    let found = values(&frame_by(gpu, compiler, scene.clone()));
    [0, 1].iter().any(|&k| check_within("wrong", &found[k], &truths[k], &bounds[k]).is_err())
}
