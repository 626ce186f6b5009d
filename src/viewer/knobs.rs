//! What of a scene is turned while it runs, a key a knob: its values in a circle, and what the
//! scene file would say.

use crate::frame::choice::named;
use crate::model::resolution::Resolution;
use crate::model::scene::{DrawPath, Gather, LightingMode, Scene, Simulate, Threading};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Knob {
    Threading,
    Simulate,
    Lighting,
    Bases,
    Gather,
    Theta,
    Path,
    Resolution,
}

const BASES: [u32; 5] = [2, 4, 8, 16, 32];
const THETAS: [f64; 4] = [0.2, 0.4, 0.6, 0.8];
const RESOLUTIONS: [Resolution; 3] = [Resolution::Full, Resolution::Half, Resolution::Quarter];

impl Knob {
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

    /// The scene's key.
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

    /// Its value in `scene`, as a scene file would have it.
    pub fn value(self, scene: &Scene) -> String {
        match self {
            Knob::Threading => named(&Threading::NAMES, scene.threads.mode),
            Knob::Simulate => named(&Simulate::NAMES, scene.threads.simulate),
            Knob::Lighting => named(&LightingMode::NAMES, scene.lighting.mode),
            Knob::Bases => scene.lighting.bases.to_string(),
            Knob::Gather => named(&Gather::NAMES, scene.lighting.gather),
            Knob::Theta => scene.lighting.theta.to_string(),
            Knob::Path => named(&DrawPath::NAMES, scene.draw.path),
            Knob::Resolution => match scene.draw.resolution {
                Resolution::Auto => "\"auto\"".to_owned(),
                resolution => resolution.name().to_owned(),
            },
        }
    }

    /// Turns to the next value; an error that says why there is no other.
    pub fn turn(self, scene: &mut Scene) -> Result<(), &'static str> {
        if self == Knob::Simulate && scene.is_animated() {
            return Err("weather that goes from step to step is moved by the game thread");
        }
        let (lighting, draw, threads) = (&mut scene.lighting, &mut scene.draw, &mut scene.threads);
        match self {
            Knob::Threading => {
                threads.mode = next(&[Threading::Serial, Threading::Parallel], threads.mode)
            }
            Knob::Simulate => {
                threads.simulate = next(&[Simulate::Gpu, Simulate::Cpu], threads.simulate)
            }
            Knob::Lighting => {
                lighting.mode = next(
                    &[LightingMode::None, LightingMode::First, LightingMode::TwoReflection],
                    lighting.mode,
                );
            }
            Knob::Bases => lighting.bases = next(&BASES, lighting.bases),
            Knob::Gather => {
                lighting.gather =
                    next(&[Gather::Auto, Gather::Exact, Gather::Tree], lighting.gather)
            }
            Knob::Theta => lighting.theta = next(&THETAS, lighting.theta),
            Knob::Path => draw.path = next(&[DrawPath::Tiles, DrawPath::Sprites], draw.path),
            Knob::Resolution => draw.resolution = next(&RESOLUTIONS, draw.resolution),
        }
        Ok(())
    }
}

/// The value after `now`; the first where `now` is none of them.
fn next<T: Copy + PartialEq>(values: &[T], now: T) -> T {
    let after = values.iter().position(|v| *v == now).map_or(0, |i| i + 1);
    values[after % values.len()]
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

    /// What a knob says of itself is what the scene file reads back.
    #[test]
    fn knobs_run_in_circles_and_say_what_files_say() {
        for knob in Knob::ALL {
            let mut turned = scene("");
            let first = knob.value(&turned);
            let mut values = vec![first.clone()];
            loop {
                knob.turn(&mut turned).unwrap();
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
    fn what_cannot_be_turned_says_why() {
        let mut still = scene("");
        assert!(Knob::Simulate.turn(&mut still).is_ok());
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/x.toml");
        let text = "[threads]\nsimulate = 'cpu'\n[[cloud]]\nfrom = 'weather'\nfile = \
            'weather/supercell.nc'\nspeed = 30\nparticles = 10";
        let mut moving = scene_file::parse(text.to_owned(), &path, &[], None).unwrap().scene;
        assert!(Knob::Simulate.turn(&mut moving).unwrap_err().contains("game thread"));
    }
}
