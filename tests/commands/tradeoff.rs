//! Studies of run time against error: a knob whose law is known comes out with the front that it
//! must have, what goes on with an earlier study runs nothing twice, and other seeds of the
//! particles give the same front within the intervals.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::program;
use nimbus::error::{Error, Result};
use nimbus::io::scene_file::load;
use nimbus::model::scene::Scene;
use nimbus::model::sort_bits::SortBits;
use nimbus::reference::picture::{Pixels, Reference};
use nimbus::studies::error::blocks::{TimeKind, TimedBlock};
use nimbus::studies::error::design::{Design, best_within};
use nimbus::studies::error::front::{Front, Metric};
use nimbus::studies::error::records::{Budget, Configuration};
use nimbus::studies::error::study::{
    ErrorStudy, Event, LoadedConfiguration, Runner, StudyPlan, StudyResults,
};
use nimbus::timing::names::Setting;
use nimbus::timing::sweep::Axis;

/// A subject of quality q: q ms a frame, and a picture that is off by 0.2/q² everywhere but for a
/// pattern of its own; with `waste` it takes half as long again for nothing. All on a machine that
/// is now fast, now slow.
#[derive(Default)]
struct Law {
    /// (q, waste) of each configuration.
    of: Vec<(f64, bool)>,
    n_blocks: u64,
    n_pictures: usize,
}

const SIDE: u32 = 48;

impl Law {
    fn ms(&self, i: usize) -> f64 {
        let (q, waste) = self.of[i];
        if waste { 1.5 * q } else { q }
    }

    fn error(q: f64) -> f64 {
        0.2 / (q * q)
    }

    /// Slow drifts and bursts by a factor of up to three, and single frames by chance, all the same
    /// in every run.
    fn noise(&mut self) -> f64 {
        self.n_blocks += 1;
        let t = self.n_blocks as f64;
        let chance =
            (self.n_blocks.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f64 / 2f64.powi(24);
        (1.0 + 0.5 * (t / 40.0).sin())
            * if (self.n_blocks / 60) % 3 == 1 { 2.0 } else { 1.0 }
            * (1.0 + 0.02 * chance)
    }
}

impl Runner for Law {
    fn add(&mut self, scene: &Arc<Scene>) {
        self.of.push((scene.draw.edge().radius, scene.draw.sort_bits == SortBits::Narrow));
    }

    fn picture(&mut self, i: usize) -> Result<Vec<f32>> {
        self.n_pictures += 1;
        let (q, _) = self.of[i];
        if q > 6.9 {
            return Err(Error::limit("q is too great for this device"));
        }
        let value = |k: u32| {
            Law::error(q) as f32 * if (k / 7 + k / SIDE).is_multiple_of(2) { 1.2 } else { -0.75 }
        };
        Ok((0..SIDE * SIDE).flat_map(|k| [value(k); 4]).collect())
    }

    fn block(&mut self, i: usize, i_round: usize) -> Result<TimedBlock> {
        let ms: Vec<f64> = (0..3).map(|_| self.ms(i) * self.noise()).collect();
        Ok(TimedBlock { i_configuration: i, i_round, gpu_ms: ms.clone(), frame_ms: ms })
    }
}

fn loaded(settings: &[Setting]) -> Result<LoadedConfiguration> {
    let mut overrides = ["draw.sort_bits=32", "draw.cutoff=3.0"].map(str::to_owned).to_vec();
    overrides.extend(settings.iter().map(|s| format!("{}={}", s.key, s.value)));
    let loaded = load(Path::new("scenes/hello.toml"), &overrides, None)?;
    let hash = loaded.hash().to_owned();
    Ok(LoadedConfiguration { scene: loaded.scene.into(), hash })
}

fn plan(knobs: &[&str], design: Design, n_rounds: usize) -> StudyPlan {
    let axes = knobs.iter().map(|text| Axis::parse("--knob", text).unwrap()).collect();
    StudyPlan { axes, design, metric: Metric::Rmse, time: TimeKind::Gpu, n_rounds, part: None }
}

fn study(law: &mut Law, plan: &StudyPlan, found: &mut StudyResults, stop: &AtomicBool) -> bool {
    let pixels = Pixels::all(SIDE, SIDE);
    let n = (SIDE * SIDE) as usize;
    let reference = Reference {
        rgba: vec![[0.0; 4]; n],
        own_error: 1e-6,
        variances: vec![],
        accuracy: String::new(),
        seconds: 0.0,
        pixels_s: 0.0,
    };
    let setup = ErrorStudy {
        plan,
        load: &loaded,
        reference: &reference,
        pixels: &pixels,
        cloud: None,
        stop,
    };
    setup.run(law, found, &mut |_: Event<'_>| Ok(())).unwrap()
}

fn best(found: &StudyResults, budget: Budget, value: f64) -> Option<usize> {
    best_within(&found.configurations, Metric::Rmse, TimeKind::Gpu, budget, value).configuration
}

fn named<'a>(found: &'a StudyResults, name: &str) -> &'a Configuration {
    found.configurations.iter().find(|c| c.name == name).unwrap_or_else(|| panic!("no {name}"))
}

