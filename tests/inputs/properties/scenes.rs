//! Generators of scene texts, usual and unusual ones.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use proptest::strategy::Union;

/// Names and contents of the files of clouds.
pub const BOXES: &str = "9\n2\n6, 1, 2, 1, 0, 0, 0, 0.8\n3, 1, 1, 1, 1.5, 0, -1, 0.5\n";
pub const LIST: &str =
    "x,y,z,sigma,kappa,r,g,b\n0,0,0,0.4,1.5,1,1,1\n0.5,0.2,-0.3,0.3,2,0.5,0.6,1\n";

fn quoted(names: &'static [&'static str]) -> BoxedStrategy<String> {
    select(names).prop_map(|name| format!("'{name}'")).boxed()
}

fn number(low: f64, high: f64) -> BoxedStrategy<String> {
    prop_oneof![
        (low..=high).prop_map(|v| format!("{v:?}")),
        Just(format!("{low:?}")),
        Just(format!("{high:?}"))
    ]
    .boxed()
}

fn integer(low: u32, high: u32) -> BoxedStrategy<String> {
    (low..=high).prop_map(|v| v.to_string()).boxed()
}

fn flag() -> BoxedStrategy<String> {
    any::<bool>().prop_map(|v| v.to_string()).boxed()
}

fn vector(low: f64, high: f64) -> BoxedStrategy<String> {
    vec(number(low, high), 3).prop_map(|v| format!("[{}]", v.join(", "))).boxed()
}

fn range(most: f64) -> BoxedStrategy<String> {
    // Exponents around those of the materials.
    number(256.0, most).prop_map(|high| format!("[0.5, {high}]")).boxed()
}

