//! Surfaces under sprites.

use super::*;

pub fn clouded() -> Picture {
    let scenery =
        Scenery::default().rectangle(v(0.0, -1.5, 0.0), v(0.0, 0.0, 6.0), v(6.0, 0.0, 0.3), [3, 3]);
    let scenery = scenery.rectangle(v(-0.9, 0.0, 0.0), v(0.7, 0.0, 0.2), v(0.0, 1.0, 0.0), [4, 4]);
    let scenery = scenery.rectangle(v(1.2, 0.2, 1.0), v(-0.6, 0.0, 0.9), v(0.0, 0.8, 0.0), [2, 2]);
    let picture = front(0.1, scenery);
    let places = [
        (-0.9, 0.3, 0.8),
        (-0.8, 0.1, -0.7),
        (0.9, 0.0, 1.0),
        (0.2, -1.4, 0.5),
        (1.3, 0.4, -2.0),
        (0.0, 0.2, 3.0),
    ];
    let add = |p: Picture, ((x, y, z), k): ((f64, f64, f64), i32)| {
        p.blob(v(x, y, z), 0.3 + 0.05 * f64::from(k), 0.8)
    };
    let picture = places.into_iter().zip(0..).fold(picture, add);
    let lit = (0..6).map(|k| 1.0 + k as f32);
    let lit = lit.map(|k| LitRecord {
        first: [k, 0.2, 1.0],
        second: [0.1, k, 0.5 * k],
        ..LitRecord::default()
    });
    Picture { lit: Some(lit.collect()), ..picture }
}

/// Draws `picture` in both formats and compares every number of every pixel but those where
/// rounding decides which surface they show; the greatest difference that the sprites make.
pub fn compare_clouded(gpu: &mut Gpu, what: &str, picture: &Picture) -> f64 {
    let mut greatest = 0f64;
    for (target, format) in FORMATS {
        let (truths, bounds) = picture.truth(format);
        let values = picture.draw(gpu, None, target);
        let n_apart = bounds.iter().step_by(4).filter(|b| !b.is_finite()).count();
        assert!(
            n_apart <= picture.scenery.as_ref().expect("rectangles").n_lines(),
            "{what}: {n_apart} apart"
        );
        let ratio = greatest_ratio(&values, &truths, &bounds);
        println!("{what}, {format:?}: error/bound {ratio:.3}; {n_apart} pixels apart");
        assert_within(what, &values, &truths, &bounds);
        let bare = picture.behind(format);
        let change = truths
            .chunks(4)
            .zip(&bare)
            .map(|(t, b)| (0..4).map(|k| (t[k] - b[0].color[k]).abs()).sum::<f64>());
        greatest = change.fold(greatest, f64::max);
    }
    greatest
}

#[test]
fn surfaces_hide_the_sprites_behind_them() {
    let mut gpu = Gpu::new();
    let picture = clouded();
    assert!(compare_clouded(&mut gpu, "lit", &picture) > 0.5);
    assert!(compare_clouded(&mut gpu, "unlit", &Picture { lit: None, ..picture }) > 0.5);
    // A wall that faces the eye, at depth 5: a blob 1e-4 before and behind, where the depth's
    // rounding is some 1e-6.
    let wall = || {
        front(
            0.1,
            Scenery::default().rectangle(
                EYE - v(0.0, 0.0, 5.0),
                9.0 * DVec3::X,
                9.0 * DVec3::Y,
                [2, 2],
            ),
        )
    };
    let at = |z: f64| wall().blob(EYE - v(0.3, 0.1, z), 0.5, 1.0);
    assert!(compare_clouded(&mut gpu, "a hair before", &at(4.9999)) > 0.5);
    assert_eq!(compare_clouded(&mut gpu, "a hair behind", &at(5.0001)), 0.0);
    assert!(compare_clouded(&mut gpu, "at the near plane", &at(0.10001)) > 0.3);
    assert_eq!(compare_clouded(&mut gpu, "before the near plane", &at(0.09999)), 0.0);
}

#[test]
fn over_no_surface_the_sprites_are_the_same_to_the_bit() {
    let mut gpu = Gpu::new();
    let mut picture = clouded();
    picture.scenery = Some(Scenery::default());
    let with = picture.draw(&mut gpu, None, TargetFormat::Rgba16f);
    picture.scenery = None;
    assert_eq!(with, picture.draw(&mut gpu, None, TargetFormat::Rgba16f));
    assert!(with.iter().any(|x| *x > 1.0));
    // Nothing at all: cleared.
    assert_eq!(compare(&mut gpu, "nothing", &front(0.1, Scenery::default())).covered, 0.0);
}
