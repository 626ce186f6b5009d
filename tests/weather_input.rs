//! Bad weather files: each is refused with one message that says what, where and what was expected,
//! and none crashes, hangs or takes memory without end.

#[path = "harness/readers.rs"]
mod readers;
#[path = "harness/weather_files.rs"]
mod weather_files;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use nimbus::error::Error;
use nimbus::io::weather::{netcdf, wrf};
use nimbus::model::philox::philox4x32_10;
use weather_files::{Attr, Made, Var};

fn good() -> Made {
    Made::wrf(1, 2)
}

/// What is said of a file when it is opened and every step of it read.
fn said_of(bytes: &[u8]) -> String {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("bad.nc");
    fs::write(&path, bytes).expect("written");
    let error = match wrf::open(&path) {
        Err(error) => error,
        Ok(file) => (0..file.n_steps)
            .find_map(|i| file.step(i).err().or_else(|| file.terrain(i).err()))
            .expect("an error"),
    };
    assert_eq!(error.exit_code(), 2, "{error}");
    let said = error.to_string();
    let place = format!("{}: ", path.display());
    said.strip_prefix(&place).unwrap_or_else(|| panic!("no place: {said}")).to_owned()
}

fn assert_said(made: &Made, expected: &str) {
    assert_eq!(said_of(&made.bytes()), expected);
}

#[test]
fn a_file_that_is_none() {
    let of = |path: &Path| wrf::open(path).err().expect("an error").to_string();
    assert!(of(Path::new("/nowhere/of/nimbus.nc")).ends_with("nimbus.nc: no such file"));
    let dir = tempfile::tempdir().expect("a folder");
    assert!(of(dir.path()).ends_with(": is a folder, expected a NetCDF file"));
    assert_eq!(said_of(b""), "the file is empty: expected a NetCDF file");
    let not_netcdf = "expected \"CDF\" and 1, 2 or 5, or \"\\x89HDF\"";
    assert_eq!(
        said_of(b"GRIB\0\0"),
        format!("not a NetCDF file: it begins with \"GRIB\", {not_netcdf}")
    );
    assert_eq!(
        said_of(b"CDF\x03 and more"),
        format!("not a NetCDF file: it begins with \"CDF\\x03\", {not_netcdf}")
    );
    assert_eq!(said_of(b"C"), format!("not a NetCDF file: it begins with \"C\", {not_netcdf}"));
}

#[test]
fn netcdf_that_is_not_wrf() {
    let mut ocean = good();
    ocean.vars.retain(|v| matches!(v.name.as_str(), "HGT" | "Times"));
    assert_said(&ocean, "not a WRF file: none of P, PB, T, PH, PHB is in it; it has Times, HGT");
    ocean.vars.clear();
    assert_said(&ocean, "not a WRF file: none of P, PB, T, PH, PHB is in it; it has no variables");
}

#[test]
fn variables_that_are_missing() {
    assert_said(
        &good().without("PHB"),
        "variable PHB is missing: expected P, PB, T, PH, PHB of WRF",
    );
    assert_said(
        &good().without("T").without("PB"),
        "variables PB, T are missing: expected P, PB, T, PH, PHB of WRF",
    );
    assert_said(
        &good().without("QCLOUD").without("QVAPOR"),
        "QCLOUD, QICE, QSNOW and QVAPOR are missing: expected one of the first three, or QVAPOR to \
         diagnose clouds from",
    );
    assert_said(
        &good().without("Times"),
        "no times: expected a variable Times, or XTIME in minutes since a date",
    );
    let file = wrf::from_container(
        Box::new(netcdf::from_bytes(Made::wrf(1, 1).without("Times").bytes()).expect("a file")),
        Path::new("one.nc"),
    );
    assert_eq!(file.expect("one step needs no time").times_s, None);
}

