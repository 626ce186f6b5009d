//! The render step: planning, submission of frames, and waiting for them.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

use tracing::info_span;

use super::clock::ms;
use super::frame_passes::FramePasses;
use super::limits;
use super::packet::Packet;
use super::plan::{Pass, Plan, Skipping, plan};
use super::staging::IN_FLIGHT;
use crate::error::{Error, Result};
use crate::gpu::{
    Barriers, Buffer, ColdCaches, Commands, Compiler, Device, Invocations, MemoryUsage, ScopeTime,
    Submission,
};
use crate::layout::frame::CameraRecord;
use crate::model::scene::Scene;

/// A scene on a device, and the frames of it that are in flight.
// Commands first: they are dropped first, and wait for frames in flight.
pub struct Renderer {
    /// One for each frame in flight.
    frames: [Commands; IN_FLIGHT],
    /// For requests between frames.
    pub(super) host: Commands,
    in_flight: VecDeque<InFlight>,
    pub(super) passes: FramePasses,
    /// The picture that the last ended frame drew.
    pub(super) i_ended_picture: usize,
    pub(super) readback: Buffer,
    pub(super) skipping: Skipping,
    pub(super) last: Option<Packet>,
    /// Frames submitted so far.
    n_begun: u64,
    last_end: Instant,
    /// A frame has failed, so that the state of the device is unknown.
    pub(super) failed: bool,
    barriers: Barriers,
}

/// A submitted frame that has not been waited for.
struct InFlight {
    slot: usize,
    i_picture: usize,
    plan: Plan,
    recorded: [Instant; 2],
    submitted: Instant,
    is_captured: bool,
}

/// The results of a render step.
pub struct Rendered {
    /// The plan of the frame.
    pub plan: Plan,
    /// Times at which uploading, planning and recording began and ended.
    pub recorded: [Instant; 2],
    /// Time at which the commands had been submitted.
    pub submitted: Instant,
    /// Wait for the device, in ms.
    pub wait_ms: f64,
    /// Device time of every pass that ran; empty without timestamps.
    pub passes: Vec<ScopeTime>,
    /// Particles that the device kept, if `draw.cull` is on.
    pub n_kept: Option<u32>,
}

