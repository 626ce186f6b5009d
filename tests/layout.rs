//! Tests that shaders and host agree: every shader is compiled unoptimised, reflected, and compared
//! with the host's records, push constants and shared constants.

mod harness;
#[path = "layout/interfaces.rs"]
mod interfaces;
#[path = "emulation/rules.rs"]
mod rules;

use harness::Gpu;
use interfaces::{INTERFACES, RECORDS};
use nimbus::gpu::{
    BindingKind, Buffer, Compiler, Field, Member, MemoryUsage, Optimize, Reflection, Sources,
    Struct, reflect,
};
use nimbus::layout::facet::{
    LitRecord, NO_LOBE, REGION_CLOUD, REGION_COLORED, REGION_SURFACE, REGION_TERRAIN, RegionRecord,
};
use nimbus::layout::frame::{LIGHT_DIRECTIONAL, LIGHT_POINT, LIGHT_SKY};
use nimbus::layout::particle::{
    FORM_CENTRED, FORM_GIVEN, FORM_PRINTED, ParticleRecord, PlacedRecord,
};
use nimbus::layout::second::{PackedRecord, SourceRecord};
use nimbus::layout::tiles::{SplatRecord, SplatTextureRecord};
use nimbus::model::grid::{
    DEPOSIT_CUT_SIGMA, FIRST_BLUR, LEVEL_SIGMA, MAX_CELLS, NARROW_BELOW, NARROW_SIGMA,
};
use nimbus::model::lod;
use nimbus::passes::{self, SHADERS, cull, generate, sort, texture, tiles, transmit};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn compare_fields(what: &str, members: &[Member], fields: &[Field], complaints: &mut Vec<String>) {
    let declared = members.iter().map(|m| (m.name.as_str(), m.offset as usize, m.bytes as usize));
    let declared: Vec<(&str, usize, usize)> = declared.collect();
    if declared != fields {
        complaints.push(format!("{what}: the shader has {declared:?}, the host {fields:?}"));
    }
}

/// GLSL appends _0, _1 … to a struct's name where two blocks lay it out differently.
fn plain(name: &str) -> &str {
    name.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end_matches('_')
}

fn compare_record(
    file: &str,
    found: &Struct,
    stride: u32,
    expected: &str,
    complaints: &mut Vec<String>,
) {
    let name = plain(&found.name);
    let Some((_, fields, size)) = RECORDS.iter().find(|(n, _, _)| *n == name) else {
        complaints.push(format!("{file}: struct {name} is no record of the host"));
        return;
    };
    if name != expected {
        complaints.push(format!("{file}: a buffer of {name}, the host gives {expected}"));
    }
    if stride as usize != *size {
        complaints
            .push(format!("{file}: {name} every {stride} bytes, the host's record has {size}"));
    }
    compare_fields(&format!("{file}: {name}"), &found.members, fields, complaints);
}

fn compare(file: &str, found: &Reflection, push: &[Field], elements: &str) -> Vec<String> {
    let mut complaints = vec![];
    let members = found.push.as_ref().map_or(&[][..], |p| &p.members);
    compare_fields(&format!("{file}: push constants"), members, push, &mut complaints);
    let bindings: Vec<u32> = found.bindings.iter().map(|b| b.binding).collect();
    let here = (0u32..).zip(elements.split_whitespace()).filter(|(_, e)| *e != "-");
    if bindings != here.clone().map(|(i, _)| i).collect::<Vec<_>>() {
        complaints.push(format!("{file}: bindings {bindings:?}, the host gives {elements}"));
        return complaints;
    }
    for (binding, (_, element)) in found.bindings.iter().zip(here) {
        let plain = match binding.kind {
            BindingKind::Storage => binding.stride.to_string(),
            BindingKind::Texels => "T".to_owned(),
            BindingKind::TexelStores => "S".to_owned(),
            BindingKind::Floats => "F".to_owned(),
        };
        match &binding.element {
            Some(s) => compare_record(file, s, binding.stride, element, &mut complaints),
            None if plain == element => {}
            None => complaints
                .push(format!("{file}: {} holds {plain}, the host gives {element}", binding.name)),
        }
    }
    complaints
}

fn unoptimised(compiler: &Compiler, file: &str) -> Reflection {
    reflect(file, &compiler.compile(file, Optimize::No, &[]).unwrap()).unwrap()
}

fn embedded() -> Compiler {
    Compiler::new(passes::sources(), Compiler::default_cache()).unwrap()
}

