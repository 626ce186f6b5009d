//! Particles from boxes, and the bound on their f32 evaluation.

use super::one_box;
use glam::DVec3;
use nimbus::model::boxes::{BoxLaw, CloudBox, Form, MAX_ATTEMPTS, mean_radius};
use nimbus::reference::generate::{
    Acceptance, decision_margin, fold, generate_box, generate_particle, is_inside, uniforms,
};
use nimbus::reference::rounding::{U_F32, particle_bound};
use std::f64::consts::{FRAC_PI_2, PI};

const FORMS: [Form; 2] = [Form::Centred, Form::Printed];

/// The boxes of the paper's Table 2 in the order of the file: count, extents, centre, R_max.
fn paper_boxes() -> Vec<CloudBox> {
    let text = include_str!("../../scenes/cubes-554.dat");
    let rows = text
        .lines()
        .skip(2)
        .map(|line| line.split(',').map(|v| v.trim().parse::<f64>().unwrap()).collect());
    rows.map(|v: Vec<f64>| CloudBox {
        n_particles: v[0] as u32,
        extent: DVec3::new(v[1], v[2], v[3]),
        center: DVec3::new(v[4], v[5], v[6]),
        radius_max: v[7],
    })
    .collect()
}

#[test]
fn a_particle_worked_by_hand() {
    // Philox's published answer for key 0, counter 0: 6627e8d5 e169c58d bc57ac4c 9b00dbd8.
    let words = [0x6627e8u32, 0xe169c5, 0xbc57ac, 0x9b00db].map(|w| f64::from(w) / 16_777_216.0);
    assert_eq!(uniforms(0, 0, 0, 0), words);
    // The law evaluated elsewhere (Python, step by step) at these four numbers, box 8 × 6 × 4: X,
    // Y, Z = −1.6152…, 4.5662…, 1.8857…; P (4): 1.1888…, −1.1351…, 1.2711…; P (5): 4.0178…,
    // −3.0279….
    let p = generate_particle(
        &one_box(1, DVec3::new(8.0, 6.0, 4.0), 2.0),
        0,
        0,
        &BoxLaw { form: Form::Centred, optical_depth: 1.5, radius_scale: 0.5 },
        0,
    );
    // 16 digits, and some ten roundings of numbers below 8.
    let expected = DVec3::new(1.2012904103575917, 0.7691475461587762, 1.5784238024958326);
    assert!((p.position - expected).length() < 1e-14, "{}", p.position);
    assert_eq!((p.n_attempts, p.folded), (1, false));
    // The face z = 2 is the nearest.
    assert!((p.margin - (2.0 - expected.z)).abs() < 1e-14);
    // R = 1.2109636068344116 + π/2 sin R = 2.681159443746758, times 2 over the greatest
    // 3.428321058021832, which was found by a scan of 10⁶ steps: its error is below 1e-12.
    assert!((p.radius - 1.564123895265403).abs() < 1e-11);
    assert!((p.sigma - p.radius * 0.5 / 3.0).abs() < 1e-15);
    // In the printed form y repeats z; box 6 × 10 × 8.
    let printed = generate_particle(
        &one_box(1, DVec3::new(6.0, 10.0, 8.0), 2.0),
        0,
        0,
        &BoxLaw::new(Form::Printed),
        0,
    );
    let expected = DVec3::new(1.9451384363068946, 3.0979168168704407, 3.0979168168704407);
    assert!((printed.position - expected).length() < 1e-14);
    assert!((printed.radius - 2.681159443746758).abs() < 1e-14);
}

#[test]
fn p9_holds_centred_and_breaks_for_most_particles_as_printed() {
    let (mut n_broken, mut n) = (0, 0);
    for (b, i_box) in paper_boxes().iter().zip(0..) {
        let b = CloudBox { n_particles: 2000, ..*b };
        let centred = generate_box(&b, i_box, 1, &BoxLaw::new(Form::Centred));
        // One rounding of the factor, one of the product.
        assert!(
            centred.iter().all(|p| p.radius >= 0.0 && p.radius <= b.radius_max * (1.0 + 4e-16))
        );
        let printed = generate_box(&b, i_box, 1, &BoxLaw::new(Form::Printed));
        n_broken += printed.iter().filter(|p| p.radius > b.radius_max).count();
        n += printed.len();
    }
    let share = n_broken as f64 / n as f64;
    println!("printed radii beyond R_max: {n_broken} of {n}, {share:.4}");
    assert!(share > 0.5);
}

