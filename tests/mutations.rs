//! The stress suite finds faults: each of these shaders is wrong in one place, and a case that is
//! named fails of it (docs/stability.md, "Faults that are found").

use nimbus::frame::stage::DeviceChoice;
use nimbus::passes;
use nimbus::stress::{Case, Desk, Outcome, Verdict, cases, run_case};

/// What is wrong, in which file, a text of it and what stands in its place, and the case that
/// fails.
type Fault = (&'static str, &'static str, &'static str, &'static str, &'static str);

const FAULTS: &[Fault] = &[
    (
        "a sine's coefficient in its fourth digit",
        "include/functions.glsl",
        "0.00833307858",
        "0.00833007858",
        "functions/sine",
    ),
    (
        "the sign of every other two half waves",
        "include/functions.glsl",
        "2.0 * floor(k * 0.5)",
        "4.0 * floor(k * 0.25)",
        "functions/sine",
    ),
    (
        "no cut of what a huge argument is reduced to",
        "include/functions.glsl",
        "r = clamp(r, -1.58, 1.58);",
        "",
        "functions/sine-far",
    ),
    (
        "1 - exp(-t) where that cancels",
        "include/functions.glsl",
        "if (t < 0.5) {",
        "if (t < 0.0) {",
        "functions/one-minus-exp",
    ),
    (
        "erf's third coefficient",
        "include/functions.glsl",
        "0.0092705272",
        "0.0092805272",
        "functions/erf",
    ),
    (
        "a coefficient of 2^x",
        "include/functions.glsl",
        "0.0555071327386",
        "0.0555171327386",
        "functions/power-of-two",
    ),
    (
        "1 - cos for half of the chord's square",
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
        "nine rounds of Philox and not ten",
        "include/philox.glsl",
        "i < 10",
        "i < 9",
        "generation/unit",
    ),
    (
        "a slot's phase forgotten",
        "live.comp",
        "d.phase + bitfieldReverse(slot)",
        "d.phase",
        "live/late",
    ),
    (
        "a death that is not faded",
        "live.comp",
        "smooth_rise((1.0 - lived) * d.inv_fade_out)",
        "1.0",
        "live/dead",
    ),
    (
        "what is outside is left there",
        "generate.comp",
        "inside ? v : fold(v, h)",
        "v",
        "generation/needle",
    ),
    (
        "one attempt more than there may be",
        "generate.comp",
        "attempt >= push.max_attempts",
        "attempt > push.max_attempts",
        "generation/folded",
    ),
    (
        "the sort key of negative depths",
        "include/key.glsl",
        "? ~bits : bits | 0x80000000u",
        "? bits : bits | 0x80000000u",
        "compositing/alternating",
    ),
    (
        "a prefix sum that begins one digit late",
        "sort_scan.comp",
        "d >= reach ? sums[d - reach] : 0u",
        "d > reach ? sums[d - reach] : 0u",
        "sorting/random",
    ),
    (
        "no barrier between reading and writing a prefix sum",
        "sort_scan.comp",
        "uint left = d >= reach ? sums[d - reach] : 0u;\n        barrier();",
        "uint left = d >= reach ? sums[d - reach] : 0u;",
        "sorting/random",
    ),
    (
        "colours added up in f16",
        "tiles.comp",
        "color[j] += here * light.xyz;",
        "color[j] += here * light.xyz; color[j].xy = unpackHalf2x16(packHalf2x16(color[j].xy));",
        "compositing/paths",
    ),
    (
        "optical depth for opacity",
        "sprites.frag",
        "one_minus_exp(tau * exp(exponent))",
        "tau * exp(exponent)",
        "space/narrow",
    ),
    ("growth forgotten", "place.comp", "sigma * group.scale", "sigma", "space/late-growth"),
    ("a wave's phase forgotten", "place.comp", " + modes[m].phase", "", "space/late-gust"),
    (
        "1/d for 1/d^2",
        "include/light.glsl",
        "cone * cone / (reach * reach)",
        "cone * cone / reach",
        "brdf/exponent-40",
    ),
    (
        "the grid's mass by the square of sigma",
        "grid_deposit.comp",
        "blob.sigma * blob.sigma * blob.sigma",
        "blob.sigma * blob.sigma",
        "transmittance/inside",
    ),
    (
        "a compensation that is lost",
        "include/sum.glsl",
        "precise T lost = (sum.value - (value - added)) + (term - added);",
        "precise T lost = T(0.0);",
        "transport/sum-kahan",
    ),
    (
        "a partial sum left out",
        "include/sum.glsl",
        "total += (n_blocks >> k & 1u) == 1u ? sum.parts[k] : T(0.0);",
        "total += k != 6u && (n_blocks >> k & 1u) == 1u ? sum.parts[k] : T(0.0);",
        "transport/sum-pairwise",
    ),
    (
        "the last particle's place is not written",
        "place.comp",
        "FOR_EACH(i, push.n_particles) {",
        "FOR_EACH(i, push.n_particles - 1u) {",
        "determinism/poison",
    ),
    (
        "an epsilon added to a depth",
        "include/functions.glsl",
        "t * (1.0 - t * (1.0 / 2.0)",
        "(t + 1e-7) * (1.0 - t * (1.0 / 2.0)",
        "functions/one-minus-exp",
    ),
    (
        "a guard of lengths that are not short",
        "include/functions.glsl",
        "max(dot(o, o), 1e-30)",
        "max(dot(o, o), 1e-2)",
        "functions/normalize",
    ),
    (
        "a guard of half vectors that are there",
        "include/lobe.glsl",
        "max(dot(h, h), 1e-30)",
        "max(dot(h, h), 1e-4)",
        "functions/half-vector",
    ),
    (
        "pi forgotten in what a diffuse surface sends",
        "first.comp",
        "0.318309886183791",
        "1.0",
        "brdf/exponent-0",
    ),
];

fn named(name: &str) -> Case {
    cases().into_iter().find(|c| c.name == name).unwrap_or_else(|| panic!("no case {name}"))
}

/// What becomes of a case with the fault.
fn with(fault: &Fault) -> Outcome {
    let (what, file, from, to, case) = fault;
    let mut sources = passes::sources();
    assert!(sources.replace(file, from, to), "{what}: {file} does not hold {from}");
    let choice = DeviceChoice { validation: true, ..DeviceChoice::default() };
    let mut desk = Desk::with_sources(&choice, sources).expect("a device");
    let outcome = run_case(&named(case), &mut desk);
    // A wrong shader may be told by validation, too; here it is the case that counts.
    let _ = desk.close();
    outcome
}

#[test]
fn every_fault_is_found_by_its_case() {
    let mut missed = Vec::new();
    for fault in FAULTS {
        let outcome = with(fault);
        println!("{}: {:?} ({}; {:?})", fault.0, outcome.verdict, fault.4, outcome.worst);
        if outcome.verdict != Verdict::Failed {
            missed.push(format!(
                "{}: {} {:?} {:?}",
                fault.0, fault.4, outcome.verdict, outcome.remark
            ));
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
