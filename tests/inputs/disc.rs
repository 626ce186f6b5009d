//! Scene keys of clouds from a disc and of the air: accepted and refused values.

use std::path::Path;

use nimbus::io::scene_file;
use nimbus::model::cloud::{Cloud, CloudSource};
use nimbus::model::disc::{Dilution, Disc};
use nimbus::model::moisture::{Saturation, T0_K};
use nimbus::model::scene::Scene;

const DISC: &str = "[[cloud]]\nfrom = 'disc'\n";
const LIST: &str = "x,y,z,radius,kappa\n0, 1, 0, 1, 1\n0, 5, 0, 2, 1\n";

fn load(text: &str) -> nimbus::error::Result<Scene> {
    let files = |_: &Path, _: &str| Ok(LIST.to_owned());
    scene_file::parse_beside(text.to_owned(), Path::new("scene.toml"), &[], None, &files)
        .map(|loaded| loaded.scene)
}

fn good(text: &str) -> Scene {
    load(text).expect("the scene loads")
}

fn message(text: &str) -> String {
    load(text).expect_err("the scene is refused").to_string()
}

fn disc(cloud: &Cloud) -> &Disc {
    let CloudSource::Disc(disc) = &cloud.source else { panic!("no disc") };
    disc
}

#[test]
fn a_disc_alone_is_a_complete_cloud() {
    let scene = good(DISC);
    let cloud = &scene.clouds[0];
    assert_eq!(
        (scene.n_particles(), disc(cloud).period_s, disc(cloud).dilution),
        (1000, 20.0, Dilution::Mass)
    );
    assert_eq!((disc(cloud).condensation, cloud.growth.is_none()), (None, true));
    // Its keys one by one.
    let scene = good(&format!(
        "{DISC}particles = 7\nlifetime_s = 3\ndilution = 'none'\nwind = [1, 0, 0]\nposition \
         = [0, 2, 0]\n"
    ));
    let cloud = &scene.clouds[0];
    assert_eq!(
        (disc(cloud).n_particles, disc(cloud).period_s, disc(cloud).dilution),
        (7, 3.0, Dilution::None)
    );
    // It stands still in the wind, and so do its bounds.
    assert_eq!(cloud.origin_at(1e6), cloud.position);
    let groups = scene.groups();
    assert_eq!(scene.bounds(&groups, 0.0, 3.0), scene.bounds(&groups, 1e6, 3.0));
}

#[test]
fn a_base_is_a_number_or_the_condensation_height() {
    let condensation = |keys: &str| disc(&good(keys).clouds[0]).condensation;
    let at = |keys: &str| condensation(&format!("{DISC}position = [0, 2, 0]\n{keys}"));
    assert_eq!(at("base = 'none'"), None);
    let of = at("base = 3.5\nbase_over = 0.25\nbase_lift = 2").expect("a base");
    assert_eq!((of.base, of.over, of.lift), (1.5, 0.25, 2.0));
    let fair = good(DISC).air;
    let of = at("base = 'lcl'").expect("a base");
    assert_eq!((of.base, of.lift), (fair.base() - 2.0, fair.lift()));
    assert_eq!(at("base = 'lcl'\nbase_lift = 0").expect("a base").lift, 0.0);

    // Other clouds are moved: the lowest particle of this list is at 1.
    let list = |base: &str| {
        let text = format!(
            "[[cloud]]\nfrom = 'particles'\nfile = 'l.csv'\nposition = [3, 7, 0]\nbase = {base}\n"
        );
        good(&text).clouds[0].position
    };
    assert_eq!(list("'none'").to_array(), [3.0, 7.0, 0.0]);
    assert_eq!(list("4.5").to_array(), [3.0, 3.5, 0.0]);
    assert!((list("'lcl'").y - (fair.base() - 1.0)).abs() < 1e-12);
}

