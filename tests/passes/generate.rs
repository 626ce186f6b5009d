//! The pass generate against its f64 reference: whole buffers, every particle at its own bound.

mod distribution;

use crate::harness::{Gpu, assert_within_and_say, check_within};
use glam::DVec3;
use nimbus::gpu::{Compiler, Kernel};
use nimbus::layout::particle::{BoxRecord, FORM_GIVEN, ParticleRecord};
use nimbus::model::boxes::{BoxLaw, CloudBox, Form, MAX_ATTEMPTS};
use nimbus::model::cloud::SIGMA_PER_RADIUS;
use nimbus::passes::generate::{FOLDED, Generate, Push};
use nimbus::reference::generate::{Generated, generate_particle};
use nimbus::reference::rounding::{ParticleBound, U_F32, particle_bound};

const FORMS: [Form; 2] = [Form::Centred, Form::Printed];

/// Law of the boxes and seed of their cloud.
struct SeededLaw {
    law: BoxLaw,
    seed: u32,
}

fn law(form: Form) -> SeededLaw {
    SeededLaw { law: BoxLaw { form, optical_depth: 1.3, radius_scale: 0.6 }, seed: 1 }
}

fn paper_boxes(name: &str) -> Vec<CloudBox> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    nimbus::io::box_file::read(&path).unwrap()
}

fn one_box(n_particles: u32, extent: [f64; 3], radius_max: f64) -> CloudBox {
    CloudBox { n_particles, extent: DVec3::from_array(extent), center: DVec3::ZERO, radius_max }
}

/// Records and the group of every particle.
fn records(boxes: &[CloudBox], law: &SeededLaw) -> (Vec<BoxRecord>, Vec<u32>) {
    let (mut list, mut i_group) = (vec![], vec![]);
    for (b, i_box) in boxes.iter().zip(0..) {
        list.push(BoxRecord::new(b, &law.law, law.seed, i_box, i_group.len() as u32));
        i_group.extend(std::iter::repeat_n(i_box, b.n_particles as usize));
    }
    (list, i_group)
}

type Made = (Vec<ParticleRecord>, Vec<u32>);

fn generate_with(gpu: &mut Gpu, compiler: &Compiler, boxes: &[CloudBox], law: &SeededLaw) -> Made {
    let generate = Generate::new(&gpu.device, compiler).unwrap();
    let (list, i_group) = records(boxes, law);
    let n = i_group.len();
    let (list, i_group) = (gpu.upload(&list), gpu.upload(&i_group));
    let (particles, status) = (gpu.buffer::<ParticleRecord>(n), gpu.buffer::<u32>(n));
    gpu.run(|rec| {
        generate.record(rec, [&list, &i_group, &particles, &status], [0, n as u32], MAX_ATTEMPTS)
    });
    (gpu.download(&particles, n), gpu.download(&status, n))
}

fn generate(gpu: &mut Gpu, boxes: &[CloudBox], law: &SeededLaw) -> Made {
    let compiler = Compiler::new(nimbus::passes::sources(), Compiler::default_cache()).unwrap();
    generate_with(gpu, &compiler, boxes, law)
}

/// The reference and its bounds, particle by particle, on all cores.
fn reference(boxes: &[CloudBox], law: &SeededLaw) -> Vec<(Generated, ParticleBound)> {
    let of_box = boxes
        .iter()
        .zip(0u32..)
        .flat_map(|(b, i_box)| (0..b.n_particles).map(move |i| (b, i_box, i)));
    let all: Vec<_> = of_box.collect();
    let one = |&(b, i_box, i): &(&CloudBox, u32, u32)| {
        let exact = generate_particle(b, i_box, law.seed, &law.law, i);
        (exact, particle_bound(b, i_box, law.seed, law.law.form, i, U_F32))
    };
    let n_threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        let chunks = all.chunks(all.len().div_ceil(n_threads).max(1));
        let threads: Vec<_> =
            chunks.map(|c| scope.spawn(move || c.iter().map(one).collect::<Vec<_>>())).collect();
        threads.into_iter().flat_map(|t| t.join().unwrap()).collect()
    })
}

/// Bound on σ = fl(fl(factor)·R), R the radius before factor and scale. Centred, the reference's
/// bound holds a rounded factor and its product already, and σ's factor only is another number: it
/// scales. As printed it holds neither, so both come on top: (1 + u)² − 1 = 2u + u².
fn sigma_bound(exact: &Generated, bound: &ParticleBound, law: &SeededLaw) -> f64 {
    let u = U_F32;
    let radius = match law.law.form {
        Form::Centred => bound.radius,
        Form::Printed => bound.radius * (1.0 + u).powi(2) + exact.radius * (2.0 * u + u * u),
    };
    radius * law.law.radius_scale * SIGMA_PER_RADIUS
}

