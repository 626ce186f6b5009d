//! Tests of gpu/: validation messages of missing barriers, leak reports, refusals of sizes and
//! shaders beyond the device, and the SPIR-V cache.

mod harness;

use std::path::Path;

use glam::{DVec3, UVec3};
use harness::Gpu;
use nimbus::error::Error;
use nimbus::gpu::Optimize;
use nimbus::gpu::TargetFormat;
use nimbus::gpu::{
    Barriers, Buffer, Compiler, Device, DeviceInfo, Image, Instance, Kernel, MemoryUsage, Sources,
};
use nimbus::layout::frame::GridRecord;
use nimbus::layout::particle::{GroupRecord, ModeRecord, ParticleRecord, PlacedRecord, Shapes};
use nimbus::model::grid::GridSpec;
use nimbus::passes;
use nimbus::passes::{grid, place};
use sha2::{Digest, Sha256};

/// Returns the validation messages of `place` and then the grid's deposit, which reads the placed
/// particles. The commands are recorded and never submitted.
fn hazards_of_two_dispatches(gpu: &mut Gpu, barriers: Barriers) -> Vec<String> {
    let spec = GridSpec { aspect: 1.0, n_cells: UVec3::splat(8), cell: 1.0, low: DVec3::ZERO };
    let place = place::Place::new(&gpu.device, &gpu.compiler).unwrap();
    let room = grid::Room { n_cells: spec.n_total(), has_levels: false, has_narrow: false };
    let grid = grid::Grid::new(&gpu.device, &gpu.compiler, room, Shapes::Balls).unwrap();
    let (particles, i_group) = (gpu.buffer::<ParticleRecord>(64), gpu.buffer::<u32>(64));
    let (groups, placed) = (gpu.buffer::<GroupRecord>(1), gpu.buffer::<PlacedRecord>(64));
    let (density, modes) = (gpu.buffer::<f32>(512), gpu.buffer::<ModeRecord>(1));
    let record = GridRecord::from(&spec);
    let recorded = gpu.commands.record(barriers, |rec| {
        let buffers = place::PlaceBuffers {
            particles: &particles,
            i_group: &i_group,
            groups: &groups,
            modes: &modes,
            placed: &placed,
        };
        place.record(rec, &buffers, 64)?;
        let (n_levels, n_blurs) = (1, 0);
        let of = grid::Deposit { grid: &record, n_particles: 64, heaviest: 1.0, n_levels, n_blurs };
        grid.record(rec, [&placed, &particles, &density], &of)
    });
    recorded.unwrap();
    // The commands are void once their buffers are gone, so others are recorded in their place.
    gpu.commands.record(Barriers::Placed, |_| Ok(())).unwrap();
    gpu.instance.messages().take()
}

#[test]
fn a_kernel_that_is_made_again_shares_its_pipeline() {
    let gpu = Gpu::new();
    let make = |compiler: &Compiler, n_sets: u32| {
        let push = passes::diffusion::PairPush::FIELDS;
        let macros = [("N_SETS", n_sets)];
        let name = "diffusion.coarsen";
        let made = Kernel::with_macros(&gpu.device, compiler, name, push, &[], &macros);
        made.unwrap();
        gpu.device.n_kept_pipelines()
    };
    // Each is dropped at once.
    assert_eq!([1, 1, 3, 1].map(|n_sets| make(&gpu.compiler, n_sets)), [1, 1, 2, 2]);
    // Another text of the same file is another kernel.
    let other = Gpu::wrong_compiler("diffusion_coarsen.comp", "merged;", "1.1 * merged;");
    assert_eq!([1, 1].map(|n_sets| make(&other, n_sets)), [3, 3]);
}

#[test]
fn a_missing_barrier_between_dispatches_is_reported() {
    let mut gpu = Gpu::new();
    let without = hazards_of_two_dispatches(&mut gpu, Barriers::OmittedIn(""));
    assert!(without.iter().any(|m| m.contains("SYNC-HAZARD-READ-AFTER-WRITE")), "{without:?}");
    assert_eq!(hazards_of_two_dispatches(&mut gpu, Barriers::Placed), [""; 0]);
}

