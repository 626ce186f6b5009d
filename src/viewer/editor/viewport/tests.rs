//! Projection, picking and framing. Rectangles are compared with a dense bundle of rays.

use super::super::fixtures::unit_box;
use super::*;

fn view() -> Viewport {
    let pose = Pose {
        position: DVec3::new(0.0, 0.0, 10.0),
        right: DVec3::X,
        up: DVec3::Y,
        forward: -DVec3::Z,
    };
    Viewport { pose, fov_y_rad: 1.0, size_px: DVec2::new(800.0, 600.0), px_per_point: 1.0 }
}

/// Returns a view turned about two axes, so that no direction is parallel to an axis.
fn turned_view() -> Viewport {
    let forward = DVec3::new(-0.4, -0.3, -0.8).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let pose =
        Pose { position: DVec3::new(4.0, 3.0, 8.0), right, up: right.cross(forward), forward };
    Viewport { pose, ..view() }
}

#[test]
fn a_place_lies_on_the_ray_of_its_pixel() {
    let view = turned_view();
    for place in [DVec3::ZERO, DVec3::new(1.0, -2.0, 0.5), DVec3::new(-30.0, 20.0, -100.0)] {
        let pixel = view.project(place).unwrap();
        let ray = view.ray(pixel);
        let beside = (place - ray.origin).cross(ray.direction).length();
        // Some roundings of coordinates of at most 108.
        assert!(beside < 1e-12, "{place}: {beside}");
    }
    assert_eq!(view.project(view.pose.position - view.pose.forward), None);
    assert_eq!(view.project(DVec3::NAN), None);
    // Row 0 is the top, column 0 the left.
    let pixel = self::view().project(DVec3::new(-1.0, 1.0, 0.0)).unwrap();
    assert!(pixel.x < 400.0 && pixel.y < 300.0);
    assert_eq!(self::view().ray(DVec2::new(400.0, 300.0)).direction, -DVec3::Z);
}

#[test]
fn a_point_spans_the_difference_of_neighbouring_pixels() {
    let view = Viewport { px_per_point: 2.0, ..turned_view() };
    let place = DVec3::new(0.3, 0.2, 0.1);
    let beside = place + view.units_per_point(place) * view.pose.right;
    let difference = view.project(beside).unwrap() - view.project(place).unwrap();
    assert!((difference - DVec2::new(2.0, 0.0)).length() < 1e-9, "{difference}");
}

#[test]
fn boxes_are_picked_from_near_to_far() {
    let at = |z: f64| CloudBox { center: DVec3::Z * z, ..unit_box() };
    let boxes = [at(-3.0), at(4.0), at(1.0), CloudBox { center: DVec3::X * 5.0, ..unit_box() }];
    let ray = view().ray(DVec2::new(400.0, 300.0));
    let order = pick_all(&boxes, &ray);
    assert_eq!(order, [1, 2, 0]);
    assert_eq!(ray.hit(&boxes[1]), Some(5.5));
    // From inside a box, a box in it is nearer than its far side.
    let around = CloudBox { extent: DVec3::splat(40.0), center: DVec3::Z * 4.0, ..unit_box() };
    assert_eq!(pick_all(&[around, at(1.0)], &ray)[0], 1);
    assert!(pick_all(&[], &ray).is_empty());
}

#[test]
fn a_rectangle_picks_the_boxes_that_its_rays_hit() {
    let view = turned_view();
    let boxes: Vec<CloudBox> = (0..40)
        .map(|i| {
            let f = |k: f64| (f64::from(i) * k).sin();
            let center = 5.0 * DVec3::new(f(1.7), f(2.9), f(4.3));
            CloudBox {
                extent: DVec3::new(1.2 + f(0.7), 1.2 + f(1.1), 1.2 + f(1.9)),
                center,
                ..unit_box()
            }
        })
        .chain([CloudBox { extent: DVec3::splat(60.0), ..unit_box() }])
        .collect();
    let mut n_found = 0;
    for (corner, opposite) in [
        (DVec2::new(300.0, 200.0), DVec2::new(420.0, 280.0)),
        (DVec2::new(700.0, 500.0), DVec2::new(100.0, 350.0)),
        (DVec2::new(0.0, 0.0), DVec2::new(60.0, 600.0)),
    ] {
        let found = pick_rectangle(&boxes, &view, corner, opposite);
        // Boxes are at least 9 pixels wide, and rays at most 2.5 pixels apart, so a box that
        // reaches 12 pixels into the rectangle is hit.
        let inwards = 12.0 * (opposite - corner).signum();
        let surely = pick_rectangle(&boxes, &view, corner + inwards, opposite - inwards);
        for (i, b) in boxes.iter().enumerate() {
            let ray = |ix: u32, iy: u32| {
                let share = DVec2::new(f64::from(ix), f64::from(iy)) / 240.0;
                view.ray(corner + share * (opposite - corner))
            };
            let is_hit = (0..=240).any(|ix| (0..=240).any(|iy| ray(ix, iy).hit(b).is_some()));
            assert!(found.contains(&i) || !is_hit, "{i} in {corner} to {opposite} is missed");
            assert!(is_hit || !surely.contains(&i), "{i} in {corner} to {opposite} is not there");
        }
        n_found += found.len();
    }
    // Neither all nor none: 41 boxes in three rectangles.
    assert!((10..100).contains(&n_found), "{n_found}");
}

#[test]
fn framed_boxes_are_whole_and_fill_the_picture() {
    for (aspect, size_px) in [(2.0, DVec2::new(800.0, 400.0)), (0.5, DVec2::new(300.0, 600.0))] {
        let b = CloudBox {
            extent: DVec3::new(3.0, 2.0, 4.0),
            center: DVec3::new(7.0, -2.0, 1.0),
            ..unit_box()
        };
        let (low, high) = bounds([&b]).unwrap();
        let turned = turned_view();
        let (position, target) = framing(low, high, turned.pose.forward, turned.fov_y_rad, aspect);
        assert_eq!(target, b.center);
        let view = Viewport { pose: Pose { position, ..turned.pose }, size_px, ..turned };
        let pixels = corners(&b).map(|corner| view.project(corner).unwrap());
        assert!(
            pixels.iter().all(|p| p.cmpge(DVec2::ZERO).all() && p.cmple(size_px).all()),
            "{pixels:?}"
        );
        let (least, most) =
            pixels.iter().fold((size_px, DVec2::ZERO), |(a, b), p| (a.min(*p), b.max(*p)));
        assert!((most - least).max_element() > 0.4 * size_px.min_element());
    }
    assert_eq!(bounds([]), None);
    assert_eq!(framing(DVec3::ONE, DVec3::ONE, -DVec3::Z, 1.0, 1.0).0, DVec3::new(1.0, 1.0, 2.0));
}
