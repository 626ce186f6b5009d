//! Scene settings that change while the window runs: each knob cycles through a list of values.

use crate::frame::toml_name;
use crate::model::resolution::Resolution;
use crate::model::scene::{DrawPath, Gather, LightingMode, Overlap, Scene, Simulate, Threading};

/// A setting that a key cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Knob {
    /// Whether game and render steps alternate or run side by side.
    Threading,
    /// Processor that moves the particles.
    Simulate,
    /// Number of reflections.
    Lighting,
    /// Number of basis vectors.
    Bases,
    /// How the second reflection is gathered.
    Gather,
    /// Opening angle of clusters.
    Theta,
    /// How particles are drawn.
    Path,
    /// Resolution of the particles' picture.
    Resolution,
}

impl Knob {
    /// Every knob, in the order of the panel.
    pub const ALL: [Knob; 8] = [
        Knob::Threading,
        Knob::Simulate,
        Knob::Lighting,
        Knob::Bases,
        Knob::Gather,
        Knob::Theta,
        Knob::Path,
        Knob::Resolution,
    ];

    /// Returns the scene key that the knob sets.
    pub fn key(self) -> &'static str {
        match self {
            Knob::Threading => "threads.mode",
            Knob::Simulate => "threads.simulate",
            Knob::Lighting => "lighting.mode",
            Knob::Bases => "lighting.bases",
            Knob::Gather => "lighting.gather",
            Knob::Theta => "lighting.theta",
            Knob::Path => "draw.path",
            Knob::Resolution => "draw.resolution",
        }
    }

    /// Returns the knob's value in `scene`, as a scene file writes it.
    pub fn value(self, scene: &Scene) -> String {
        match self {
            Knob::Threading => toml_name(&Threading::NAMES, scene.threads.mode),
            Knob::Simulate => toml_name(&Simulate::NAMES, scene.threads.simulate),
            Knob::Lighting => toml_name(&LightingMode::NAMES, scene.lighting.mode),
            Knob::Bases => scene.lighting.bases.to_string(),
            Knob::Gather => toml_name(&Gather::NAMES, scene.lighting.gather),
            Knob::Theta => scene.lighting.theta.to_string(),
            Knob::Path => toml_name(&DrawPath::NAMES, scene.draw.path),
            Knob::Resolution => match scene.draw.resolution {
                Resolution::Auto => "\"auto\"".to_owned(),
                resolution => resolution.name().to_owned(),
            },
        }
    }

    /// Sets the knob to its next value.
    ///
    /// # Errors
    /// The scene allows no other value; the error says why.
    pub fn advance(self, scene: &mut Scene) -> Result<(), &'static str> {
        if self == Knob::Simulate && scene.is_animated() {
            return Err("weather that goes from step to step is moved by the game thread");
        }
        if self == Knob::Path && scene.draw.overlap == Overlap::Slices {
            return Err("only tiles are composed by slices");
        }
        let (lighting, draw, threads) = (&mut scene.lighting, &mut scene.draw, &mut scene.threads);
        match self {
            Knob::Threading => cycle(&mut threads.mode, &[Threading::Serial, Threading::Parallel]),
            Knob::Simulate => cycle(&mut threads.simulate, &[Simulate::Gpu, Simulate::Cpu]),
            Knob::Lighting => {
                use LightingMode::{Diffusion, First, None, Similarity, TwoReflection};
                let all = [None, First, TwoReflection, Similarity, Diffusion];
                cycle(&mut lighting.mode, &all);
            }
            Knob::Bases => cycle(&mut lighting.bases, &[2, 4, 8, 16, 32]),
            Knob::Gather => {
                cycle(&mut lighting.gather, &[Gather::Auto, Gather::Exact, Gather::Tree])
            }
            Knob::Theta => cycle(&mut lighting.theta, &[0.2, 0.4, 0.6, 0.8]),
            Knob::Path => cycle(&mut draw.path, &[DrawPath::Tiles, DrawPath::Sprites]),
            Knob::Resolution => {
                use Resolution::{Full, Half, Quarter};
                cycle(&mut draw.resolution, &[Full, Half, Quarter]);
            }
        }
        Ok(())
    }
}

/// Replaces `value` by the one after it in `values`, or by the first where it is not listed.
fn cycle<T: Copy + PartialEq>(value: &mut T, values: &[T]) {
    let next = values.iter().position(|v| v == value).map_or(0, |i| i + 1);
    *value = values[next % values.len()];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::scene_file;

    fn scene(more: &str) -> Scene {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/x.toml");
        let text = format!("[[cloud]]\nfrom = 'particles'\nfile = 'hello.csv'\n{more}");
        scene_file::parse(text, &path, &[], None).unwrap().scene
    }

    #[test]
    fn knobs_cycle_and_scene_files_read_their_values_back() {
        for knob in Knob::ALL {
            let mut turned = scene("");
            let first = knob.value(&turned);
            let mut values = vec![first.clone()];
            loop {
                knob.advance(&mut turned).unwrap();
                let value = knob.value(&turned);
                let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/x.toml");
                let text = "[[cloud]]\nfrom = 'particles'\nfile = 'hello.csv'\n".to_owned();
                let set = [format!("{}={value}", knob.key())];
                let read = scene_file::parse(text, &path, &set, None).unwrap().scene;
                assert_eq!(knob.value(&read), value, "{knob:?}");
                if values.contains(&value) {
                    break;
                }
                values.push(value);
            }
            assert!(values.len() >= 2, "{values:?}");
        }
    }

    #[test]
    fn a_knob_that_cannot_change_returns_the_reason() {
        let mut still = scene("");
        assert!(Knob::Simulate.advance(&mut still).is_ok());
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/x.toml");
        let text = "[threads]\nsimulate = 'cpu'\n[[cloud]]\nfrom = 'weather'\nfile = \
            'weather/supercell.nc'\nspeed = 30\nparticles = 10";
        let mut moving = scene_file::parse(text.to_owned(), &path, &[], None).unwrap().scene;
        assert!(Knob::Simulate.advance(&mut moving).unwrap_err().contains("game thread"));
    }
}
