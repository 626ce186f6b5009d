//! Files worked out by hand, in every format, and their faults.

use std::f64::consts::{FRAC_1_SQRT_2, LN_2};

use glam::{DMat3, DVec3};

use super::*;
use crate::io::mapped_file::MappedFile;
use crate::model::cloud::Shape;

const PATH: &str = "a.ply";
/// √(2π).
const ROOT: f64 = 2.506_628_274_631_000_5;

fn header(format: &str, n: usize, properties: &[&str]) -> String {
    let lines: Vec<String> = properties.iter().map(|p| format!("property {p}\n")).collect();
    format!("ply\nformat {format} 1.0\nelement vertex {n}\n{}end_header\n", lines.concat())
}

fn ascii(properties: &[&str], rows: &str) -> Result<Read> {
    let n = rows.lines().count();
    parse((header("ascii", n, properties) + rows).as_bytes(), Path::new(PATH))
}

fn floats(names: &str) -> Vec<String> {
    names.split_whitespace().map(|name| format!("float {name}")).collect()
}

/// Reads one row of floats of the given names.
fn one(names: &str, row: &str) -> Read {
    let owned = floats(names);
    let properties: Vec<&str> = owned.iter().map(String::as_str).collect();
    ascii(&properties, row).unwrap_or_else(|e| panic!("{e}"))
}

fn is_near(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 1e-12 * expected.abs()
}

#[test]
fn every_format_has_the_same_particles() {
    let properties = [
        "double x",
        "float y",
        "int z",
        "float radius",
        "float kappa",
        "uchar red",
        "uchar green",
        "uchar blue",
        "short more",
    ];
    let rows = [
        (1.5, -2.0_f32, 3, 6.0_f32, 0.25_f32, [255, 51, 0], -7),
        (0.0, 0.5, -4, 3.0, 1.0, [0, 0, 255], 9),
    ];
    let text: Vec<String> = rows
        .iter()
        .map(|(x, y, z, r, k, c, m)| {
            format!("{x} {y} {z} {r} {k} {} {} {} {m}\n", c[0], c[1], c[2])
        })
        .collect();
    let of_text = ascii(&properties, &text.concat()).expect("a list").particles;
    let expected = Particle {
        position: DVec3::new(1.5, -2.0, 3.0),
        sigma: 2.0,
        shape: Shape::BALL,
        kappa: 0.25,
        color: DVec3::new(1.0, 0.2, 0.0),
    };
    assert_eq!(of_text[0], expected);
    assert_eq!(of_text[1].color, DVec3::Z);
    for format in ["binary_little_endian", "binary_big_endian"] {
        let mut bytes = header(format, 2, &properties).into_bytes();
        let is_big = format == "binary_big_endian";
        let mut add = |number: &[u8]| match is_big {
            true => bytes.extend(number.iter().rev()),
            false => bytes.extend(number),
        };
        for (x, y, z, r, k, c, m) in rows {
            let (x, z, m): (f64, i32, i16) = (x, z, m);
            add(&x.to_le_bytes());
            add(&y.to_le_bytes());
            add(&z.to_le_bytes());
            add(&r.to_le_bytes());
            add(&k.to_le_bytes());
            c.into_iter().for_each(|c: u8| add(&[c]));
            add(&m.to_le_bytes());
        }
        assert_eq!(parse(&bytes, Path::new(PATH)).expect("a list").particles, of_text);
        bytes.pop();
        let error = parse(&bytes, Path::new(PATH)).expect_err("cut").to_string();
        let expected = "a.ply: the file is cut: expected 2 rows of 29 bytes in `vertex`, found 57";
        assert!(error.starts_with(expected), "{error}");
    }
}

#[test]
fn a_splat_has_its_opacity_through_the_middle() {
    // Opacity ½ is the optical depth ln 2, through a ball √(2π) κ σ.
    let names =
        "x y z scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3 opacity f_dc_0 f_dc_1 f_dc_2";
    let found = one(names, &format!("1 2 3 {LN_2} {LN_2} {LN_2} 0.3 0.1 -2 0.5 0 0 1 -3"));
    let p = found.particles[0];
    assert_eq!((p.position, p.shape), (DVec3::new(1.0, 2.0, 3.0), Shape::BALL));
    assert!(is_near(p.sigma, 2.0) && is_near(p.kappa, LN_2 / (ROOT * 2.0)), "{p:?}");
    // ½ + f/(2√π), not below 0.
    assert!(is_near(p.color.y, 0.5 + 0.5 / std::f64::consts::PI.sqrt()));
    assert_eq!((p.color.x, p.color.z), (0.5, 0.0));
    assert_eq!(found.harmonics, None);
    // No splat has more than 0.99.
    let opaque = one("x y z scale_0 scale_1 scale_2 opacity", "0 0 0 0 0 0 90").particles[0];
    assert!(is_near(opaque.kappa, 100f64.ln() / ROOT), "{opaque:?}");
}

