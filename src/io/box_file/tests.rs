//! Box files: what is read, refused and written.

use super::*;

fn message(text: &str) -> String {
    parse(text, Path::new("b.dat")).expect_err(text).to_string()
}

#[test]
fn commas_blanks_line_ends_and_exponents_are_read() {
    let boxes = parse(
        "7\r\n2\r\n\r\n3,1,2,3,-4,5.5,6.12438e-007, 2\r\n4 1\t2  3 , 4 5 6,2\n\n \n",
        Path::new("b"),
    )
    .unwrap();
    let first = CloudBox {
        n_particles: 3,
        extent: DVec3::new(1.0, 2.0, 3.0),
        center: DVec3::new(-4.0, 5.5, 6.12438e-7),
        radius_max: 2.0,
    };
    let center = DVec3::new(4.0, 5.0, 6.0);
    assert_eq!(boxes, [first, CloudBox { n_particles: 4, center, ..first }]);
    assert_eq!(parse("0\n0", Path::new("b")).unwrap(), []);
}

#[test]
fn faults_have_their_place_and_say_what_was_expected() {
    let one = |line: &str| message(&format!("3\n1\n{line}\n"));
    for (found, expected) in [
        (one("3, 1, 1, 1, 0, 0, 0"), "3:20: EIGHT, found 7"),
        (one("3, 1, 1, 1, 0, 0, 0, 1, 5"), "3:25: EIGHT, found 9"),
        (
            one("3, 1, -1, 1, 0, 0, 0, 1"),
            "3:7: y extent: expected 0 or a number from 1e-30 to 1e15, found `-1`",
        ),
        (
            one("3, 1, 1, 1, 0, 0, 0, -0.5"),
            "3:22: radius: expected a number from 0 to 1e15, found `-0.5`",
        ),
        (
            one("-3, 1, 1, 1, 0, 0, 0, 1"),
            "3:1: particles: expected an integer from 0 to 4294967295, found `-3`",
        ),
        (
            one("3.5, 1, 1, 1, 0, 0, 0, 1"),
            "3:1: particles: expected an integer from 0 to 4294967295, found `3.5`",
        ),
        (
            one("4294967296, 1, 1, 1, 0, 0, 0, 1"),
            "3:1: particles: expected an integer from 0 to 4294967295, found `4294967296`",
        ),
        (one("3, 1, 1, 1, nan, 0, 0, 1"), "3:13: x: expected a finite number, found `nan`"),
        (one("3, 1, 1, 1, 0, 0, 1e999, 1"), "3:19: z: expected a finite number, found `1e999`"),
        (
            one("3, 1, 1, 1e300, 0, 0, 0, 1"),
            "3:10: z extent: expected 0 or a number from 1e-30 to 1e15, found `1e300`",
        ),
        (
            one("3, 1e-31, 1, 1, 0, 0, 0, 1"),
            "3:4: x extent: expected 0 or a number from 1e-30 to 1e15, found `1e-31`",
        ),
        (
            one("3, 1, 1, 1, 0, -1e30, 0, 1"),
            "3:16: y: expected a number from -1e15 to 1e15, found `-1e30`",
        ),
        (
            one("3, 1, 1, 1, 0, 0, 0, 1e16"),
            "3:22: radius: expected a number from 0 to 1e15, found `1e16`",
        ),
        (one("3, 1, 1, 1, 0, o, 0, 1"), "3:16: y: expected a number, found `o`"),
        (one("3, 1,, 1, 0, 0, 0, 1"), "3:6: expected a number, found nothing beside the comma"),
        (one("3, 1, 1, 1, 0, 0, 0, 1,"), "3:24: expected a number, found nothing beside the comma"),
        (
            one("ä, 1, 1, 1, 0, 0, 0, ö"),
            "3:1: particles: expected an integer from 0 to 4294967295, found `ä`",
        ),
        (message(&format!("3\n1\n{}", "1 ".repeat(99))), "3:17: EIGHT, found 99"),
        (
            message("4\n1\n3, 1, 1, 1, 0, 0, 0, 1"),
            "1:1: the file says 4 particles and its boxes have 3",
        ),
        (message("3\n\n 2\n3, 1, 1, 1, 0, 0, 0, 1"), "3:2: the file says 2 boxes and has 1"),
        (message("3\n0\n3, 1, 1, 1, 0, 0, 0, 1"), "2:1: the file says 0 boxes and has 1"),
        (message("3\n"), "1:2: the file ends: expected the number of boxes"),
        (
            message("x, y\n1"),
            "1:1: expected the number of particles, found `x`; a list of particles needs from = \
             \"particles\"",
        ),
        (
            message("3, 1\n1"),
            "1:4: expected the number of particles alone on its line, found more: `1`",
        ),
        (message("3\nx"), "2:1: expected the number of boxes, found `x`"),
        (message("-1\n0"), "1:1: expected the number of particles, found `-1`"),
    ] {
        let eight = format!("expected 8 fields ({})", FIELDS.join(", "));
        assert_eq!(found, format!("b.dat:{}", expected.replace("EIGHT", &eight)));
    }
}

