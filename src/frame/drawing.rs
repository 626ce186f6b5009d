//! The two ways to draw what is sorted, over the surfaces where there are any.

use super::buffers::Buffers;
use super::packet::Packet;
use super::render::Settings;
use super::tiling::Tiling;
use crate::error::Result;
use crate::gpu::{Recorder, Target};
use crate::passes::sprites::Sprites;
use crate::passes::tiles::View;

pub(super) fn draw_sprites(
    rec: &mut Recorder<'_>,
    sprites: &Sprites,
    b: &Buffers,
    on: Target<'_>,
    packet: &Packet,
    s: &Settings,
) -> Result<()> {
    let counts = [packet.n_drawn, s.n_surface_facets];
    sprites.record(rec, b.of_sprites(), on, &packet.camera, [s.cutoff, s.threshold], counts)
}

pub(super) fn draw_tiles(
    rec: &mut Recorder<'_>,
    tiling: &Tiling,
    i_target: usize,
    b: &Buffers,
    on: Target<'_>,
    packet: &Packet,
    s: &Settings,
) -> Result<()> {
    let Settings { cutoff, threshold, saturated, .. } = *s;
    let view = View { camera: &packet.camera, cutoff, threshold, saturated };
    let under = on.depth.is_some().then_some(on);
    tiling.record(rec, i_target, under, b.of_sprites(), &view, [packet.n_drawn, s.n_surface_facets])
}
