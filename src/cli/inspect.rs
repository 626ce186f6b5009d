//! `nimbus inspect SCENE`.

use super::args::{BasisArg, InspectArgs};
use super::{check_time, device_choice, load, output, say_notes, say_sizes};
use crate::error::Result;
use crate::frame::Stage;
use crate::inspect::{air, basis, stages as inspect};
use crate::model::scene::Scene;

/// Frames that `--plan` shows: the first does everything, the second shows what a step of time
/// changes, the third that it goes on so.
const PLAN_FRAMES: u32 = 3;

pub fn run(args: &InspectArgs) -> Result<()> {
    // With --plan a number of frames from the first on.
    let i_frame = args.frame.filter(|_| !args.plan).unwrap_or(0);
    let scene = load(&args.scene, &args.options)?.at_frame(i_frame);
    if let Some(what) = args.basis {
        return print_basis(&basis::report(&scene), what, args);
    }
    if args.air {
        return output::rows(&[air::row(&scene)], args.json);
    }
    check_time(&scene, scene.time.at(args.frame.unwrap_or(0)))?;
    let spinner = output::spinner("inspecting", args.options.quiet);
    if args.reference {
        let scene = &scene;
        let found = match (args.particles, args.facets) {
            (true, _) => Found::Particles(inspect::particles_reference(scene, i_frame)?),
            (_, true) => {
                Found::Facets(of_surfaces(args, scene, inspect::facets_reference(scene, i_frame)?))
            }
            _ => Found::Boxes(inspect::boxes_reference(scene)),
        };
        drop(spinner);
        if args.options.verbose {
            say_sizes(scene, None);
        }
        return print(&found, args.json);
    }
    let mut stage = Stage::new(scene, &device_choice(&args.options), !args.options.no_skip)?;
    let found = match (args.particles, args.facets, args.plan) {
        (true, _, _) => Found::Particles(inspect::particles(&mut stage, i_frame)?),
        (_, true, _) => {
            let rows = inspect::facets(&mut stage, i_frame)?;
            say_notes(&mut stage, &args.options)?;
            Found::Facets(of_surfaces(args, &stage.scene, rows))
        }
        (_, _, true) => Found::Plan(inspect::plans(&mut stage, args.frame.unwrap_or(PLAN_FRAMES))?),
        _ => Found::Boxes(inspect::boxes(&mut stage)?),
    };
    drop(spinner);
    if args.options.verbose {
        say_sizes(&stage.scene, Some(&stage));
    }
    print(&found, args.json)?;
    stage.close()
}

/// The rows, or the surfaces' means of them.
fn of_surfaces(
    args: &InspectArgs,
    scene: &Scene,
    rows: Vec<inspect::FacetRow>,
) -> Vec<inspect::FacetRow> {
    if args.per_surface { inspect::per_surface(scene, &rows) } else { rows }
}

/// What was asked for, complete before the first line of it is printed.
enum Found {
    Particles(Vec<inspect::ParticleRow>),
    Facets(Vec<inspect::FacetRow>),
    Boxes(Vec<inspect::BoxRow>),
    Plan(Vec<inspect::PlanRow>),
}

fn print(found: &Found, json: bool) -> Result<()> {
    match found {
        Found::Particles(rows) => output::rows(rows, json),
        Found::Facets(rows) => output::rows(rows, json),
        Found::Boxes(rows) => boxes(rows, json),
        Found::Plan(rows) => plan(rows, json),
    }
}

fn print_basis(report: &basis::BasisReport, what: BasisArg, args: &InspectArgs) -> Result<()> {
    if let Some(note) = basis::note(report).filter(|_| !args.options.quiet) {
        eprintln!("note: {note}");
    }
    match what {
        _ if args.json => output::object(report),
        BasisArg::Table => output::numbers(&report.table.names(), report.table.rows()),
        BasisArg::Values => output::rows(&report.singular_values, false),
        BasisArg::Errors => output::rows(&report.errors, false),
    }
}

fn boxes(rows: &[inspect::BoxRow], json: bool) -> Result<()> {
    if json {
        return output::rows(rows, true);
    }
    let rate = |accepted: Option<f64>| accepted.map_or("-".to_owned(), |a| format!("{a:.4}"));
    let header = ["cloud", "box", "particles", "attempts", "acceptance", "folded"];
    let mut table = vec![header.map(str::to_owned).to_vec()];
    for r in rows {
        let (particles, attempts) = (r.particles.to_string(), r.attempts.to_string());
        let (cloud, number) = (r.cloud.to_string(), r.r#box.to_string());
        table.push(vec![
            cloud,
            number,
            particles,
            attempts,
            rate(r.acceptance),
            r.folded.to_string(),
        ]);
    }
    let (particles, attempts) =
        rows.iter().fold((0u64, 0u64), |(p, a), r| (p + u64::from(r.particles), a + r.attempts));
    let folded: u64 = rows.iter().map(|r| u64::from(r.folded)).sum();
    let all = (attempts > 0).then(|| (particles - folded) as f64 / attempts as f64);
    table.push(vec![
        "all".into(),
        String::new(),
        particles.to_string(),
        attempts.to_string(),
        rate(all),
        folded.to_string(),
    ]);
    output::text(&output::table(&table))
}

fn plan(rows: &[inspect::PlanRow], json: bool) -> Result<()> {
    if json {
        return output::rows(rows, true);
    }
    let mut table = vec![["frame", "pass", "", "reason"].map(str::to_owned).to_vec()];
    for r in rows {
        let done = if r.run { "run" } else { "skip" };
        table.push(vec![r.frame.to_string(), r.pass.into(), done.into(), r.reason.clone()]);
    }
    output::text(&output::table(&table))
}