/// Values, truths and bounds of one quantity.
#[derive(Default)]
struct Compared {
    values: Vec<f64>,
    truths: Vec<f64>,
    bounds: Vec<f64>,
}

impl Compared {
    fn add(&mut self, value: f32, truth: f64, bound: f64) {
        self.values.push(f64::from(value));
        self.truths.push(truth);
        self.bounds.push(bound);
    }

    fn check(&self, what: &str) -> Result<f64, String> {
        check_within(what, &self.values, &self.truths, &self.bounds)
    }
}

#[derive(Default)]
struct Outcome {
    position: Compared,
    sigma: Compared,
    kappa: Compared,
    /// Decisions that rounding may turn, and those among them that it has turned.
    n_undecided: usize,
    n_other: usize,
    n_folded: usize,
    /// Decided particles whose attempts or fold differ nevertheless: none may.
    wrongly: Vec<usize>,
    /// Greatest distance from a face at which a decision went the other way.
    farthest_other: f64,
}

fn compare(truth: &[(Generated, ParticleBound)], made: &Made, law: &SeededLaw) -> Outcome {
    let mut o = Outcome::default();
    assert!(truth.len() == made.0.len() && truth.len() == made.1.len());
    for (i, ((exact, bound), (particle, status))) in
        truth.iter().zip(made.0.iter().zip(&made.1)).enumerate()
    {
        let same = status & !FOLDED == exact.n_attempts && (status & FOLDED != 0) == exact.folded;
        o.n_folded += usize::from(exact.folded);
        o.kappa.add(particle.kappa, exact.kappa, U_F32 * exact.kappa);
        assert_eq!(particle.color, [1.0; 3]);
        if !bound.decided {
            o.n_undecided += 1;
            if !same {
                // Another attempt was kept: nothing of the two is alike.
                o.n_other += 1;
                o.farthest_other = o.farthest_other.max(exact.margin);
                continue;
            }
        } else if !same {
            o.wrongly.push(i);
        }
        for axis in 0..3 {
            o.position.add(particle.position[axis], exact.position[axis], bound.position[axis]);
        }
        o.sigma.add(particle.sigma, exact.sigma, sigma_bound(exact, bound, law));
    }
    o
}

impl Outcome {
    fn assert(&self, what: &str) {
        assert!(
            self.wrongly.is_empty(),
            "{what}: {} decided otherwise: {:?}",
            self.wrongly.len(),
            self.wrongly.first()
        );
        for (quantity, c) in
            [("position", &self.position), ("sigma", &self.sigma), ("kappa", &self.kappa)]
        {
            assert_within_and_say(&format!("{what}: {quantity}"), &c.values, &c.truths, &c.bounds);
        }
        println!(
            "{what}: undecided {}, other {}, folded {}",
            self.n_undecided, self.n_other, self.n_folded
        );
    }

    fn is_right(&self) -> bool {
        self.wrongly.is_empty()
            && [&self.position, &self.sigma, &self.kappa].iter().all(|c| c.check("").is_ok())
    }
}

/// Undecided particles that a test of `n` allows: an attempt is undecided where it falls within
/// some 2e-6 of one of six faces of a box of size 1, a chance of 1e-5, and a particle makes some
/// ten. 1e-3 is ten times that.
fn most_undecided(n: usize) -> usize {
    n.div_ceil(1000)
}

#[test]
fn the_papers_boxes_in_both_forms() {
    let mut gpu = Gpu::new();
    for name in ["cubes-554.dat", "cubes-615.dat"] {
        for form in FORMS {
            let (boxes, law) = (paper_boxes(name), law(form));
            let made = generate(&mut gpu, &boxes, &law);
            let outcome = compare(&reference(&boxes, &law), &made, &law);
            outcome.assert(&format!("{name} {form:?}"));
            assert!(outcome.n_undecided <= most_undecided(made.0.len()));
            // The same again is the same bytes.
            assert_eq!(generate(&mut gpu, &boxes, &law), made);
        }
    }
}

