//! Devices on which scenes run.

use std::path::PathBuf;
use std::sync::Arc;

use super::choice::{self, Choice, ImpostorChoice, LightChoice};
use super::game::Game;
use super::player::Player;
use super::renderer::Renderer;
use super::times::OnFrame;
use super::{parallel, serial};
use crate::error::{Error, Result};
use crate::gpu::{Compiler, Device, DeviceInfo, DeviceOptions, Instance, Sources};
use crate::model::layers::Layers;
use crate::model::scene::{Scene, Threading};
use crate::passes;

/// How a device is opened.
#[derive(Debug, Clone, Default)]
pub struct DeviceChoice {
    /// An index or a part of a name; without, the best device.
    pub device: Option<String>,
    /// A folder of shaders that replace the embedded ones.
    pub shaders: Option<PathBuf>,
    /// Vulkan's validation layer is on.
    pub validation: bool,
    /// Lowered limits, reports on pipelines, guard bands, the limit of a submission.
    pub options: DeviceOptions,
}

impl DeviceChoice {
    /// Returns the shaders to use.
    ///
    /// # Errors
    /// Fails if the folder of shaders cannot be read.
    pub fn sources(&self) -> Result<Sources> {
        let sources = passes::sources();
        match &self.shaders {
            Some(dir) => sources.with_dir(dir),
            None => Ok(sources),
        }
    }
}

/// An open device and its shader compiler, on which any number of scenes can run side by side.
pub struct GpuContext {
    compiler: Compiler,
    /// The device.
    pub device: Device,
    instance: Arc<Instance>,
}

impl GpuContext {
    /// Opens a device.
    ///
    /// # Errors
    /// Fails if there is no such device or the shaders cannot be read.
    pub fn open(choice: &DeviceChoice) -> Result<GpuContext> {
        GpuContext::with_sources(choice, choice.sources()?)
    }

    /// Opens a device with shaders in place of those of `choice`.
    ///
    /// # Errors
    /// Fails if there is no such device.
    pub fn with_sources(choice: &DeviceChoice, sources: Sources) -> Result<GpuContext> {
        GpuContext::with_instance(Instance::new(choice.validation)?, choice, sources)
    }

    /// Opens a device of an existing instance.
    ///
    /// # Errors
    /// Fails if there is no such device.
    pub fn with_instance(
        instance: Arc<Instance>,
        choice: &DeviceChoice,
        sources: Sources,
    ) -> Result<GpuContext> {
        let device = Device::with_options(&instance, choice.device.as_deref(), &choice.options)?;
        let compiler = Compiler::new(sources, Compiler::default_cache())?;
        Ok(GpuContext { compiler, device, instance })
    }

    /// Returns the compiler.
    pub fn compiler(&self) -> &Compiler {
        &self.compiler
    }

    /// Replaces the shaders of later players, and returns the previous compiler.
    ///
    /// # Errors
    /// Fails if the compiler cannot be created.
    pub fn set_sources(&mut self, sources: Sources) -> Result<Compiler> {
        let compiler = Compiler::new(sources, Compiler::default_cache())?;
        Ok(std::mem::replace(&mut self.compiler, compiler))
    }

    /// Replaces the compiler of later players.
    pub fn set_compiler(&mut self, compiler: Compiler) {
        self.compiler = compiler;
    }

    /// Makes everything that `scene` needs. With `skip`, frames skip passes whose input is
    /// unchanged.
    ///
    /// # Errors
    /// Fails if the scene exceeds a limit of the device or a shader does not compile.
    pub fn player(&self, scene: impl Into<Arc<Scene>>, skip: bool) -> Result<Player> {
        Player::new(&self.device, &self.compiler, scene.into(), skip)
    }

    /// Closes the device, after all its players are dropped.
    ///
    /// # Errors
    /// Fails if the validation layer or the leak report has left messages.
    pub fn close(self) -> Result<()> {
        let GpuContext { device, instance, .. } = self;
        drop(device);
        let messages = instance.messages().take();
        if messages.is_empty() {
            return Ok(());
        }
        let n = messages.len();
        Err(Error::Check {
            what: format!("{n} validation messages or leaks:\n{}", messages.join("\n")),
        })
    }
}