fn shaders_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders")
}

#[test]
fn every_shader_declares_the_hosts_records() {
    let compiler = embedded();
    let complaints: Vec<String> = INTERFACES
        .iter()
        .flat_map(|(file, push, elements)| {
            compare(file, &unoptimised(&compiler, file), push, elements)
        })
        .collect();
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
    // The grid and the camera lie in push constants, and reflection gives only the size of a nested
    // member. A buffer of each shows the layout of its members.
    let text = r#"#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
layout(local_size_x = 1) in;
layout(std430, binding = 0) buffer Grids { Grid grids[]; };
layout(std430, binding = 1) buffer Cameras { Camera cameras[]; };
void main() { grids[0].cell = cameras[0].near; }
"#;
    let texts = [&[("nested.comp", text)], SHADERS].concat();
    let compiler = Compiler::new(Sources::embedded(&texts), None).unwrap();
    let complaints =
        compare("nested.comp", &unoptimised(&compiler, "nested.comp"), &[], "Grid Camera");
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

#[test]
fn every_shader_and_record_is_compared() {
    let listed: BTreeSet<&str> = SHADERS.iter().map(|(name, _)| *name).collect();
    let compared: BTreeSet<&str> = INTERFACES.iter().map(|(file, _, _)| *file).collect();
    let compiled: BTreeSet<&str> =
        listed.iter().copied().filter(|name| !name.starts_with("include/")).collect();
    assert_eq!(compared, compiled);
    let mut on_disk = BTreeSet::new();
    for (folder, prefix) in [("", ""), ("include", "include/")] {
        for entry in std::fs::read_dir(shaders_folder().join(folder)).unwrap().map(Result::unwrap) {
            if entry.path().is_file() {
                on_disk.insert(format!("{prefix}{}", entry.file_name().to_string_lossy()));
            }
        }
    }
    assert_eq!(on_disk, listed.iter().map(|s| (*s).to_owned()).collect());
    let structs = records_glsl()
        .lines()
        .filter_map(|l| l.strip_prefix("struct ")?.split(' ').next())
        .collect();
    let known: BTreeSet<&str> = RECORDS.iter().map(|(name, _, _)| *name).collect();
    assert_eq!(known, structs);
}

/// A region that shaders read by texels has no layout to reflect. The test reads regions by the
/// shaders' own function, writes them as records, and compares every word.
#[test]
fn a_region_read_by_texels_equals_its_record() {
    let mut gpu = Gpu::new();
    let text = r#"#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
layout(local_size_x = 1) in;
TEXELS(0, regions)
layout(std430, binding = 1) writeonly buffer Copies { Region copies[]; };
#include "regions.glsl"
void main() { copies[gl_WorkGroupID.x] = region_at(gl_WorkGroupID.x); }
"#;
    let kernel = gpu.test_kernel("texels", text, &[]);
    const N_WORDS: usize = size_of::<RegionRecord>() / 4;
    // Normal floats keep their bits where the shader takes them for floats.
    let words: Vec<u32> = (0..3 * N_WORDS as u32).map(|i| (1.0 + i as f32).to_bits()).collect();
    let mut from =
        Buffer::new::<u32>(&gpu.device, "test.from", words.len() as u64, MemoryUsage::Upload)
            .unwrap();
    from.write(&words).unwrap();
    let to = Buffer::new::<u32>(&gpu.device, "test.to", words.len() as u64, MemoryUsage::Readback)
        .unwrap();
    gpu.run(|rec| rec.dispatch_groups(&kernel, &[&from, &to], &(), 3));
    assert_eq!(to.read::<u32>(words.len()).unwrap(), words);
    // tiles_splat.comp reads the last half of a Lit, and stores a Splat by two texels and a
    // SplatTexture by three.
    let texels =
        [size_of::<LitRecord>(), size_of::<SplatRecord>(), size_of::<SplatTextureRecord>()];
    assert_eq!(texels, [64, 32, 48]);
    assert!(text_of("tiles_splat.comp").contains("TEXEL(lit, 4 * facet + 2)"));
    let gather = text_of("include/gather.glsl");
    for (record, n_texels) in [
        ("sources", size_of::<SourceRecord>() / 16),
        ("cell_samples", size_of::<PackedRecord>() / 16),
    ] {
        let first = gather.split(&format!("TEXEL({record}, k)")).next().unwrap();
        assert!(first.ends_with("Float(") || first.ends_with("Packed("), "{record}");
        let stride = first.rsplit_once("* ").unwrap().1.split(';').next().unwrap();
        assert_eq!(stride.parse(), Ok(n_texels), "{record}");
    }
}

/// Particles and their places are read and stored by texels. The test reads them by the shaders'
/// own functions and writes them as records, stores others, and compares every word.
#[test]
fn particles_by_texels_equal_their_records() {
    let mut gpu = Gpu::new();
    let text = r#"#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
layout(local_size_x = 1) in;
TEXELS(0, placed)
TEXELS(1, particles)
WRITES(2, Placed, placed_records)
WRITES(3, Particle, records)
void main() {
    uint i = gl_WorkGroupID.x;
    placed_records[i] = PLACED_AT(i);
    records[i] = PARTICLE_AT(i);
}
"#;
    let reads = gpu.test_kernel("reads", text, &[]);
    const N: usize = 3;
    // Normal floats keep their bits where the shader takes words for floats.
    let number = |i: usize, k: usize| (100 * i + k) as f32 + 1.0;
    let place = |i| PlacedRecord { position: [0, 1, 2].map(|k| number(i, k)), sigma: number(i, 3) };
    let particle = |i| ParticleRecord {
        position: [4, 5, 6].map(|k| number(i, k)),
        sigma: number(i, 7),
        color: [8, 9, 10].map(|k| number(i, k)),
        kappa: number(i, 11),
        aspect: number(i, 12),
        aspect_z: number(i, 13),
        turn: [14, 15].map(|k| number(i, k).to_bits()),
    };
    let (places, particles): (Vec<_>, Vec<_>) = (0..N).map(|i| (place(i), particle(i))).unzip();
    let from = [gpu.upload(&places), gpu.upload(&particles)];
    let to = [gpu.buffer::<PlacedRecord>(N), gpu.buffer::<ParticleRecord>(N)];
    let all = [&from[0], &from[1], &to[0], &to[1]];
    gpu.run(|rec| rec.dispatch_groups(&reads, &all, &(), N as u32));
    assert_eq!(gpu.download::<PlacedRecord>(&to[0], N), places);
    assert_eq!(gpu.download::<ParticleRecord>(&to[1], N), particles);

    let text = r#"#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "particles.glsl"
layout(local_size_x = 1) in;
READS(0, Particle, records)
TEXEL_STORES(1, placed)
TEXEL_STORES(2, particles)
void main() {
    uint i = gl_WorkGroupID.x;
    Particle of = records[i];
    STORE_PLACED(i, of.position, of.sigma);
    STORE_BALL(i, of.position, of.sigma, of.kappa);
}
"#;
    let stores = gpu.test_kernel("stores", text, &[]);
    gpu.run(|rec| rec.dispatch_groups(&stores, &[&from[1], &to[0], &to[1]], &(), N as u32));
    let placed = |p: &ParticleRecord| PlacedRecord { position: p.position, sigma: p.sigma };
    let ball = |p: &ParticleRecord| ParticleRecord {
        color: [1.0; 3],
        aspect: 1.0,
        aspect_z: 1.0,
        turn: [0; 2],
        ..*p
    };
    let placed: Vec<_> = particles.iter().map(placed).collect();
    let balls: Vec<_> = particles.iter().map(ball).collect();
    assert_eq!(gpu.download::<PlacedRecord>(&to[0], N), placed);
    assert_eq!(gpu.download::<ParticleRecord>(&to[1], N), balls);
}

fn text_of(name: &str) -> &'static str {
    SHADERS.iter().find(|(n, _)| *n == name).unwrap().1
}

