//! scatter against its f64 twin, in modes that scatter light once: every facet's light on the device
//! is that of the twin, and wrong shaders are found.

use crate::harness::Gpu;
use crate::media;

#[test]
fn every_facet_has_the_light_of_the_twin() {
    let gpu = Gpu::new();
    for name in ["coloured", "droplets", "flat", "boxes"] {
        for mode in ["single", "similarity", "octaves"] {
            media::check(&gpu, name, mode);
        }
    }
}

#[test]
fn wrong_shaders_are_found() {
    let wrong = [
        ("boxes", "single", "scatter.comp", "a.toward + outgoing", "a.toward - outgoing"),
        ("boxes", "single", "scatter.comp", "return law.albedo * sum", "return sum"),
        ("boxes", "octaves", "scatter.comp", "phase *= push.term_phase", "phase *= 0.49"),
        ("boxes", "octaves", "scatter.comp", "depth * tau * law.depth", "tau * law.depth"),
        ("boxes", "single", "scatter.comp", "- 0.5) * up", "- 0.5) * -up"),
        ("boxes", "similarity", "include/medium.glsl", "1.0 - albedo * m.straight", "vec3(1.0)"),
        ("coloured", "single", "include/medium.glsl", "1.17 * r", "1.16 * r"),
        ("droplets", "single", "include/medium.glsl", "c * m.draine_lobe", "c * m.lobe"),
        ("droplets", "single", "include/medium.glsl", "2.0 * g * g) * (1.0", "g * g) * (1.0"),
    ];
    media::check_found(&Gpu::new(), &wrong);
}

#[test]
fn surfaces_have_the_light_of_the_first_reflection() {
    let gpu = Gpu::new();
    for forward in ["lighting.forward=0.85", "lighting.forward=1.0"] {
        let light = |mode: &str| {
            let scene = media::scene("coloured", mode, &[forward, "lighting.octave_depth=0.0"]);
            media::on_device(&gpu, &gpu.compiler, &scene).of_solids
        };
        let first = light("first");
        let shade = first.iter().map(|e| e.x).fold(f64::INFINITY, f64::min);
        let most = first.iter().map(|e| e.x).fold(0.0, f64::max);
        assert!(shade < 0.5 * most, "a shadow of the roof or the cloud");
        for mode in ["single", "similarity", "octaves"] {
            // (1 - g) tau and its exponent, rounded alike but for some units in the last place.
            let off = media::apart(&light(mode), &first);
            assert!(off < 1e-6, "{mode}, {forward}: {off:e}");
        }
    }
}
