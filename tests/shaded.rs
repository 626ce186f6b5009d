//! The light inside of blobs (model.md §18): whole pictures against the f64 reference by every way
//! of drawing, and wrong shaders are found.

#[path = "harness/bounded.rs"]
mod bounded;
mod harness;
#[path = "harness/mixed.rs"]
mod mixed;
#[path = "harness/picture.rs"]
mod picture;
#[path = "harness/scenery.rs"]
mod scenery;
#[path = "harness/sheets.rs"]
mod sheets;
#[path = "harness/tiled.rs"]
mod tiled;

use bounded::{Random, greatest_ratio};
use harness::{Gpu, assert_within};
use mixed::{cases, mixed};
use nimbus::frame::saturation_bound;
use nimbus::gpu::Compiler;
use nimbus::layout::facet::{LitRecord, SlopeRecord};
use nimbus::layout::frame::GridRecord;
use nimbus::model::film::FilmFormat;
use nimbus::passes;
use nimbus::passes::tiles::Sharing;
use picture::{FORMATS, Picture, Tiled, Way};

/// Gives every facet a slope: some slight, some steeper than blobs take.
fn shaded(picture: &Picture) -> Picture {
    let mut random = Random(5);
    let n = picture.lit.as_ref().map_or(picture.placed.len(), Vec::len);
    let white = LitRecord { first: [0.9, 0.8, 1.0], ..LitRecord::default() };
    let lit = picture.lit.clone().unwrap_or_else(|| vec![white; n]);
    let slope = |i: usize| {
        let most = 10f32.powf(random.within(-2.0, 0.7));
        let relative = [0, 1, 2].map(|_| most * random.within(-1.0, 1.0));
        let of_facet = |k: u32| k as usize == i;
        let member =
            picture.i_facet.as_ref().and_then(|all| all.iter().copied().position(of_facet));
        let position = picture.placed.get(member.unwrap_or(0)).map_or([0.0; 3], |p| p.position);
        SlopeRecord { relative, position, ..SlopeRecord::default() }
    };
    let slopes = Some((0..n).map(slope).collect());
    Picture { lit: Some(lit), slopes, ..picture.clone() }
}

/// Pictures of all kinds, composed one after the other and by slices.
fn pictures() -> Vec<(String, Picture)> {
    let mut all: Vec<(String, Picture)> =
        cases().into_iter().map(|(what, picture, _)| (what, shaded(&picture))).collect();
    let mut flat = mixed(60, 8, 2.0, -1.0);
    for (k, particle) in flat.particles.iter_mut().enumerate() {
        particle.aspect = [1.0, 0.2, 3.0][k % 3];
    }
    all.push(("ellipsoids".to_owned(), shaded(&flat)));
    all.push(("wide".to_owned(), shaded(&mixed(150, 2, 12.0, -1.0))));
    let sliced = |picture: &Picture| shaded(&picture.clone().sliced(0.7));
    all.push(("slices".to_owned(), sliced(&mixed(100, 3, 3.0, -1.0))));
    all.push(("slices of ellipsoids".to_owned(), sliced(&flat)));
    let over = cases().into_iter().find(|(what, ..)| what == "over surfaces");
    let (_, over, _) = over.expect("a picture over surfaces");
    all.push(("slices over surfaces".to_owned(), sliced(&over)));
    all.push(("cells".to_owned(), in_cells(&mixed(100, 3, 3.0, -1.0).sliced(0.7))));
    all.push(("cells of ellipsoids".to_owned(), in_cells(&flat.clone().sliced(0.7))));
    all.push(("cells over surfaces".to_owned(), in_cells(&over.clone().sliced(0.7))));
    let two = mixed(100, 3, 3.0, -1.0).sliced(1.5).in_parts(2);
    all.push(("two slices".to_owned(), shaded(&two)));
    all.push(("cells in two slices".to_owned(), in_cells(&two)));
    all.push(("cells in three slices".to_owned(), in_cells(&over.clone().sliced(0.9).in_parts(3))));
    let scenery = over.scenery.clone();
    let flat_over = Picture { scenery, ..flat };
    all.push(("slices of ellipsoids over surfaces".to_owned(), sliced(&flat_over)));
    all
}

/// Gives slices the light of cells whose light changes up to the next by as much as it is.
fn in_cells(picture: &Picture) -> Picture {
    let mut random = Random(9);
    let picture = shaded(picture);
    let half = |l: &LitRecord| l.first.map(|v| 0.5 * v);
    let lit = picture.lit.iter().flatten();
    let lit = lit.map(|l| LitRecord { indirect: l.first, first: half(l), second: half(l), ..*l });
    let [x, y, z] = [0, 1, 2].map(|k| {
        let all = || picture.placed.iter().map(move |p| p.position[k]);
        (all().fold(f32::MAX, f32::min), all().fold(f32::MIN, f32::max))
    });
    let widest = (x.1 - x.0).max(y.1 - y.0).max(z.1 - z.0);
    let cell = widest / 9.0;
    let grid = GridRecord {
        low: [x.0, y.0, z.0],
        cell,
        n_cells: [9, 14, 8],
        inv_cell: 1.0 / cell,
        aspect: 0.7,
        inv_aspect: 1.0 / 0.7,
        ..GridRecord::default()
    };
    let cell = |_| std::array::from_fn(|_| random.within(0.2, 1.4));
    let cells = Some((grid, (0..9 * 14 * 8).map(cell).collect()));
    Picture { lit: Some(lit.collect()), slopes: None, cells, ..picture.clone() }
}

