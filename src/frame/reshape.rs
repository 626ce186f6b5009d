//! A player's scene with other boxes: only particles that follow from what has changed are
//! generated.

use std::sync::Arc;

use super::buffers::{Buffers, box_records, textured_records, upload};
use super::limits;
use super::render::Renderer;
use super::stage::{Bed, Player};
use super::tiling::is_thin;
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Device, MemoryUsage};
use crate::layout::particle::ParticleRecord;
use crate::model::boxes::MAX_ATTEMPTS;
use crate::model::cloud::{Cloud, CloudSource, Group};
use crate::model::scene::{Scene, Simulate};

/// What became of a player's buffers and pipelines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reshaped {
    /// They are those that were there.
    InPlace,
    /// Boxes have other numbers of particles, or there are more or fewer of them: made anew, and
    /// particles that are the same were copied.
    Anew,
}

/// A run of particles: its first there, its first here, and how many they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Kept {
    there: u32,
    here: u32,
    n: u32,
}

impl Player {
    /// Goes on with `scene`, which is as the player's but for boxes and seeds of clouds that are
    /// made from boxes; what its `draw` says was settled when the player was made. `touched`:
    /// numbers of `scene`'s groups, rising, whose particles follow from something that changed; all
    /// others are taken to be as they were relative to their boxes' centres. The next frame is like
    /// a first one, but that nothing is generated in it; a [`Renderer::reset`] before it takes that
    /// back. To be called between runs. An error leaves the player as it was, but where the device
    /// fails.
    pub fn reshape(
        &mut self,
        bed: &Bed,
        scene: impl Into<Arc<Scene>>,
        touched: &[usize],
    ) -> Result<Reshaped> {
        let mut scene: Arc<Scene> = scene.into();
        if scene.draw != self.scene.draw {
            Arc::make_mut(&mut scene).draw = self.scene.draw;
        }
        if !differs_in_boxes_alone(&self.scene, &scene) {
            return Err(Error::usage(
                "only boxes and seeds may differ from the scene that is played",
            ));
        }
        self.renderer.check_ready()?;
        let groups = scene.groups();
        if !touched.is_sorted() || touched.iter().any(|i| *i >= groups.len()) {
            return Err(Error::usage(format!(
                "expected rising numbers of groups below {}",
                groups.len()
            )));
        }
        limits::check(&scene, bed.device.limits())?;
        let old_groups = self.scene.groups();
        let is_same_size = old_groups.len() == groups.len()
            && old_groups
                .iter()
                .zip(&groups)
                .all(|(a, b)| (a.i_cloud, a.n_particles) == (b.i_cloud, b.n_particles));
        let reshaped = if is_same_size && is_thin(&self.scene) == is_thin(&scene) {
            self.renderer.make_room(&bed.device, &scene)?;
            self.renderer.reshape(&bed.device, &scene, &groups, touched)?;
            Reshaped::InPlace
        } else {
            let mut renderer =
                Renderer::new(&bed.device, bed.compiler(), &scene, self.renderer.traits.skip)?;
            renderer.traits.keeps_made = self.renderer.traits.keeps_made;
            let kept = kept((&self.scene.clouds, &old_groups), (&scene.clouds, &groups), touched);
            renderer.adopt(&mut self.renderer, &groups, (&kept, touched))?;
            self.renderer = renderer;
            Reshaped::Anew
        };
        let rest = match scene.threads.simulate {
            Simulate::Gpu => None,
            Simulate::Cpu => Some(self.renderer.at_rest(&bed.device)?),
        };
        self.game.replay(scene.clone(), rest);
        self.scene = scene;
        Ok(reshaped)
    }
}

impl Renderer {
    /// No frame is in flight and none has failed.
    fn check_ready(&self) -> Result<()> {
        match self.failed {
            true => {
                Err(Error::usage("a frame has failed: what the device holds is not known any more"))
            }
            false => self.check_alone(),
        }
    }

    /// Whether the particles of boxes lie there, and the pool of textures.
    fn is_made(&self) -> bool {
        self.last.is_some() || self.traits.made
    }

    /// Boxes that move may give the density grid other proportions, and with them more cells.
    fn make_room(&mut self, device: &Device, scene: &Scene) -> Result<()> {
        let n = limits::n_cells_max(scene);
        if n <= self.grid.room() {
            return Ok(());
        }
        // A drag goes on as it began: twice as many, so that few of its steps come here; a cube has
        // room for any.
        let side = u64::from(scene.lighting.grid);
        let n = (2 * n).min(side * side * side).max(n);
        let density = Buffer::new::<f32>(device, "grid.density", n, MemoryUsage::Device)?;
        self.grid.make_room(device, n)?;
        self.buffers.density = density;
        Ok(())
    }

    fn reshape(
        &mut self,
        device: &Device,
        scene: &Scene,
        groups: &[Group],
        touched: &[usize],
    ) -> Result<()> {
        // Until all of it has gone well nobody knows whose particles lie there.
        self.failed = true;
        upload(device, &mut self.host, &box_records(scene, groups), &self.buffers.boxes)?;
        if self.traits.textured {
            upload(
                device,
                &mut self.host,
                &textured_records(scene, groups),
                &self.buffers.textured,
            )?;
        }
        let is_made = self.is_made();
        if is_made {
            self.generate_runs(groups, touched)?;
        }
        (self.last, self.traits.made, self.failed) = (None, is_made, false);
        Ok(())
    }