fn records_glsl() -> &'static str {
    text_of("include/records.glsl")
}

/// Returns the number of `const uint NAME = …;` (decimal or 0x…u) or `const float NAME = …;`.
fn constant(text: &str, name: &str) -> Option<f64> {
    let line = text.lines().find_map(|l| {
        let rest = l.trim().strip_prefix("const ")?;
        rest.split_once(' ')?.1.strip_prefix(name)?.strip_prefix(" = ")
    })?;
    let number = line.split(';').next()?;
    match number.strip_prefix("0x").and_then(|n| n.strip_suffix('u')) {
        Some(digits) => u32::from_str_radix(digits, 16).ok().map(f64::from),
        None => number.parse().ok(),
    }
}

#[test]
fn shared_constants_have_one_value() {
    let shared = [
        ("include/shell.glsl", "MIN_ASPECT", nimbus::model::cloud::MIN_ASPECT),
        ("include/records.glsl", "FORM_CENTRED", f64::from(FORM_CENTRED)),
        ("include/records.glsl", "FORM_PRINTED", f64::from(FORM_PRINTED)),
        ("include/records.glsl", "FORM_GIVEN", f64::from(FORM_GIVEN)),
        ("include/records.glsl", "LIGHT_DIRECTIONAL", f64::from(LIGHT_DIRECTIONAL)),
        ("include/records.glsl", "LIGHT_SKY", f64::from(LIGHT_SKY)),
        ("include/records.glsl", "LIGHT_POINT", f64::from(LIGHT_POINT)),
        ("include/records.glsl", "REGION_SURFACE", f64::from(REGION_SURFACE)),
        ("include/records.glsl", "REGION_CLOUD", f64::from(REGION_CLOUD)),
        ("include/records.glsl", "REGION_COLORED", f64::from(REGION_COLORED)),
        ("include/records.glsl", "REGION_TERRAIN", f64::from(REGION_TERRAIN)),
        ("include/records.glsl", "NO_LOBE", f64::from(NO_LOBE)),
        ("include/records.glsl", "NO_PARTICLE", f64::from(u32::MAX)),
        ("include/texture.glsl", "TEXTURE_STREAM", f64::from(0x7465_7874u32)),
        ("include/texture.glsl", "FIELD_TEXELS", f64::from(texture::FIELD_TEXELS)),
        ("include/texture.glsl", "TEXTURE_SIDE", nimbus::reference::texture::SIDE as f64),
        ("include/texture.glsl", "LAST_LEVEL", nimbus::reference::texture::N_LEVELS as f64 - 1.0),
        ("include/texture.glsl", "PERIOD_SIGMA", nimbus::reference::texture::PERIOD_SIGMA),
        ("include/texture.glsl", "QUANTA", 1.0 / nimbus::reference::texture::QUANTUM),
        ("include/cull.glsl", "TILE", f64::from(cull::TILE)),
        ("include/cull.glsl", "WORDS", f64::from(cull::WORDS)),
        ("include/sort.glsl", "TILE", f64::from(sort::TILE)),
        ("include/sort.glsl", "NO_COUNT", f64::from(sort::NO_COUNT)),
        ("include/tiles.glsl", "BLOCK", f64::from(tiles::BLOCK)),
        ("include/tiles.glsl", "TILES_ACROSS", f64::from(tiles::TILES_ACROSS)),
        ("include/second_order.glsl", "N_SECOND", nimbus::passes::diffusion::N_SECOND as f64),
        ("include/directions.glsl", "N_DIRECTIONS", nimbus::passes::diffusion::N_DIRECTIONS as f64),
        ("tiles.comp", "RUN", f64::from(tiles::RUN)),
        ("include/lod.glsl", "RUN", f64::from(lod::RUN)),
        ("include/lod.glsl", "RUN", f64::from(nimbus::passes::lod::RUN)),
        ("include/lod.glsl", "CLASSES_PER_OCTAVE", lod::CLASSES_PER_OCTAVE),
        ("include/lod.glsl", "CELLS_PER_AXIS", f64::from(lod::CELLS_PER_AXIS)),
        ("include/upsample.glsl", "ALIKE", nimbus::model::resolution::ALIKE),
        ("grid_deposit.comp", "MAX_CELLS", f64::from(MAX_CELLS)),
        ("grid_deposit.comp", "CUT_SIGMA", DEPOSIT_CUT_SIGMA),
        ("grid_deposit.comp", "LEVEL_SIGMA", LEVEL_SIGMA),
        ("include/grid_narrow.glsl", "NARROW_SIGMA", NARROW_SIGMA),
        ("include/grid_narrow.glsl", "NARROW_BELOW", NARROW_BELOW),
        ("grid_narrow.comp", "FIRST_BLUR", f64::from(FIRST_BLUR)),
        ("grid_turned.comp", "CUT_SIGMA", DEPOSIT_CUT_SIGMA),
        ("grid_turned.comp", "LEVEL_SIGMA", LEVEL_SIGMA),
        ("include/shell.glsl", "SHELL_SIGMA", nimbus::reference::facets::SHELL_SIGMA),
        ("include/shell.glsl", "SMOOTH_SIGMA", nimbus::reference::facets::GRADIENT_RADIUS_SIGMA),
        ("include/shell.glsl", "CONDITION_LOW", nimbus::reference::facets::CONDITIONING.0),
        ("include/shell.glsl", "CONDITION_HIGH", nimbus::reference::facets::CONDITIONING.1),
        ("include/cells.glsl", "LOBE_REACH", rules::LOBE_REACH),
        ("include/cells.glsl", "LOBE_STEP", rules::LOBE_STEP),
        ("include/cells.glsl", "LOBE_PARTS", rules::LOBE_PARTS),
        ("include/cells.glsl", "TURN", rules::TURN),
        ("include/cells.glsl", "NEAR", rules::NEAR),
        ("include/cells.glsl", "EDGE_WIDTH", rules::EDGE_WIDTH),
        ("include/cells.glsl", "SINGLE_EDGE_WIDTH", rules::SINGLE_EDGE_WIDTH),
        ("include/cells.glsl", "CELL_WIDTH", rules::CELL_WIDTH),
        ("include/cells.glsl", "CLUSTER_EDGE_WIDTH", rules::CLUSTER_EDGE_WIDTH),
        ("include/cells.glsl", "CLOUD_THETA", rules::CLOUD_THETA),
        ("include/cells.glsl", "MIXED", rules::MIXED),
        ("include/cells.glsl", "EVEN", rules::EVEN),
    ];
    for (file, name, host) in shared {
        assert_eq!(constant(text_of(file), name), Some(host), "{file}: {name}");
    }
    // Every constant beside the records is in the list above.
    let n = records_glsl().lines().filter(|l| l.starts_with("const uint ")).count();
    assert_eq!(n, shared.iter().filter(|(file, _, _)| *file == "include/records.glsl").count());
    let in_plane = constant(text_of("include/occlude.glsl"), "IN_PLANE");
    assert_eq!(in_plane, Some(nimbus::reference::occlude::IN_PLANE));
    assert_eq!(transmit::MAX_STEPS, nimbus::model::grid::MAX_MARCH_STEPS);
    assert!(text_of("include/sort.glsl").contains("#define DIGIT_BITS 8\n"));
    // FOLDED is a number in an expression of the shader.
    assert!(text_of("generate.comp").contains(&format!("{:#x}u", generate::FOLDED)));
    // The parser tells names apart, and reads decimal and hexadecimal numbers.
    assert_eq!(constant("const uint TILE = 7;", "TIL"), None);
    assert_eq!(constant("const uint TILE = 7;", "TILE"), Some(7.0));
    assert_eq!(constant("const uint MANY = 0xFFu;", "MANY"), Some(255.0));
}