#[test]
fn a_million_particles_agree_but_for_decisions_within_rounding_of_a_face() {
    let mut gpu = Gpu::new();
    let law = law(Form::Centred);
    let mut boxes = paper_boxes("cubes-554.dat");
    for b in &mut boxes {
        b.n_particles = 58_824;
    }
    boxes[0].n_particles = 1_000_000 - 16 * 58_824;
    let made = generate(&mut gpu, &boxes, &law);
    assert_eq!(made.0.len(), 1_000_000);
    let truth = reference(&boxes, &law);
    let outcome = compare(&truth, &made, &law);
    outcome.assert("a million");
    // How many to expect within rounding: the margins' density near 0, from those below 1e-4, times
    // the mean bound.
    let near = truth.iter().filter(|(exact, _)| exact.margin < 1e-4).count() as f64;
    let mean_bound =
        truth.iter().map(|(_, b)| b.position.element_sum() / 3.0).sum::<f64>() / truth.len() as f64;
    let n_attempts: u32 = truth.iter().map(|(exact, _)| exact.n_attempts).sum();
    println!(
        "attempts {n_attempts}, mean bound {mean_bound:e}, expected undecided about {:.1}",
        near * mean_bound / 1e-4
    );
    println!(
        "of 1000000: {} within rounding of a face, {} of them decided otherwise, the farthest \
         {:e} from it",
        outcome.n_undecided, outcome.n_other, outcome.farthest_other
    );
    assert!(outcome.n_undecided <= most_undecided(1_000_000));
    // A decision can only turn within the rounding of its position: the bounds here are below 1e-5.
    assert!(outcome.farthest_other < 1e-5);
}

/// P (5) amplifies: its argument P_x Z/2 multiplies P_x's error by half the extent, twice in a row,
/// so that the bound on y grows with the square of the extent and more: some 1e-1 here, and in
/// boxes of thousands it says nothing any more.
#[test]
fn in_large_boxes_decisions_turn_only_within_their_bound() {
    let mut gpu = Gpu::new();
    let law = law(Form::Centred);
    let boxes = [one_box(200_000, [300.0, 300.0, 200.0], 9.0)];
    let made = generate(&mut gpu, &boxes, &law);
    let outcome = compare(&reference(&boxes, &law), &made, &law);
    outcome.assert("large boxes");
    println!(
        "large boxes: the farthest decision that turned, {:e} from its face",
        outcome.farthest_other
    );
    // A bound of 1e-1 beside half extents of 150, on either side of two faces, in three attempts or
    // so: some 0.5 %.
    assert!(outcome.n_undecided <= made.0.len() / 100 && outcome.farthest_other < 0.5);
}

#[test]
fn needles_plates_and_points_are_folded() {
    let mut gpu = Gpu::new();
    let boxes = [
        one_box(300, [10.0, 0.0, 0.0], 1.0),
        one_box(300, [8.0, 0.0, 6.0], 2.0),
        one_box(300, [0.0, 5.0, 0.02], 2.0),
        one_box(300, [7.4, 0.003, 2.9], 2.0),
        one_box(300, [1e-6, 4.0, 1e-3], 2.0),
        one_box(20, [0.0; 3], 0.0),
        one_box(300, [500.0, 3000.0, 40.0], 90.0),
    ];
    for form in FORMS {
        let law = law(form);
        let made = generate(&mut gpu, &boxes, &law);
        let outcome = compare(&reference(&boxes, &law), &made, &law);
        outcome.assert(&format!("thin boxes {form:?}"));
        // All of the needle and of two more boxes at the least.
        assert!(outcome.n_folded > 900, "{}", outcome.n_folded);
        // Where an axis has no extent and its phase is sin 0, the bound cannot know that the
        // shader's sine of 0 is 0: the points, and as printed, where y comes from Z, the needle.
        // The shader's is, so they agree all the same.
        let exactly_on_a_face = if form == Form::Printed { 320 } else { 20 };
        assert!(
            outcome.n_undecided <= exactly_on_a_face + most_undecided(made.0.len()),
            "{}",
            outcome.n_undecided
        );
        assert!(outcome.n_other <= most_undecided(made.0.len()));
        let (_, i_group) = records(&boxes, &law);
        for (p, g) in made.0.iter().zip(i_group) {
            let half = (0.5 * boxes[g as usize].extent).as_vec3().to_array();
            assert!((0..3).all(|k| p.position[k].abs() <= half[k]), "{p:?}");
        }
        let points = &made.0[1500..1520];
        assert!(points.iter().all(|p| p.position == [0.0; 3] && p.sigma == 0.0 && p.kappa == 0.0));
    }
}

