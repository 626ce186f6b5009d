//! Diagnosed clouds against the given ones of files that have both.

use std::path::Path;

use nimbus::io::weather::wrf;
use nimbus::model::weather::agreement::Agreement;
use nimbus::model::weather::{diagnosed, statistics};

/// All steps of a file.
struct Compared {
    cells: Agreement,
    /// Mean opacity of the columns: given, and diagnosed.
    opacity: [f64; 2],
    /// Share of the columns whose lowest cell has diagnosed clouds.
    at_ground: f64,
}

fn compare(name: &str) -> Compared {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/weather").join(name);
    let file = wrf::open(&path).expect("a file");
    let n = file.n_steps as f64;
    let mut all = Compared { cells: Agreement::default(), opacity: [0.0; 2], at_ground: 0.0 };
    for i_step in 0..file.n_steps {
        let step = file.step(i_step).expect("a step");
        let found = diagnosed::extinction(&step.grid, &step.air);
        all.cells = all.cells + Agreement::of(&step.extinction, &found);
        for (opacity, extinction) in all.opacity.iter_mut().zip([&step.extinction, &found]) {
            *opacity += statistics::of(&step.grid, extinction).mean_opacity / n;
        }
        let n_columns = file.shape.n_columns();
        let lowest = found[..n_columns].iter().filter(|beta| **beta > statistics::FAINT);
        all.at_ground += lowest.count() as f64 / n_columns as f64 / n;
    }
    all
}

/// The rates of docs/explanation/model.md §15. With one threshold of 0.8 Katrina had 16 times its
/// cloudy cells, and was fog from the sea up.
#[test]
fn diagnosed_clouds_are_where_clouds_are() {
    for (name, bias, hits, false_alarms, opacities) in [
        ("katrina.nc", 3.22, 1.0, 0.078, [0.139, 0.438]),
        ("supercell.nc", 0.52, 0.471, 0.023, [0.722, 0.735]),
    ] {
        let Compared { cells, opacity, at_ground } = compare(name);
        let rates = [cells.bias(), cells.hit_rate(), cells.false_alarm_rate()];
        println!("{name}: {rates:.3?}, opacities {opacity:.3?}, at the ground {at_ground:.4}");
        for (found, expected) in rates.into_iter().zip([bias, hits, false_alarms]) {
            let found = found.expect("clouds");
            assert!((found - expected).abs() < 0.01 * expected.max(0.1), "{name}: {rates:?}");
        }
        assert!(opacity.iter().zip(opacities).all(|(a, b)| (a - b).abs() < 2e-3), "{opacity:?}");
        assert!(at_ground < 0.01, "{name}: {at_ground}");
    }
}