#[test]
fn wrong_is_what_the_reader_refuses() {
    let good =
        CloudBox { n_particles: 1, extent: DVec3::ONE, center: DVec3::ZERO, radius_max: 1.0 };
    let numbers = "0 -0 1e-31 1e-30 1e-300 3 -3 1e15 -1e15 1.1e15 1e300 nan inf";
    let numbers = numbers.split(' ').map(|v| v.parse::<f64>().unwrap());
    let mut n_wrong = 0;
    for v in numbers {
        for i in 0..7 {
            let mut b = good;
            match i {
                0..3 => b.extent[i] = v,
                3..6 => b.center[i - 3] = v,
                _ => b.radius_max = v,
            }
            let refused = parse(&format(&[b]), Path::new("b")).err().map(|e| e.to_string());
            assert_eq!(wrong(&b).is_some(), refused.is_some(), "{b:?}");
            let named = wrong(&b)
                .is_none_or(|what| what.starts_with(&format!("{}: expected ", FIELDS[i + 1])));
            assert!(named, "{b:?}");
            n_wrong += usize::from(refused.is_some());
        }
    }
    // 1e-31 and 1e-300 three times, −3 and −1e15 four times, and four numbers everywhere.
    assert_eq!(n_wrong, 3 + 3 + 4 + 4 + 4 * 7);
}

#[test]
#[cfg(unix)]
fn a_link_still_leads_to_the_file_after_a_save() {
    let folder = tempfile::tempdir().unwrap();
    let (file, link) = (folder.path().join("a.dat"), folder.path().join("link.dat"));
    std::fs::write(&file, "0\n0\n").unwrap();
    std::os::unix::fs::symlink(&file, &link).unwrap();
    let b = CloudBox { n_particles: 4, extent: DVec3::ONE, center: DVec3::X, radius_max: 2.0 };
    write(&link, &[b]).unwrap();
    assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(
        (read(&file).unwrap(), std::fs::read_dir(folder.path()).unwrap().count()),
        (vec![b], 2)
    );
}

#[test]
fn lines_that_were_not_edited_keep_their_text() {
    let old = "9\r\n3\r\n\r\n3,1.0,2,3,-4,5.50,6.12438e-007, 2\r\n\
        4 1\t2  3 , 4 5 6,2 \r\n2, 1, 1, 1, 0, -0.0, 0, 1";
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("b.dat");
    std::fs::write(&path, old).unwrap();
    let mut boxes = read(&path).unwrap();
    let written = |boxes: &[CloudBox]| {
        write(&path, boxes).unwrap();
        std::fs::read_to_string(&path).unwrap()
    };
    assert_eq!(written(&boxes), old);
    boxes[1].n_particles = 5;
    boxes.push(boxes[0]);
    boxes[2].center.y = 0.0;
    let expected = "13\n4\n3,1.0,2,3,-4,5.50,6.12438e-007, 2\n5, 1, 2, 3, 4, 5, 6, 2\n\
        2, 1, 1, 1, 0, 0, 0, 1\n3,1.0,2,3,-4,5.50,6.12438e-007, 2\n";
    assert_eq!(written(&boxes), expected);
    std::fs::write(&path, expected.replace('\n', "\r\n")).unwrap();
    boxes.pop();
    let ends = |text: String| (text.matches("\r\n").count(), text.matches('\n').count());
    assert_eq!(ends(written(&boxes)), (5, 5));
    let other = dir.path().join("other.dat");
    write_like(&other, &path, &boxes).unwrap();
    let text = |path| std::fs::read_to_string(path).unwrap();
    assert_eq!(text(&other), text(&path));
    std::fs::write(&path, "no boxes").unwrap();
    assert_eq!(written(&boxes), format(&boxes));
}

#[test]
fn what_is_written_reads_back_as_equal_bits() {
    // Knuth's MMIX generator, its high bits.
    let mut state = 1u64;
    let mut next = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        state >> 16
    };
    for n in 0..200 {
        let boxes: Vec<CloudBox> = (0..n % 7)
            .map(|_| {
                // Every exponent that is allowed, and both signs: coordinates and radii from
                // the subnormals on, edges from their least.
                let mut number = |least: f64| loop {
                    let v = f64::from_bits(next() << 32 ^ next());
                    if wrong_size(v.abs(), least).is_none() {
                        return v;
                    }
                };
                let mut vector = |least| DVec3::new(number(least), number(least), number(least));
                let (extent, center) = (vector(LEAST_EXTENT).abs(), vector(0.0));
                let radius_max = vector(0.0).x.abs();
                CloudBox { n_particles: next() as u32, extent, center, radius_max }
            })
            .collect();
        let text = format(&boxes);
        let again = parse(&text, Path::new("b")).unwrap();
        let bits = |b: &CloudBox| {
            (
                b.n_particles,
                [b.extent, b.center].map(|v| v.to_array().map(f64::to_bits)),
                b.radius_max.to_bits(),
            )
        };
        assert!(boxes.iter().map(bits).eq(again.iter().map(bits)), "{text}");
        assert_eq!(format(&again), text);
    }
}
