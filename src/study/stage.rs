//! A scene on a device, ready to run.

use std::path::PathBuf;
use std::sync::Arc;

use crate::error::{Error, Result};
use crate::frame::choice::{Choice, ImpostorChoice};
use crate::frame::choice_resolution::SizeChoice;
use crate::frame::game::Game;
use crate::frame::render::Renderer;
use crate::frame::{OnFrame, parallel, serial};
use crate::gpu::{Compiler, Device, DeviceInfo, Instance};
use crate::model::resolution::Resolution;
use crate::model::scene::{DrawPath, Impostors, Scene, Simulate, Threading};
use crate::passes;

/// How to open a device.
#[derive(Debug, Clone, Default)]
pub struct DeviceChoice {
    /// An index or a part of a name; the best device without.
    pub device: Option<String>,
    /// Shaders to use in place of those built in.
    pub shaders: Option<PathBuf>,
    pub validation: bool,
}

// Fields drop in order: what lies on the device before the device.
pub struct Stage {
    pub renderer: Renderer,
    pub game: Game,
    /// Its `draw.path`, `draw.resolution` and `draw.impostors` are what is drawn by.
    pub scene: Arc<Scene>,
    /// What `draw.path = "auto"` came to, where the scene asks for it.
    pub choice: Option<Choice>,
    /// The same of its `draw.resolution`.
    pub size_choice: Option<SizeChoice>,
    /// And of its `draw.impostors`.
    pub impostor_choice: Option<ImpostorChoice>,
    compiler: Compiler,
    pub device: Device,
    instance: Arc<Instance>,
}

impl Stage {
    /// Opens a device and makes everything the scene needs on it. `skip`: leave out what a frame does not need.
    pub fn new(scene: impl Into<Arc<Scene>>, choice: &DeviceChoice, skip: bool) -> Result<Stage> {
        let instance = Instance::new(choice.validation)?;
        let device = Device::open(&instance, choice.device.as_deref())?;
        let mut sources = passes::sources();
        if let Some(dir) = &choice.shaders {
            sources = sources.with_dir(dir)?;
        }
        let compiler = Compiler::new(sources, Compiler::default_cache())?;
        Stage::build(scene.into(), skip, compiler, device, instance)
    }

    /// Another scene on the same device; what was there for this one is given back first.
    pub fn again(self, scene: impl Into<Arc<Scene>>, skip: bool) -> Result<Stage> {
        let Stage { renderer, game, compiler, device, instance, .. } = self;
        drop((renderer, game));
        Stage::build(scene.into(), skip, compiler, device, instance)
    }

    fn build(
        scene: Arc<Scene>,
        skip: bool,
        compiler: Compiler,
        device: Device,
        instance: Arc<Instance>,
    ) -> Result<Stage> {
        let (made, impostor_choice) = match scene.draw.impostors {
            Impostors::Auto => faster(&device, &compiler, &scene, skip)?,
            _ => (make(&device, &compiler, scene, skip)?, None),
        };
        let Made { renderer, game, scene, choice, size_choice } = made;
        Ok(Stage { renderer, game, scene, choice, size_choice, impostor_choice, compiler, device, instance })
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
            Threading::Parallel => parallel::run(&mut self.game, &mut self.renderer, frames, on_frame),
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
        let said = instance.messages().take();
        if said.is_empty() {
            return Ok(());
        }
        Err(Error::Check { what: format!("{} validation messages or leaks:\n{}", said.len(), said.join("\n")) })
    }
}

/// What a stage holds of one scene.
struct Made {
    renderer: Renderer,
    game: Game,
    scene: Arc<Scene>,
    choice: Option<Choice>,
    size_choice: Option<SizeChoice>,
}

/// Everything that `scene`, whose impostors are decided, needs on a device.
fn make(device: &Device, compiler: &Compiler, mut scene: Arc<Scene>, skip: bool) -> Result<Made> {
    let mut renderer = Renderer::new(device, compiler, &scene, skip)?;
    let rest = match scene.threads.simulate {
        Simulate::Gpu => None,
        Simulate::Cpu => Some(renderer.generate_now(device)?.0),
    };
    let mut game = Game::new(scene.clone(), rest).culling(skip);
    let (mut choice, mut size_choice) = (None, None);
    if scene.draw.path == DrawPath::Auto {
        let packet = game.step(0)?;
        let chosen = renderer.choose_path(&packet)?;
        Arc::make_mut(&mut scene).draw.path = chosen.path;
        choice = Some(chosen);
    }
    if scene.draw.resolution == Resolution::Auto {
        let chosen = renderer.choose_resolution(&game.step(0)?, scene.draw.error)?;
        Arc::make_mut(&mut scene).draw.resolution = chosen.resolution;
        size_choice = Some(chosen);
    }
    Ok(Made { renderer, game, scene, choice, size_choice })
}

/// `scene` with impostors or without, whichever draws its first frames faster.
fn faster(
    device: &Device,
    compiler: &Compiler,
    scene: &Arc<Scene>,
    skip: bool,
) -> Result<(Made, Option<ImpostorChoice>)> {
    let with = |scene: &Arc<Scene>, impostors| {
        let mut scene = Scene::clone(scene);
        scene.draw.impostors = impostors;
        Arc::new(scene)
    };
    let mut off = make(device, compiler, with(scene, Impostors::Off), skip)?;
    if !skip {
        // Where nothing is skipped there are none.
        return Ok((off, None));
    }
    let off_ms = off.renderer.time_frames(&mut off.game)?;
    // One at a time: both may not fit. What draws stays the same.
    let Made { scene, choice, .. } = off;
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
    Ok((Made { choice, ..made }, Some(chosen)))
}
