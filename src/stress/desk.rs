//! What cases are run on: a device with nimbus's shaders, for single functions of them and for
//! whole scenes.

use std::path::Path;
use std::sync::Arc;

use bytemuck::Pod;

use crate::error::{Error, Result};
use crate::frame::stage::{Bed, DeviceChoice, Player};
use crate::gpu::{
    Buffer, Commands, Compiler, Device, Field, Kernel, MemoryUsage, Recorder, Sources,
};
use crate::io::scene_file::parse;
use crate::layout::facet::{FacetRecord, LitRecord};
use crate::layout::particle::{ParticleRecord, PlacedRecord};
use crate::layout::record;
use crate::model::scene::{LightingMode, Scene};
use crate::passes;

record! {
    struct ProbePush { n: u32 }
}

/// A shader of nothing but `vec4 probe(vec4 x)`, for every x of a buffer.
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

/// Shaders that work by single records: their workgroups may be as large as one likes.
const LEAST_CHANGED: u32 = 15;

pub struct Desk {
    // Commands first: they are dropped first, and wait for what is still under way.
    commands: Commands,
    sources: Sources,
    choice: DeviceChoice,
    bed: Bed,
}

/// What a device made of one frame of a scene.
pub struct Played {
    /// Premultiplied linear RGBA, rows from the top; and as it lies in the target.
    pub rgba: Vec<f32>,
    pub bytes: Vec<u8>,
    pub placed: Vec<PlacedRecord>,
    pub particles: Vec<ParticleRecord>,
    /// Attempts of every particle; bit 31 where it was folded back.
    pub status: Vec<u32>,
    /// Empty where nothing is lit.
    pub facets: Vec<FacetRecord>,
    pub lit: Vec<LitRecord>,
}

impl Played {
    /// Values of the picture that are no finite numbers.
    pub fn n_odd(&self) -> usize {
        self.rgba.iter().filter(|v| !v.is_finite()).count()
    }
}

impl Desk {
    pub fn open(choice: &DeviceChoice) -> Result<Desk> {
        let mut sources = passes::sources();
        if let Some(dir) = &choice.shaders {
            sources = sources.with_dir(dir)?;
        }
        Desk::with_sources(choice, sources)
    }

    /// With other shaders than nimbus's: for those who want to see that a wrong one is found.
    pub fn with_sources(choice: &DeviceChoice, sources: Sources) -> Result<Desk> {
        let bed = Bed::with_sources(choice, sources.clone())?;
        let commands = Commands::new(&bed.device, "stress")?;
        Ok(Desk { commands, sources, choice: choice.clone(), bed })
    }

    /// Another one on the same device whose shaders, where they take workgroups of 64, take `n`.
    /// (Others' are made of subgroups, or of what shared memory holds.)
    pub fn in_workgroups_of(&self, n: u32) -> Result<Desk> {
        let names: Vec<String> = self
            .sources
            .names()
            .filter(|name| name.ends_with(".comp"))
            .map(str::to_owned)
            .collect();
        let mut sources = self.sources.clone();
        let mut n_changed = 0;
        for name in names {
            n_changed += u32::from(sources.replace(
                &name,
                "local_size_x = 64",
                &format!("local_size_x = {n}"),
            ));
        }
        if n_changed < LEAST_CHANGED {
            return Err(Error::usage(format!(
                "{n_changed} shaders take workgroups of 64; expected at least {LEAST_CHANGED}"
            )));
        }
        Desk::with_sources(&self.choice, sources)
    }

    /// Another one whose buffers hold NaN when they are made.
    pub fn poisoned(&self) -> Result<Desk> {
        let choice = DeviceChoice { poison: true, ..self.choice.clone() };
        Desk::with_sources(&choice, self.sources.clone())
    }

    pub fn device(&self) -> &Device {
        &self.bed.device
    }

    pub fn compiler(&self) -> &Compiler {
        self.bed.compiler()
    }

    /// Ends it; an error where validation or the leak report had anything to say.
    pub fn close(self) -> Result<()> {
        let Desk { commands, bed, .. } = self;
        drop(commands);
        bed.close()
    }

    /// A kernel of a text of the suite's own, which may include what nimbus's shaders include, and
    /// its macros.
    pub fn kernel(
        &self,
        name: &str,
        text: &str,
        push: &[Field],
        macros: &[(&str, u32)],
    ) -> Result<Kernel> {
        let sources = self.sources.clone().with_text(&format!("{name}.comp"), text);
        let compiler = Compiler::new(sources, Compiler::default_cache())?;
        Kernel::with_macros(&self.bed.device, &compiler, name, push, &[], macros)
    }

    /// `body`, the inside of a GLSL function `vec4 probe(vec4 x)`, of every one of `inputs`.
    pub fn probe(
        &mut self,
        includes: &[&str],
        body: &str,
        inputs: &[[f32; 4]],
    ) -> Result<Vec<[f32; 4]>> {
        self.probe_beside(&[], includes, body, inputs)
    }

