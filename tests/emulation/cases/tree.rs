//! Clusters by values worked by hand.

use super::*;
use crate::emulation::cluster_view::positive_part;

/// Gathers from a tree over the facets in their given order.
fn through_a_tree(exchange: &Exchange, theta: f64) -> Gathered {
    let senders = exchange.senders();
    let order: Vec<u32> = (0..exchange.facets.len() as u32).collect();
    exchange.gather_from(0, &senders, &exchange.clusters(&order, &senders, theta))
}

#[test]
fn the_positive_part_of_a_normal_distribution() {
    assert!((positive_part(0.0, 1.0) - 0.398_942_280_401_4).abs() < 1e-12);
    // E max(x, 0) − E max(−x, 0) = m, and at m = s: φ(1) + Φ(1) = 0.241971 + 0.841345.
    assert!((positive_part(1.0, 1.0) - 1.083_315).abs() < 1e-6);
    assert!((positive_part(0.3, 0.04) - positive_part(-0.3, 0.04) - 0.3).abs() < 1e-15);
    assert_eq!(
        [positive_part(0.5, 0.0), positive_part(-0.5, 0.0), positive_part(0.0, 0.0)],
        [0.5, 0.0, 0.0]
    );
}

#[test]
fn a_cluster_of_quarters_equals_the_rectangle() {
    // Off the axis and turned, so that every term counts. Half axes are ¼ and ⅛, a quarter's ⅛ and
    // 1/16. Second moments of a quarter about the middle are (⅛)² (⅓ + 1) = (¼)²/3.
    let ceiling = |n| {
        plane(DVec3::new(1.0, 2.0, -0.5), 0.25 * DVec3::new(0.8, 0.6, 0.0), 0.125 * DVec3::Z, n)
    };
    let scene = |n| Scene::of_surfaces(&[eye_on_the_floor(), ceiling(n)], matte(1.0));
    let normal = scene(1).facets[1].normal;
    assert!(normal.y < 0.0);
    let found = |n: u32, theta: f64| {
        let scene = scene(n);
        through_a_tree(&scene.exchange(&[GLOW], &vec![0.0; scene.facets.len()]), theta).indirect.x
    };
    let whole = found(1, 1.0);
    assert!(whole > 0.0 && (found(2, 3.0) / whole - 1.0).abs() < 1e-12);
    // ρ = (0.2795/2 + 0.2795/2)/2.29 = 0.122: h = 0.0027, c_j 0.87 + ρ, c_i 0.25…, ΣA/d² = 0.024:
    // θ⁴ at about 2e-5.
    let exact = |n| {
        let scene = scene(n);
        scene.gather(&[GLOW], 0.0, 0).indirect.x
    };
    assert_eq!(found(2, 0.0), exact(2));
    assert!(found(2, 0.04) == exact(2) && found(2, 0.1) != exact(2));
}

#[test]
fn a_clouds_cluster_spreads_about_its_mean() {
    // Two discs 2a apart, ten above, their normals 60° to either side of down: the mean normal is ½
    // long, the variance (1 − ¼)/3. Seen along the axis M = a² x xᵀ, N = a²/100, w·Nw = 0 and n_j·N
    // = 0.
    let a = 0.1;
    let tilt = |s: f64| DVec3::new(s * 0.75f64.sqrt(), -0.5, 0.0);
    let cloud = |s: f64| disc(DVec3::new(s * a, 10.0, 0.0), tilt(s), 0.01, 1);
    let mut scene =
        Scene::of_discs(&[disc(DVec3::ZERO, DVec3::Y, 1e-4, 0), cloud(-1.0), cloud(1.0)]);
    scene.regions.pop();
    scene.pairings = pairings(&[], 2);
    let found = through_a_tree(&scene.exchange(&[GLOW], &[0.0; 3]), 1.0).indirect.x;
    // Under GLOW a facet's g is ½ + ½ n·up of no light and the constant 1, so its L = 1.
    let spread = a * a / 100.0;
    let form = positive_part(0.5, 0.25) * positive_part(1.0, spread / 3.0) - 2.0 * 0.5 * spread;
    assert!((found / (0.02 * form / 100.0) - 1.0).abs() < 1e-12, "{found} {form}");
}
