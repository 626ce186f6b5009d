use super::*;
use crate::model::cloud::{SQRT_TAU, Shape};
use crate::reference::Blob;
use crate::reference::sprites::{render_over, shares_at};
use crate::reference::volume::Volume;

const VIEW: View = View { slice: 1.0, ..View::ONE_PIXEL };

fn at(z: f64, sigma: f64, tau: f64) -> Blob {
    let kappa = tau / (SQRT_TAU * sigma);
    Blob { shape: Shape::BALL, position: DVec3::NEG_Z * z, sigma, kappa }
}

fn drawn(view: &View, blobs: &[Blob], behind: OpaquePixel) -> [f64; 4] {
    let colors = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut order: Vec<u32> = (0..blobs.len() as u32).collect();
    order.sort_by(|i, j| {
        let z = |k: &u32| blobs[*k as usize].position.length();
        z(j).total_cmp(&z(i))
    });
    let sprites = Sprites {
        blobs,
        radiance: &colors[..blobs.len()],
        order: &order,
        factor: None,
        shades: None,
        cells: None,
    };
    let drawn = render_over(view, &[behind], &sprites, &Rounding::NONE).0[0];
    // Shares are those of the picture.
    let raster = Raster { first: [0, 0], n_columns: 1, cell: 1, at: &[[0, 0]] };
    let shares = shares_at(view, &raster, &[behind], &sprites).remove(0);
    let sum: DVec3 = shares.blobs.iter().map(|(j, s)| *s * colors[*j as usize]).sum();
    let shown = sum + shares.behind * DVec3::from_slice(&behind.color[..3]);
    assert!((shown - DVec3::from_slice(&drawn[..3])).abs().max_element() < 1e-14);
    drawn
}

fn is(a: [f64; 4], b: [f64; 4]) -> bool {
    (0..4).all(|k| (a[k] - b[k]).abs() < 1e-12)
}

#[test]
fn blobs_in_one_place_are_mixed_and_blobs_apart_are_not() {
    // Small blobs inside of one slice: half of each, 1 − e^{−(ln 2 + ln 2)} = 3/4 together.
    let ln2 = std::f64::consts::LN_2;
    let mixed = drawn(&VIEW, &[at(5.5, 0.01, ln2), at(5.4, 0.01, ln2)], OpaquePixel::EMPTY);
    assert!(is(mixed, [0.375, 0.375, 0.0, 0.75]), "{mixed:?}");
    // Slices apart: ½, and ½ of what is left.
    let apart = drawn(&VIEW, &[at(5.5, 0.01, ln2), at(2.5, 0.01, ln2)], OpaquePixel::EMPTY);
    assert!(is(apart, [0.25, 0.5, 0.0, 0.75]), "{apart:?}");
}

#[test]
fn a_blob_is_dealt_by_its_share_of_a_gaussian() {
    // σ = 1 about the boundary at 5: half of it on either side, of which Φ(−1) = 0.158655 lies
    // more than a slice before. A thin blob in the slice from 4 to 5 sees that before it.
    let tau = 1e-6;
    let [before, own] = [0.158_655_253_931_457_05, 0.341_344_746_068_543];
    let seen = drawn(&VIEW, &[at(5.0, 1.0, tau), at(4.5, 1e-3, 40.0)], OpaquePixel::EMPTY);
    // All of the opaque blob shows, but for what is before it. Behind it nothing does. In its
    // own slice the share of the thin one is that of the mixture, next to nothing.
    assert!((seen[0] / tau - before - own / 40.0).abs() < 1e-4, "{seen:?}");
    // Dealt among two slices, all that is before 5 is in the one from 4 to 5.
    let view = View { n_parts: 2, ..VIEW };
    let seen = drawn(&view, &[at(5.0, 1.0, tau), at(4.5, 1e-3, 40.0)], OpaquePixel::EMPTY);
    assert!((seen[0] / tau - 0.5 / 40.0).abs() < 1e-4, "{seen:?}");
}

#[test]
fn what_is_behind_a_surface_is_cut_off() {
    let behind = OpaquePixel { color: [0.0, 0.0, 1.0, 1.0], depth: 5.0, ..OpaquePixel::EMPTY };
    let half = drawn(&VIEW, &[at(5.0, 0.3, 2.0)], behind);
    let through = (-1.0f64).exp();
    assert!(is(half, [1.0 - through, 0.0, through, 1.0]), "{half:?}");
    let none = drawn(&VIEW, &[at(7.0, 0.1, 2.0)], behind);
    assert!(is(none, behind.color));
}

/// Error against the integral over the volume, and that of thin sprites.
fn errors(view: &View, blobs: &[Blob]) -> [f64; 2] {
    let colors = [DVec3::X, DVec3::Y, DVec3::Z];
    let volume = Volume::new(view, blobs, &colors[..blobs.len()]);
    let truth = volume.row(0, [(0, OpaquePixel::EMPTY)].into_iter())[0].color;
    [view.slice, 0.0].map(|slice| {
        let found = drawn(&View { slice, ..*view }, blobs, OpaquePixel::EMPTY);
        (0..3).map(|k| (found[k] - truth[k]).powi(2)).sum::<f64>().sqrt()
    })
}

#[test]
fn slices_are_nearer_to_the_volume_than_thin_sprites() {
    let mut all = [0.0f64; 2];
    for shift in [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9] {
        let blobs =
            [at(6.0 + shift, 0.8, 1.5), at(6.3 + shift, 0.9, 1.0), at(7.1 + shift, 0.8, 2.0)];
        let view = View { edge: crate::model::edge::Edge::NONE, ..VIEW };
        let [slices, thin] = errors(&view, &blobs);
        all = [all[0] + slices * slices, all[1] + thin * thin];
    }
    assert!(all[0] < 0.15 * 0.15 * all[1], "{all:?}");
}

#[test]
fn a_boundary_that_rounding_may_choose_is_in_the_bound() {
    let rounding = Rounding { depth: 1e-6, ..Rounding::NONE };
    let blobs = [at(5.5, 0.9, 1.0), at(5.1, 0.9, 1.0)];
    let off = |z: f64| {
        let blobs = [at(z, 0.9, 1.0), blobs[1]];
        let (radiance, order) = ([DVec3::X, DVec3::Y], [0, 1]);
        let sprites = Sprites {
            blobs: &blobs,
            radiance: &radiance,
            order: &order,
            factor: None,
            shades: None,
            cells: None,
        };
        let behind = [OpaquePixel::EMPTY];
        let (value, bound) = render_over(&VIEW, &behind, &sprites, &rounding);
        (value[0], bound[0])
    };
    let (below, wide) = off(5.5 - 1e-7);
    let (above, _) = off(5.5 + 1e-7);
    let (_, narrow) = off(5.6);
    assert!(narrow[0] < 1e-4 && wide[0] < 0.5, "{narrow:?} {wide:?}");
    for k in 0..4 {
        assert!((below[k] - above[k]).abs() <= wide[k], "{k}: {below:?} {above:?} {wide:?}");
    }
    assert!((below[0] - above[0]).abs() > narrow[0], "the choice shows: {below:?} {above:?}");
}
