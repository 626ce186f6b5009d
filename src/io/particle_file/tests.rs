//! Tests of particle lists.

use super::*;

/// Reads a list as a whole, and by parts of a few bytes: particles, lines and faults are the same.
fn read(text: &str) -> Result<Lines> {
    let path = Path::new("p.csv");
    let whole = parse(text, path);
    for part_bytes in [1, 7, 40] {
        let parts = parse_by(part_bytes, text, path).map_err(|e| e.to_string());
        let whole = whole.as_ref().map_err(ToString::to_string);
        assert_eq!(whole, parts.as_ref().map_err(String::clone), "{part_bytes} a part of\n{text}");
    }
    whole
}

fn good(text: &str) -> Vec<Particle> {
    read(text).unwrap().0
}

#[test]
fn columns_come_in_any_order_and_colour_is_optional() {
    let list = good("kappa, b,g,r, radius,z,y,x\n2,0.3,0.2,0.1,6,-3,2,1\n");
    let position = DVec3::new(1.0, 2.0, -3.0);
    let expected = Particle {
        shape: Shape::BALL,
        position,
        sigma: 2.0,
        kappa: 2.0,
        color: DVec3::new(0.1, 0.2, 0.3),
    };
    assert_eq!(list, [expected]);
    let flat = good("x,y,z,sigma,sigma_y,kappa\n1,2,-3,2,0.5,2\n0,0,0,0,7,1\n");
    assert_eq!([flat[0].shape, flat[1].shape], [Shape::upright(0.25), Shape::BALL]);
    // A turn by a third about the diagonal: x, y and z become y, z and x.
    let turned = good("x,y,z,sigma,sigma_y,sigma_z,qw,qx,qy,qz,kappa\n0,0,0,3,2,1,2,2,2,2,1\n");
    let extents = turned[0].sigma * turned[0].shape.extents();
    assert!(extents.abs_diff_eq(DVec3::new(1.0, 3.0, 2.0), 3e-5), "{extents}");
    let plain = good("\n\"x\",y,z,sigma,kappa\r\n\r\n1,2,-3, 2.0 ,\"2\"\r\n \r\n");
    assert_eq!(plain, [Particle { color: DVec3::ONE, ..expected }]);
    assert_eq!(good("x,y,z,sigma,kappa"), []);
    let text = "\nx,y,z,sigma,kappa\r\n\r\n1,2,3,4,5\n \n1,2,3,4,5\n1,2,3,4,5";
    assert_eq!(read(text).unwrap().1, [4, 6, 7]);
}

#[test]
fn faults_have_their_place_and_say_what_was_expected() {
    let known = "(known: `x`, `y`, `z`, `sigma`, `radius`, `sigma_y`, `kappa`, `r`, `g`, `b`, \
                 `sigma_z`, `qw`, `qx`, `qy`, `qz`)";
    let row = |row: &str| format!("x,y,z,sigma,kappa\n0,0,0,1,1\r\n\r\n{row}\n");
    for (text, expected) in [
        (
            "x,y,z,sigma,kapa".to_owned(),
            format!(
                "1:13: unknown column `kapa`; did you mean \
            `kappa`? {known}"
            ),
        ),
        (
            "x,y,z,sigma,kappa,".to_owned(),
            format!(
                "1:19: unknown column ``; did you mean \
            `x`? {known}"
            ),
        ),
        ("x, x,y,z,sigma,kappa".to_owned(), "1:4: column `x` stands twice".to_owned()),
        ("x,y,sigma,kappa".to_owned(), "1:1: missing column `z`".to_owned()),
        (
            "x,y,z,kappa".to_owned(),
            "1:1: missing column `sigma` (or \
            `radius` = 3 sigma)"
                .to_owned(),
        ),
        (
            "x,y,z,sigma,kappa,radius".to_owned(),
            "1:19: expected `sigma` or \
            `radius`, found both"
                .to_owned(),
        ),
        (
            "x,y,z,sigma,kappa,r,b".to_owned(),
            "1:19: expected all of `r`, `g`, `b` or \
            none; missing `g`"
                .to_owned(),
        ),
        (
            "\n1,2,3,4,5\n".to_owned(),
            "2:1: expected a header x,y,z,sigma (or radius),kappa[,r,g,b], found numbers"
                .to_owned(),
        ),
        (
            "3\n1\n3, 1, 1, 1, 0, 0, 0, 1\n".to_owned(),
            "1:1: expected a header x,y,z,sigma (or radius),kappa[,r,g,b], found numbers; a \
             box file needs from = \"boxes\""
                .to_owned(),
        ),
        (
            "x;y;z;sigma;kappa\n0;0;0;1;1".to_owned(),
            format!("1:1: unknown column `x;y;z;sigma;kappa`; commas separate the columns {known}"),
        ),
        (
            row("0\t0\t0\t1\t1"),
            "4:10: expected 5 fields as in the header, found 1; commas separate the columns"
                .to_owned(),
        ),
        (row("0,0,0,1"), "4:8: expected 5 fields as in the header, found 4".to_owned()),
        (row("0,0,0,1,1,7"), "4:11: expected 5 fields as in the header, found 6".to_owned()),
        (
            "x,y,z,sigma,sigma_y,kappa\n0,0,0,2,0.001,1".to_owned(),
            "2:9: sigma_y: expected a number from 2.000e-3 to 2.000e3, a thousandth to a \
             thousand times the other, found `0.001`"
                .to_owned(),
        ),
        (row("0,0,zero,1,1"), "4:5: expected a finite number, found `zero`".to_owned()),
        (row("0,0,,1,1"), "4:5: expected a finite number, found ``".to_owned()),
        (row("0,\"0\", inf,1,1"), "4:8: expected a finite number, found `inf`".to_owned()),
        (
            row("0,0,0,-1,1"),
            "4:7: sigma: expected 0 or a number from 1e-15 to \
            1e15, found `-1`"
                .to_owned(),
        ),
        (
            row("0,0,0,1,-2"),
            "4:9: kappa: expected a number from 0 to \
            1e15, found `-2`"
                .to_owned(),
        ),
        (
            row("0,0,0,1e-300,1"),
            "4:7: sigma: expected 0 or a number from 1e-15 to 1e15, \
            found `1e-300`"
                .to_owned(),
        ),
        (
            row("0,0,0,1,1e300"),
            "4:9: kappa: expected a number from 0 to 1e15, \
            found `1e300`"
                .to_owned(),
        ),
        (
            row("0,1e30,0,1,1"),
            "4:3: y: expected a number from -1e15 to 1e15, \
            found `1e30`"
                .to_owned(),
        ),
        (row("0,0,\"0,1,1"), "4:5: the quote is not closed on its line".to_owned()),
    ] {
        let error = read(&text).expect_err(&text).to_string();
        assert_eq!(error, format!("p.csv:{expected}"), "for\n{text}");
    }
}
