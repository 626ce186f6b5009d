//! The device that stress cases run on, for single shader functions and for whole scenes.

use std::sync::Arc;

use bytemuck::Pod;

use crate::error::{Error, Result};
use crate::frame::{DeviceChoice, GpuContext, Player};
use crate::gpu::{
    Buffer, Commands, Compiler, Device, DeviceOptions, Field, Kernel, MemoryUsage, Recorder,
    Sources,
};
use crate::layout::facet::{FacetRecord, LitRecord};
use crate::layout::particle::{ParticleRecord, PlacedRecord};
use crate::layout::record;
use crate::model::scene::{LightingMode, Scene};

record! {
    struct ProbePush { n: u32 }
}

/// A shader that applies `vec4 probe(vec4 x)` to every element of a buffer.
const PROBE: &str = "#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
ABOVE
layout(local_size_x = 64) in;
layout(push_constant) uniform Push { uint n; } push;
layout(std430, binding = 0) readonly buffer X { vec4 xs[]; };
layout(std430, binding = 1) writeonly buffer Y { vec4 ys[]; };
vec4 probe(vec4 x) { BODY }
void main() {
    FOR_EACH(i, push.n) {
        ys[i] = probe(xs[i]);
    }
}
";

/// Shader files that declare workgroups of 64 invocations, one per record: the loop over records
/// that most shaders include, and shaders with a declaration of their own.
const PER_RECORD: [&str; 3] = ["include/each.glsl", "generate.comp", "tiles_ranges.comp"];

/// A device with a set of shaders.
pub struct StressContext {
    // Dropped first, because dropping the commands waits for the work in flight.
    commands: Commands,
    sources: Sources,
    choice: DeviceChoice,
    gpu: GpuContext,
}

/// The device's results for one frame of a scene.
pub struct DeviceFrame {
    /// Premultiplied linear RGBA, row by row from the top.
    pub rgba: Vec<f32>,
    /// The render target's content.
    pub bytes: Vec<u8>,
    /// Particles relative to the scene's origin.
    pub placed: Vec<PlacedRecord>,
    /// Particles relative to their groups' origins.
    pub particles: Vec<ParticleRecord>,
    /// Facets; empty if the lighting mode is "none".
    pub facets: Vec<FacetRecord>,
    /// Light of the facets.
    pub lit: Vec<LitRecord>,
}

impl DeviceFrame {
    /// Returns channel `k` (0 to 3: red, green, blue, alpha) of a pixel.
    pub fn channel(&self, i_pixel: usize, k: usize) -> f64 {
        f64::from(self.rgba[4 * i_pixel + k])
    }
}

impl StressContext {
    /// Opens a device with the shaders that `choice` names.
    ///
    /// # Errors
    /// If the device cannot be opened or a shader cannot be read.
    pub fn open(choice: &DeviceChoice) -> Result<StressContext> {
        StressContext::with_sources(choice, choice.sources()?)
    }

    /// Opens a device with the given shaders. Tests pass faulty ones.
    ///
    /// # Errors
    /// If the device cannot be opened.
    pub fn with_sources(choice: &DeviceChoice, sources: Sources) -> Result<StressContext> {
        let gpu = GpuContext::with_sources(choice, sources.clone())?;
        let commands = Commands::new(&gpu.device, "stress")?;
        Ok(StressContext { commands, sources, choice: choice.clone(), gpu })
    }

    /// Opens the device again with workgroups of `n` in the shaders that treat single records.
    /// Other workgroup sizes follow from subgroups or shared memory.
    ///
    /// # Errors
    /// Fails if a shader declares no such workgroups, or the device cannot be opened.
    pub(super) fn with_workgroup_size(&self, n: u32) -> Result<StressContext> {
        let mut sources = self.sources.clone();
        for name in PER_RECORD {
            if !sources.replace(name, "local_size_x = 64", &format!("local_size_x = {n}")) {
                let what = format!("{name} declares no workgroups of 64 invocations");
                return Err(Error::Fault { what });
            }
        }
        StressContext::with_sources(&self.choice, sources)
    }

    /// Opens the device again with other options.
    ///
    /// # Errors
    /// Fails if the device cannot be opened.
    pub(super) fn with_options(&self, change: fn(&mut DeviceOptions)) -> Result<StressContext> {
        let mut choice = self.choice.clone();
        change(&mut choice.options);
        StressContext::with_sources(&choice, self.sources.clone())
    }

    /// Returns the device.
    pub fn device(&self) -> &Device {
        &self.gpu.device
    }

    /// Returns the compiler of the shaders.
    pub(super) fn compiler(&self) -> &Compiler {
        self.gpu.compiler()
    }

    /// Closes the device.
    ///
    /// # Errors
    /// If the validation layer or the leak report has messages.
    pub fn close(self) -> Result<()> {
        let StressContext { commands, gpu, .. } = self;
        drop(commands);
        gpu.close()
    }

