//! Weather files with wrong contents: each is refused with one message that says what, where and
//! what was expected.

use std::path::Path;

use crate::weather_files;
use crate::weather_files::{Attr, Made, Var, message_of};
use nimbus::io::weather::{netcdf, wrf};

fn good() -> Made {
    Made::wrf(1, 2)
}

fn assert_message(made: &Made, expected: &str) {
    assert_eq!(message_of(&made.bytes()), expected);
}

#[test]
fn files_that_are_no_netcdf_are_refused() {
    let of = |path: &Path| wrf::open(path).err().expect("an error").to_string();
    assert!(of(Path::new("/nowhere/of/nimbus.nc")).ends_with("nimbus.nc: no such file"));
    let dir = tempfile::tempdir().expect("a folder");
    assert!(of(dir.path()).ends_with(": is a folder, expected a file"));
    assert_eq!(message_of(b""), "the file is empty: expected a NetCDF file");
    let not_netcdf = "expected \"CDF\" and 1, 2 or 5, or \"\\x89HDF\"";
    assert_eq!(
        message_of(b"GRIB\0\0"),
        format!("not a NetCDF file: it begins with \"GRIB\", {not_netcdf}")
    );
    assert_eq!(
        message_of(b"CDF\x03 and more"),
        format!("not a NetCDF file: it begins with \"CDF\\x03\", {not_netcdf}")
    );
    assert_eq!(message_of(b"C"), format!("not a NetCDF file: it begins with \"C\", {not_netcdf}"));
}

#[test]
fn netcdf_that_is_not_wrf_is_refused() {
    let mut ocean = good();
    ocean.vars.retain(|v| matches!(v.name.as_str(), "HGT" | "Times"));
    assert_message(&ocean, "not a WRF file: none of P, PB, T, PH, PHB is in it; it has Times, HGT");
    ocean.vars.clear();
    assert_message(
        &ocean,
        "not a WRF file: none of P, PB, T, PH, PHB is in it; it has \
        no variables",
    );
}

#[test]
fn missing_variables_are_named() {
    assert_message(
        &good().without("PHB"),
        "variable PHB is missing: expected P, PB, T, PH, PHB of WRF",
    );
    assert_message(
        &good().without("T").without("PB"),
        "variables PB, T are missing: expected P, PB, T, PH, PHB of WRF",
    );
    assert_message(
        &good().without("QCLOUD").without("QVAPOR"),
        "QCLOUD, QICE, QSNOW and QVAPOR are missing: expected one of the first three, or QVAPOR to \
         diagnose clouds from",
    );
    assert_message(
        &good().without("Times"),
        "no times: expected a variable Times, or XTIME in minutes since a date",
    );
    let file = wrf::from_container(
        netcdf::from_bytes(Made::wrf(1, 1).without("Times").bytes()).expect("a file"),
        Path::new("one.nc"),
    );
    assert_eq!(file.expect("one step needs no time").times_s, None);
}

#[test]
fn variables_of_a_wrong_shape_or_unit_are_refused() {
    let shaped = |name: &str, dims: &[usize]| {
        let mut made = good();
        made.var(name).dims = dims.to_vec();
        let n = dims.iter().skip(1).map(|d| made.dims[*d].1 as usize).product();
        made.with_floats(name, |numbers| numbers.resize(n, 0.0))
    };
    assert_message(
        &shaped("QCLOUD", &[0, 5, 3, 2]),
        "variable QCLOUD: it is 2 x 6 x 3 x 4, expected 2 steps of 5 x 3 x 4",
    );
    assert_message(
        &shaped("PH", &[0, 4, 3, 2]),
        "variable PH: it is 2 x 5 x 3 x 4, expected 2 steps of 6 x 3 x 4",
    );
    assert_message(&shaped("HGT", &[0, 2]), "variable HGT: it is 2 x 4, expected 2 steps of 3 x 4");
    assert_message(
        &shaped("P", &[0, 3, 2]),
        "variable P: 3 dimensions, expected Time, bottom_top, south_north and west_east",
    );
    let none = Made::wrf(1, 0);
    assert_message(&none, "variable P: 0 steps of 5 x 3 x 4 cells, expected at least one of each");
    assert_message(&good().with_units("P", "hPa"), "variable P: units \"hPa\", expected \"Pa\"");
    let ratio = "expected \"kg kg-1\" or \"kg/kg\" or \"kg kg**-1\" or \"g kg-1\" or \"g/kg\" \
        or \"g kg**-1\"";
    let said = format!("variable QCLOUD: units \"\\u{{1b}}[31m\", {ratio}");
    assert_message(&good().with_units("QCLOUD", "\u{1b}[31m"), &said);
}