#[test]
fn variables_of_a_wrong_shape_or_unit() {
    let shaped = |name: &str, dims: &[usize]| {
        let mut made = good();
        made.var(name).dims = dims.to_vec();
        let n = dims.iter().skip(1).map(|d| made.dims[*d].1 as usize).product();
        made.with_floats(name, |numbers| numbers.resize(n, 0.0))
    };
    assert_said(
        &shaped("QCLOUD", &[0, 5, 3, 2]),
        "variable QCLOUD: it is 2 x 6 x 3 x 4, expected 2 steps of 5 x 3 x 4",
    );
    assert_said(
        &shaped("PH", &[0, 4, 3, 2]),
        "variable PH: it is 2 x 5 x 3 x 4, expected 2 steps of 6 x 3 x 4",
    );
    assert_said(&shaped("HGT", &[0, 2]), "variable HGT: it is 2 x 4, expected 2 steps of 3 x 4");
    assert_said(
        &shaped("P", &[0, 3, 2]),
        "variable P: 3 dimensions, expected Time, bottom_top, south_north and west_east",
    );
    let none = Made::wrf(1, 0);
    assert_said(&none, "variable P: 0 steps of 5 x 3 x 4 cells, expected at least one of each");
    assert_said(&good().with_units("P", "hPa"), "variable P: units \"hPa\", expected \"Pa\"");
    let ratio = "expected \"kg kg-1\" or \"kg/kg\" or \"kg kg**-1\" or \"g kg-1\" or \"g/kg\" \
        or \"g kg**-1\"";
    let said = format!("variable QCLOUD: units \"\\u{{1b}}[31m\", {ratio}");
    assert_said(&good().with_units("QCLOUD", "\u{1b}[31m"), &said);
}

#[test]
fn values_that_are_no_air() {
    let put =
        |name: &str, i: usize, value: f32| good().with_floats(name, |numbers| numbers[i] = value);
    let filled = "1 values are NaN or fill values, the first at level 1, row 0, column 2; expected \
        a number everywhere";
    assert_said(&put("T", 14, f32::NAN), &format!("variable T, step 0: {filled}"));
    assert_said(&put("PB", 14, 9.969_21e36), &format!("variable PB, step 0: {filled}"));
    assert_said(&put("PHB", 14, f32::INFINITY), &format!("variable PHB, step 0: {filled}"));
    let mut marked = put("P", 14, -999.0);
    marked.var("P").attrs.push(("_FillValue".to_owned(), Attr::Float(-999.0)));
    assert_said(&marked, &format!("variable P, step 0: {filled}"));
    assert_said(
        &put("PB", 0, 0.0),
        "step 0: P + PB is 0 Pa at level 0, row 0, column 0, expected 0.1 to 120000",
    );
    assert_said(
        &put("T", 59, -299.5),
        &format!(
            "step 0: the temperature of T, P and PB is {} K at level 4, row 2, column 3, \
             expected 100 to 400",
            cold()
        ),
    );
    assert_said(
        &put("PH", 24, -9810.0),
        "variables PH, PHB, step 0: heights do not rise: 0.0 m above 500.0 m at level 1, row 0, \
         column 0; expected every staggered level above the one before it",
    );
    assert_said(
        &put("PH", 71, 9.81e6),
        "step 0: the height of PH + PHB is 1002500 m at level 5, row 2, column 3, expected \
         -1000 to 200000",
    );
}

/// θ of 0.5 K at the fifth level of the file.
fn cold() -> f64 {
    let p = f64::from(1e5f32 * (-4.5f32 * 500.0 / 8000.0).exp());
    nimbus::model::weather::air::temperature(-299.5, p)
}

#[test]
fn spacings_and_map_factors() {
    let expected = "expected metres from 1 to 500000";
    assert_said(&good().without("DX"), &format!("attribute DX is missing: {expected}"));
    assert_said(
        &good().with_attr("DX", Attr::Float(0.0)),
        &format!("attribute DX is 0: {expected}"),
    );
    assert_said(
        &good().with_attr("DY", Attr::Float(f32::NAN)),
        &format!("attribute DY is NaN: {expected}"),
    );
    assert_said(
        &good().with_attr("DY", Attr::Float(-1000.0)),
        &format!("attribute DY is -1000: {expected}"),
    );
    assert_said(
        &good().with_attr("DX", Attr::Text("1 km".to_owned())),
        &format!("attribute DX is missing: {expected}"),
    );
    let factor = "variables MAPFAC_M, MAPFAC_MX, MAPFAC_MY, step 0: a map factor is 0: expected \
        one from 0.05 to 20";
    assert_said(&good().with_attr("MAP_PROJ", Attr::Int(1)), factor);
}