    /// Compiles a shader text, which may include nimbus's own files.
    ///
    /// # Errors
    /// Fails if the text does not compile.
    pub(super) fn kernel(
        &self,
        name: &str,
        text: &str,
        push: &[Field],
        macros: &[(&str, u32)],
    ) -> Result<Kernel> {
        let sources = self.sources.clone().with_text(&format!("{name}.comp"), text);
        let compiler = Compiler::new(sources, Compiler::default_cache())?;
        Kernel::with_macros(self.device(), &compiler, name, push, &[], macros)
    }

    /// Evaluates `vec4 probe(vec4 x) { body }` for every input, and returns the inputs with their
    /// values. `body` may use the shader file `include` and, unless `table` is empty, its elements
    /// as `FLOATS table`.
    ///
    /// # Errors
    /// Fails if `body` does not compile, or a Vulkan call fails.
    pub(super) fn probe(
        &mut self,
        include: &str,
        table: &[f32],
        body: &str,
        inputs: Vec<[f32; 4]>,
    ) -> Result<impl Iterator<Item = ([f32; 4], [f32; 4])> + use<>> {
        let mut above = format!("#include \"each.glsl\"\n#include \"{include}\"\n");
        if !table.is_empty() {
            above.insert_str(0, "#include \"buffers.glsl\"\nFLOATS(2, table)\n");
        }
        let text = PROBE.replace("ABOVE", &above).replace("BODY", body);
        let kernel = self.kernel("probe", &text, ProbePush::FIELDS, &[])?;
        let (x, y) = (self.upload(&inputs)?, self.buffer::<[f32; 4]>(inputs.len())?);
        let push = ProbePush { n: inputs.len() as u32 };
        if table.is_empty() {
            self.run(|rec| rec.dispatch(&kernel, &[&x, &y], &push, push.n))?;
        } else {
            let table = self.upload(table)?;
            self.run(|rec| rec.dispatch(&kernel, &[&x, &y, &table], &push, push.n))?;
        }
        let values = self.download(&y, inputs.len())?;
        Ok(inputs.into_iter().zip(values))
    }

    /// Uploads `data` to a new device buffer.
    ///
    /// # Errors
    /// Fails if memory runs out or the device is lost.
    pub(super) fn upload<T: Pod>(&mut self, data: &[T]) -> Result<Buffer> {
        let n = data.len() as u64;
        let mut staging =
            Buffer::new::<T>(self.device(), "stress.staging", n, MemoryUsage::Upload)?;
        staging.write(data)?;
        let buffer = self.buffer::<T>(data.len())?;
        self.copy(&staging, &buffer)?;
        Ok(buffer)
    }

    /// Allocates a device buffer of `n` records of undefined content.
    ///
    /// # Errors
    /// Fails if memory runs out.
    pub(super) fn buffer<T: Pod>(&self, n: usize) -> Result<Buffer> {
        Buffer::new::<T>(self.device(), "stress.buffer", n as u64, MemoryUsage::Device)
    }

    /// Reads the first `n` records of a device buffer.
    ///
    /// # Errors
    /// Fails if memory runs out or the device is lost.
    pub(super) fn download<T: Pod>(&mut self, buffer: &Buffer, n: usize) -> Result<Vec<T>> {
        let readback =
            Buffer::new::<T>(self.device(), "stress.readback", n as u64, MemoryUsage::Readback)?;
        self.copy(buffer, &readback)?;
        readback.read(n)
    }

    fn copy(&mut self, from: &Buffer, to: &Buffer) -> Result<()> {
        self.run(|rec| {
            rec.copy(from, to);
            Ok(())
        })
    }

    /// Records commands, submits them and waits until they have run.
    ///
    /// # Errors
    /// Fails if recording fails or the device is lost.
    pub(super) fn run(&mut self, f: impl FnOnce(&mut Recorder<'_>) -> Result<()>) -> Result<()> {
        self.commands.run(f).map(|_| ())
    }

    /// Allocates the buffers and pipelines of a scene. With `skip`, passes whose input has not
    /// changed since the last frame are left out.
    ///
    /// # Errors
    /// If the scene exceeds a limit of the device, or a Vulkan call fails.
    pub fn player(&self, scene: &Scene, skip: bool) -> Result<Player> {
        self.gpu.player(Arc::new(scene.clone()), skip)
    }

    /// Renders a single frame of a scene with every pass.
    ///
    /// # Errors
    /// If the scene exceeds a limit of the device, or a Vulkan call fails.
    pub fn render(&mut self, scene: &Scene, i_frame: u32) -> Result<DeviceFrame> {
        let mut player = self.player(scene, false)?;
        let (renderer, device) = (&mut player.renderer, &self.gpu.device);
        renderer.step(player.game.step(i_frame)?)?;
        let (facets, lit) = match scene.lighting.mode {
            LightingMode::None => (Vec::new(), Vec::new()),
            _ => renderer.facets(device)?,
        };
        let (rgba, bytes) = (renderer.image()?, renderer.image_bytes()?);
        let placed = renderer.placed(device)?;
        let (particles, _) = renderer.generate_now(device)?;
        Ok(DeviceFrame { rgba, bytes, placed, particles, facets, lit })
    }
}