#[test]
fn a_knob_of_known_law_has_the_expected_front() {
    let (mut law, mut found) = (Law::default(), StudyResults::default());
    // The unchanged scene has q = 3 and no waste. Four qualities that nobody beats, the same
    // with waste, one too great.
    let plan =
        plan(&["draw.cutoff=2.0,2.5,3.0,4.0,5.0,7.0", "draw.sort_bits=32,16"], Design::Grid, 24);
    assert!(study(&mut law, &plan, &mut found, &AtomicBool::new(false)));
    for (q, text) in [(2.0, "2.0"), (2.5, "2.5"), (4.0, "4.0"), (5.0, "5.0")] {
        let pure = named(&found, &format!("draw.cutoff={text}, draw.sort_bits=32"));
        let waste = named(&found, &format!("draw.cutoff={text}, draw.sort_bits=16"));
        assert_eq!((pure.front, waste.front), (Front::On, Front::Off), "{q}");
        let (ratio, wasted) = (pure.by_base.unwrap(), waste.by_base.unwrap());
        // Chance moves a frame by 2 % at most, a burst may begin or end between two turns.
        assert!(
            (ratio.value / (q / 3.0) - 1.0).abs() < 0.05
                && (wasted.value / (q / 2.0) - 1.0).abs() < 0.05,
            "{ratio:?}"
        );
        assert!(
            ratio.low.unwrap() <= q / 3.0 * 1.02 && ratio.high.unwrap() >= q / 3.0 * 0.98,
            "{ratio:?}"
        );
        let error = pure.error.unwrap();
        // The pattern's mean square: as many of 1.2² as of 0.75², nearly: 1.0006 together, its root
        // 1.0003.
        assert!(
            (error.rmse.value / Law::error(q) - 1.0).abs() < 0.02 && error.is_resolved,
            "{error:?}"
        );
    }
    // The unchanged scene occurs once; a value that does not fit says why, and is left out.
    assert_eq!(found.configurations[0].front, Front::On);
    assert!(!found.configurations.iter().any(|c| c.name == "draw.cutoff=3.0, draw.sort_bits=32"));
    let beyond = named(&found, "draw.cutoff=7.0, draw.sort_bits=32");
    assert!(
        beyond.front == Front::Unknown && beyond.failure.as_ref().unwrap().contains("too great")
    );
    // The best within a budget, in ms at the machine's median speed.
    let base_ms = found.configurations[0].gpu_ms.unwrap().value;
    let name = |best: Option<usize>| best.map(|i| found.configurations[i].name.as_str());
    let within = |q: f64| best(&found, Budget::Ms, base_ms * q / 3.0);
    assert_eq!(name(within(4.4)), Some("draw.cutoff=4.0, draw.sort_bits=32"));
    assert_eq!((name(within(3.2)), within(1.8)), (Some("as it stands"), None));
    let near = |e: f64| best(&found, Budget::Error, e);
    assert_eq!(name(near(0.04)), Some("draw.cutoff=2.5, draw.sort_bits=32"));
    assert_eq!(near(0.001), None);
}

#[test]
fn settings_that_save_time_are_combined() {
    let (mut law, mut found) = (Law::default(), StudyResults::default());
    // From q = 3 to 2.5 saves a sixth, to 2 a third; waste saves nothing.
    assert!(study(
        &mut law,
        &plan(&["draw.cutoff=2.0,2.5", "draw.sort_bits=16"], Design::Alone, 10),
        &mut found,
        &AtomicBool::new(false)
    ));
    let names: Vec<&str> = found.configurations.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["as it stands", "draw.cutoff=2.0", "draw.cutoff=2.5", "draw.sort_bits=16"]);
    assert_eq!(named(&found, "draw.sort_bits=16").front, Front::Off);
}