#[test]
fn a_missing_barrier_between_copies_is_reported() {
    let mut gpu = Gpu::new();
    let [a, b, c] = [(); 3].map(|()| gpu.buffer::<u32>(1000));
    // Read after write, write after read, write after write.
    let cases: [(&str, [&Buffer; 4]); 3] = [
        ("SYNC-HAZARD-READ-AFTER-WRITE", [&a, &b, &b, &c]),
        ("SYNC-HAZARD-WRITE-AFTER-READ", [&a, &b, &c, &a]),
        ("SYNC-HAZARD-WRITE-AFTER-WRITE", [&a, &b, &c, &b]),
    ];
    for (hazard, [from, to, then_from, then_to]) in cases {
        for barriers in [Barriers::OmittedIn(""), Barriers::Placed] {
            let recorded = gpu.commands.record(barriers, |rec| {
                rec.copy(from, to);
                rec.copy(then_from, then_to);
                Ok(())
            });
            recorded.unwrap();
            let messages = gpu.instance.messages().take();
            match barriers {
                Barriers::OmittedIn(_) => {
                    assert!(messages.iter().any(|m| m.contains(hazard)), "{hazard}: {messages:?}")
                }
                Barriers::Placed => assert!(messages.is_empty(), "{messages:?}"),
            }
        }
    }
}

#[test]
fn a_leaked_buffer_is_reported_by_name_and_size() {
    let instance = Instance::new(true).unwrap();
    let device = Device::open(&instance, None).unwrap();
    let kept = Buffer::new::<u32>(&device, "test.freed", 10, MemoryUsage::Device).unwrap();
    let leaked = Buffer::new::<u32>(&device, "test.leaked", 1000, MemoryUsage::Device).unwrap();
    drop(kept);
    std::mem::forget(leaked);
    drop(device);
    let messages = instance.messages().take();
    assert_eq!(messages.len(), 1, "{messages:?}");
    let bytes: u64 = messages[0]
        .strip_prefix("leak: test.leaked (")
        .unwrap()
        .strip_suffix(" bytes)")
        .unwrap()
        .parse()
        .unwrap();
    // The allocation may be rounded up to what the device aligns to.
    assert!((4000..=4000 + 65_536).contains(&bytes), "{bytes}");
}

#[test]
fn a_freed_buffer_is_not_reported() {
    let gpu = Gpu::new();
    let instance = gpu.instance.clone();
    let buffer = gpu.buffer::<u32>(10);
    drop(buffer);
    drop(gpu);
    assert_eq!(instance.messages().take(), [""; 0]);
}

#[test]
fn sizes_beyond_the_device_are_refused_before_anything_is_allocated() {
    let gpu = Gpu::new();
    let before = gpu.device.allocated_bytes();
    for n in [1_000_000_000, u64::MAX / 2] {
        let refused = Buffer::new::<[u32; 8]>(&gpu.device, "test.huge", n, MemoryUsage::Device)
            .err()
            .unwrap();
        let Error::Limit { what } = &refused else { panic!("{refused:?}") };
        let limit = gpu.device.limits().max_storage_buffer_bytes;
        assert!(what.contains(&format!("test.huge: {n} records of 32 bytes")), "{what}");
        assert!(what.contains(&format!("maxStorageBufferRange {limit}")), "{what}");
    }
    let refused =
        Image::color_target(&gpu.device, "test.wide", 10_000_000, 4, TargetFormat::Rgba16f)
            .err()
            .unwrap();
    let most = gpu.device.limits().max_image_extent;
    assert!(
        matches!(&refused, Error::Limit { what } if what.contains(&format!("{most} along a side"))),
        "{refused}"
    );
    assert_eq!(gpu.device.allocated_bytes(), before);
    // The greatest number of records fits, one more does not, and an empty buffer has one record.
    let limits = gpu.device.limits();
    let most = limits.max_storage_buffer_bytes.min(limits.device_memory_bytes) / 32;
    assert_eq!(nimbus::gpu::storage_bytes(limits, "test", most, 32), Ok(32 * most));
    assert!(nimbus::gpu::storage_bytes(limits, "test", most + 1, 32).is_err());
    assert_eq!(nimbus::gpu::storage_bytes(limits, "test", 0, 32), Ok(32));
    // A buffer is bound by whole texels of 16 bytes, which an odd limit must hold.
    let odd = nimbus::gpu::Limits { max_storage_buffer_bytes: 111, ..*limits };
    assert_eq!(nimbus::gpu::storage_bytes(&odd, "test", 96, 1), Ok(96));
    assert!(nimbus::gpu::storage_bytes(&odd, "test", 97, 1).is_err());
}