    /// The same with tables: each a declaration's name, a `samplerBuffer` that the includes and
    /// `body` may read, and what it holds.
    pub fn probe_beside(
        &mut self,
        tables: &[(&str, &[f32])],
        includes: &[&str],
        body: &str,
        inputs: &[[f32; 4]],
    ) -> Result<Vec<[f32; 4]>> {
        let declared = tables.iter().enumerate();
        let declared = declared.map(|(i, (name, _))| {
            format!("layout(binding = {}) uniform samplerBuffer {name};\n", i + 2)
        });
        let included =
            ["each.glsl"].iter().chain(includes).map(|name| format!("#include \"{name}\"\n"));
        let above: String = declared.chain(included).collect();
        let text = PROBE.replace("ABOVE", &above).replace("BODY", body);
        let kernel = self.kernel("probe", &text, ProbePush::FIELDS, &[])?;
        let (x, y) = (self.upload(inputs)?, self.buffer::<[f32; 4]>(inputs.len())?);
        let tables =
            tables.iter().map(|(_, table)| self.upload(table)).collect::<Result<Vec<Buffer>>>()?;
        let buffers: Vec<&Buffer> = [&x, &y].into_iter().chain(&tables).collect();
        let push = ProbePush { n: inputs.len() as u32 };
        self.run(|rec| rec.dispatch(&kernel, &buffers, &push, push.n))?;
        self.download(&y, inputs.len())
    }

    /// The first component of `body` for every one of `inputs`, as x.x.
    pub fn function(&mut self, includes: &[&str], body: &str, inputs: &[f32]) -> Result<Vec<f64>> {
        let inputs: Vec<[f32; 4]> = inputs.iter().map(|x| [*x, 0.0, 0.0, 0.0]).collect();
        Ok(self.probe(includes, body, &inputs)?.into_iter().map(|y| f64::from(y[0])).collect())
    }

    /// A device buffer that holds `data`.
    pub fn upload<T: Pod>(&mut self, data: &[T]) -> Result<Buffer> {
        let mut staging = Buffer::new::<T>(
            &self.bed.device,
            "stress.staging",
            data.len() as u64,
            MemoryUsage::Upload,
        )?;
        staging.write(data)?;
        let buffer = self.buffer::<T>(data.len())?;
        self.run(|rec| {
            rec.copy(&staging, &buffer);
            Ok(())
        })?;
        Ok(buffer)
    }

    /// A device buffer of `n` records of unknown content.
    pub fn buffer<T: Pod>(&self, n: usize) -> Result<Buffer> {
        Buffer::new::<T>(&self.bed.device, "stress.buffer", n as u64, MemoryUsage::Device)
    }

    /// The first `n` records of a device buffer.
    pub fn download<T: Pod>(&mut self, buffer: &Buffer, n: usize) -> Result<Vec<T>> {
        let readback =
            Buffer::new::<T>(&self.bed.device, "stress.readback", n as u64, MemoryUsage::Readback)?;
        self.run(|rec| {
            rec.copy(buffer, &readback);
            Ok(())
        })?;
        readback.read(n)
    }

    pub fn run(&mut self, f: impl FnOnce(&mut Recorder<'_>) -> Result<()>) -> Result<()> {
        self.commands.run(f).map(|_| ())
    }

    /// A scene of a text, without files.
    pub fn scene(&self, text: &str) -> Result<Scene> {
        Ok(parse(text.to_owned(), Path::new("stress.toml"), &[], None)?.scene)
    }

    /// A scene made ready.
    pub fn player(&self, scene: &Scene, skip: bool) -> Result<Player> {
        self.bed.player(Arc::new(scene.clone()), skip)
    }

    /// Frame `i_frame` of `scene`, alone, with nothing left out.
    pub fn play(&mut self, scene: &Scene, i_frame: u32) -> Result<Played> {
        let mut player = self.player(scene, false)?;
        self.played(&mut player, i_frame)
    }

    /// The next frame of a player.
    pub fn played(&mut self, player: &mut Player, i_frame: u32) -> Result<Played> {
        let packet = player.game.step(i_frame)?;
        let Player { renderer, scene, .. } = player;
        renderer.step(packet)?;
        let device = &self.bed.device;
        let (rgba, bytes) = (renderer.image()?, renderer.image_bytes()?);
        let placed = renderer.placed(device)?;
        let (facets, lit) = match scene.lighting.mode {
            LightingMode::None => (Vec::new(), Vec::new()),
            _ => renderer.facets(device)?,
        };
        let (particles, status) = renderer.generate_now(device)?;
        Ok(Played { rgba, bytes, placed, particles, status, facets, lit })
    }
}
