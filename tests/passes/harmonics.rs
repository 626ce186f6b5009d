//! The pass harmonics against its f64 reference: whole buffers, every colour at its own bound.

use crate::harness::{Gpu, assert_within_and_say, check_within};
use glam::DVec3;
use nimbus::gpu::Compiler;
use nimbus::layout::harmonics::push_texels;
use nimbus::layout::particle::{ParticleRecord, PlacedRecord};
use nimbus::model::harmonics::{Coefficients, n_rest};
use nimbus::model::philox::philox4x32_10;
use nimbus::passes::harmonics::{Colored, Harmonics};
use nimbus::reference::harmonics::{color, rounding};

const EYE: [f32; 3] = [0.5, -3.25, 7.0];

/// Runs of each degree, apart from each other.
const RUNS: [Colored; 3] = [
    Colored { i_first: 3, n_particles: 700, degree: 3 },
    Colored { i_first: 1000, n_particles: 65, degree: 1 },
    Colored { i_first: 1065, n_particles: 130, degree: 2 },
];
const N: usize = 1200;

/// Returns numbers from −1 to 1.
fn some(i: u32, k: u32) -> [f32; 4] {
    philox4x32_10([1, 2], [i, k, 0, 0]).map(|word| word as f32 / (1u64 << 31) as f32 - 1.0)
}

/// Returns the coefficients of particle `i`; those of higher degrees are 0.
fn coefficients(i: u32, degree: u32) -> Coefficients {
    let mut of = Coefficients::default();
    let n = 3 * (1 + n_rest(degree)) as usize;
    for (k, v) in of.as_flattened_mut()[..n].iter_mut().enumerate() {
        *v = some(i, 1 + k as u32 / 4)[k % 4];
    }
    of
}

fn place(i: u32) -> PlacedRecord {
    let [x, y, z, size] = some(i, 0);
    // Near and far, and one at the eye itself, which has no direction.
    let far = 10f32.powf(4.0 * size);
    let position = [x, y, z].map(|v| far * v);
    let at = [0, 1, 2].map(|axis| EYE[axis] + position[axis]);
    PlacedRecord { position: if i == 5 { EYE } else { at }, sigma: 1.0 }
}

fn kappa(i: u32) -> f64 {
    f64::from(1 + i) / 8.0
}

/// Returns the particles after the pass.
fn run(gpu: &mut Gpu, compiler: Option<&Compiler>) -> Vec<ParticleRecord> {
    let compiler = compiler.unwrap_or(&gpu.compiler);
    let pass = Harmonics::new(&gpu.device, compiler).expect("the pass");
    let mut texels = vec![];
    for Colored { i_first, n_particles, degree } in RUNS {
        for i in i_first..i_first + n_particles {
            push_texels(&mut texels, &coefficients(i, degree), kappa(i), degree);
        }
    }
    let places: Vec<_> = (0..N as u32).map(place).collect();
    let before = ParticleRecord { sigma: 7.0, color: [9.0; 3], kappa: 9.0, ..Default::default() };
    let (placed, coefficients) = (gpu.upload(&places), gpu.upload(&texels));
    let particles = gpu.upload(&vec![before; N]);
    gpu.run(|rec| pass.record(rec, [&placed, &coefficients, &particles], EYE, &RUNS));
    gpu.download(&particles, N)
}

/// Returns the colours of the particles of all runs, in f64, and their bounds.
fn truth() -> (Vec<f64>, Vec<f64>) {
    let (mut colors, mut bounds) = (vec![], vec![]);
    for Colored { i_first, n_particles, degree } in RUNS {
        for i in i_first..i_first + n_particles {
            let [position, eye] = [place(i).position, EYE].map(|v| DVec3::from(v.map(f64::from)));
            let of = coefficients(i, degree);
            colors.extend(color(&of, (position - eye).normalize_or_zero()).to_array());
            bounds.extend(rounding(&of).to_array());
        }
    }
    (colors, bounds)
}

fn values(particles: &[ParticleRecord]) -> Vec<f64> {
    let of_run = |r: Colored| &particles[r.i_first as usize..(r.i_first + r.n_particles) as usize];
    RUNS.into_iter().flat_map(of_run).flat_map(|p| p.color.map(f64::from)).collect()
}

#[test]
fn colours_equal_those_of_the_reference() {
    let mut gpu = Gpu::new();
    let particles = run(&mut gpu, None);
    let (colors, bounds) = truth();
    assert_within_and_say("colours", &values(&particles), &colors, &bounds);
    for (i, p) in particles.iter().enumerate() {
        let is_in = |r: &Colored| (r.i_first..r.i_first + r.n_particles).contains(&(i as u32));
        let is_colored = RUNS.iter().any(is_in);
        // Nothing else of a particle changes, and no other particle.
        assert_eq!(p.sigma, 7.0);
        assert_eq!(p.kappa, if is_colored { kappa(i as u32) as f32 } else { 9.0 }, "{i}");
        assert!(is_colored || p.color == [9.0; 3], "{i}");
    }
}

#[test]
fn wrong_shaders_are_noticed() {
    let mut gpu = Gpu::new();
    let (colors, bounds) = truth();
    for (from, to) in [
        ("0.488602511903", "0.4887"),
        ("push.degree > 1u", "push.degree > 2u"),
        ("push.degree > 2u", "push.degree > 3u"),
        (".position - push.eye", ".position + push.eye"),
        ("max(mean.rgb + sum, 0.0)", "mean.rgb + sum"),
        ("far > 0.0 ? d / far : vec3(0.0)", "normalize(d + vec3(0.0, 1e-30, 0.0))"),
        ("0.590043589927 * y * (3.0 * xx - yy)", "0.590043589927 * y * (3.0 * yy - xx)"),
        ("- 0.590043589927 * x", "+ 0.590043589927 * x"),
        ("push.i_texel + k *", "k *"),
        ("[k % 4]", "[k % 3]"),
    ] {
        let compiler = Gpu::wrong_compiler("harmonics.comp", from, to);
        let found = values(&run(&mut gpu, Some(&compiler)));
        assert!(check_within("wrong", &found, &colors, &bounds).is_err(), "{to} was not noticed");
    }
}