/// A key with possible values.
pub type Key = (&'static str, BoxedStrategy<String>);

/// The keys of the scene's single tables, with values that are valid whatever the others are.
pub fn tables() -> Vec<(&'static str, Vec<Key>)> {
    vec![
        (
            "film",
            vec![
                ("width", integer(1, 64)),
                ("height", integer(1, 64)),
                ("format", quoted(&["rgba8", "rgba16f", "rgba32f"])),
                ("background", vector(0.0, 2.0)),
                ("exposure", number(0.0, 1e15)),
                ("tone_map", quoted(&["neutral", "clip"])),
            ],
        ),
        (
            "camera",
            vec![
                ("fov_y_deg", number(1.0, 170.0)),
                ("near", number(1e-15, 1.0)),
                ("position", vector(3.0, 9.0)),
            ],
        ),
        (
            "time",
            vec![
                ("start_s", number(-1e6, 1e6)),
                ("step_s", number(0.0, 10.0)),
                ("frames", integer(1, 1000)),
            ],
        ),
        (
            "lighting",
            vec![
                ("mode", quoted(&["none", "first", "two-reflection"])),
                ("grid", integer(8, 512)),
                ("layers", integer(8, 512)),
                ("step", number(0.3, 16.0)),
                ("forward", number(0.0, 1.0)),
                ("bases", integer(1, 32)),
                ("sampling", quoted(&["log", "uniform"])),
                ("exponents", range(1e6)),
                ("gather", quoted(&["auto", "exact", "tree"])),
                ("theta", number(0.0, 2.0)),
                ("facets_per_cloud", integer(0, 50)),
                ("pair_size", number(0.01, 100.0)),
                ("pair_levels", integer(0, 16)),
                ("pair_steps", integer(1, 4096)),
                ("summation", quoted(&["plain", "kahan", "pairwise"])),
                ("precision", quoted(&["f32", "f64"])),
            ],
        ),
        (
            "draw",
            vec![
                ("path", quoted(&["sprites", "tiles", "auto"])),
                ("cutoff", number(0.5, 8.0)),
                ("threshold", prop_oneof![number(0.0, 0.99), Just("'auto'".to_owned())].boxed()),
                ("sort_bits", select(&["16", "32", "'auto'"][..]).prop_map(str::to_owned).boxed()),
                (
                    "resolution",
                    select(&["1.0", "0.5", "0.25", "'auto'"][..]).prop_map(str::to_owned).boxed(),
                ),
                ("error", number(0.0, 0.9)),
                ("texture_seed", integer(0, u32::MAX)),
                ("count", quoted(&["all", "distance"])),
                ("count_a", number(1e-15, 1e15)),
                ("count_d0", number(1e-15, 1e15)),
                ("count_normalised", flag()),
                ("count_conserve", flag()),
            ],
        ),
        (
            "threads",
            vec![("mode", quoted(&["serial", "parallel"])), ("simulate", quoted(&["gpu", "cpu"]))],
        ),
    ]
}

/// Each key is present or not.
fn some_of(keys: Vec<Key>) -> BoxedStrategy<String> {
    let lines = keys.into_iter().map(|(key, value)| {
        proptest::option::weighted(0.3, value)
            .prop_map(move |v| v.map_or(String::new(), |v| format!("{key} = {v}\n")))
    });
    lines.collect::<Vec<_>>().prop_map(|lines| lines.concat()).boxed()
}

fn light() -> BoxedStrategy<String> {
    let amount = || vector(0.0, 10.0);
    let place = || vector(-20.0, 20.0);
    prop_oneof![
        (vector(0.1, 1.0), amount()).prop_map(|(d, e)| format!(
            "kind = 'directional'\ndirection = {d}\nirradiance = {e}\n"
        )),
        (amount(), number(0.0, 1.0))
            .prop_map(|(e, c)| format!("kind = 'sky'\nirradiance = {e}\nconstant = {c}\n")),
        (place(), amount())
            .prop_map(|(p, i)| format!("kind = 'point'\nposition = {p}\nintensity = {i}\n")),
        (place(), vector(-1.0, -0.1), amount(), number(45.0, 180.0)).prop_map(
            |(p, d, i, o)| format!(
                "kind = 'spot'\nposition = {p}\ndirection = {d}\nintensity = {i}\nouter_deg = {o}\n"
            )
        ),
    ]
    .prop_map(|keys| format!("[[light]]\n{keys}"))
    .boxed()
}

fn cloud() -> BoxedStrategy<String> {
    let every = some_of(vec![
        ("position", vector(-5.0, 5.0)),
        ("wind", vector(-1.0, 1.0)),
        ("gust", number(0.0, 1.0)),
        ("gust_length", number(0.1, 10.0)),
        ("gust_period_s", number(0.1, 10.0)),
        ("gust_waves", integer(1, 32)),
        ("grow_to", number(0.1, 10.0)),
        ("grow_time_s", number(0.1, 100.0)),
        ("texture_strength", number(0.0, 1.0)),
        ("seed", integer(0, u32::MAX)),
    ]);
    let boxes = some_of(vec![
        ("form", quoted(&["centred", "printed"])),
        ("optical_depth", number(0.0, 10.0)),
        ("radius_scale", number(0.1, 3.0)),
    ]);
    let source = prop_oneof![
        boxes.prop_map(|keys| format!("from = 'boxes'\nfile = 'b.dat'\n{keys}")),
        Just("from = 'particles'\nfile = 'p.csv'\n".to_owned()),
    ];
    (source, every).prop_map(|(source, every)| format!("[[cloud]]\n{source}{every}")).boxed()
}

fn surface() -> BoxedStrategy<String> {
    let half = || number(0.1, 5.0);
    (vector(-5.0, 5.0), half(), half(), integer(1, 6), integer(1, 6))
        .prop_map(|(c, a, b, m, n)| {
            format!(
                "[[surface]]\ncenter = {c}\nu = [0, 0, {a}]\nv = [{b}, 0, 0]\nsubdivide = \
                [{m}, {n}]\n"
            )
        })
        .boxed()
}

fn material() -> BoxedStrategy<String> {
    some_of(vec![("kd", vector(0.0, 1.0)), ("ks", vector(0.0, 0.2)), ("ns", number(0.5, 256.0))])
        .prop_map(|keys| format!("[[material]]\nname = 'cloud'\n{keys}"))
        .boxed()
}

fn phases() -> BoxedStrategy<String> {
    vec((integer(1, 9), number(0.0, 9.0)), 1..4)
        .prop_map(|phases| {
            let of = |(i, (n, exposure)): (usize, &(String, String))| {
                format!("[[phase]]\nname = '{i}'\nframes = {n}\nset.film.exposure = {exposure}\n")
            };
            phases.iter().enumerate().map(of).collect()
        })
        .boxed()
}

/// A scene of valid values; nearly all of these load.
pub fn usual() -> BoxedStrategy<String> {
    let single = tables()
        .into_iter()
        .map(|(name, keys)| some_of(keys).prop_map(move |keys| format!("[{name}]\n{keys}")));
    let single = single.collect::<Vec<_>>().prop_map(|tables| tables.concat());
    let maybe =
        |s: BoxedStrategy<String>, most: usize| vec(s, 0..=most).prop_map(|all| all.concat());
    let with = (single, maybe(light(), 3), material(), maybe(surface(), 2), maybe(cloud(), 3));
    let plain = with.prop_map(|(a, b, c, d, e)| [a, b, c, d, e].concat());
    // The scene must not set the frames that the phases set.
    let in_phases =
        (maybe(light(), 2), maybe(cloud(), 2), phases()).prop_map(|(a, b, c)| [a, b, c].concat());
    Union::new_weighted(vec![(4, plain.boxed()), (1, in_phases.boxed())]).boxed()
}

/// A value that hardly any key accepts.
fn odd() -> BoxedStrategy<String> {
    const ODD: &[&str] = &[
        "nan",
        "-inf",
        "inf",
        "1e400",
        "-1e400",
        "1e-400",
        "-0.0",
        "0x7fffffffffffffff",
        "99999999999999999999999999",
        "-1",
        "0",
        "1",
        "4294967295",
        "4294967296",
        "''",
        "'auto'",
        "'\u{202e}x'",
        "\"\\u0000\"",
        "'none'",
        "true",
        "[]",
        "[[]]",
        "[1, 2]",
        "[1, 2, 3, 4]",
        "[nan, 1, 1]",
        "[1e15, -1e15, 1e16]",
        "{}",
        "{ a = 1 }",
        "{ time_s = 1 }",
        "1979-05-27",
        "[{ time_s = 0 }, { time_s = 0 }]",
        "'b.dat'",
        "'../b.dat'",
        "'/dev/zero'",
        "１２",
        "",
        "=",
        "\"",
    ];
    prop_oneof![
        select(ODD).prop_map(str::to_owned),
        any::<f64>().prop_map(|v| format!("{v:?}")),
        "\\PC{0,12}".boxed()
    ]
    .boxed()
}

/// A scene with lines of another scene, or with invalid lines.
pub fn unusual() -> BoxedStrategy<String> {
    let lines = usual().prop_map(|text| text.lines().map(str::to_owned).collect::<Vec<_>>());
    let changes = vec((any::<prop::sample::Index>(), 0..5u8, odd()), 1..5);
    (lines, changes)
        .prop_map(|(mut lines, changes)| {
            for (index, how, odd) in changes {
                if lines.is_empty() {
                    break;
                }
                let i = index.index(lines.len());
                let key = lines[i].split('=').next().unwrap_or_default().to_owned();
                match how {
                    0 | 1 => lines[i] = format!("{key}= {odd}"),
                    2 => lines.insert(i, odd),
                    3 => drop(lines.remove(i)),
                    _ => lines.insert(i, lines[i].clone()),
                }
            }
            lines.join("\n")
        })
        .boxed()
}

/// An argument of `--set`: a key of the single tables with a valid value.
pub fn setting() -> BoxedStrategy<(&'static str, &'static str, String)> {
    let all = tables().into_iter().flat_map(|(table, keys)| {
        keys.into_iter()
            .map(move |(key, value)| value.prop_map(move |value| (table, key, value)).boxed())
    });
    Union::new(all).boxed()
}

/// An invalid argument of `--set`.
pub fn odd_setting() -> BoxedStrategy<String> {
    let path = prop_oneof![
        select(
            &[
                "film.width",
                "cloud.0.seed",
                "cloud.*.file",
                "cloud.9.seed",
                "light.*",
                "phase.0.frames",
                "",
                ".",
                "x"
            ][..]
        )
        .prop_map(str::to_owned),
        "[a-z.*0-9]{0,24}".boxed(),
    ];
    prop_oneof![
        (path, odd()).prop_map(|(path, value)| format!("{path}={value}")),
        "\\PC{0,40}".boxed()
    ]
    .boxed()
}
