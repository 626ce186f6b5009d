//! The bound of a frame's rounds.

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::layout::frame::CameraRecord;

fn camera(tan_x: f32, tan_y: f32) -> CameraRecord {
    CameraRecord {
        right: [1.0, 0.0, 0.0],
        up: [0.0, 1.0, 0.0],
        forward: [0.0, 0.0, -1.0],
        tan_x,
        tan_y,
        near: 0.01,
        ..CameraRecord::default()
    }
}

const THIN: Form = Form { is_one_subgroup: true, slices: 0 };

fn view<'a>(camera: &'a CameraRecord, extents: &'a [Extent]) -> BlobView<'a> {
    BlobView {
        camera,
        cutoff: 8.0,
        threshold: 0.0,
        least: 0.0,
        saturated: 0.0,
        slice: 0.0,
        extents: Some(extents),
        cells: None,
    }
}

fn extent(center: DVec3, half: f64, sigma: f64, n_particles: u32) -> Extent {
    let half = DVec3::splat(half);
    Extent { center, half, sigma_max: sigma, sigma_mean: sigma, reach: 3.0, n_particles }
}

/// Bins that the silhouette of a ball covers, from the slopes of rays that touch it.
fn bins_of(division: &Division, camera: &CameraRecord, center: DVec3, radius: f64) -> u64 {
    let z = -center.z;
    let along = |x: f64, tangent: f32, pixels: u32, bin: u32| {
        let t = f64::from(tangent);
        let square = z * z - radius * radius;
        let root = radius * (x * x + square).sqrt();
        let pixel =
            |slope: f64| ((slope + t) / (2.0 * t) * f64::from(pixels)).clamp(0.0, pixels.into());
        let ends = [(x * z - root) / square, (x * z + root) / square].map(pixel);
        if ends[0] >= ends[1] {
            return 0;
        }
        (ends[1].ceil() as u64 - 1) / u64::from(bin) - ends[0].floor() as u64 / u64::from(bin) + 1
    };
    let [bin_width, bin_height] = division.tile.map(|n| TILES_ACROSS * n);
    along(center.x, camera.tan_x, division.width, bin_width)
        * along(center.y, camera.tan_y, division.height, bin_height)
}

proptest! {
    /// No ball within an extent covers more bins than the bound.
    #[test]
    fn no_ball_reaches_more_bins_than_the_bound(
        place in prop::array::uniform3(-1.0f64..1.0),
        depth in 0.5f64..50.0,
        half in 0.0f64..4.0,
        sigma in 1e-3f64..1.0,
        tangents in prop::array::uniform2(0.1f32..2.0),
        size in prop::array::uniform2(16u32..2000),
    ) {
        let division = Division::new(size[0], size[1], 32).expect("few bins");
        let camera = camera(tangents[0], tangents[1]);
        let middle = DVec3::new(4.0 * place[0], 4.0 * place[1], -depth);
        let extent = extent(middle, half, sigma, 1);
        let bound = most_bins(&division, &view(&camera, &[]), &extent);
        let center = middle + half * DVec3::from(place);
        let radius = 3.0 * sigma;
        if -center.z > radius {
            prop_assert!(bins_of(&division, &camera, center, radius) <= bound);
        } else if -center.z > f64::from(camera.near) {
            prop_assert_eq!(bound, u64::from(division.n_bins));
        }
    }
}

#[test]
fn far_blobs_need_few_rounds_and_unknown_ones_all() {
    let limits = Limits {
        max_storage_buffer_bytes: 1 << 32,
        device_memory_bytes: 16 << 30,
        max_loop_iterations: u32::MAX,
        ..Limits::default()
    };
    let division = Division::new(3840, 2160, 32).expect("few bins");
    let camera = camera(0.7, 0.4);
    for n in [50_000, 1_000_000, 4_000_000] {
        let rounds = Rounds::new(n, &division, &limits, None, THIN).expect("it fits");
        let far = [extent(DVec3::NEG_Z * 18.0, 4.0, 0.06, n)];
        assert!(rounds.of_frame(&division, &view(&camera, &far)) <= 1 + n / 2_000_000, "{n}");
        let unknown = BlobView { extents: None, ..view(&camera, &[]) };
        assert_eq!(rounds.of_frame(&division, &unknown), rounds.n);
        // Around the camera every blob may cover the picture.
        let near = [extent(DVec3::ZERO, 4.0, 0.06, n)];
        assert_eq!(rounds.of_frame(&division, &view(&camera, &near)), rounds.n);
        let behind = [extent(DVec3::Z * 18.0, 4.0, 0.06, n)];
        assert_eq!(rounds.of_frame(&division, &view(&camera, &behind)), 1);
    }
    // llvmpipe's loops bound the blocks of a round.
    let llvmpipe = Limits { max_loop_iterations: 65_535, ..limits };
    let rounds = Rounds::new(1_000_000, &division, &llvmpipe, None, THIN).expect("it fits");
    let far = [extent(DVec3::NEG_Z * 18.0, 4.0, 0.06, 1_000_000)];
    assert_eq!(rounds.of_frame(&division, &view(&camera, &far)), 16);
}

#[test]
fn loops_with_slices_end_before_a_device_ends_them() {
    // The most turns that a tile takes for all splats of a round and the slices among them.
    for (form, of_splat, of_slice) in [
        (THIN, 1, 0),
        (Form { slices: 4, ..THIN }, 2, 2),
        (Form { is_one_subgroup: false, slices: 0 }, 2, 0),
        (Form { is_one_subgroup: false, slices: 4 }, 3, 2),
    ] {
        for iterations in [10_000, 65_535, 10_000_000] {
            let n = form.most_blocks(iterations);
            let turns = n * BLOCK * of_splat + MAX_SLICES * of_slice;
            assert!(turns <= iterations && turns + of_splat * BLOCK > iterations, "{form:?} {n}");
        }
    }
    assert_eq!(Form { slices: 4, ..THIN }.most_blocks(1000), 1);
}
