//! Floors worked out by hand for one small scene, and the laws that they follow.

use super::*;
use crate::frame::work::amounts::Blobs;

/// Ten particles of boxes, five of them in view, in a grid of 4 × 5 × 6 cells, with two lights and
/// two reflections, drawn into 8 × 4 pixels of half floats.
const SMALL: Amounts = Amounts {
    is_medium: false,
    cycles: 0.0,
    gathered: 0.0,
    particles: 10.0,
    box_particles: 10.0,
    live_particles: 0.0,
    is_moved_by_host: false,
    waves: 0.0,
    cells: 120.0,
    deposits: 270.0,
    facets: 10.0,
    cloud_facets: 10.0,
    lit_particles: 10.0,
    is_grouped: false,
    lights: 2.0,
    march_samples: 100.0,
    has_second: true,
    is_glossy: false,
    pairs: 90.0,
    tensor_numbers: Some(60.0),
    drawn: 10.0,
    kept: 5.0,
    culls: true,
    key_bytes: 2.0,
    texels: 0.0,
    colored_particles: 10.0,
    harmonics: 160.0,
    film_pixels: 32.0,
    pixel_bytes: 8.0,
    has_solids: false,
    blobs: Some(Blobs { pixels: 32.0, layers: 64.0 }),
};

fn of(pass: Pass, amounts: &Amounts) -> [f64; 2] {
    let work = floor(pass, amounts).unwrap_or_else(|| panic!("{pass:?} has no floor"));
    [work.bytes, work.operations]
}

#[test]
fn floors_are_those_worked_out_by_hand() {
    for (pass, bytes, operations) in [
        // 10 × (12 + 4) bytes.
        (Pass::Generate, 160.0, 80.0),
        (Pass::Live, 0.0, 0.0),
        // 10 × 16 bytes in, 10 × 16 out; 10 × 3 sums.
        (Pass::Place, 320.0, 30.0),
        // 10 × 16 and 160 × 12 bytes in, 10 × 12 out; 10 directions of 8, 160 harmonics of 8.
        (Pass::Harmonics, 2200.0, 1360.0),
        // 10 × 32 bytes in, 10 × 32 out; 10 × 25.
        (Pass::Lod, 640.0, 250.0),
        // 10 × 20 bytes in, 120 × 4 out; 270 multiply-adds.
        (Pass::Grid, 680.0, 540.0),
        // 10 × 12 bytes in, 10 × 4 out.
        (Pass::Morton, 160.0, 60.0),
        // 10 × 20 bytes in, 10 × 28 out; 10 × 14 samples of 24.
        (Pass::Facets, 480.0, 3360.0),
        // 10 × 12 bytes in, 10 × 2 × 8 out; 100 samples of 22.
        (Pass::Transmit, 280.0, 2200.0),
        // 10 × (12 + 8) bytes in, 10 × 24 out; 10 × (2 × 11 + 6).
        (Pass::First, 440.0, 280.0),
        // 10 × (28 + 8) bytes in, 10 × 24 out; 90 pairs of 28.
        (Pass::Second, 600.0, 2520.0),
        // 60 × 4 bytes in, 10 × 24 out.
        (Pass::Contract, 480.0, 360.0),
        // 10 × 20 bytes in, 5 × (4 + 2) out.
        (Pass::Cull, 230.0, 150.0),
        // 5 × (4 + 2) bytes in, 5 × 4 out.
        (Pass::Sort, 50.0, 0.0),
        (Pass::Texture, 0.0, 0.0),
        // 5 × (4 + 16 + 4 + 12) bytes in, 32 × 8 out; 64 layers of 19.
        (Pass::Sprites, 436.0, 1216.0),
        (Pass::Tiles, 436.0, 1216.0),
        // 32 × 8 bytes in, 32 × 8 out.
        (Pass::Upsample, 512.0, 768.0),
    ] {
        assert_eq!(of(pass, &SMALL), [bytes, operations], "{pass:?}");
    }
    for pass in [Pass::Surfaces, Pass::Terrain, Pass::Impostors] {
        assert_eq!(floor(pass, &SMALL), None, "{pass:?}");
    }
}

