//! Faults injected into the shaders, each of which must fail a case of the stress suite
//! (docs/explanation/stability.md, "Faults that are found").

use nimbus::frame::DeviceChoice;
use nimbus::passes;
use nimbus::stress::{Outcome, StressContext, Verdict, cases};

/// Description, shader file, original text, faulty text, and the case that must fail.
type Fault = (&'static str, &'static str, &'static str, &'static str, &'static str);

const FAULTS: &[Fault] = &[
    (
        "wrong fourth digit in a coefficient of the sine",
        "include/functions.glsl",
        "0.00833307858",
        "0.00833007858",
        "functions/sine",
    ),
    (
        "wrong sign of every other pair of half waves",
        "include/functions.glsl",
        "2.0 * floor(k * 0.5)",
        "4.0 * floor(k * 0.25)",
        "functions/sine",
    ),
    (
        "no clamp of the reduced argument",
        "include/functions.glsl",
        "r = clamp(r, -1.58, 1.58);",
        "",
        "functions/sine-far",
    ),
    (
        "1 - exp(-t) evaluated where it cancels",
        "include/functions.glsl",
        "if (t < 0.5) {",
        "if (t < 0.0) {",
        "functions/one-minus-exp",
    ),
    (
        "wrong third coefficient of erf",
        "include/functions.glsl",
        "0.0092705272",
        "0.0092805272",
        "functions/erf",
    ),
    (
        "wrong coefficient of 2^x",
        "include/functions.glsl",
        "0.0555071327386",
        "0.0555171327386",
        "functions/power-of-two",
    ),
    (
        "1 - cos instead of half the squared chord",
        "include/lobe.glsl",
        "return 0.5 * dot(chord, chord);",
        "return 1.0 - dot(n, n - chord);",
        "functions/half-vector",
    ),
    (
        "no guard where there is no half vector",
        "include/lobe.glsl",
        "max(dot(h, h), 1e-30)",
        "dot(h, h)",
        "brdf/opposite",
    ),
    (
        "no interpolation between the table's nodes",
        "include/lobe.glsl",
        "t - float(i))",
        "0.0)",
        "functions/lobe",
    ),
    (
        "nine rounds of Philox instead of ten",
        "include/philox.glsl",
        "i < 10",
        "i < 9",
        "generation/unit",
    ),
    (
        "a slot's phase is ignored",
        "live.comp",
        "d.phase + bitfieldReverse(slot)",
        "d.phase",
        "live/late",
    ),
    (
        "no fade-out at the end of life",
        "live.comp",
        "smooth_rise((1.0 - lived) * d.inv_fade_out)",
        "1.0",
        "live/dead",
    ),
    (
        "particles outside the box are not folded back",
        "generate.comp",
        "inside ? v : fold(v, h)",
        "v",
        "generation/needle",
    ),
    (
        "one attempt more than allowed",
        "generate.comp",
        "attempt >= push.max_attempts",
        "attempt > push.max_attempts",
        "generation/folded",
    ),
    (
        "wrong sort key of negative depths",
        "include/key.glsl",
        "? ~bits : bits | 0x80000000u",
        "? bits : bits | 0x80000000u",
        "compositing/alternating",
    ),
    (
        "a prefix sum that starts one digit late",
        "include/scan.glsl",
        "t >= reach ? sums[t - reach] : 0u",
        "t > reach ? sums[t - reach] : 0u",
        "sorting/random",
    ),
    (
        "no barrier between reading and writing a prefix sum",
        "include/scan.glsl",
        "uint left = t >= reach ? sums[t - reach] : 0u;\n        barrier();",
        "uint left = t >= reach ? sums[t - reach] : 0u;",
        "sorting/random",
    ),
    (
        "colours accumulated in f16",
        "tiles.comp",
        "color[j] += here * light.xyz;",
        "color[j] += here * light.xyz; color[j].xy = unpackHalf2x16(packHalf2x16(color[j].xy));",
        "compositing/paths",
    ),
    (
        "optical depth used as opacity",
        "sprites.frag",
        "one_minus_exp(tau * exp(exponent))",
        "tau * exp(exponent)",
        "space/narrow",
    ),
    ("growth is ignored", "place.comp", "sigma * group.scale", "sigma", "space/late-growth"),
    ("a wave's phase is ignored", "place.comp", " + modes[m].phase", "", "space/late-gust"),
    (
        "falloff 1/d instead of 1/d^2",
        "include/light.glsl",
        "cone * cone / (reach * reach)",
        "cone * cone / reach",
        "brdf/exponent-40",
    ),
    (
        "grid mass by the square of sigma",
        "grid_deposit.comp",
        "blob.sigma * blob.sigma * blob.sigma",
        "blob.sigma * blob.sigma",
        "transmittance/inside",
    ),
    (
        "lost compensation",
        "include/sum.glsl",
        "precise T lost = (sum.value - (value - added)) + (term - added);",
        "precise T lost = T(0.0);",
        "transport/sum-kahan",
    ),
    (
        "a missing partial sum",
        "include/sum.glsl",
        "total += (n_blocks >> k & 1u) == 1u ? sum.parts[k] : T(0.0);",
        "total += k != 6u && (n_blocks >> k & 1u) == 1u ? sum.parts[k] : T(0.0);",
        "transport/sum-pairwise",
    ),
    (
        "the last particle's position is not written",
        "place.comp",
        "FOR_EACH(i, push.n_particles) {",
        "FOR_EACH(i, push.n_particles - 1u) {",
        "determinism/guard",
    ),
    (
        "an epsilon added to an optical depth",
        "include/functions.glsl",
        "t * (1.0 - t * (1.0 / 2.0)",
        "(t + 1e-7) * (1.0 - t * (1.0 / 2.0)",
        "functions/one-minus-exp",
    ),
    (
        "a guard that affects long vectors",
        "include/functions.glsl",
        "max(dot(o, o), 1e-30)",
        "max(dot(o, o), 1e-2)",
        "functions/normalize",
    ),
    (
        "a guard that affects existing half vectors",
        "include/lobe.glsl",
        "max(dot(h, h), 1e-30)",
        "max(dot(h, h), 1e-4)",
        "functions/half-vector",
    ),
    (
        "missing 1/pi in diffuse reflection",
        "include/first.glsl",
        "0.318309886183791",
        "1.0",
        "brdf/exponent-0",
    ),
];

/// Runs the fault's case with the faulty shader.
fn run(fault: &Fault) -> Outcome {
    let (what, file, from, to, name) = fault;
    let mut sources = passes::sources();
    assert!(sources.replace(file, from, to), "{what}: {file} does not contain {from}");
    let choice = DeviceChoice { validation: true, ..DeviceChoice::default() };
    let mut context = StressContext::with_sources(&choice, sources).expect("a device");
    let case = cases().into_iter().find(|c| c.name == *name);
    let outcome = case.unwrap_or_else(|| panic!("no case {name}")).run(&mut context);
    // The validation layer may report the fault as well; only the case counts here.
    let _ = context.close();
    outcome
}

#[test]
fn every_fault_fails_its_case() {
    let mut missed = Vec::new();
    for fault in FAULTS {
        let outcome = run(fault);
        let found = format!("{}: {} {:?}", fault.0, fault.4, outcome.verdict);
        println!("{found}; {:?}", outcome.worst);
        if outcome.verdict != Verdict::Failed {
            missed.push(format!("{found} {:?}", outcome.remark));
        }
    }
    assert!(missed.is_empty() && FAULTS.len() >= 20, "not found:\n{}", missed.join("\n"));
}

#[test]
fn the_page_lists_every_fault() {
    let page = std::fs::read_to_string("docs/explanation/stability.md")
        .expect("docs/explanation/stability.md");
    for (what, file, _, _, case) in FAULTS {
        let row = format!("| {what} | `{file}` | `{case}` |");
        assert!(page.contains(&row), "docs/explanation/stability.md has no row\n{row}");
    }
}