/// Shaders reach the last texel of a buffer that is too large to be bound as records.
#[test]
fn a_buffer_of_texels_may_be_larger_than_one_of_records() {
    let mut gpu = Gpu::new();
    let limits = *gpu.device.limits();
    let n = limits.max_storage_buffer_bytes / 16 + 1;
    assert!(nimbus::gpu::storage_bytes(&limits, "test.wide", n, 16).is_err());
    let few = nimbus::gpu::Limits { max_texels: 65_536, ..limits };
    assert!(nimbus::gpu::texel_bytes(&few, "test.wide", n, 16).is_err());
    if limits.max_texel_buffer_bytes(16).min(limits.max_buffer_bytes) < 16 * n {
        // Some devices read fewer bytes by texels than as records.
        assert!(nimbus::gpu::texel_bytes(&limits, "test.wide", n, 16).is_err());
        return;
    }
    let text = r#"#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
layout(local_size_x = 1) in;
layout(push_constant) uniform Push { uint i; } push;
TEXEL_STORES(0, wide)
void main() { STORE_TEXEL(wide, int(push.i), uvec4(push.i, 2u, 3u, 4u)); }
"#;
    let store = gpu.test_kernel("store", text, &[("i", 0, 4)]);
    let text = r#"#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
layout(local_size_x = 1) in;
layout(push_constant) uniform Push { uint i; } push;
TEXELS(0, wide)
WRITES(1, uvec4, copies)
void main() { copies[0] = TEXEL(wide, int(push.i)); }
"#;
    let load = gpu.test_kernel("load", text, &[("i", 0, 4)]);
    let wide =
        Buffer::of_texels::<[u32; 4]>(&gpu.device, "test.wide", n, MemoryUsage::Device).unwrap();
    let copy = gpu.buffer::<[u32; 4]>(1);
    let i = n as u32 - 1;
    gpu.run(|rec| {
        rec.dispatch_groups(&store, &[&wide], &i, 1)?;
        rec.dispatch_groups(&load, &[&wide, &copy], &i, 1)
    });
    assert_eq!(gpu.download::<[u32; 4]>(&copy, 1), [[i, 2, 3, 4]]);
    let text = r#"#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
layout(local_size_x = 1) in;
WRITES(0, uvec4, wide)
void main() { wide[0] = uvec4(0u); }
"#;
    let records = gpu.test_kernel("records", text, &[]);
    gpu.run(|rec| {
        let refused = rec.dispatch_groups(&records, &[&wide], &(), 1).unwrap_err().to_string();
        assert!(refused.contains("test.wide") && refused.contains("maxStorageBufferRange"));
        Ok(())
    });
}

#[test]
fn an_unknown_device_is_refused_with_a_list_of_all() {
    let instance = Instance::new(true).unwrap();
    let names: Vec<String> =
        DeviceInfo::list(&instance).unwrap().into_iter().map(|d| d.name).collect();
    assert!(!names.is_empty());
    for choice in ["no such device", "4096"] {
        let refused = Device::open(&instance, Some(choice)).err().unwrap();
        assert!(matches!(refused, Error::Usage { .. }), "{refused:?}");
        let text = refused.to_string();
        assert!(text.contains(choice) && names.iter().all(|n| text.contains(n.as_str())), "{text}");
    }
    // A name matches in any case, and so does an index.
    assert_eq!(Device::open(&instance, Some(&names[0].to_uppercase())).unwrap().info().index, 0);
    assert_eq!(Device::open(&instance, Some("0")).unwrap().info().name, names[0]);
    assert_eq!(instance.messages().take(), [""; 0]);
}

