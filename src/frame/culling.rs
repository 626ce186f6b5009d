//! Which particles the device keeps of those that are drawn, and how many they were.

use super::buffers::Buffers;
use super::drawing::Drawing;
use super::feed::IN_FLIGHT;
use super::packet::Packet;
use super::settings::Settings;
use crate::error::Result;
use crate::gpu::{Buffer, Compiler, Device, MemoryUsage, Recorder};
use crate::layout::cull::KeptRecord;
use crate::model::scene::{Cull as CullMode, Impostors, Scene};
use crate::passes::cull::{Cull, Order, View};
use crate::passes::sort::{Counts, Sort, TILE};
use crate::passes::tiles::BLOCK;

/// Whether the device leaves out particles of `scene`.
pub fn culls(scene: &Scene) -> bool {
    // Who is in a shell must not depend on the view.
    scene.draw.cull != CullMode::Off
        && scene.draw.impostors == Impostors::Off
        && scene.n_particles() > 0
}

pub(super) struct Culling {
    cull: Cull,
    /// KeptRecord, as the frame in each slot left it.
    counts: [Buffer; IN_FLIGHT],
}

impl Culling {
    /// None where the scene asks for none.
    pub fn of_scene(
        device: &Device,
        compiler: &Compiler,
        scene: &Scene,
    ) -> Result<Option<Culling>> {
        if !culls(scene) {
            return Ok(None);
        }
        let (n, variant) = (
            scene.n_particles() as u32,
            [scene.draw.count.is_some(), scene.draw.threshold.is_active(), scene.has_ellipsoids()],
        );
        let count = |name| Buffer::new::<KeptRecord>(device, name, 1, MemoryUsage::Readback);
        let counts = [count("cull.count.even")?, count("cull.count.odd")?];
        Ok(Some(Culling { cull: Cull::new(device, compiler, n, variant)?, counts }))
    }

    /// Keeps what can show of `packet`'s particles.
    pub fn record(
        &self,
        rec: &mut Recorder<'_>,
        b: &Buffers,
        (packet, drawing): (&Packet, &Drawing),
        s: &Settings,
    ) -> Result<()> {
        let Some(kept) = &b.kept else { return Ok(()) };
        let (camera, [width, height]) = drawing.seen(&packet.camera, s);
        let Settings { cutoff, threshold, size, .. } = *s;
        // Pixels of the film; the blobs' are as many times as wide as fewer of them cover a slope.
        let pixels = f64::from(height) * f64::from(packet.camera.tan_y)
            / (f64::from(size[1]) * f64::from(camera.tan_y));
        let smallest = s.smallest * pixels;
        let view = View { camera: &camera, width, height, cutoff, threshold, smallest };
        let order = Order {
            radius: packet.radius,
            n_bits: packet.sort_bits,
            sort_tile: TILE,
            splat_block: BLOCK,
        };
        let buffers =
            [b.placed.buffer(), &b.particles, &b.i_group, &b.drawn.buffer, &b.entries, kept];
        self.cull.record(rec, buffers, &view, &order, s.n_particles)
    }

    /// Has the host told how many were kept.
    pub fn record_count(&self, rec: &mut Recorder<'_>, b: &Buffers, slot: usize) {
        if let Some(kept) = &b.kept {
            rec.copy(kept, &self.counts[slot]);
        }
    }

    /// How many were kept in the frame that last ended in `slot`.
    pub fn n_kept(&self, slot: usize) -> Result<u32> {
        let counts: Vec<u32> = self.counts[slot].read(size_of::<KeptRecord>() / 4)?;
        Ok(counts[KeptRecord::I_COUNT as usize])
    }
}

/// Sorts what is drawn of `packet`: of the kept ones, whose entries are there, or of all.
pub(super) fn record_sort(
    rec: &mut Recorder<'_>,
    sort: &Sort,
    b: &Buffers,
    packet: &Packet,
    s: &Settings,
) -> Result<()> {
    let Some(kept) = &b.kept else {
        let buffers = [b.placed.buffer(), &b.i_group, &b.drawn.buffer, &b.entries];
        sort.record_keys(
            rec,
            buffers,
            packet.camera.forward,
            s.n_particles,
            packet.radius,
            packet.sort_bits,
        )?;
        return sort.record(rec, &b.entries, packet.n_drawn, packet.sort_bits);
    };
    let counts =
        Counts { buffer: kept, i_count: KeptRecord::I_COUNT, i_groups: KeptRecord::I_SORT };
    // Both key widths take an even number of passes, so the result lies where it began.
    sort.record_counted(rec, &b.entries, packet.sort_bits, counts).map(|_| ())
}