#[test]
fn harmonics_are_read_by_channel() {
    let of = |n: u32, more: &str| {
        let rest: Vec<String> = (0..n).map(|k| format!("f_rest_{k}")).collect();
        let names = format!("x y z sigma kappa f_dc_0 f_dc_1 f_dc_2 {}{more}", rest.join(" "));
        let values: Vec<String> = (0..n).map(|k| (k + 1).to_string()).collect();
        let owned = floats(&names);
        let properties: Vec<&str> = owned.iter().map(String::as_str).collect();
        let more = if more.is_empty() { "" } else { " 0" };
        ascii(&properties, &format!("0 0 0 1 1 1 0 -3 {}{more}", values.join(" ")))
    };
    for (degree, n) in [(1, 9), (2, 24), (3, 45)] {
        let read = of(n, "").expect("a list");
        let harmonics = read.harmonics.expect("harmonics");
        assert_eq!((harmonics.degree, harmonics.by_particle.len()), (degree, 1));
        let found = harmonics.by_particle[0];
        // All of red, then all of green, then all of blue.
        let third = n as f32 / 3.0;
        assert_eq!(found[1], [1.0, 1.0 + third, 1.0 + 2.0 * third]);
        assert_eq!(found[n as usize / 3], [third, 2.0 * third, 3.0 * third]);
        assert!(found[n as usize / 3 + 1..].iter().all(|c| *c == [0.0; 3]));
        // The mean may be below 0 where the colour is not.
        let y = 0.5 / std::f32::consts::PI.sqrt();
        assert!((found[0][0] - (0.5 + y)).abs() < 1e-6 && found[0][1] == 0.5);
        assert!((found[0][2] - (0.5 - 3.0 * y)).abs() < 1e-6);
        assert_eq!(read.particles[0].color.z, 0.0);
    }
    let expected = "a.ply:3:1: expected f_rest_0 to f_rest_8/23/44, of degree 1 to 3, found";
    for (n, more, found) in [(3, "", 3), (72, "", 72), (8, " f_rest_9", 9)] {
        let error = of(n, more).expect_err("harmonics").to_string();
        assert_eq!(error, format!("{expected} {found}"));
    }
    let names = "x y z sigma kappa r g b f_rest_0";
    assert_eq!(one(names, "0 0 0 1 1 1 1 1 7").harmonics, None);
}

#[test]
fn ellipsoids_have_their_axes() {
    let names = "x y z scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3 kappa";
    let ln3 = 3f64.ln();
    // Turned about x by a right angle, z becomes the height.
    let upright = one(names, &format!("0 0 0 0 0 {ln3} {FRAC_1_SQRT_2} {FRAC_1_SQRT_2} 0 0 2"));
    let p = upright.particles[0];
    assert!(
        is_near(p.sigma, 1.0) && is_near(p.shape.aspect, 3.0) && is_near(p.kappa, 2.0),
        "{p:?}"
    );
    // By half of that, variances along y and z are (1 + 9)/2.
    let (cos, sin) = (std::f64::consts::FRAC_PI_8.cos(), std::f64::consts::FRAC_PI_8.sin());
    let askew = one(names, &format!("0 0 0 0 0 {ln3} {cos} {sin} 0 0 2"));
    let p = askew.particles[0];
    let found = p.sigma * p.sigma * p.shape.covariance();
    let expected = DMat3::from_cols_array(&[1.0, 0.0, 0.0, 0.0, 5.0, -4.0, 0.0, -4.0, 5.0]);
    assert!(found.abs_diff_eq(expected, 9.0 * 1e-5), "{found}");
    assert!(is_near(p.sigma, 3.0) && is_near(p.kappa, 2.0), "{p:?}");
    // A splat of any shape: its opacity times its area, in the mean over directions.
    let flat = one("x y z scale_0 scale_1 scale_2 opacity", &format!("0 0 0 {ln3} 0 {ln3} 0"));
    let p = flat.particles[0];
    let area = ((2.0 * 3f64.powf(1.6075) + 9f64.powf(1.6075)) / 3.0).powf(1.0 / 1.6075);
    assert!(is_near(ROOT * p.kappa * 9.0, LN_2 * area), "{p:?}");
}