#[test]
fn particles_lie_in_their_boxes_and_acceptance_is_a_share() {
    for form in FORMS {
        for (b, i_box) in paper_boxes().iter().zip(0..) {
            let particles = generate_box(b, i_box, 1, &BoxLaw::new(form));
            assert_eq!(particles.len(), b.n_particles as usize);
            assert!(particles.iter().all(|p| is_inside(p.position, 0.5 * b.extent)));
            let a = Acceptance::of(&particles);
            assert_eq!(a.n_accepted + a.n_folded, u64::from(b.n_particles));
            let many =
                generate_box(&CloudBox { n_particles: 20_000, ..*b }, i_box, 1, &BoxLaw::new(form));
            let many = Acceptance::of(&many);
            let rate = many.rate().unwrap();
            println!(
                "{form:?} box {i_box}: {a:?}; of 20000: rate {rate:.4}, folded {}",
                many.n_folded
            );
            assert!(rate > 0.0 && rate < 1.0);
        }
    }
}

#[test]
fn a_needle_ends_at_its_bound_and_is_folded() {
    // Along x the phase P_y = π/2 sin X/2 moves every particle out of a box without height.
    let needle = one_box(50, DVec3::new(10.0, 0.0, 0.0), 1.0);
    let particles = generate_box(&needle, 0, 1, &BoxLaw::new(Form::Centred));
    for p in &particles {
        assert_eq!((p.n_attempts, p.folded), (MAX_ATTEMPTS, true));
        assert!(p.position.y == 0.0 && p.position.z == 0.0 && p.position.x.abs() <= 5.0);
    }
    assert_eq!(
        Acceptance::of(&particles),
        Acceptance { n_attempts: 50 * 64, n_accepted: 0, n_folded: 50 }
    );
    // A box without extent moves nothing: sin 0 everywhere, and the centre is inside.
    let point = generate_box(&one_box(3, DVec3::ZERO, 0.0), 0, 1, &BoxLaw::new(Form::Centred));
    assert!(point.iter().all(|p| p.n_attempts == 1 && p.position == DVec3::ZERO && p.kappa == 0.0));
    assert_eq!(Acceptance::of(&[]).rate(), None);
}

#[test]
fn folding_mirrors_at_the_faces() {
    // By hand, h = 2: 3 is one beyond the face and is folded to 1; 7 passes both faces and lands on
    // 1 … (period 8).
    let cases = [
        (0.0, 0.0),
        (2.0, 2.0),
        (3.0, 1.0),
        (-3.0, -1.0),
        (6.0, -2.0),
        (7.0, -1.0),
        (-7.0, 1.0),
        (9.0, 1.0),
    ];
    for (v, expected) in cases {
        assert_eq!(fold(v, 2.0), expected, "{v}");
    }
    assert_eq!(fold(0.3, 0.0), 0.0);
    let half = DVec3::new(1.0, 2.0, 3.0);
    assert_eq!(decision_margin(DVec3::new(0.5, -1.75, 0.0), half), 0.25);
    assert_eq!(decision_margin(DVec3::new(1.5, -4.0, 0.0), half), 2.0);
}

#[test]
fn radii_have_their_mean_and_positions_their_symmetry() {
    for form in FORMS {
        let b = one_box(100_000, DVec3::new(7.4, 1.07, 2.9), 2.1);
        let particles = generate_box(&b, 0, 3, &BoxLaw::new(form));
        let mean_of = |f: &dyn Fn(usize) -> f64| {
            let n = particles.len() as f64;
            let mean = (0..particles.len()).map(f).sum::<f64>() / n;
            let variance = (0..particles.len()).map(|i| (f(i) - mean).powi(2)).sum::<f64>() / n;
            (mean, (variance / n).sqrt())
        };
        // Five standard errors have a probability of 6e-7 a comparison, and the seed is fixed.
        let (mean, error) = mean_of(&|i| particles[i].radius);
        assert!((mean - mean_radius(form, 2.1)).abs() < 5.0 * error);
        if form == Form::Centred {
            // X, Y → −X, −Y reverses P_x, P_y and both swirls and leaves Z, so that x and y are
            // symmetric together. z is not, because acceptance along x depends on the sign of Z.
            for axis in 0..2 {
                let (mean, error) = mean_of(&|i| particles[i].position[axis]);
                assert!(mean.abs() < 5.0 * error, "{axis}: {mean} ± {error}");
            }
            let (mean, error) = mean_of(&|i| particles[i].position.z);
            println!("mean z {mean:.4} ± {error:.4}");
        }
    }
}

/// P (1)–(11) in f32 operations, with the sine given.
struct InF32<'a> {
    form: Form,
    sine: &'a dyn Fn(f32) -> f32,
}