#[test]
fn air_has_a_humidity_or_a_dew_point() {
    let air = |keys: &str| good(&format!("[air]\n{keys}")).air;
    let fair = air("");
    assert_eq!((fair.law.saturation, fair.metres_per_unit), (Saturation::Bolton, 250.0));
    let wet = air("temperature_c = 24\ndew_point_c = 24\nground = -3\nsaturation = 'linear'");
    assert_eq!((wet.base(), wet.law.saturation), (-3.0, Saturation::Linear));
    let by_dew = air("temperature_c = 20\ndew_point_c = 12\nmetres_per_unit = 100");
    assert!((by_dew.parcel.dew_point_k(by_dew.law) - T0_K - 12.0).abs() < 1e-9);
    assert!(by_dew.base() > 9.5 && by_dew.base() < 10.5, "{}", by_dew.base());
    // Over ice the air holds less, so at the same vapour it condenses lower.
    let cold = "temperature_c = -20\ndew_point_c = -30\n";
    assert!(air(&format!("{cold}ice = true")).parcel.humidity < 0.4);
}

#[test]
fn wrong_values_of_discs_and_air_are_refused_by_key() {
    for (text, what) in [
        ("grow_to = 2", "unknown key `cloud.0.grow_to`"),
        ("file = 'a'", "unknown key `cloud.0.file`"),
        ("lifetime_s = 0", "`cloud.0.lifetime_s`: expected a number from 1e-15 to 1e15"),
        ("lifetime_spread = 1", "`cloud.0.lifetime_spread`: expected a number from 0 to 0.9"),
        ("fade_in = 0", "`cloud.0.fade_in`: expected a number from 0.01 to 1"),
        ("warmth_k = -1", "`cloud.0.warmth_k`: expected a number from 0 to 1e15"),
        ("dilution = 'masse'", "`cloud.0.dilution`: unknown value `masse`; did you mean `mass`?"),
        (
            "base = 'lcm'",
            "`cloud.0.base`: expected a number from -1e15 to 1e15, \"lcl\" or \"none\", found \
             string \"lcm\"",
        ),
        (
            "base = true",
            "`cloud.0.base`: expected a number from -1e15 to 1e15, \"lcl\" or \"none\", found \
             boolean true",
        ),
        (
            "wind = [1e15, 0, 0]",
            "`cloud.0.from`: its particles' places: expected at most 1e15, found 2.000e16",
        ),
        (
            "sigma = 1e15\nsigma_spread = 0.5",
            "its particles' σ: expected at most 1e15, found 1.500e15",
        ),
        (
            "sigma = 1e-15\noptical_depth = 10",
            "its particles' κ = optical_depth / (√(2π) σ): expected at most 1e15",
        ),
        (
            "outflow = 1e15\nlifetime_s = 1e-15\nsigma = 1e14\noptical_depth = 1e15",
            "κ (2π)^{3/2} σ³: expected at most 1e37",
        ),
    ] {
        let said = message(&format!("{DISC}{text}\n"));
        assert!(said.contains(what), "{text}: {said}");
    }
    for (text, what) in [
        ("humidity = 0", "`air.humidity`: expected a number from 0.001 to 1, found 0"),
        ("temperature_c = 61", "`air.temperature_c`: expected a number from -80 to 60"),
        ("pressure_hpa = 100", "`air.pressure_hpa`: expected a number from 250 to 2000"),
        ("humidity = 0.5\ndew_point_c = 3", "either a `humidity` or a `dew_point_c`, not both"),
        ("dew_point_c = 21", "`air.dew_point_c`: expected at most the temperature, found 21"),
        ("temperature_c = 50\ndew_point_c = -80", "makes a humidity of"),
        (
            "saturation = 'magnus'",
            "`air.saturation`: unknown value `magnus`; known here: `constant`, `linear`, `bolton`",
        ),
        ("metres_per_unit = 1e-15", "`air.metres_per_unit`: puts the clouds' bases at"),
        ("moisture = 1", "unknown key `air.moisture`"),
    ] {
        let said = message(&format!("[air]\n{text}\n"));
        assert!(said.contains(what), "{text}: {said}");
    }
}