#[test]
fn results_of_an_earlier_run_are_not_measured_again() {
    let (mut law, mut found) = (Law::default(), StudyResults::default());
    let stopped = AtomicBool::new(false);
    let first = plan(&["draw.cutoff=2.0,2.5"], Design::Alone, 4);
    assert!(study(&mut law, &first, &mut found, &stopped));
    let (n_pictures, blocks) = (law.n_pictures, found.blocks.clone());
    assert_eq!(n_pictures, 3);
    // The same again: nothing to do. With one more value: that one alone, with the unchanged
    // scene beside it.
    let mut again = Law::default();
    assert!(study(&mut again, &first, &mut found, &stopped));
    assert_eq!((again.n_pictures, found.blocks.len()), (0, blocks.len()));
    let mut more = Law::default();
    assert!(study(
        &mut more,
        &plan(&["draw.cutoff=2.0,2.5,4.0"], Design::Alone, 4),
        &mut found,
        &stopped
    ));
    assert_eq!((more.n_pictures, found.blocks[..blocks.len()] == blocks[..]), (1, true));
    assert!(found.blocks[blocks.len()..].iter().all(|t| [0, 3].contains(&t.i_configuration)));
    assert_eq!(named(&found, "draw.cutoff=4.0").front, Front::On);
    // One that is stopped at once has nothing and says so.
    let mut none = StudyResults::default();
    assert!(!study(&mut Law::default(), &first, &mut none, &AtomicBool::new(true)));
    assert!(
        none.blocks.is_empty() && none.configurations.iter().all(|c| c.front == Front::Unknown)
    );
}

#[test]
fn other_seeds_of_the_particles_give_errors_that_agree_within_their_intervals() {
    let of_seed = |seed: &str| -> Vec<(String, [f64; 3])> {
        let args = [
            "error",
            "scenes/study-cloud.toml",
            "--size",
            "80x60",
            "--pixels",
            "all",
            "--rounds",
            "1",
            "--frames",
            "1",
        ];
        let knobs = [
            "--knob",
            "draw.cutoff=2,4",
            "--knob",
            "lighting.grid=16,32",
            "--set",
            "lighting.grid=48",
        ];
        let rest = ["--csv", "-q", "--seed", seed, "--against", "model"];
        let output = program::run(&[&args[..], &knobs[..], &rest[..]].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let mut rows = csv::Reader::from_reader(&output.stdout[..]);
        let head = rows.headers().unwrap().clone();
        let column = |name: &str| head.iter().position(|h| h == name).unwrap();
        let of = ["rmse", "rmse_low", "rmse_high"].map(column);
        let row = |r: csv::StringRecord| (r[0].to_owned(), of.map(|c| r[c].parse().unwrap()));
        rows.records().map(|r| row(r.unwrap())).filter(|(name, _)| !name.contains(", ")).collect()
    };
    let all = ["1", "2", "3"].map(of_seed);
    let (mut n, mut widest) = (0, 0f64);
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        for (name, a) in &all[i] {
            let Some((_, b)) = all[j].iter().find(|(other, _)| other == name) else { continue };
            let (less, more) = if a[0] < b[0] { (a, b) } else { (b, a) };
            // Half widths of two independent draws add up by squares.
            let allowed = (less[2] - less[0]).hypot(more[0] - more[1]);
            assert!(more[0] - less[0] <= allowed, "{name}: {a:?} {b:?}");
            (n, widest) = (n + 1, widest.max(allowed / less[0]));
        }
    }
    // Intervals that allow anything would agree, too; and who is nearer is the same with every
    // seed.
    assert!(n >= 12 && widest < 0.8, "{n} {widest}");
    for of in &all {
        let rmse = |name: &str| of.iter().find(|(other, _)| other == name).unwrap().1[0];
        assert!(
            rmse("draw.cutoff=2") > 2.0 * rmse("as it stands")
                && rmse("lighting.grid=16") > rmse("lighting.grid=32")
        );
    }
}