#[test]
fn faults_say_where_and_what() {
    let list = ["float x", "float y", "float z", "float sigma", "float kappa"];
    for (properties, rows, expected) in [
        (&list[..4], "0 0 0 1", "a.ply:3:1: expected a property `kappa`, or `opacity`"),
        (&list[..3], "0 0 0", "a.ply:3:1: expected a property `sigma`, `radius` (3 sigma), or"),
        (&list[1..], "0 0 1 1", "a.ply:3:1: expected properties `x`, `y`, `z`"),
        (&list[..], "0 0 0 1", "a.ply:10:8: expected 5 numbers as in the header, found 4"),
        (&list[..], "0 0 0 1 1 1", "a.ply:10:12: expected 5 numbers as in the header, found 6"),
        (&list[..], "0 0 nil 1 1", "a.ply:10:5: expected a number, found `nil`"),
        (&list[..], "0 0 0 -1 1", "a.ply:10:7: `sigma`: expected 0 or a number from 1e-15 to"),
        (&list[..], "0 inf 0 1 1", "a.ply:10:3: `y`: expected a finite number, found `inf`"),
        (&list[..], "0 0 0 1 NaN", "a.ply:10:9: `kappa`: expected a number from 0 to 1e15,"),
    ] {
        let error = ascii(properties, rows).expect_err(expected).to_string();
        assert!(error.starts_with(expected), "{error}");
    }
    let mut bytes = header("binary_little_endian", 20_000, &list).into_bytes();
    let start = bytes.len();
    bytes.resize(start + 20 * 20_000, 0);
    // The message is about the first of two wrong rows.
    for row in [19_000, 17_001] {
        bytes[start + 20 * row + 4..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    }
    let error = parse(&bytes, Path::new(PATH)).expect_err("NaN").to_string();
    assert_eq!(error, "a.ply: vertex 17001 (from 0): `y`: expected a finite number, found `NaN`");
    let both = [&list[..], &["float scale_0", "float scale_1", "float scale_2"]].concat();
    let error = ascii(&both, "0 0 0 1 1 0 0 0").expect_err("two sizes").to_string();
    assert!(error.contains("expected one of `sigma`, `radius` and `scale_0`"), "{error}");
    // Rows that no memory holds.
    let huge = header("ascii", usize::MAX, &list);
    let error = parse(huge.as_bytes(), Path::new(PATH)).expect_err("too many").to_string();
    assert!(error.contains("particles need") && error.contains("MiB are free"), "{error}");
}

#[test]
fn elements_before_the_particles_are_passed_over() {
    let more = "element camera 2\nproperty float fov\nproperty uchar id\n";
    let list = ["float x", "float y", "float z", "float sigma", "float kappa"];
    let row: Vec<u8> = [1f32, 2.0, 3.0, 4.0, 5.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let text = header("binary_little_endian", 1, &list);
    let text = text.replace("element vertex", &format!("{more}element vertex"));
    let bytes = [text.as_bytes(), &[9; 10], &row].concat();
    let found = parse(&bytes, Path::new(PATH)).expect("a list").particles;
    assert_eq!((found[0].position, found[0].kappa), (DVec3::new(1.0, 2.0, 3.0), 5.0));
    let text = header("ascii", 1, &list);
    let text = text.replace("element vertex", &format!("{more}element vertex"));
    let found = parse(format!("{text}1 2\n3 4\n1 2 3 4 5\n").as_bytes(), Path::new(PATH));
    assert_eq!(found.expect("a list").particles[0].kappa, 5.0);
    let lists = more.replace("float fov", "list uchar int fov");
    let text = header("binary_little_endian", 1, &list);
    let text = text.replace("element vertex", &format!("{lists}element vertex"));
    let error = parse(text.as_bytes(), Path::new(PATH)).expect_err("lists").to_string();
    assert!(error.starts_with("a.ply:6:1: expected `vertex` before `camera`, "), "{error}");
}

#[test]
fn what_is_written_is_read_again() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("a.PLY");
    let particle = |i: u32| Particle {
        position: DVec3::new(f64::from(i), 0.1, -1e9),
        sigma: 0.3,
        shape: Shape::BALL,
        kappa: 1.0 / 3.0,
        color: DVec3::new(0.1, 0.2, 1.0),
    };
    let all: Vec<Particle> = (0..40_000).map(particle).collect();
    write(&path, &all).expect("room");
    assert!(is_named(&path));
    let file = MappedFile::open(&path).expect("a file");
    assert_eq!(
        parse(file.bytes(), &path).expect("a list"),
        Read { particles: all, harmonics: None }
    );
}

#[test]
fn the_difference_from_splatting_is_as_told() {
    // Over u = b²/2, in which the area is even. model.md §14 has the table.
    const N: u32 = 100_000;
    for (alpha, rms, ratio) in
        [(0.1_f64, 0.0007, 1.03), (0.5, 0.024, 1.18), (0.9, 0.141, 1.59), (0.99, 0.279, 2.10)]
    {
        let depth = -(-alpha).ln_1p();
        let (mut squares, mut sums) = (0.0, [0.0; 2]);
        for i in 0..N {
            let fall = (-4.5 * (f64::from(i) + 0.5) / f64::from(N)).exp();
            let (volume, splat) = (1.0 - (-depth * fall).exp(), alpha * fall);
            squares += (volume - splat).powi(2);
            sums = [sums[0] + volume, sums[1] + splat];
        }
        let found = (squares / f64::from(N)).sqrt();
        assert!((found / rms - 1.0).abs() < 0.07, "{alpha}: {found}");
        assert!((sums[0] / sums[1] - ratio).abs() < 0.005, "{alpha}: {sums:?}");
    }
}
