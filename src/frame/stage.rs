//! A scene on a device, ready to run.

use std::path::PathBuf;
use std::sync::Arc;

use super::choice::Choice;
use super::choice::impostors::ImpostorChoice;
use super::game::Game;
use super::render::Renderer;
use super::{OnFrame, parallel, serial};
use crate::error::{Error, Result};
use crate::gpu::{Compiler, Device, DeviceInfo, Instance, Sources};
use crate::model::scene::{Impostors, Scene, Simulate, Threading};
use crate::passes;

/// How to open a device.
#[derive(Debug, Clone, Default)]
pub struct DeviceChoice {
    /// An index or a part of a name; the best device without.
    pub device: Option<String>,
    /// Shaders to use in place of those built in.
    pub shaders: Option<PathBuf>,
    pub validation: bool,
    /// Buffers are full of NaN until something is written to them.
    pub poison: bool,
}

impl DeviceChoice {
    /// The shaders that are to be used.
    pub fn sources(&self) -> Result<Sources> {
        let sources = passes::sources();
        match &self.shaders {
            Some(dir) => sources.with_dir(dir),
            None => Ok(sources),
        }
    }
}

/// A device on which any number of scenes can be made ready side by side.
pub struct Bed {
    compiler: Compiler,
    pub device: Device,
    instance: Arc<Instance>,
}

/// What a device holds of one scene.
pub struct Player {
    pub renderer: Renderer,
    pub game: Game,
    /// Its `draw` is what is drawn by: nothing in it is "auto".
    pub scene: Arc<Scene>,
    /// What every "auto" of the scene's `draw` came to.
    pub choices: Vec<Choice>,
    /// The same of its `draw.impostors`.
    pub impostor_choice: Option<ImpostorChoice>,
}

impl Bed {
    pub fn open(choice: &DeviceChoice) -> Result<Bed> {
        Bed::with_sources(choice, choice.sources()?)
    }

    /// With these shaders, whatever `choice` says of them.
    pub fn with_sources(choice: &DeviceChoice, sources: Sources) -> Result<Bed> {
        Bed::of_instance(Instance::new(choice.validation)?, choice, sources)
    }

    /// The same on an instance that is there.
    pub fn of_instance(
        instance: Arc<Instance>,
        choice: &DeviceChoice,
        sources: Sources,
    ) -> Result<Bed> {
        let device = Device::open(&instance, choice.device.as_deref())?;
        if choice.poison {
            device.poison();
        }
        let compiler = Compiler::new(sources, Compiler::default_cache())?;
        Ok(Bed { compiler, device, instance })
    }

    pub fn compiler(&self) -> &Compiler {
        &self.compiler
    }

    /// What is made from now on is of these shaders; the compiler of those before.
    pub fn set_sources(&mut self, sources: Sources) -> Result<Compiler> {
        let compiler = Compiler::new(sources, Compiler::default_cache())?;
        Ok(std::mem::replace(&mut self.compiler, compiler))
    }

    /// What is made from now on is compiled by this one.
    pub fn set_compiler(&mut self, compiler: Compiler) {
        self.compiler = compiler;
    }

    /// All that `scene` needs. `skip`: leave out what a frame does not need.
    pub fn player(&self, scene: impl Into<Arc<Scene>>, skip: bool) -> Result<Player> {
        player(&self.device, &self.compiler, scene.into(), skip)
    }

    /// Ends it, once all players are gone; an error where validation or the leak report had
    /// anything to say.
    pub fn close(self) -> Result<()> {
        let Bed { device, instance, .. } = self;
        drop(device);
        said(&instance)
    }
}

// Fields drop in order: what lies on the device before the device.
pub struct Stage {
    pub renderer: Renderer,
    pub game: Game,
    /// Its `draw` is what is drawn by: nothing in it is "auto".
    pub scene: Arc<Scene>,
    /// What every "auto" of the scene's `draw` came to.
    pub choices: Vec<Choice>,
    /// The same of its `draw.impostors`.
    pub impostor_choice: Option<ImpostorChoice>,
    compiler: Compiler,
    pub device: Device,
    instance: Arc<Instance>,
}

impl Stage {
    /// Opens a device and makes everything the scene needs on it. `skip`: leave out what a frame
    /// does not need.
    pub fn new(scene: impl Into<Arc<Scene>>, choice: &DeviceChoice, skip: bool) -> Result<Stage> {
        Stage::build(scene.into(), skip, Bed::open(choice)?)
    }

    /// Another scene on the same device; what was there for this one is given back first.
    pub fn again(self, scene: impl Into<Arc<Scene>>, skip: bool) -> Result<Stage> {
        let Stage { renderer, game, compiler, device, instance, .. } = self;
        drop((renderer, game));
        Stage::build(scene.into(), skip, Bed { compiler, device, instance })
    }

