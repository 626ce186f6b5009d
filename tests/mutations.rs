//! Faults injected into the shaders, each of which must fail a case of the stress suite
//! (docs/explanation/stability.md, "Faults that are found").

#[path = "harness/faults.rs"]
mod faults;

use faults::{FAULTS, Fault};
use nimbus::frame::DeviceChoice;
use nimbus::passes;
use nimbus::stress::{Outcome, StressContext, Verdict, cases};

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
