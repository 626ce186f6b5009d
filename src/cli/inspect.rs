//! `nimbus inspect SCENE`.

use super::args::{BasisArg, InspectArgs};
use super::output::{self, header, or_dash};
use super::progress::spinner;
use super::scene::{check_time, device_choice, load, print_notes, print_sizes};
use crate::error::{Error, Result};
use crate::frame::Stage;
use crate::inspect::{air, basis, particles, stages as inspect};
use crate::io::claim::Claim;
use crate::io::console::say;
use crate::io::ply;
use crate::model::cloud::Particle;
use crate::model::scene::Scene;
use crate::reference::picture::check_memory;

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
        return output::text(&basis_text(&basis::report(&scene), what, args)?);
    }
    if args.air {
        return output::text(&output::rows(&[air::row(&scene)], args.json)?);
    }
    check_rows(args, &scene)?;
    let _claim = claim(args)?;
    check_time(&scene, scene.time.at(args.frame.unwrap_or(0)))?;
    let waiting = spinner("inspecting", args.options.quiet);
    // The text is complete before any of it is printed.
    if args.reference {
        let scene = &*scene.lit();
        let text = match (args.particles, args.facets) {
            (true, _) => listed(scene, &particles::list_reference(scene, i_frame)?, args),
            (_, true) => facets(args, scene, inspect::facets_reference(scene, i_frame)?),
            _ => boxes(&inspect::boxes_reference(scene), args.json),
        }?;
        drop(waiting);
        if args.options.verbose {
            print_sizes(scene, None);
        }
        return output::text(&text);
    }
    let mut stage = Stage::new(scene, &device_choice(&args.options), !args.options.no_skip)?;
    let text = match (args.particles, args.facets, args.plan) {
        (true, _, _) => {
            let list = particles::list(&mut stage, i_frame)?;
            listed(&stage.scene, &list, args)
        }
        (_, true, _) => {
            let rows = inspect::facets(&mut stage, i_frame)?;
            print_notes(&mut stage, &args.options)?;
            facets(args, &stage.scene, rows)
        }
        (_, _, true) => {
            plan(&inspect::plans(&mut stage, args.frame.unwrap_or(PLAN_FRAMES))?, args.json)
        }
        _ => boxes(&inspect::boxes(&mut stage)?, args.json),
    }?;
    drop(waiting);
    if args.options.verbose {
        print_sizes(&stage.scene, Some(&stage));
    }
    output::text(&text)?;
    stage.close()
}

/// Refuses tables that do not fit in memory.
fn check_rows(args: &InspectArgs, scene: &Scene) -> Result<()> {
    /// Most frames of `--plan`, each a row for every pass.
    const MOST_FRAMES: u32 = 10_000;
    if let Some(n) = args.frame.filter(|n| args.plan && *n > MOST_FRAMES) {
        return Err(Error::limit(format!(
            "--plan --frame {n}: expected at most {MOST_FRAMES} frames, whose rows fit in memory"
        )));
    }
    let n_particles = if args.particles || args.reference { scene.n_particles() } else { 0 };
    let n_facets = if args.facets { scene.n_facets() } else { 0 };
    check_memory(0, 1, n_particles.max(n_facets))
}

/// Claims the place of a PLY file, before anything is drawn.
fn claim(args: &InspectArgs) -> Result<Option<Claim>> {
    let Some(path) = &args.output else { return Ok(None) };
    if !ply::is_named(path) {
        let name = path.display();
        return Err(Error::usage(format!("-o {name}: expected a name that ends in .ply")));
    }
    output::claim_file(path, args.force)
}

/// Returns the rows of particles. With a file to write, they go there, and no text is left.
fn listed(scene: &Scene, list: &[Particle], args: &InspectArgs) -> Result<String> {
    let Some(path) = &args.output else {
        return output::rows(&particles::rows(scene, list), args.json);
    };
    ply::write(path, list)?;
    output::wrote(path, &format!("{} particles", list.len()), args.options.quiet);
    Ok(String::new())
}

/// Returns the rows of facets, or their means over each surface.
fn facets(args: &InspectArgs, scene: &Scene, rows: Vec<inspect::FacetRow>) -> Result<String> {
    let rows = if args.per_surface { inspect::per_surface(scene, &rows) } else { rows };
    output::rows(&rows, args.json)
}

fn basis_text(report: &basis::BasisReport, what: BasisArg, args: &InspectArgs) -> Result<String> {
    if let Some(note) = basis::note(report).filter(|_| !args.options.quiet) {
        say!("note: {note}");
    }
    match what {
        _ if args.json => output::json_text(report),
        BasisArg::Table => output::csv_rows(&report.table.names(), report.table.rows()),
        BasisArg::Values => output::rows(&report.singular_values, false),
        BasisArg::Errors => output::rows(&report.errors, false),
    }
}

fn boxes(rows: &[inspect::BoxRow], json: bool) -> Result<String> {
    if json {
        return output::rows(rows, true);
    }
    let mut table = header(["cloud", "box", "particles", "attempts", "acceptance", "folded"]);
    let mut add = |[cloud, name]: [String; 2], [particles, attempts, folded]: [u64; 3]| {
        let rate = (attempts > 0).then(|| (particles - folded) as f64 / attempts as f64);
        let rate = or_dash(rate, |rate| format!("{rate:.4}"));
        let [particles, attempts, folded] = [particles, attempts, folded].map(|n| n.to_string());
        table.push(vec![cloud, name, particles, attempts, rate, folded]);
    };
    let mut sums = [0; 3];
    for r in rows {
        let counts = [r.particles.into(), r.attempts, r.folded.into()];
        add([r.cloud, r.r#box].map(|i| i.to_string()), counts);
        (0..3).for_each(|k| sums[k] += counts[k]);
    }
    add(["all".to_owned(), String::new()], sums);
    Ok(output::table(&table))
}

fn plan(rows: &[inspect::PlanRow], json: bool) -> Result<String> {
    if json {
        return output::rows(rows, true);
    }
    let mut table = header(["frame", "pass", "", "reason"]);
    for r in rows {
        let done = if r.run { "run" } else { "skip" };
        table.push(vec![r.frame.to_string(), r.pass.into(), done.into(), r.reason.clone()]);
    }
    Ok(output::table(&table))
}
