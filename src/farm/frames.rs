//! The work of shards of frames: what `nimbus render` draws of each, to the byte.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::plan::{PictureFormat, Plan, Shard, Work, output};
use super::store::{Store, Workplace};
use crate::error::{Error, Result};
use crate::frame::{DeviceChoice, GpuContext, Player};
use crate::io::image::{ImageKind, encoded};
use crate::io::scene_file::LoadedScene;
use crate::model::scene::Scene;
use crate::timing::machine::{Device, device_record};

/// Draws the frames of `shard` that are not there yet, and tells of each; which device did.
pub fn draw(
    (store, plan, shard, loaded): (&Store, &Plan, &Shard, &LoadedScene),
    choice: &DeviceChoice,
    workplace: &mut Workplace,
    stop: &AtomicBool,
    on_frame: &dyn Fn(),
) -> Result<Device> {
    let Work::Frames { format, .. } = plan.work else {
        return Err(Error::usage("a plan of something else"));
    };
    let kind = match format {
        PictureFormat::Png => ImageKind::Png,
        PictureFormat::Exr => ImageKind::Exr,
    };
    let bed = GpuContext::open(choice)?;
    let device = device_record(bed.device.info());
    store.resume(workplace, plan, shard, &device)?;
    let mut playing: Option<(Arc<Scene>, Player)> = None;
    for i_frame in shard.items() {
        let name = output(i_frame, format);
        if !workplace.has(&name) {
            if stop.load(Ordering::Relaxed) {
                return Err(Error::Interrupted);
            }
            let (scene, player) = match playing.take() {
                // Without phases it is one scene throughout.
                Some((scene, player))
                    if loaded.phases.is_empty() || *scene == scene_at(loaded, i_frame) =>
                {
                    playing.insert((scene, player))
                }
                before => {
                    // What the last phase had on the device makes room first.
                    drop(before);
                    let scene = Arc::new(scene_at(loaded, i_frame));
                    playing.insert((scene.clone(), bed.player(scene, true)?))
                }
            };
            let packet = player.game.step(i_frame)?;
            player.renderer.step(packet)?;
            let (rgba, film) = (player.renderer.image()?, scene.film);
            workplace.add(&name, &encoded(kind, &film, film.width, film.height, &rgba)?)?;
        }
        on_frame();
    }
    drop(playing);
    // What the validation layers say comes here: pictures that it is about are drawn anew.
    bed.close().inspect_err(|_| workplace.disown())?;
    Ok(device)
}

/// As a frame has it. What "auto" takes may differ from one node to the next, and so would the
/// pictures.
fn scene_at(loaded: &LoadedScene, i_frame: u32) -> Scene {
    loaded.clone().at_frame(i_frame).exact().into_owned()
}