#[test]
fn times_that_are_none_or_out_of_order() {
    let form = "expected YYYY-MM-DD_HH:MM:SS";
    let first = "2005-08-28_12:00:00";
    assert_said(
        &good().with_times(&[first, "2005-02-30_12:00:00"]),
        &format!("variable Times, step 1: \"2005-02-30_12:00:00\" is no time, {form}"),
    );
    assert_said(
        &good().with_times(&[first, "\u{1b}[31m              "]),
        &format!("variable Times, step 1: \"\\u{{1b}}[31m              \" is no time, {form}"),
    );
    assert_said(
        &good().with_times(&[first, first]),
        "variable Times, step 1: 2005-08-28 12:00:00 does not come after step 0, \
         2005-08-28 12:00:00",
    );
    assert_said(
        &good().with_times(&[first, "2005-08-28_11:00:00"]),
        "variable Times, step 1: 2005-08-28 11:00:00 does not come after step 0, \
         2005-08-28 12:00:00",
    );
    let minutes = |numbers: &[f32], units: &str| {
        let mut made = Made::wrf(1, numbers.len() as u32).without("Times");
        made.vars.push(Var {
            name: "XTIME".to_owned(),
            dims: vec![0],
            attrs: vec![("units".to_owned(), Attr::Text(units.to_owned()))],
            data: weather_files::Data::Floats(vec![numbers[0]]),
        });
        made
    };
    let since = "minutes since 2005-08-28 12:00:00";
    assert_said(
        &minutes(&[5.0, 5.0], since),
        "variable XTIME, step 1: 2005-08-28 12:05:00 does not come after step 0, \
         2005-08-28 12:05:00",
    );
    assert_said(&minutes(&[f32::NAN], since), "variable XTIME, step 0: NaN is no time in minutes");
    assert_said(
        &minutes(&[5.0], "hours since then"),
        "variable XTIME: expected units \"minutes since YYYY-MM-DD HH:MM:SS\"",
    );
}

#[test]
fn a_step_that_is_not_there() {
    let file = netcdf::from_bytes(good().bytes()).expect("a file");
    let file = wrf::from_container(Box::new(file), Path::new("two.nc")).expect("a WRF file");
    assert_eq!(
        file.step(2).err().expect("an error").to_string(),
        "step 2: two.nc has steps 0 to 1"
    );
}

fn small_netcdf4() -> Vec<u8> {
    let path: PathBuf =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/weather/small-netcdf4.nc");
    fs::read(path).expect("a file")
}

/// A file of each kind, cut off everywhere: in its header, at its last step, by one byte. NetCDF-4
/// tells by its superblock, the others by what their header declares.
#[test]
fn files_that_are_cut_off() {
    let whole = small_netcdf4();
    let n = whole.len();
    for keep in [100, n / 2, n - 1] {
        let said = said_of(&whole[..keep]);
        assert_eq!(
            said,
            format!(
                "the file is cut off: it has {keep} bytes, and by its own superblock it ends at {n}"
            )
        );
    }
    for version in [1, 2, 5] {
        let whole = Made::wrf(version, 2).bytes();
        for keep in [10, 200, whole.len() / 2, whole.len() - 400, whole.len() - 4, whole.len() - 1]
        {
            let said = said_of(&whole[..keep]);
            assert!(
                said.starts_with("the file is damaged or cut off: "),
                "{version}, {keep} of {}: {said}",
                whole.len()
            );
        }
    }
}

const LONGEST: Duration = Duration::from_secs(20);
/// KiB.
const MOST_MEMORY: u64 = 1 << 20;

/// A file with some bytes otherwise, of a seed: set, swapped for the ends of integers' ranges,
/// moved, or cut.
fn mutate(whole: &[u8], seed: u32) -> Vec<u8> {
    const ENDS: [[u8; 4]; 5] =
        [[255; 4], [0x7f, 255, 255, 255], [0; 4], [0, 0, 0, 1], [0x80, 0, 0, 0]];
    let mut bytes = whole.to_vec();
    for i in 0..1 + seed % 4 {
        let [at, kind, value, length] = philox4x32_10([seed, 0x6d75_7461], [i, 0, 0, 0]);
        // Half of them where the file says what is in it.
        let n = if kind & 0x100 == 0 { bytes.len() } else { bytes.len().min(2048) };
        let at = at as usize % n.max(1);
        match kind % 4 {
            0 => bytes[at] = value as u8,
            1 => bytes[at..]
                .iter_mut()
                .zip(ENDS[value as usize % ENDS.len()])
                .for_each(|(b, end)| *b = end),
            2 => {
                let (from, length) = (value as usize % n, (length as usize % 64).min(n - at));
                let part: Vec<u8> = bytes.iter().skip(from).take(length).copied().collect();
                bytes[at..at + part.len()].copy_from_slice(&part);
            }
            _ if length % 8 == 0 => bytes.truncate(at + 1),
            _ => bytes[at] ^= 1 << (value % 8),
        }
    }
    bytes
}

