//! Every number in the tables of docs/explanation/moisture.md, computed again from the laws.

use nimbus::model::moisture::{Parcel, Saturation, T0_K, Vapour};

const PAGE: &str = include_str!("../docs/explanation/moisture.md");

fn law(saturation: Saturation) -> Vapour {
    Vapour { saturation, ice: false }
}

/// Bolton's law, and the two beside it.
fn laws() -> [Vapour; 3] {
    [Saturation::Bolton, Saturation::Constant, Saturation::Linear].map(law)
}

/// The rows of the table under `heading` whose cells are numbers.
fn table(heading: &str) -> Vec<Vec<String>> {
    let part = PAGE.split("\n## ").find(|part| part.starts_with(heading)).expect("the heading");
    let rows = part.lines().filter(|line| line.starts_with('|')).skip(2);
    rows.map(|line| {
        line.trim_matches('|').split('|').map(|cell| cell.trim().replace('−', "-")).collect()
    })
    .collect()
}

/// A number as the page writes it.
fn number(cell: &str) -> f64 {
    cell.trim_end_matches(" %").parse().expect("a number")
}

#[test]
fn the_pages_pressures_are_the_laws() {
    let rows = table("Saturation over water");
    assert_eq!(rows.len(), 9);
    for (row, t) in rows.iter().zip((-40..=40).step_by(10)) {
        assert_eq!(row[0], t.to_string());
        let [bolton, constant, linear] =
            laws().map(|law| law.saturation(T0_K + f64::from(t)) / 100.0);
        for (cell, of) in [(&row[1], bolton), (&row[2], constant), (&row[4], linear)] {
            assert_eq!(*cell, format!("{of:.4}"), "{t} °C");
        }
        for (cell, of) in [(&row[3], constant), (&row[5], linear)] {
            assert!((number(cell) - 100.0 * (of / bolton - 1.0)).abs() < 0.0051, "{t} °C: {cell}");
        }
    }
    // Claims of the text about all temperatures between.
    let off = |k: i32, i: usize| {
        let of = laws().map(|law| law.saturation(T0_K + 0.1 * f64::from(k)));
        of[i] / of[0] - 1.0
    };
    let most = (-400..=400).map(|k| off(k, 2).abs()).fold(0.0, f64::max);
    assert_eq!(format!("{:.2} %", 100.0 * most), "0.45 %");
    assert!(PAGE.contains("at most 0.45 %") && (-400..=400).all(|k| off(k, 1) > -1.2e-5));
}

#[test]
fn the_pages_cloud_bases_are_where_parcels_condense() {
    let rows = table("Cloud bases");
    assert_eq!(rows.len(), 24);
    let mut extremes = [0.0f64; 3];
    for row in &rows {
        let t_k = T0_K + number(&row[0]);
        let parcel = Parcel { t_k, pressure_pa: 101_325.0, humidity: number(&row[1]) };
        let [bolton, constant, linear] = laws().map(|law| parcel.condensation(law).height_m);
        assert_eq!(row[2], format!("{bolton:.0}"), "{row:?}");
        for (cell, of) in [(&row[3], constant), (&row[4], linear)] {
            assert!((number(cell) - (of - bolton)).abs() < 0.051, "{row:?}: {}", of - bolton);
        }
        let [low, high, other] = &mut extremes;
        (*low, *high) = (low.min(constant - bolton), high.max(constant - bolton));
        *other = other.max((linear - bolton).abs());
    }
    assert_eq!(extremes.map(|m| format!("{m:.0}")), ["-69", "50", "9"]);
    assert!(
        PAGE.contains("69 m too low")
            && PAGE.contains("50 m too high")
            && PAGE.contains("it is 9 m at most")
    );
    // A sixteenth of 250 m.
    let at_20 = Parcel { t_k: T0_K + 20.0, pressure_pa: 101_325.0, humidity: 0.6 };
    let [bolton, constant, _] = laws().map(|law| at_20.condensation(law).height_m);
    assert!(((bolton - constant) / 250.0 * 16.0 - 1.0).abs() < 0.02);
}