#[test]
fn shader_errors_carry_file_and_line() {
    let line_of = |file: &str, text: &str| {
        let source = passes::SHADERS.iter().find(|(n, _)| *n == file).unwrap().1;
        1 + source.lines().position(|l| l.contains(text)).unwrap()
    };
    for (file, from) in
        [("place.comp", "FOR_EACH(i"), ("include/functions.glsl", "float s = r * r;")]
    {
        let compiler = Gpu::wrong_compiler(file, from, &format!("nonsense {from}"));
        let user = if file.starts_with("include") { "facets.comp" } else { file };
        let refused = compiler.compile(user, Optimize::Yes, &[]).err().unwrap();
        let Error::Shader { name, what } = refused else { panic!("{refused:?}") };
        assert_eq!(name, user);
        assert!(what.contains(&format!("{file}:{}:", line_of(file, from))), "{what}");
    }
    let compiler = Compiler::new(passes::sources(), None).unwrap();
    for file in ["absent.comp", "include/records.glsl"] {
        assert!(matches!(compiler.compile(file, Optimize::Yes, &[]), Err(Error::Shader { .. })));
    }
}

#[test]
fn a_host_interface_that_differs_from_the_shaders_is_refused() {
    let mut gpu = Gpu::new();
    let new = |push: &[nimbus::gpu::Field]| {
        Kernel::new(&gpu.device, &gpu.compiler, "grid.resolve", push).err()
    };
    assert!(new(grid::ResolvePush::FIELDS).is_none());
    let wrong: [&[nimbus::gpu::Field]; 4] = [
        &[("n_cells", 0, 4)],
        &[("n_cells", 0, 4), ("density_per_quantum", 8, 4)],
        &[("n_cells", 0, 4), ("density_per_quantum", 4, 8)],
        &[("n_cells", 0, 4), ("density_per_quantum", 4, 4), ("more", 8, 4)],
    ];
    for push in wrong {
        let refused = new(push).unwrap();
        assert!(
            matches!(&refused, Error::Shader { name, .. } if name == "grid_resolve.comp"),
            "{refused:?}"
        );
    }
    // Recording refuses a missing buffer, and push constants of another size.
    let kernel =
        Kernel::new(&gpu.device, &gpu.compiler, "grid.resolve", grid::ResolvePush::FIELDS).unwrap();
    let (sums, density) = (gpu.buffer::<[u32; 2]>(8), gpu.buffer::<f32>(8));
    let push = grid::ResolvePush { n_cells: 8, density_per_quantum: 1.0 };
    let too_few =
        gpu.commands.record(Barriers::Placed, |rec| rec.dispatch(&kernel, &[&sums], &push, 8));
    assert!(matches!(too_few, Err(Error::Shader { .. })));
    let buffers = [&sums, &density];
    let too_small =
        gpu.commands.record(Barriers::Placed, |rec| rec.dispatch(&kernel, &buffers, &8u32, 8));
    assert!(matches!(too_small, Err(Error::Shader { .. })));
    // The recorder still works afterwards.
    gpu.run(|rec| {
        rec.fill(&sums, 1);
        rec.dispatch(&kernel, &buffers, &push, 8)
    });
    assert_eq!(gpu.download::<f32>(&density, 8), [4_294_967_297.0f64 as f32; 8]);
}

#[test]
fn a_dispatch_of_several_rows_of_workgroups_processes_every_record() {
    let mut gpu = Gpu::new();
    let kernel =
        Kernel::new(&gpu.device, &gpu.compiler, "grid.resolve", grid::ResolvePush::FIELDS).unwrap();
    // Two rows and a part of a workgroup.
    let in_a_row =
        u64::from(gpu.device.limits().max_workgroups_x) * u64::from(kernel.local_size_x());
    if in_a_row > 1 << 23 {
        println!("skipped: a row of this device holds {in_a_row} records");
        return;
    }
    let n = 2 * in_a_row as u32 + 77;
    let (sums, density) = (gpu.buffer::<[u32; 2]>(n as usize), gpu.buffer::<f32>(n as usize));
    let push = grid::ResolvePush { n_cells: n, density_per_quantum: 1.0 };
    gpu.run(|rec| {
        rec.fill(&sums, 0);
        rec.fill(&density, 0xffff_ffff);
        rec.dispatch(&kernel, &[&sums, &density], &push, n)
    });
    assert!(gpu.download::<f32>(&density, n as usize).iter().all(|d| *d == 0.0));
}