impl Renderer {
    /// Checks the scene against the device's limits, then makes every pipeline and buffer it needs.
    /// Each knob that is "auto" takes the value that changes nothing. With `skip`, frames skip
    /// passes whose input is unchanged.
    ///
    /// # Errors
    /// Fails if the scene exceeds a limit or a shader does not compile.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
        skip: bool,
    ) -> Result<Renderer> {
        let free = device.limits().device_memory_bytes - limits::check(scene, device.limits())?;
        let mut host = Commands::new(device, "frame.host")?;
        let passes = FramePasses::new(device, compiler, &mut host, &scene.exact(), free)?;
        let n_bytes = passes.constants.n_bytes();
        Ok(Renderer {
            frames: [Commands::new(device, "frame.even")?, Commands::new(device, "frame.odd")?],
            host,
            in_flight: VecDeque::with_capacity(IN_FLIGHT),
            passes,
            i_ended_picture: 0,
            readback: Buffer::new::<u8>(device, "film.readback", n_bytes, MemoryUsage::Readback)?,
            skipping: Skipping::new(skip),
            last: None,
            n_begun: 0,
            last_end: Instant::now(),
            failed: false,
            barriers: Barriers::Placed,
        })
    }

    /// Returns the time of the last frame that began, in seconds of the scene.
    pub fn last_time_s(&self) -> Option<f64> {
        self.last.as_ref().map(|packet| packet.time_s)
    }

    /// Returns the sky of the last frame, a `SkyRecord`; `None` without one.
    pub fn sky(&self) -> Option<&Buffer> {
        let has_sky = self.last.as_ref().is_some_and(|packet| packet.sky.is_some());
        has_sky.then_some(&self.passes.buffers.sky)
    }

    /// Draws one frame and waits for it.
    ///
    /// # Errors
    /// Fails as [`Renderer::begin`] and [`Renderer::end`] do.
    pub fn step(&mut self, packet: Packet) -> Result<Rendered> {
        self.begin(packet)?.wait()?;
        self.end()
    }

    /// Draws one frame in which every pass runs that the scene needs, and returns what each of them
    /// invoked; none if the device does not count that.
    ///
    /// # Errors
    /// Fails as [`Renderer::step`] does, or if frames are in flight.
    pub fn count_invocations(
        &mut self,
        packet: Packet,
    ) -> Result<Option<Vec<(&'static str, Invocations)>>> {
        self.check_idle()?;
        self.reset();
        let slot = self.slot();
        self.frames[slot].count_invocations(true);
        let stepped = self.step(packet);
        let counted = stepped.and_then(|_| self.frames[slot].invocations());
        self.frames[slot].count_invocations(false);
        counted
    }

    /// Returns the place of the next frame.
    fn slot(&self) -> usize {
        (self.n_begun % IN_FLIGHT as u64) as usize
    }

    /// Uploads, records and submits a frame, and returns a handle to wait for it. At most
    /// [`IN_FLIGHT`] frames may have begun and not ended.
    ///
    /// # Errors
    /// Fails if too many frames are in flight, an earlier frame has failed, or a Vulkan call fails.
    pub fn begin(&mut self, packet: Packet) -> Result<Submission> {
        self.check_not_failed()?;
        if self.in_flight.len() == IN_FLIGHT {
            return Err(Error::usage(format!(
                "{IN_FLIGHT} frames are in flight; one must end before the next begins"
            )));
        }
        // Reset only after success: until then the device's state may differ from `last`.
        self.failed = true;
        let pending = self.submit(packet)?;
        self.failed = false;
        Ok(pending)
    }

    fn submit(&mut self, packet: Packet) -> Result<Submission> {
        let begin = Instant::now();
        let _zone = info_span!("render step").entered();
        let plan = info_span!("plan").in_scope(|| self.plan(&packet));
        let slot = self.slot();
        let draws = [Pass::Surfaces, Pass::Terrain, Pass::Sprites, Pass::Tiles];
        if draws.into_iter().any(|pass| plan.runs(pass)) {
            self.passes.picture.flip();
        }
        info_span!("upload").in_scope(|| self.passes.write(slot, &packet))?;
        let (frame, passes) = (&mut self.frames[slot], &mut self.passes);
        let is_captured = frame.begin_frame();
        frame.record(self.barriers, |rec| passes.record(rec, slot, &packet, &plan))?;
        let recorded = [begin, Instant::now()];
        let pending = frame.submit()?;
        let (i_picture, submitted) = (passes.picture.i, Instant::now());
        let frame = InFlight { slot, i_picture, plan, recorded, submitted, is_captured };
        self.in_flight.push_back(frame);
        self.n_begun += 1;
        self.last = Some(packet);
        Ok(pending)
    }

    fn plan(&mut self, packet: &Packet) -> Plan {
        let plan = plan(&self.passes.features, self.skipping, self.last.as_ref(), packet);
        match &mut self.passes.picture.impostors {
            Some(impostors) => impostors.decide(plan, packet),
            None => plan,
        }
    }

    /// Waits for the oldest frame in flight and returns its results.
    ///
    /// # Errors
    /// Fails if no frame is in flight or the device is lost.
    pub fn end(&mut self) -> Result<Rendered> {
        let frame =
            self.in_flight.pop_front().ok_or_else(|| Error::usage("no frame is in flight"))?;
        self.failed = true;
        let passes = self.frames[frame.slot].wait()?;
        if frame.is_captured {
            self.frames[frame.slot].end_captured_frame();
        }
        self.failed = false;
        self.i_ended_picture = frame.i_picture;
        let now = Instant::now();
        // Time spent waiting for the previous frame counts for that frame, not for this one.
        let wait_ms = ms(frame.submitted.max(std::mem::replace(&mut self.last_end, now)), now);
        let InFlight { plan, recorded, submitted, .. } = frame;
        let culling = self.passes.culling.as_ref();
        let n_kept = culling.map(|culling| culling.n_kept(frame.slot)).transpose()?;
        Ok(Rendered { plan, recorded, submitted, wait_ms, passes, n_kept })
    }

    /// Waits for every frame in flight and discards its results.
    pub fn drain(&mut self) {
        // An error is ignored here: the next call that needs a frame reports it.
        while !self.in_flight.is_empty() && self.end().is_ok() {}
        self.in_flight.clear();
    }

    /// Forgets the last frame, so that the next one runs every pass.
    pub fn reset(&mut self) {
        (self.last, self.skipping.is_made) = (None, false);
    }

    /// Sets whether frames skip passes whose input is unchanged.
    pub fn set_skip(&mut self, skip: bool) {
        self.skipping.is_on = skip;
    }

    /// Returns the particles that the last frame kept; `None` without culling.
    pub(super) fn n_kept_last(&self) -> Result<Option<u32>> {
        let slot = (self.n_begun.wrapping_sub(1) % IN_FLIGHT as u64) as usize;
        self.passes.culling.as_ref().map(|culling| culling.n_kept(slot)).transpose()
    }

    /// Returns camera and size, in pixels, of the picture that a frame's blobs are drawn into.
    pub(super) fn blob_camera(&self, packet: &Packet) -> (CameraRecord, [u32; 2]) {
        self.passes.picture.blob_camera(&packet.camera, &self.passes.constants)
    }

    /// Returns the transmittance below which a pixel hides everything behind it.
    pub(super) fn saturated(&self) -> f64 {
        self.passes.constants.saturated
    }

    /// Makes caches cold before each pass of later frames.
    pub(super) fn make_cold(&mut self, cold: &Arc<ColdCaches>) {
        self.frames.iter_mut().for_each(|frame| frame.set_cold(Some(cold.clone())));
    }

    /// Sets where frames have barriers. Tests omit some, to prove that validation would notice.
    pub fn set_barriers(&mut self, barriers: Barriers) {
        self.barriers = barriers;
    }

    /// Makes the next frames run every pass whose input can change during a run.
    pub fn move_all(&mut self) {
        (self.skipping.is_on, self.skipping.keeps_made) = (false, true);
    }

    /// Returns whether the particles of boxes and the pool of textures exist.
    pub(super) fn is_made(&self) -> bool {
        self.last.is_some() || self.skipping.is_made
    }

    /// Forgets the last frame, and remembers whether particles and textures exist.
    pub(super) fn restart(&mut self, is_made: bool) {
        (self.last, self.skipping.is_made, self.failed) = (None, is_made, false);
    }

    /// Fails if frames are in flight: it is undefined which one a reader would see.
    pub(super) fn check_idle(&self) -> Result<()> {
        if self.in_flight.is_empty() { Ok(()) } else { Err(Error::usage("frames are in flight")) }
    }

    /// Fails if a frame has failed.
    pub(super) fn check_not_failed(&self) -> Result<()> {
        match self.failed {
            true => Err(Error::usage("a frame has failed: the state of the device is unknown")),
            false => Ok(()),
        }
    }
}
