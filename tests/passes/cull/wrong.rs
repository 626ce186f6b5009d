//! Wrong shaders are noticed.

use super::*;

#[test]
fn wrong_shaders_are_noticed() {
    let mut gpu = Gpu::new();
    let scenes: Vec<Scene> =
        [(4, 2000), (6, 2000), (9, 2000)].map(|(seed, n)| random(seed, n)).into();
    let keys: Vec<Vec<u32>> = scenes.iter().map(|s| s.keys(&mut gpu)).collect();
    let noticed = |gpu: &mut Gpu, compiler: Option<&Compiler>| {
        let mut all = scenes.iter().zip(&keys);
        all.any(|(scene, keys)| complaint(scene, keys, &scene.run_by(gpu, compiler)).is_some())
    };
    assert!(!noticed(&mut gpu, None));
    for (file, from, to) in [
        ("cull_test.comp", "v.z >= push.camera.near", "v.z > 0.0"),
        ("cull_test.comp", "GROWTH * reach * sigma", "0.9 * reach * sigma"),
        ("cull_test.comp", "GROWTH * reach * sigma", "1.1 * reach * sigma"),
        ("cull_test.comp", "i < group.end &&", ""),
        ("include/blob.glsl", "i + 1u == group.end", "i + 2u == group.end"),
        ("cull_test.comp", "is_dense && cut > 0.0", "is_dense && cut > 0.5"),
        ("cull_test.comp", "push.least_cut);", "0.5 * push.least_cut);"),
        ("cull_test.comp", "widest >= push.smallest * v.z", "widest >= push.smallest"),
        ("cull_test.comp", "pixels.z < pixels.w", "true"),
        ("cull_test.comp", "before += bitCount(bits[k])", "before += 1u"),
        ("include/scan.glsl", "return sums[t] - total;", "return sums[t];"),
        ("cull_scan.comp", "push.splat_block), 1, 1, 0)", "push.splat_block), 1, 1, 1)"),
        ("cull_write.comp", "(bit - 1u)", "bit"),
        ("cull_write.comp", "uvec2(key_at(i), i)", "uvec2(key_at(i), at)"),
        ("include/blob.glsl", "ceil(low - 0.5 - SNAP)", "ceil(low)"),
        ("include/blob.glsl", "min(low, high) > 0.0", "true"),
        (
            "include/camera.glsl",
            "vec3(dot(camera.right, v), dot(camera.up",
            "vec3(dot(camera.up, v), dot(camera.right",
        ),
    ] {
        let wrong = Gpu::wrong_compiler(file, from, to);
        assert!(noticed(&mut gpu, Some(&wrong)), "{from} as {to}");
    }
}