#[test]
fn other_ways_of_a_pass_have_floors_of_their_own() {
    // The host uploads 16 bytes a particle, which are copied.
    let by_host = Amounts { is_moved_by_host: true, live_particles: 4.0, ..SMALL };
    assert_eq!(of(Pass::Place, &by_host), [320.0, 0.0]);
    assert_eq!(of(Pass::Live, &by_host), [160.0, 0.0]);
    assert_eq!(of(Pass::Live, &Amounts { is_moved_by_host: false, ..by_host }), [80.0, 88.0]);
    // Three waves a particle.
    assert_eq!(of(Pass::Place, &Amounts { waves: 30.0, ..SMALL }), [320.0, 30.0 + 390.0]);
    // Two cycles: 4 × 39 sums each by cell. 100 visits of cells by bounces: 12 each.
    let bounces = Amounts { cycles: 2.0, gathered: 100.0, ..SMALL };
    assert_eq!(of(Pass::Diffusion, &bounces), [120.0 * 52.0, 120.0 * 312.0 + 1200.0]);
    // Without culling the sort computes the depths itself.
    let all = Amounts { culls: false, kept: 10.0, ..SMALL };
    assert_eq!(of(Pass::Sort, &all), [160.0, 50.0]);
    // Facets for several particles: the particles are read once, and learn their facet.
    let runs = Amounts { is_grouped: true, facets: 2.0, cloud_facets: 2.0, ..SMALL };
    assert_eq!(of(Pass::Facets, &runs), [200.0 + 80.0 + 56.0, 2.0 * 336.0]);
    // Ground is copied to facets without a sample.
    let ground = Amounts { facets: 15.0, ..SMALL };
    assert_eq!(of(Pass::Facets, &ground), [480.0 + 140.0, 3360.0]);
    assert_eq!(of(Pass::Transmit, &Amounts { has_second: false, ..SMALL })[0], 200.0);
    // Over solids sprites write the pixels alone that blobs cover, and tiles all.
    let solid = Amounts { has_solids: true, ..SMALL };
    assert_eq!(of(Pass::Sprites, &solid)[0], 180.0);
    assert_eq!(of(Pass::Tiles, &solid)[0], 436.0);
    for none in [
        floor(Pass::Second, &Amounts { is_glossy: true, ..SMALL }),
        floor(Pass::Contract, &Amounts { tensor_numbers: None, ..SMALL }),
        floor(Pass::Sprites, &Amounts { blobs: None, ..SMALL }),
        floor(Pass::Upsample, &Amounts { blobs: None, ..SMALL }),
    ] {
        assert_eq!(none, None);
    }
}

/// Returns the scene with `factor` times as many particles in the same grid and picture.
fn more_particles(factor: f64) -> Amounts {
    let of = |n: f64| factor * n;
    Amounts {
        particles: of(SMALL.particles),
        box_particles: of(SMALL.box_particles),
        facets: of(SMALL.facets),
        cloud_facets: of(SMALL.cloud_facets),
        lit_particles: of(SMALL.lit_particles),
        drawn: of(SMALL.drawn),
        kept: of(SMALL.kept),
        deposits: of(SMALL.deposits),
        march_samples: of(SMALL.march_samples),
        ..SMALL
    }
}

#[test]
fn twice_the_particles_are_twice_the_bytes_where_nothing_else_is_moved() {
    let (once, twice) = (more_particles(1.0), more_particles(2.0));
    for pass in [
        Pass::Generate,
        Pass::Place,
        Pass::Morton,
        Pass::Facets,
        Pass::Transmit,
        Pass::First,
        Pass::Cull,
        Pass::Sort,
    ] {
        let ([a, b], [c, d]) = (of(pass, &once), of(pass, &twice));
        assert_eq!([c, d], [2.0 * a, 2.0 * b], "{pass:?}");
    }
    // The grid's cells and the picture's pixels are the same.
    assert_eq!(of(Pass::Grid, &twice)[0] - of(Pass::Grid, &once)[0], 200.0);
    assert_eq!(of(Pass::Tiles, &twice)[0] - of(Pass::Tiles, &once)[0], 180.0);
}

#[test]
fn the_other_amounts_scale_the_parts_that_they_are_in() {
    let grown = |change: fn(&mut Amounts)| {
        let mut more = SMALL;
        change(&mut more);
        move |pass| {
            let ([a, b], [c, d]) = (of(pass, &SMALL), of(pass, &more));
            [c - a, d - b]
        }
    };
    assert_eq!(grown(|a| a.cells *= 2.0)(Pass::Grid), [480.0, 0.0]);
    assert_eq!(grown(|a| a.deposits *= 2.0)(Pass::Grid), [0.0, 540.0]);
    assert_eq!(grown(|a| a.lights *= 2.0)(Pass::First), [80.0, 220.0]);
    assert_eq!(grown(|a| a.lights *= 2.0)(Pass::Transmit), [160.0, 0.0]);
    assert_eq!(grown(|a| a.pairs *= 2.0)(Pass::Second), [0.0, 2520.0]);
    // Keys of 32 bits instead of 16: two bytes more a kept particle, written and read.
    assert_eq!(grown(|a| a.key_bytes = 4.0)(Pass::Cull), [10.0, 0.0]);
    assert_eq!(grown(|a| a.key_bytes = 4.0)(Pass::Sort), [10.0, 0.0]);
    let deeper = grown(|a| a.blobs = Some(Blobs { pixels: 32.0, layers: 128.0 }));
    assert_eq!(deeper(Pass::Tiles), [0.0, 1216.0]);
    let wider = grown(|a| a.blobs = Some(Blobs { pixels: 64.0, layers: 64.0 }));
    assert_eq!(wider(Pass::Tiles), [256.0, 0.0]);
}