/// Every workgroup, or row of workgroups, is a part if nothing is within the limit.
#[test]
fn work_beyond_the_limit_of_a_submission_is_submitted_in_parts() {
    for (max_submit_ms, is_parted) in [(None, false), (Some(1e6), false), (Some(1e-6), true)] {
        let mut gpu = Gpu::with_options(|options| options.max_submit_ms = max_submit_ms);
        let fields = grid::ResolvePush::FIELDS;
        let kernel = Kernel::new(&gpu.device, &gpu.compiler, "grid.resolve", fields).unwrap();
        let n = 100 * kernel.local_size_x() - 7;
        let words: Vec<[u32; 2]> = (0..n).map(|i| [i, 0]).collect();
        let sums = gpu.upload(&words);
        let density = gpu.buffer::<f32>(n as usize);
        let push = grid::ResolvePush { n_cells: n, density_per_quantum: 1.0 };
        // The second time the rate is known.
        for is_known in [false, true] {
            gpu.run(|rec| {
                rec.fill(&density, 0xffff_ffff);
                rec.dispatch(&kernel, &[&sums, &density], &push, n)
            });
            let n_parts = gpu.commands.n_parts();
            match (is_parted, is_known) {
                (true, _) => assert!(n_parts >= 100, "{n_parts} parts"),
                (false, true) => assert_eq!(n_parts, 1),
                // Ten parts at most are timed, and two are around each.
                (false, false) => assert!(n_parts <= 21, "{n_parts} parts"),
            }
            let found = gpu.download::<f32>(&density, n as usize);
            assert!((0..n).zip(&found).all(|(i, d)| *d == i as f32));
        }
    }
}

/// The workgroups of an indirect dispatch count from 0, wherever those of the dispatch before it
/// began. At some of the limits, a dispatch's last part and the indirect one are submitted
/// together.
#[test]
fn indirect_dispatches_after_a_dispatch_in_parts_begin_at_the_first_workgroup() {
    let mut n_parts = vec![];
    for max_submit_ms in (0..20).map(|k| Some(1e-3 * f64::from(1 << k))) {
        let mut gpu = Gpu::with_options(|options| options.max_submit_ms = max_submit_ms);
        let fields = grid::ResolvePush::FIELDS;
        let kernel = Kernel::new(&gpu.device, &gpu.compiler, "grid.resolve", fields).unwrap();
        let a_group = kernel.local_size_x();
        let n = 512 * a_group;
        let sums = gpu.upload(&(0..n).map(|i| [i + 1, 0]).collect::<Vec<_>>());
        let [first, second] = [0, 1].map(|_| gpu.buffer::<f32>(n as usize));
        let groups = gpu.upload(&[1u32, 1, 1]);
        let push = grid::ResolvePush { n_cells: n, density_per_quantum: 1.0 };
        // From the second time on the rates are known.
        for _ in 0..3 {
            gpu.run(|rec| {
                rec.fill(&second, 0);
                rec.dispatch(&kernel, &[&sums, &first], &push, n)?;
                rec.dispatch_indirect(&kernel, &[&sums, &second], &push, (&groups, 0))
            });
            n_parts.push(gpu.commands.n_parts());
            let found = gpu.download::<f32>(&second, n as usize);
            let expected = |i: u32| if i < a_group { (i + 1) as f32 } else { 0.0 };
            let wrong = (0..n).find(|i| found[*i as usize] != expected(*i));
            assert_eq!(wrong, None, "{max_submit_ms:?} ms, parts {n_parts:?}");
        }
    }
    println!("parts {n_parts:?}");
}

#[test]
fn host_access_is_checked_against_the_buffers_size() {
    let gpu = Gpu::new();
    let mut upload =
        Buffer::new::<u32>(&gpu.device, "test.upload", 4, MemoryUsage::Upload).unwrap();
    assert!(upload.write(&[1u32; 4]).is_ok());
    // The allocation may be larger than the buffer.
    assert!(matches!(upload.write(&[1u8; 17]), Err(Error::Limit { .. })));
    let readback =
        Buffer::new::<u32>(&gpu.device, "test.readback", 4, MemoryUsage::Readback).unwrap();
    assert!(readback.read::<u32>(4).is_ok());
    assert!(matches!(readback.read::<u32>(5), Err(Error::Limit { .. })));
    assert!(matches!(readback.read::<u32>(usize::MAX / 2), Err(Error::Limit { .. })));
    let device = Buffer::new::<u32>(&gpu.device, "test.device", 4, MemoryUsage::Device).unwrap();
    assert_eq!(device.bytes(), 16);
}