/// As many mutations of each kind of file as `NIMBUS_MUTATIONS` says, 150 without: read or refused.
#[test]
fn damaged_files_are_read_or_refused() {
    let n: u32 = std::env::var("NIMBUS_MUTATIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(150);
    let wholes = [
        Made::wrf(1, 2).bytes(),
        Made::wrf(2, 2).bytes(),
        Made::wrf(5, 2).bytes(),
        small_netcdf4(),
    ];
    for (i_kind, whole) in wholes.into_iter().enumerate() {
        assert_eq!(readers::weather(&whole), Ok(()), "the whole file is read");
        let mut n_refused = 0;
        for seed in 0..n {
            let bytes = mutate(&whole, seed.wrapping_mul(4).wrapping_add(i_kind as u32));
            let (done, wait) = mpsc::channel();
            let worker = thread::spawn(move || drop(done.send(readers::weather(&bytes))));
            match wait.recv_timeout(LONGEST) {
                Ok(outcome) => n_refused += u32::from(outcome.is_err()),
                Err(mpsc::RecvTimeoutError::Timeout) => {
                    panic!("kind {i_kind}, seed {seed}: takes longer than {LONGEST:?}")
                }
                Err(mpsc::RecvTimeoutError::Disconnected) => {
                    let cause = worker.join().err();
                    panic!(
                        "kind {i_kind}, seed {seed}: {:?}",
                        cause.and_then(|c| c.downcast::<String>().ok())
                    );
                }
            }
        }
        println!("kind {i_kind}: {n_refused} of {n} refused");
        // Mutations that change nothing that is read are few.
        assert!(n_refused > n / 10, "kind {i_kind}: {n_refused} refused");
    }
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status
        .lines()
        .find_map(|l| l.strip_prefix("VmHWM:")?.split_whitespace().next()?.parse::<u64>().ok());
    assert!(peak.is_none_or(|peak| peak < MOST_MEMORY), "{peak:?} KiB");
}

/// Small files that declare much: looked at before room is made for it.
#[test]
fn what_is_declared_is_checked_before_room_is_made() {
    let declared = |lengths: [u64; 3], version| {
        let mut made = Made::wrf(version, 0);
        for (i, length) in [2, 3, 4].into_iter().zip(lengths) {
            made.dims[i].1 = length;
        }
        made.dims[5].1 = lengths[2] + 1;
        said_of(&made.bytes())
    };
    for version in [1, 2, 5] {
        let said = declared([60_000, 60_000, 60_000], version);
        assert!(
            said.contains("variable P: 0 steps")
                || said.starts_with("the file is damaged or cut off"),
            "{said}"
        );
    }
    let error: Error =
        wrf::from_container(Box::new(Huge::new()), Path::new("huge.nc")).err().expect("an error");
    assert_eq!(
        error.to_string(),
        "huge.nc: variable P: 60000 x 60000 x 60000 cells, at most 16777216 can be held"
    );
}

/// A container that declares what no memory holds.
struct Huge(Vec<nimbus::io::weather::container::Variable>);

impl Huge {
    fn new() -> Self {
        use nimbus::io::weather::container::{Dimension, Variable};
        let lengths = [1, 60_000, 60_000, 60_000];
        let dimensions: Vec<Dimension> =
            lengths.iter().map(|n| Dimension { name: "d".to_owned(), length: *n }).collect();
        let variable = |name: &&str| Variable {
            name: (*name).to_owned(),
            kind: "float".to_owned(),
            dimensions: dimensions.clone(),
            attributes: vec![],
        };
        Huge(["P", "PB", "T", "PH", "PHB", "QCLOUD"].iter().map(variable).collect())
    }
}

impl nimbus::io::weather::container::Container for Huge {
    fn kind(&self) -> &'static str {
        "none"
    }
    fn dimensions(&self) -> &[nimbus::io::weather::container::Dimension] {
        &[]
    }
    fn variables(&self) -> &[nimbus::io::weather::container::Variable] {
        &self.0
    }
    fn attributes(&self) -> &[nimbus::io::weather::container::Attribute] {
        &[]
    }
    fn read(&self, _: &str, _: &[u64], _: &[u64]) -> Result<Vec<f64>, String> {
        panic!("nothing is read")
    }
    fn read_rows(&self, _: &str) -> Result<Vec<String>, String> {
        panic!("nothing is read")
    }
}
