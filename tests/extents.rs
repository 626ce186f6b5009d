//! The bounds that the game thread sends with a frame: where a group's blobs are, and how far they
//! reach.

mod harness;

use std::path::Path;

use nimbus::frame::{DeviceChoice, GpuContext};
use nimbus::io::scene_file;
use nimbus::model::cloud::SQRT_TAU;
use nimbus::reference::live;

/// Moving particles are looked at one by one, in lengths of before they grew.
#[test]
fn blobs_reach_no_farther_than_their_bound_where_clouds_grow_and_move() {
    let scene = scene_file::load(Path::new("tests/data/grown.toml"), &[], None).expect("a scene");
    let scene = scene.scene;
    assert!(scene.is_animated());
    let blobs = live::cloud(&scene.clouds[1], 0.0);
    let densest = blobs.iter().map(|g| SQRT_TAU * g.kappa * g.sigma).fold(0.0, f64::max);
    let (edge, growth) = (scene.draw.edge(), scene.clouds[1].growth.to);
    // The game starts long after the cloud has grown.
    let reach = edge.reach(growth * densest);
    assert!(reach > edge.reach(densest) + 0.1 && growth == 3.0);
    let context = GpuContext::open(&DeviceChoice::default()).expect("a device");
    let mut player = context.player(scene, true).expect("the scene fits");
    let packet = player.game.step(0).expect("a packet");
    assert_eq!(packet.extents.len(), 2);
    assert!(packet.extents[1].reach >= reach * (1.0 - 1e-6), "{:?} {reach}", packet.extents[1]);
    assert!(packet.extents[1].reach <= 8.0);
}
