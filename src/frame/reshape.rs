//! Replaces a player's scene by one with other boxes: only particles of changed boxes are
//! generated.

use std::sync::Arc;

use super::buffers::n_cells;
use super::features::{has_diffusion, is_thin};
use super::limits;
use super::player::Player;
use super::records::upload_groups;
use super::renderer::Renderer;
use super::stage::GpuContext;
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Device, MemoryUsage};
use crate::layout::particle::ParticleRecord;
use crate::model::boxes::MAX_ATTEMPTS;
use crate::model::cloud::{Cloud, CloudSource, Group};
use crate::model::scene::{LightingMode, Scene, Simulate};

/// How a player's buffers and pipelines have followed an edit of boxes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reshaped {
    /// They were kept.
    InPlace,
    /// They were replaced, because the number of boxes or of their particles has changed, or
    /// because light by diffusion needs more cells. Unchanged particles were copied.
    Anew,
}

/// A range of particles that two scenes share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct SharedRange {
    i_old: u32,
    i_new: u32,
    n: u32,
}

impl Player {
    /// Continues with `scene`, which differs from the player's only in boxes and seeds of clouds
    /// made from boxes. Its `draw` is replaced by the player's, and "auto" lighting, too.
    ///
    /// `touched` has the indices of `scene`'s groups, rising, whose particles may change; all
    /// others must be unchanged relative to their boxes' centers. The next frame runs every pass
    /// except `generate`, unless [`Renderer::reset`] is called before it. No run may be under way.
    ///
    /// # Errors
    /// Fails if the scenes differ otherwise, an index is wrong, or the new scene exceeds a limit of
    /// the device. The player then stays as it was, unless the device has failed.
    pub fn reshape(
        &mut self,
        context: &GpuContext,
        scene: impl Into<Arc<Scene>>,
        touched: &[usize],
    ) -> Result<Reshaped> {
        let device = &context.device;
        let mut scene: Arc<Scene> = scene.into();
        if scene.draw != self.scene.draw {
            Arc::make_mut(&mut scene).draw = self.scene.draw;
        }
        if scene.lighting.mode == LightingMode::Auto {
            Arc::make_mut(&mut scene).lighting = self.scene.lighting;
        }
        if !differs_in_boxes_alone(&self.scene, &scene) {
            return Err(Error::usage(
                "only boxes and seeds may differ from the scene that is played",
            ));
        }
        self.renderer.check_not_failed()?;
        self.renderer.check_idle()?;
        let groups = scene.groups();
        if !touched.is_sorted() || touched.iter().any(|i| *i >= groups.len()) {
            return Err(Error::usage(format!(
                "expected rising numbers of groups below {}",
                groups.len()
            )));
        }
        limits::check(&scene, device.limits())?;
        let old_groups = self.scene.groups();
        let size = |g: &Group| (g.i_cloud, g.n_particles);
        let is_same_size = old_groups.iter().map(size).eq(groups.iter().map(size));
        // Only the grid itself can grow in place, and not the light in its cells.
        let is_wider = n_cells(&scene) > self.renderer.passes.grid.capacity();
        let is_kept = is_same_size && is_thin(&self.scene) == is_thin(&scene);
        let reshaped = if is_kept && !(is_wider && has_diffusion(&scene)) {
            self.renderer.grow_grid(device, &scene)?;
            self.renderer.replace_groups(device, &scene, &groups, touched)?;
            Reshaped::InPlace
        } else {
            let skipping = self.renderer.skipping;
            let mut renderer = Renderer::new(device, context.compiler(), &scene, skipping.is_on)?;
            renderer.skipping.keeps_made = skipping.keeps_made;
            let shared =
                shared_ranges((&self.scene.clouds, &old_groups), (&scene.clouds, &groups), touched);
            renderer.adopt(&mut self.renderer, &groups, &shared, touched)?;
            self.renderer = renderer;
            Reshaped::Anew
        };
        let rest = match scene.threads.simulate {
            Simulate::Gpu => None,
            Simulate::Cpu => Some(self.renderer.particles_at_rest(device)?),
        };
        self.game.replay(scene.clone(), rest);
        self.scene = scene;
        Ok(reshaped)
    }
}

impl Renderer {
    /// Reallocates the density grid if moved boxes need more cells.
    fn grow_grid(&mut self, device: &Device, scene: &Scene) -> Result<()> {
        let (n, passes) = (n_cells(scene), &mut self.passes);
        if n <= passes.grid.capacity() {
            return Ok(());
        }
        // Twice as many, so that few steps of a drag reallocate; a cube has room for any.
        let side = u64::from(scene.lighting.grid);
        let n = (2 * n).min(side * side * side).max(n);
        let density = Buffer::new::<f32>(device, "grid.density", n, MemoryUsage::Device)?;
        passes.grid.set_capacity(device, n)?;
        passes.buffers.density = density;
        Ok(())
    }