    fn build(scene: Arc<Scene>, skip: bool, bed: Bed) -> Result<Stage> {
        let Player { renderer, game, scene, choices, impostor_choice } = bed.player(scene, skip)?;
        let Bed { compiler, device, instance } = bed;
        Ok(Stage { renderer, game, scene, choices, impostor_choice, compiler, device, instance })
    }

    /// What every "auto" came to, as users are told, once.
    pub fn take_chosen(&mut self) -> Vec<String> {
        let choices = std::mem::take(&mut self.choices);
        choices
            .iter()
            .map(Choice::text)
            .chain(self.impostor_choice.take().map(|c| c.text()))
            .collect()
    }

    /// Runs `frames` from a fresh start, on one thread or two; `on_frame` sees each as it ends.
    pub fn run(
        &mut self,
        threading: Threading,
        frames: impl Iterator<Item = u32> + Send,
        on_frame: &mut OnFrame<'_>,
    ) -> Result<()> {
        self.renderer.reset();
        match threading {
            Threading::Serial => serial::run(&mut self.game, &mut self.renderer, frames, on_frame),
            Threading::Parallel => {
                parallel::run(&mut self.game, &mut self.renderer, frames, on_frame)
            }
        }
    }

    /// Whether frames leave out what they do not need, from the next run on.
    pub fn set_skip(&mut self, skip: bool) {
        self.renderer.set_skip(skip);
        self.game.set_culling(skip);
    }

    pub fn info(&self) -> &DeviceInfo {
        self.device.info()
    }

    /// Ends the stage; an error where validation or the leak report had anything to say.
    pub fn close(self) -> Result<()> {
        let Stage { renderer, game, device, instance, .. } = self;
        drop((renderer, game));
        drop(device);
        said(&instance)
    }
}

/// An error where validation or the leak report had anything to say.
fn said(instance: &Instance) -> Result<()> {
    let said = instance.messages().take();
    if said.is_empty() {
        return Ok(());
    }
    Err(Error::Check {
        what: format!("{} validation messages or leaks:\n{}", said.len(), said.join("\n")),
    })
}

fn player(device: &Device, compiler: &Compiler, scene: Arc<Scene>, skip: bool) -> Result<Player> {
    match scene.draw.impostors {
        Impostors::Auto => faster(device, compiler, &scene, skip),
        _ => make(device, compiler, scene, skip),
    }
}

/// Everything that `scene`, whose impostors are decided, needs on a device.
fn make(device: &Device, compiler: &Compiler, mut scene: Arc<Scene>, skip: bool) -> Result<Player> {
    let mut renderer = Renderer::new(device, compiler, &scene, skip)?;
    let rest = match scene.threads.simulate {
        Simulate::Gpu => None,
        Simulate::Cpu => Some(renderer.generate_now(device)?.0),
    };
    let mut game = Game::new(scene.clone(), rest).culling(skip);
    let (draw, choices) = renderer.choose(device, compiler, &scene, &mut game)?;
    if draw != scene.draw {
        Arc::make_mut(&mut scene).draw = draw;
        game = game.drawn_by(scene.clone());
    }
    Ok(Player { renderer, game, scene, choices, impostor_choice: None })
}

/// `scene` with impostors or without, whichever draws its first frames faster.
fn faster(device: &Device, compiler: &Compiler, scene: &Arc<Scene>, skip: bool) -> Result<Player> {
    let with = |scene: &Arc<Scene>, impostors| {
        let mut scene = Scene::clone(scene);
        scene.draw.impostors = impostors;
        Arc::new(scene)
    };
    let mut off = make(device, compiler, with(scene, Impostors::Off), skip)?;
    if !skip {
        // Where nothing is skipped there are none.
        return Ok(off);
    }
    let off_ms = off.renderer.time_frames(&mut off.game)?;
    // One at a time: both may not fit. What draws stays the same.
    let Player { scene, choices, .. } = off;
    let made = make(device, compiler, with(&scene, Impostors::On), skip).and_then(|mut on| {
        let ms = on.renderer.time_frames(&mut on.game)?;
        Ok((on, ms))
    });
    let (on, on_ms) = match made {
        Ok((on, ms)) => (Some(on), Some(ms)),
        // What does not fit is not used.
        Err(Error::Limit { .. }) => (None, None),
        Err(error) => return Err(error),
    };
    let chosen = ImpostorChoice { on: on_ms.is_some_and(|ms| ms < off_ms), off_ms, on_ms };
    let made = match on.filter(|_| chosen.on) {
        Some(on) => on,
        None => make(device, compiler, scene, skip)?,
    };
    Ok(Player { choices, impostor_choice: Some(chosen), ..made })
}