#[test]
fn given_groups_and_empty_lists_are_left_alone() {
    let mut gpu = Gpu::new();
    let generate = Generate::new(&gpu.device, &gpu.compiler).unwrap();
    let law = law(Form::Centred);
    let boxes = [
        one_box(100, [7.4, 1.07, 2.9], 2.1),
        one_box(0, [1.0; 3], 1.0),
        one_box(50, [2.0; 3], 2.0),
    ];
    let (made, made_status) = self::generate(&mut gpu, &boxes, &law);
    // The same boxes with 70 given particles before the last: its numbers within the box stay what
    // they were.
    let (mut list, mut i_group) = records(&boxes, &law);
    list.insert(2, BoxRecord::given());
    list[3].i_first = 170;
    i_group.splice(100.., [vec![2; 70], vec![3; 50]].concat());
    assert_eq!(list[2].form, FORM_GIVEN);
    let before = ParticleRecord {
        aspect: 1.0,
        aspect_z: 1.0,
        turn: [0; 2],
        position: [7.0, 8.0, 9.0],
        sigma: 4.0,
        color: [0.1, 0.2, 0.3],
        kappa: 5.0,
    };
    let (list, i_group) = (gpu.upload(&list), gpu.upload(&i_group));
    let (particles, status) = (gpu.upload(&[before; 220]), gpu.upload(&[77u32; 220]));
    let buffers = [&list, &i_group, &particles, &status];
    gpu.run(|rec| generate.record(rec, buffers, [0, 0], MAX_ATTEMPTS));
    assert_eq!(gpu.download::<ParticleRecord>(&particles, 220), vec![before; 220]);
    gpu.run(|rec| generate.record(rec, buffers, [0, 220], MAX_ATTEMPTS));
    let after: Vec<ParticleRecord> = gpu.download(&particles, 220);
    assert_eq!(after[100..170], [before; 70]);
    assert_eq!([&after[..100], &after[170..]].concat(), made);
    let status: Vec<u32> = gpu.download(&status, 220);
    assert_eq!(status[100..170], [77; 70]);
    assert_eq!([&status[..100], &status[170..]].concat(), made_status);
}

#[test]
fn the_number_of_invocations_does_not_matter() {
    let mut gpu = Gpu::new();
    let law = law(Form::Printed);
    let boxes = paper_boxes("cubes-615.dat");
    let expected = generate(&mut gpu, &boxes, &law);
    let kernel = Kernel::new(&gpu.device, &gpu.compiler, "generate", Push::FIELDS).unwrap();
    let (list, i_group) = records(&boxes, &law);
    let (list, i_group) = (gpu.upload(&list), gpu.upload(&i_group));
    let push = Push { i_first: 0, n_particles: 615, max_attempts: MAX_ATTEMPTS };
    for n_groups in [1, 2, 7, 40] {
        let (particles, status) = (gpu.buffer::<ParticleRecord>(615), gpu.buffer::<u32>(615));
        gpu.run(|rec| {
            rec.dispatch_groups(&kernel, &[&list, &i_group, &particles, &status], &push, n_groups)
        });
        assert_eq!(
            (gpu.download(&particles, 615), gpu.download(&status, 615)),
            expected,
            "{n_groups} groups"
        );
    }
}

#[test]
fn a_wrong_shader_is_noticed() {
    let mut gpu = Gpu::new();
    let (boxes, law) = (paper_boxes("cubes-554.dat"), law(Form::Centred));
    let truth = reference(&boxes, &law);
    let made = generate(&mut gpu, &boxes, &law);
    assert!(compare(&truth, &made, &law).is_right());
    let mutations = [
        // P (4) takes Y for x; P (5) in the wrong order; the radius; the key; the order of the
        // counter.
        ("0.5 * PI * sine(0.5 * x.y)", "0.4 * PI * sine(0.5 * x.y)"),
        ("0.5 * PI * sine(0.5 * x.y)", "0.5 * PI * sine(0.5 * x.x)"),
        ("    py += PI * sine(px * x.z * 0.5);\n", ""),
        ("0.5 * PI * sine(r)", "0.5 * 3.1415 * sine(r)"),
        ("uvec2(b.seed, b.i_box)", "uvec2(b.i_box, b.seed)"),
        ("i - b.i_first, attempt", "i, attempt"),
        ("lessThanEqual(abs(v), h)", "lessThanEqual(abs(v), 1.001 * h)"),
    ];
    for (from, to) in mutations {
        let wrong = Gpu::wrong_compiler("generate.comp", from, to);
        let made = generate_with(&mut gpu, &wrong, &boxes, &law);
        assert!(!compare(&truth, &made, &law).is_right(), "{to} was not noticed");
    }
    // One particle's attempt off by one.
    let mut other = made;
    other.1[300] += 1;
    assert!(!compare(&truth, &other, &law).is_right());
}