impl InF32<'_> {
    fn offset(&self, extent: [f32; 3], u: [f32; 3]) -> [f32; 3] {
        let (pi, half_pi) = (PI as f32, FRAC_PI_2 as f32);
        let share = |u: f32| if self.form == Form::Centred { 2.0 * u - 1.0 } else { u };
        let [x, y, z] = [0, 1, 2].map(|i| share(u[i]) * extent[i]);
        let [mut px, mut py, pz] = [y, x, z].map(|v| half_pi * (self.sine)(0.5 * v));
        px += pi * (self.sine)(px * z * 0.5);
        py += pi * (self.sine)(px * z * 0.5);
        let v = [x + px, y + py, z + pz].map(|v| 0.5 * v);
        if self.form == Form::Centred { v } else { [v[0], v[2], v[2]] }
    }

    fn fold(v: f32, h: f32) -> f32 {
        let (a, period) = (v + h, 4.0 * h);
        let w = a - period * (a / period).floor();
        if w <= 2.0 * h { w - h } else { 3.0 * h - w }
    }

    /// Position, radius and number of attempts.
    fn particle(&self, b: &CloudBox, i_box: u32, i: u32) -> ([f32; 3], f32, u32) {
        let extent = b.extent.as_vec3().to_array();
        let factor = nimbus::model::boxes::radius_factor(self.form, b.radius_max) as f32;
        for attempt in 0.. {
            let u = uniforms(1, i_box, i, attempt).map(|u| u as f32);
            let v = self.offset(extent, [u[0], u[1], u[2]]);
            let inside = (0..3).all(|k| v[k].abs() <= 0.5 * extent[k]);
            if !inside && attempt + 1 < MAX_ATTEMPTS {
                continue;
            }
            let v = if inside { v } else { [0, 1, 2].map(|k| Self::fold(v[k], 0.5 * extent[k])) };
            let r = u[3] * b.radius_max as f32;
            return (v, factor * (r + FRAC_PI_2 as f32 * (self.sine)(r)), attempt + 1);
        }
        unreachable!()
    }
}

#[test]
fn f32_evaluations_stay_within_their_bound() {
    let good = |x: f32| f64::from(x).sin() as f32;
    // The greatest error that the assumptions allow, with signs taken from the argument's bits.
    let poor = |x: f32| {
        let sign = |bit: u32| if x.to_bits() >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let x = f64::from(x);
        let moved = (x + sign(0) * 2.0 * U_F32 * x.abs()).sin();
        // Rounding to f32 is up to 2⁻²⁵ of the 2⁻²² allowed, or one of seven units for small sines.
        (moved + sign(1) * U_F32 * (6.0 * moved.abs()).min(3.5)) as f32
    };
    // The paper's boxes accept before the bound on attempts; such a thin box mostly folds.
    let mut boxes = paper_boxes();
    boxes.push(one_box(0, DVec3::new(7.4, 0.03, 2.9), 2.0));
    for (form, sine) in
        [(FORMS[0], &good as &dyn Fn(f32) -> f32), (FORMS[0], &poor), (FORMS[1], &poor)]
    {
        let (mut n, mut n_folded, mut n_undecided, mut n_other, mut ratios) =
            (0u32, 0u32, 0u32, 0u32, Vec::new());
        for (b, i_box) in boxes.iter().zip(0..) {
            for i in 0..100_000 / 18 + 1 {
                n += 1;
                let exact = generate_particle(b, i_box, 1, &BoxLaw::new(form), i);
                let bound = particle_bound(b, i_box, 1, form, i, U_F32);
                let (v, r, n_attempts) = InF32 { form, sine }.particle(b, i_box, i);
                n_folded += u32::from(exact.folded);
                n_undecided += u32::from(!bound.decided);
                n_other += u32::from(n_attempts != exact.n_attempts);
                if !bound.decided {
                    continue;
                }
                assert_eq!(n_attempts, exact.n_attempts);
                assert!((f64::from(r) - exact.radius).abs() <= bound.radius);
                for (k, v) in v.into_iter().enumerate() {
                    let actual = (f64::from(v) - exact.position[k]).abs();
                    assert!(actual <= bound.position[k], "box {i_box} particle {i} axis {k}");
                    ratios.push(bound.position[k] / actual.max(1e-30));
                }
            }
        }
        ratios.sort_by(f64::total_cmp);
        let (least, median) = (ratios[0], ratios[ratios.len() / 2]);
        println!(
            "{form:?}: bound/actual least {least:.2}, median {median:.1}; undecided {n_undecided}, \
             other {n_other}, folded {n_folded} of {n}"
        );
        assert!(median < 1000.0 && n_folded > 100);
        // The bounds are some 1e-6 for boxes of size 1 with a few attempts each.
        assert!(n_other <= n_undecided && f64::from(n_undecided) < 1e-3 * f64::from(n));
    }
}
