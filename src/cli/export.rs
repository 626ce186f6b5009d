//! `nimbus export SCENE --mitsuba DIR`.

use std::fs;
use std::path::Path;

use serde_json::json;

use super::args::ExportArgs;
use super::progress::spinner;
use super::scene::{check_time, load, print_sizes};
use crate::error::{Error, Result};
use crate::inspect::mitsuba::{
    ALBEDO, EXTINCTION, Exported, GROUND, SCENE, SKY_PICTURE, export, spot_picture,
};
use crate::io::console::say;
use crate::io::image::{self, ImageKind};
use crate::io::result_folder::{Existing, ResultFolder};
use crate::model::film::Film;
use crate::reference::picture::ReferenceKind;

/// The record, which is written last.
const RECORD: &str = "mitsuba.json";

/// Runs `nimbus export`.
///
/// # Errors
/// Fails if the arguments or the scene are faulty, Mitsuba has not what the scene has, or a file
/// cannot be written.
pub fn run(args: &ExportArgs) -> Result<()> {
    let scene = load(&args.scene, &args.options)?.at_frame(args.frame);
    let time_s = scene.time.at(args.frame);
    check_time(&scene, time_s)?;
    let scene = &scene.exact().into_owned();
    ReferenceKind::Transport.check(scene, time_s)?;
    if args.options.verbose {
        print_sizes(scene, None);
    }
    let planned = [SCENE, EXTINCTION, ALBEDO, SKY_PICTURE, GROUND, RECORD].map(str::to_owned);
    let planned: Vec<String> =
        planned.into_iter().chain((0..scene.lights.len()).map(spot_picture)).collect();
    let existing = Existing::new(args.force);
    let mut folder = ResultFolder::open(&args.mitsuba, "mitsuba", existing, &planned)?;
    let waiting = spinner("filling the grid", args.options.quiet);
    let exported = export(scene, time_s, args.step, args.samples)?;
    write(&mut folder, args, &scene.film, &exported)?;
    drop(waiting);
    if !args.options.quiet {
        let n = exported.extinction.as_ref().map_or([0; 3], |grid| grid.n);
        let [x, y, z] = n;
        say!(
            "wrote {}: a grid of {x} x {y} x {z} cells of {:.4}",
            args.mitsuba.join(SCENE).display(),
            exported.step
        );
    }
    Ok(())
}

fn write(
    folder: &mut ResultFolder,
    args: &ExportArgs,
    film: &Film,
    exported: &Exported,
) -> Result<()> {
    let Exported { scene, extinction, albedo, sky, spots, ground, step } = exported;
    let bytes =
        |path: &Path, bytes: &[u8]| fs::write(path, bytes).map_err(|cause| Error::io(path, cause));
    folder.add(SCENE, |path| bytes(path, scene.as_bytes()))?;
    for (name, grid) in [(EXTINCTION, extinction), (ALBEDO, albedo)] {
        if let Some(grid) = grid {
            folder.add(name, |path| bytes(path, &grid.bytes()))?;
        }
    }
    let of_spots = spots.iter().enumerate().map(|(i, picture)| (spot_picture(i), picture));
    let pictures = sky.iter().map(|picture| (SKY_PICTURE.to_owned(), picture)).chain(of_spots);
    for (name, ([width, height], rgba)) in pictures {
        let picture = image::encoded(ImageKind::Exr, &(*film).into(), *width, *height, rgba)?;
        folder.add(&name, |path| bytes(path, &picture))?;
    }
    if let Some(ground) = ground {
        folder.add(GROUND, |path| bytes(path, ground.as_bytes()))?;
    }
    let record = json!({
        "scene": args.scene.display().to_string(), "frame": args.frame, "step": step,
        "cells": extinction.as_ref().map(|grid| grid.n),
    });
    folder.finish(&[RECORD], |at| bytes(&at.join(RECORD), format!("{record:#}\n").as_bytes()))
}