fn tiled(gpu: &Gpu, format: FilmFormat) -> Tiled {
    let invocations = passes::tiles::invocations(gpu.device.limits());
    let saturated = saturation_bound(format);
    Tiled { invocations, sharing: None, max_pairs: None, max_tiles: None, saturated }
}

#[test]
fn every_way_draws_the_light_inside_of_blobs() {
    let mut gpu = Gpu::new();
    for (what, picture) in pictures() {
        for (target, format) in FORMATS {
            let tiled = tiled(&gpu, format);
            let (truths, bounds) = picture.tiled_truth(format, tiled.saturated);
            let values = picture.draw_by(&mut gpu, None, target, Way::Tiles(tiled));
            println!("{what}, {format:?}: {:.3}", greatest_ratio(&values, &truths, &bounds));
            assert_within(&format!("{what}, {format:?}, tiles"), &values, &truths, &bounds);
            let barriers = Tiled { sharing: Some(Sharing::Barriers), ..tiled };
            let alike = picture.draw_by(&mut gpu, None, target, Way::Tiles(barriers));
            assert!(values == alike, "{what}, {format:?}: without subgroups");
            if picture.view.slice > 0.0 {
                continue;
            }
            let values = picture.draw(&mut gpu, None, target);
            let (truths, bounds) = picture.truth(format);
            assert_within(&format!("{what}, {format:?}, sprites"), &values, &truths, &bounds);
            let way = Way::Chunks(3, tiled.saturated);
            let values = picture.draw_by(&mut gpu, None, target, way);
            let (truths, bounds) = picture.chunked_truth(format, tiled.saturated);
            assert_within(&format!("{what}, {format:?}, chunks"), &values, &truths, &bounds);
        }
    }
}

#[test]
fn wrong_shaders_are_found() {
    let mut gpu = Gpu::new();
    let all = pictures();
    let named = |name: &str| {
        let (_, picture) = all.iter().find(|(what, _)| what == name).expect("a picture");
        picture.clone()
    };
    let thin = "wide";
    let (shade, sliced) = ("include/shade.glsl", "include/tile_slices.glsl");
    for (name, by_tiles, file, from, to) in [
        (thin, true, shade, "STEEPEST / steep", "1.0"),
        (thin, true, shade, "-along * sigma", "along * sigma"),
        (thin, true, shade, "along / white_square * w.xy", "0.0"),
        ("shared facets", true, shade, "slope / base", "slope"),
        ("shared facets", false, shade, "MOST_OF_FACET);", "9.0);"),
        ("ellipsoids", true, shade, "* inversesqrt(white_square)", ""),
        ("ellipsoids", false, shade, "w += (shape.inverse - 1.0)", "w += 0.0"),
        ("ellipsoids", false, shade, "steep += (shape.square - 1.0)", "steep += 0.0"),
        (thin, true, "include/seen.glsl", "-0.01546", "-0.012"),
        (thin, false, "include/seen.glsl", "DEEPEST_SEEN = 8.0", "DEEPEST_SEEN = 1.0"),
        (thin, true, "include/tile_thin.glsl", "shade.y * (y", "shade.y * (-y"),
        (thin, false, "sprites.frag", "vec3(delta, seen)", "vec3(delta, 0.0)"),
        ("slices", true, sliced, "- nearer * middle", ""),
        ("slices", true, sliced, "exp(-0.5 * min", "exp(-5.0 * min"),
        ("cells", true, "include/field.glsl", "of.base + to", "of.base + 1 - to"),
        ("cells", true, sliced, "NEAREST_MIDDLE = 1.5", "NEAREST_MIDDLE = 1.6"),
        ("cells", true, sliced, "middle += 1.0;", ""),
        ("cells", true, sliced, "middle / length_of_ray(j)", "middle"),
        (
            "cells of ellipsoids",
            true,
            sliced,
            "light_at(RUN - 1u, middle)",
            "light_at(RUN - 3u, middle)",
        ),
        ("cells", true, "tiles.comp", "y * push.up_in_cells", "-y * push.up_in_cells"),
        ("cells", true, "tiles_splat.comp", "4 * facet + 1)", "4 * facet + 2)"),
        ("slices over surfaces", true, sliced, "density_here = density(to_wall)", ""),
        ("slices of ellipsoids", true, sliced, "density_here = density(u)", "density_here = 0.0"),
    ] {
        let picture = named(name);
        let (target, format) = FORMATS[2];
        let mut sources = passes::sources();
        assert!(sources.replace(file, from, to), "{from}");
        let compiler = Compiler::new(sources, None).expect("shaderc");
        let tiled = tiled(&gpu, format);
        let (way, (truths, bounds)) = match by_tiles {
            true => (Way::Tiles(tiled), picture.tiled_truth(format, tiled.saturated)),
            false => (Way::Sprites, picture.truth(format)),
        };
        let values = picture.draw_by(&mut gpu, Some(&compiler), target, way);
        let ratio = greatest_ratio(&values, &truths, &bounds);
        println!("{name}, {from} as {to}: {ratio:.1}");
        assert!(ratio > 1.0, "{name}: {from} as {to}");
    }
}