#[test]
fn wrong_declarations_are_reported() {
    const RECORDS: &str = "include/records.glsl";
    let wrong = [
        // A renamed, a missing and two swapped fields; push constants swapped; a plain element
        // widened.
        (
            "place.comp",
            RECORDS,
            "struct Mode { vec3 k; float phase; vec3 a; uint unused;",
            "uint unused",
            "uint padding",
        ),
        ("place.comp", RECORDS, "struct Group { vec3 offset; uint i_region;", "uint i_region;", ""),
        (
            "generate.comp",
            RECORDS,
            "float kappa; uint seed; uint i_box;",
            "uint seed; uint i_box;",
            "uint i_box; uint seed;",
        ),
        (
            "first.comp",
            RECORDS,
            "struct Lit { vec3 direct; float n_unresolved; vec3 indirect;",
            "vec3 direct; float n_unresolved; vec3 indirect;",
            "vec3 indirect; float n_unresolved; vec3 direct;",
        ),
        (
            "transmit.comp",
            "transmit.comp",
            "float step_length; float backward;",
            "float step_length; float backward;",
            "float backward; float step_length;",
        ),
        ("grid_resolve.comp", "grid_resolve.comp", "READS(0, uvec2, sums)", "uvec2", "uvec4"),
    ];
    for (file, in_text, passage, from, to) in wrong {
        let mut sources = passes::sources();
        assert!(sources.replace(in_text, passage, &passage.replace(from, to)), "{in_text}: {from}");
        let compiler = Compiler::new(sources, None).unwrap();
        let (_, push, elements) = INTERFACES.iter().find(|(f, _, _)| *f == file).unwrap();
        match compiler.compile(file, Optimize::No, &[]) {
            Ok(words) => {
                let complaints = compare(file, &reflect(file, &words).unwrap(), push, elements);
                assert!(!complaints.is_empty(), "{file}: {to} was not reported");
            }
            Err(e) => panic!("{file}: the wrong declaration does not even compile: {e}"),
        }
    }
}
