//! `nimbus inspect SCENE`.

use super::args::{BasisArg, InspectArgs};
use super::output::{self, header, or_dash};
use super::progress::spinner;
use super::scene::{check_time, device_choice, load, print_notes, print_sizes};
use crate::error::Result;
use crate::frame::Stage;
use crate::inspect::{air, basis, stages as inspect};
use crate::model::scene::Scene;

/// Frames that `--plan` shows: the first runs every pass, the second those that a step of time
/// requires, and the third shows that later frames do the same.
const PLAN_FRAMES: u32 = 3;

/// Runs `nimbus inspect`.
///
/// # Errors
/// Fails if the arguments or the scene are faulty, or the device fails.
pub fn run(args: &InspectArgs) -> Result<()> {
    // With --plan, --frame is a number of frames from the first on.
    let i_frame = args.frame.filter(|_| !args.plan).unwrap_or(0);
    let scene = load(&args.scene, &args.options)?.at_frame(i_frame);
    if let Some(what) = args.basis {
        return print_basis(&basis::report(&scene), what, args);
    }
    if args.air {
        return output::rows(&[air::row(&scene)], args.json);
    }
    check_time(&scene, scene.time.at(args.frame.unwrap_or(0)))?;
    let waiting = spinner("inspecting", args.options.quiet);
    if args.reference {
        let scene = &scene;
        let found = match (args.particles, args.facets) {
            (true, _) => Rows::Particles(inspect::particles_reference(scene, i_frame)?),
            (_, true) => {
                Rows::Facets(of_surfaces(args, scene, inspect::facets_reference(scene, i_frame)?))
            }
            _ => Rows::Boxes(inspect::boxes_reference(scene)),
        };
        drop(waiting);
        if args.options.verbose {
            print_sizes(scene, None);
        }
        return print(&found, args.json);
    }
    let mut stage = Stage::new(scene, &device_choice(&args.options), !args.options.no_skip)?;
    let found = match (args.particles, args.facets, args.plan) {
        (true, _, _) => Rows::Particles(inspect::particles(&mut stage, i_frame)?),
        (_, true, _) => {
            let rows = inspect::facets(&mut stage, i_frame)?;
            print_notes(&mut stage, &args.options)?;
            Rows::Facets(of_surfaces(args, &stage.scene, rows))
        }
        (_, _, true) => Rows::Plan(inspect::plans(&mut stage, args.frame.unwrap_or(PLAN_FRAMES))?),
        _ => Rows::Boxes(inspect::boxes(&mut stage)?),
    };
    drop(waiting);
    if args.options.verbose {
        print_sizes(&stage.scene, Some(&stage));
    }
    print(&found, args.json)?;
    stage.close()
}

/// Returns the rows of facets, or their means over each surface.
fn of_surfaces(
    args: &InspectArgs,
    scene: &Scene,
    rows: Vec<inspect::FacetRow>,
) -> Vec<inspect::FacetRow> {
    if args.per_surface { inspect::per_surface(scene, &rows) } else { rows }
}

/// The rows of a stage, complete before the first is printed.
enum Rows {
    Particles(Vec<inspect::ParticleRow>),
    Facets(Vec<inspect::FacetRow>),
    Boxes(Vec<inspect::BoxRow>),
    Plan(Vec<inspect::PlanRow>),
}

fn print(rows: &Rows, json: bool) -> Result<()> {
    match rows {
        Rows::Particles(rows) => output::rows(rows, json),
        Rows::Facets(rows) => output::rows(rows, json),
        Rows::Boxes(rows) => boxes(rows, json),
        Rows::Plan(rows) => plan(rows, json),
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
    let mut table = header(["cloud", "box", "particles", "attempts", "acceptance", "folded"]);
    let mut add =
        |names: [String; 2], particles: u64, attempts: u64, rate: Option<f64>, folded: u64| {
            let rate = or_dash(rate, |rate| format!("{rate:.4}"));
            let counts = [particles.to_string(), attempts.to_string(), rate, folded.to_string()];
            table.push([&names[..], &counts[..]].concat());
        };
    for r in rows {
        let names = [r.cloud.to_string(), r.r#box.to_string()];
        add(names, r.particles.into(), r.attempts, r.acceptance, r.folded.into());
    }
    let (particles, attempts) =
        rows.iter().fold((0u64, 0u64), |(p, a), r| (p + u64::from(r.particles), a + r.attempts));
    let folded: u64 = rows.iter().map(|r| u64::from(r.folded)).sum();
    let all = (attempts > 0).then(|| (particles - folded) as f64 / attempts as f64);
    add(["all".to_owned(), String::new()], particles, attempts, all, folded);
    output::text(&output::table(&table))
}

fn plan(rows: &[inspect::PlanRow], json: bool) -> Result<()> {
    if json {
        return output::rows(rows, true);
    }
    let mut table = header(["frame", "pass", "", "reason"]);
    for r in rows {
        let done = if r.run { "run" } else { "skip" };
        table.push(vec![r.frame.to_string(), r.pass.into(), done.into(), r.reason.clone()]);
    }
    output::text(&output::table(&table))
}