    /// Takes what is the same from another renderer's buffers, and generates the rest; nothing
    /// where that has none yet.
    fn adopt(
        &mut self,
        from: &mut Renderer,
        groups: &[Group],
        (kept, touched): (&[Kept], &[usize]),
    ) -> Result<()> {
        if !from.is_made() {
            return Ok(());
        }
        let (old, new) = (&from.buffers, &self.buffers);
        let pairs: [fn(&Buffers) -> &Buffer; 2] = [|b| &b.particles, |b| &b.status];
        let of_record = [size_of::<ParticleRecord>() as u64, size_of::<u32>() as u64];
        self.host.run(|rec| {
            for (buffer, bytes) in pairs.iter().zip(of_record) {
                let run = |k: &Kept| [k.there, k.here, k.n].map(|n| u64::from(n) * bytes);
                rec.copy_runs(buffer(old), buffer(new), &kept.iter().map(run).collect::<Vec<_>>());
            }
            if self.traits.textured {
                rec.copy(&old.pool, &new.pool);
            }
            Ok(())
        })?;
        self.generate_runs(groups, touched)?;
        self.traits.made = true;
        Ok(())
    }

    /// Generates the particles of `touched` groups alone.
    fn generate_runs(&mut self, groups: &[Group], touched: &[usize]) -> Result<()> {
        let (generate, b) = (&self.generate, &self.buffers);
        let buffers = [&b.boxes, &b.i_group, &b.particles, &b.status];
        let runs = runs(groups, touched);
        self.host.run(|rec| {
            runs.iter().try_for_each(|run| generate.record_run(rec, buffers, *run, MAX_ATTEMPTS))
        })?;
        Ok(())
    }

    /// Every particle relative to its group.
    fn at_rest(&mut self, device: &Device) -> Result<Vec<ParticleRecord>> {
        if self.is_made() { self.particles(device) } else { Ok(self.generate_now(device)?.0) }
    }
}

/// First and number of the particles of `touched` groups, of neighbours together.
fn runs(groups: &[Group], touched: &[usize]) -> Vec<[u32; 2]> {
    let mut runs: Vec<[u32; 2]> = vec![];
    for group in touched.iter().map(|i| &groups[*i]).filter(|g| g.n_particles > 0) {
        match runs.last_mut() {
            Some([first, n]) if *first + *n == group.i_first => *n += group.n_particles,
            _ => runs.push([group.i_first, group.n_particles]),
        }
    }
    runs
}

/// What particles of boxes `new` has of `old`: those of boxes with the same number in the same
/// cloud that are not touched.
fn kept(
    (old, old_groups): (&[Cloud], &[Group]),
    (new, groups): (&[Cloud], &[Group]),
    touched: &[usize],
) -> Vec<Kept> {
    let mut kept: Vec<Kept> = vec![];
    let (mut i_there, mut i_here) = (0, 0);
    for (was, cloud) in old.iter().zip(new) {
        let (n_there, n_here) = (was.n_groups() as usize, cloud.n_groups() as usize);
        if matches!(cloud.source, CloudSource::Boxes { .. }) {
            for i in
                (0..n_there.min(n_here)).filter(|i| touched.binary_search(&(i_here + i)).is_err())
            {
                let (there, here) = (&old_groups[i_there + i], &groups[i_here + i]);
                let run = Kept {
                    there: there.i_first,
                    here: here.i_first,
                    n: there.n_particles.min(here.n_particles),
                };
                match kept.last_mut() {
                    Some(k) if k.there + k.n == run.there && k.here + k.n == run.here => {
                        k.n += run.n
                    }
                    _ => kept.push(run),
                }
            }
        }
        (i_there, i_here) = (i_there + n_there, i_here + n_here);
    }
    kept
}

/// Whether all but boxes and seeds of clouds that are made from boxes is the same, and all of their
/// `draw` that says what is drawn.
fn differs_in_boxes_alone(a: &Scene, b: &Scene) -> bool {
    let Scene {
        title: _,
        film,
        camera,
        time,
        lighting,
        draw,
        threads,
        lights,
        materials,
        surfaces,
        terrains,
        clouds,
        air,
    } = a;
    (film, camera, time, lighting, draw, threads)
        == (&b.film, &b.camera, &b.time, &b.lighting, &b.draw, &b.threads)
        && (lights, materials, surfaces, terrains, air)
            == (&b.lights, &b.materials, &b.surfaces, &b.terrains, &b.air)
        && clouds.len() == b.clouds.len()
        && clouds.iter().zip(&b.clouds).all(|(a, b)| is_same_but_for_boxes(a, b))
}

fn is_same_but_for_boxes(a: &Cloud, b: &Cloud) -> bool {
    let Cloud { source, position, wind, gust, growth, texture, i_material, facing, seed } = a;
    let same_source = match (source, &b.source) {
        (CloudSource::Boxes { boxes: _, law }, CloudSource::Boxes { boxes: _, law: b_law }) => {
            law == b_law
        }
        (source, b_source) => source == b_source && *seed == b.seed,
    };
    same_source
        && (position, wind, gust, growth) == (&b.position, &b.wind, &b.gust, &b.growth)
        && (texture, i_material, facing) == (&b.texture, &b.i_material, &b.facing)
}

#[cfg(test)]
mod tests;