#[test]
fn values_that_are_no_air_are_refused() {
    let put =
        |name: &str, i: usize, value: f32| good().with_floats(name, |numbers| numbers[i] = value);
    let filled = "1 values are NaN or fill values, the first at level 1, row 0, column 2; expected \
        a number everywhere";
    assert_message(&put("T", 14, f32::NAN), &format!("variable T, step 0: {filled}"));
    assert_message(&put("PB", 14, 9.969_21e36), &format!("variable PB, step 0: {filled}"));
    assert_message(&put("PHB", 14, f32::INFINITY), &format!("variable PHB, step 0: {filled}"));
    let mut marked = put("P", 14, -999.0);
    marked.var("P").attrs.push(("_FillValue".to_owned(), Attr::Float(-999.0)));
    assert_message(&marked, &format!("variable P, step 0: {filled}"));
    assert_message(
        &put("PB", 0, 0.0),
        "step 0: P + PB is 0 Pa at level 0, row 0, column 0, expected 0.1 to 120000",
    );
    assert_message(
        &put("T", 59, -299.5),
        &format!(
            "step 0: the temperature of T, P and PB is {} K at level 4, row 2, column 3, \
             expected 100 to 400",
            cold()
        ),
    );
    assert_message(
        &put("PH", 24, -9810.0),
        "variables PH, PHB, step 0: heights do not rise: 0.0 m above 500.0 m at level 1, row 0, \
         column 0; expected every staggered level above the one before it",
    );
    assert_message(
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
fn wrong_spacings_and_map_factors_are_refused() {
    let expected = "expected metres from 1 to 500000";
    assert_message(&good().without("DX"), &format!("attribute DX is missing: {expected}"));
    assert_message(
        &good().with_attr("DX", Attr::Float(0.0)),
        &format!("attribute DX is 0: {expected}"),
    );
    assert_message(
        &good().with_attr("DY", Attr::Float(f32::NAN)),
        &format!("attribute DY is NaN: {expected}"),
    );
    assert_message(
        &good().with_attr("DY", Attr::Float(-1000.0)),
        &format!("attribute DY is -1000: {expected}"),
    );
    assert_message(
        &good().with_attr("DX", Attr::Text("1 km".to_owned())),
        &format!("attribute DX is missing: {expected}"),
    );
    let factor = "variables MAPFAC_M, MAPFAC_MX, MAPFAC_MY, step 0: a map factor is 0: expected \
        one from 0.05 to 20";
    assert_message(&good().with_attr("MAP_PROJ", Attr::Int(1)), factor);
}

#[test]
fn wrong_and_unordered_times_are_refused() {
    let form = "expected YYYY-MM-DD_HH:MM:SS";
    let first = "2005-08-28_12:00:00";
    assert_message(
        &good().with_times(&[first, "2005-02-30_12:00:00"]),
        &format!("variable Times, step 1: \"2005-02-30_12:00:00\" is no time, {form}"),
    );
    assert_message(
        &good().with_times(&[first, "\u{1b}[31m              "]),
        &format!("variable Times, step 1: \"\\u{{1b}}[31m              \" is no time, {form}"),
    );
    assert_message(
        &good().with_times(&[first, first]),
        "variable Times, step 1: 2005-08-28 12:00:00 does not come after step 0, \
         2005-08-28 12:00:00",
    );
    assert_message(
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
    assert_message(
        &minutes(&[5.0, 5.0], since),
        "variable XTIME, step 1: 2005-08-28 12:05:00 does not come after step 0, \
         2005-08-28 12:05:00",
    );
    assert_message(
        &minutes(&[f32::NAN], since),
        "variable XTIME, step 0: NaN is no \
        time in minutes",
    );
    assert_message(
        &minutes(&[5.0], "hours since then"),
        "variable XTIME: expected units \"minutes since YYYY-MM-DD HH:MM:SS\"",
    );
}

#[test]
fn a_missing_step_is_refused() {
    let file = netcdf::from_bytes(good().bytes()).expect("a file");
    let file = wrf::from_container(file, Path::new("two.nc")).expect("a WRF file");
    assert_eq!(
        file.step(2).err().expect("an error").to_string(),
        "step 2: two.nc has steps 0 to 1"
    );
}