fn cached_files(folder: &Path) -> Vec<std::path::PathBuf> {
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn the_spirv_cache_is_read_checked_and_repaired() {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("below/spirv");
    let compiler = |sources: Sources| Compiler::new(sources, Some(cache.clone())).unwrap();
    let compile = |c: &Compiler| c.compile("place.comp", Optimize::Yes, &[]).unwrap();
    let words = compile(&compiler(passes::sources()));
    let files = cached_files(&cache);
    assert_eq!(files.len(), 1);
    let good = std::fs::read(&files[0]).unwrap();
    // A cached file with a right checksum is used: here the words with one added.
    let other: Vec<u32> = [&words[..], &[7]].concat();
    let bytes: &[u8] = bytemuck::cast_slice(&other);
    std::fs::write(&files[0], [Sha256::digest(bytes).as_slice(), bytes].concat()).unwrap();
    assert_eq!(compile(&compiler(passes::sources())), other);
    // Damaged files (a flipped bit, cuts, nothing at all) are compiled and written again.
    let mut flipped = good.clone();
    flipped[100] ^= 4;
    for bad in [flipped, good[..good.len() - 4].to_vec(), good[..20].to_vec(), vec![]] {
        std::fs::write(&files[0], &bad).unwrap();
        assert_eq!(compile(&compiler(passes::sources())), words);
        assert_eq!(std::fs::read(&files[0]).unwrap(), good);
    }
    // Another include or other options give other files. No temporary file is left.
    let mut sources = passes::sources();
    assert!(sources.replace("include/each.glsl", "Runs its body", "Runs this body"));
    compile(&compiler(sources));
    compiler(passes::sources()).compile("place.comp", Optimize::No, &[]).unwrap();
    let files = cached_files(&cache);
    assert_eq!(files.len(), 3);
    assert!(files.iter().all(|f| f.extension().is_some_and(|e| e == "spv")), "{files:?}");
    // A cache that cannot be written (its folder is a file) costs time only.
    let file = folder.path().join("file");
    std::fs::write(&file, "").unwrap();
    assert_eq!(compile(&Compiler::new(passes::sources(), Some(file)).unwrap()), words);
}

#[test]
fn a_folder_of_shaders_replaces_the_embedded_ones() {
    let folder = tempfile::tempdir().unwrap();
    let compile = |s: Sources| {
        Compiler::new(s, None).unwrap().compile("place.comp", Optimize::Yes, &[]).unwrap()
    };
    let embedded = compile(passes::sources());
    let empty = passes::sources().with_dir(folder.path()).err().unwrap();
    assert!(matches!(&empty, Error::Io { what, .. } if what.contains("place.comp")), "{empty}");
    assert!(matches!(
        passes::sources().with_dir(&folder.path().join("absent")),
        Err(Error::Io { .. })
    ));
    let text = passes::SHADERS.iter().find(|(n, _)| *n == "place.comp").unwrap().1;
    std::fs::write(
        folder.path().join("place.comp"),
        text.replace("+ group.offset", "- group.offset"),
    )
    .unwrap();
    assert_ne!(compile(passes::sources().with_dir(folder.path()).unwrap()), embedded);
    std::fs::write(folder.path().join("place.comp"), text).unwrap();
    assert_eq!(compile(passes::sources().with_dir(folder.path()).unwrap()), embedded);
    // Includes are replaced, too.
    std::fs::create_dir(folder.path().join("include")).unwrap();
    std::fs::write(folder.path().join("include/records.glsl"), "nonsense").unwrap();
    let sources = passes::sources().with_dir(folder.path()).unwrap();
    let refused = Compiler::new(sources, None)
        .unwrap()
        .compile("place.comp", Optimize::Yes, &[])
        .err()
        .unwrap();
    assert!(refused.to_string().contains("include/records.glsl:1:"), "{refused}");
}