    /// Uploads other boxes of the same sizes and generates the particles of `touched` ones.
    fn replace_groups(
        &mut self,
        device: &Device,
        scene: &Scene,
        groups: &[Group],
        touched: &[usize],
    ) -> Result<()> {
        // Reset by `restart`: until then boxes and particles may not belong together.
        self.failed = true;
        upload_groups(device, &mut self.host, scene, groups, &self.passes.buffers)?;
        let is_made = self.is_made();
        if is_made {
            self.generate_groups(groups, touched)?;
        }
        self.restart(is_made);
        Ok(())
    }

    /// Copies shared particles and the pool of textures from another renderer and generates the
    /// others; does nothing if that renderer has not drawn yet.
    fn adopt(
        &mut self,
        from: &mut Renderer,
        groups: &[Group],
        shared: &[SharedRange],
        touched: &[usize],
    ) -> Result<()> {
        if !from.is_made() {
            return Ok(());
        }
        let (old, new) = (&from.passes.buffers, &self.passes.buffers);
        let is_textured = self.passes.features.is_textured;
        let runs = |record_bytes: usize| -> Vec<[u64; 3]> {
            let bytes = |n: u32| u64::from(n) * record_bytes as u64;
            shared.iter().map(|s| [s.i_old, s.i_new, s.n].map(bytes)).collect()
        };
        self.host.run(|rec| {
            let particles = runs(size_of::<ParticleRecord>());
            rec.copy_runs(&old.particles, &new.particles, &particles);
            rec.copy_runs(&old.status, &new.status, &runs(size_of::<u32>()));
            if is_textured {
                rec.copy(&old.pool, &new.pool);
            }
            Ok(())
        })?;
        self.generate_groups(groups, touched)?;
        self.skipping.is_made = true;
        Ok(())
    }

    /// Generates the particles of `touched` groups alone.
    fn generate_groups(&mut self, groups: &[Group], touched: &[usize]) -> Result<()> {
        let (generate, b) = (&self.passes.generate, &self.passes.buffers);
        let buffers = [&b.boxes, &b.i_group, &b.particles, &b.status];
        let ranges = particle_ranges(groups, touched);
        self.host.run(|rec| {
            ranges.iter().try_for_each(|range| generate.record(rec, buffers, *range, MAX_ATTEMPTS))
        })?;
        Ok(())
    }

    /// Returns every particle relative to its group.
    fn particles_at_rest(&mut self, device: &Device) -> Result<Vec<ParticleRecord>> {
        if self.is_made() { self.particles(device) } else { Ok(self.generate_now(device)?.0) }
    }
}

/// Returns first and number of the particles of `touched` groups; contiguous ranges are merged.
fn particle_ranges(groups: &[Group], touched: &[usize]) -> Vec<[u32; 2]> {
    let mut ranges: Vec<[u32; 2]> = vec![];
    for group in touched.iter().map(|i| &groups[*i]).filter(|g| g.n_particles > 0) {
        match ranges.last_mut() {
            Some([first, n]) if *first + *n == group.i_first => *n += group.n_particles,
            _ => ranges.push([group.i_first, group.n_particles]),
        }
    }
    ranges
}

/// Returns the ranges of particles that two scenes share: those of untouched boxes with the same
/// index in the same cloud.
fn shared_ranges(
    (old, old_groups): (&[Cloud], &[Group]),
    (new, groups): (&[Cloud], &[Group]),
    touched: &[usize],
) -> Vec<SharedRange> {
    let mut shared: Vec<SharedRange> = vec![];
    let (mut i_old, mut i_new) = (0, 0);
    for (was, cloud) in old.iter().zip(new) {
        let (n_old, n_new) = (was.n_groups() as usize, cloud.n_groups() as usize);
        let n_both = match cloud.source {
            CloudSource::Boxes { .. } => n_old.min(n_new),
            _ => 0,
        };
        for i in (0..n_both).filter(|i| touched.binary_search(&(i_new + i)).is_err()) {
            let (old_group, group) = (&old_groups[i_old + i], &groups[i_new + i]);
            let range = SharedRange {
                i_old: old_group.i_first,
                i_new: group.i_first,
                n: old_group.n_particles.min(group.n_particles),
            };
            match shared.last_mut() {
                Some(s) if (s.i_old + s.n, s.i_new + s.n) == (range.i_old, range.i_new) => {
                    s.n += range.n
                }
                _ => shared.push(range),
            }
        }
        (i_old, i_new) = (i_old + n_old, i_new + n_new);
    }
    shared
}

/// Returns whether two scenes are the same except for titles, boxes, and seeds of clouds made from
/// boxes.
fn differs_in_boxes_alone(a: &Scene, b: &Scene) -> bool {
    let mut b = Scene { title: a.title.clone(), ..b.clone() };
    for (cloud, of) in b.clouds.iter_mut().zip(&a.clouds) {
        if let (CloudSource::Boxes { boxes, .. }, CloudSource::Boxes { boxes: of_a, .. }) =
            (&mut cloud.source, &of.source)
        {
            boxes.clone_from(of_a);
            cloud.seed = of.seed;
        }
    }
    *a == b
}

#[cfg(test)]
mod tests;