/// A device with one scene that is ready to run.
// Fields drop in order: what lies on the device before the device.
pub struct Stage {
    /// The render side.
    pub renderer: Renderer,
    /// The game side.
    pub game: Game,
    /// The scene; in its `draw` and lighting nothing is "auto".
    pub scene: Arc<Scene>,
    /// The lighting that "auto" has taken.
    pub light_choice: Option<LightChoice>,
    /// The values that "auto" knobs of the scene's `draw` have taken.
    pub choices: Vec<Choice>,
    /// The choice of `draw.impostors`, if it is "auto".
    pub impostor_choice: Option<ImpostorChoice>,
    compiler: Compiler,
    /// The device.
    pub device: Device,
    instance: Arc<Instance>,
}

impl Stage {
    /// Opens a device and makes everything the scene needs on it. With `skip`, frames skip passes
    /// whose input is unchanged.
    ///
    /// # Errors
    /// Fails if there is no such device, the scene exceeds its limits, or a shader does not
    /// compile.
    pub fn new(scene: impl Into<Arc<Scene>>, choice: &DeviceChoice, skip: bool) -> Result<Stage> {
        Stage::with_context(scene.into(), skip, GpuContext::open(choice)?)
    }

    /// Replaces the scene by another one on the same device; the buffers of this one are freed
    /// first.
    ///
    /// # Errors
    /// Fails as [`Stage::new`] does.
    pub fn again(self, scene: impl Into<Arc<Scene>>, skip: bool) -> Result<Stage> {
        Stage::with_context(scene.into(), skip, self.into_context())
    }

    fn with_context(scene: Arc<Scene>, skip: bool, context: GpuContext) -> Result<Stage> {
        let Player { renderer, game, scene, light_choice, choices, impostor_choice } =
            context.player(scene, skip)?;
        let GpuContext { compiler, device, instance } = context;
        Ok(Stage {
            renderer,
            game,
            scene,
            light_choice,
            choices,
            impostor_choice,
            compiler,
            device,
            instance,
        })
    }

    fn into_context(self) -> GpuContext {
        let Stage { renderer, game, compiler, device, instance, .. } = self;
        drop((renderer, game));
        GpuContext { compiler, device, instance }
    }

    /// Returns sentences about the values that "auto" knobs have taken, once.
    pub fn take_chosen(&mut self) -> Vec<String> {
        let choices = std::mem::take(&mut self.choices);
        choice::chosen_texts(self.light_choice.take(), &choices, self.impostor_choice.take())
    }

    /// Runs `frames` from a fresh start and calls `on_frame` with each as it ends.
    ///
    /// # Errors
    /// Fails if a step or `on_frame` fails, or a thread panics.
    pub fn run(
        &mut self,
        threading: Threading,
        frames: impl Iterator<Item = u32> + Send,
        on_frame: &mut OnFrame<'_>,
    ) -> Result<()> {
        self.renderer.reset();
        let (game, renderer) = (&mut self.game, &mut self.renderer);
        match threading {
            Threading::Serial => serial::run(game, renderer, frames, on_frame),
            Threading::Parallel => parallel::run(game, renderer, frames, on_frame),
        }
    }

    /// Sets whether frames skip passes whose input is unchanged, from the next run on.
    pub fn set_skip(&mut self, skip: bool) {
        self.renderer.set_skip(skip);
        self.game.set_culling(skip);
    }

    /// Makes the device write at least `bytes` before each pass of later frames, so that the pass
    /// finds nothing in a cache.
    ///
    /// # Errors
    /// Fails if the device has too little memory.
    pub fn set_cold(&mut self, bytes: u64) -> Result<()> {
        self.renderer.set_cold(&self.device, &self.compiler, bytes)
    }

    /// Draws the layers of the last frame.
    ///
    /// # Errors
    /// Fails as [`Renderer::layers`] does.
    pub fn layers(&mut self) -> Result<Layers> {
        self.renderer.layers(&self.device, &self.compiler, &self.scene)
    }

    /// Returns the device's name, type and driver.
    pub fn info(&self) -> &DeviceInfo {
        self.device.info()
    }

    /// Frees everything and closes the device.
    ///
    /// # Errors
    /// Fails if the validation layer or the leak report has left messages.
    pub fn close(self) -> Result<()> {
        self.into_context().close()
    }
}
