//! A film clip, which ffmpeg encodes from the pictures as they are drawn.

use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use super::atomic::{Temporary, folder_of};
use crate::error::{Error, Result};

/// Name of the file within its temporary folder.
const FILE: &str = "clip.mp4";

/// A clip that is being written. Without [`Clip::finish`] nothing is left of it.
#[derive(Debug)]
pub struct Clip {
    encoder: Child,
    folder: Temporary,
    place: PathBuf,
    n_frames: u32,
}

impl Clip {
    /// Starts the encoder of a clip at `place`, of pictures of `size` pixels, `rate` a second.
    ///
    /// # Errors
    /// ffmpeg cannot be started, or no file can be written there.
    pub fn start(place: &Path, [width, height]: [u32; 2], rate: f64) -> Result<Clip> {
        let folder =
            Temporary::folder(folder_of(place), "clip").map_err(|cause| Error::io(place, cause))?;
        let mut command = Command::new("ffmpeg");
        command
            .args(["-hide_banner", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt"])
            .args(["rgb24", "-s", &format!("{width}x{height}"), "-r", &rate.to_string(), "-i", "-"])
            // Players want even sides and this layout of colours.
            .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", "-an"])
            .arg(folder.path.join(FILE))
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        // Ctrl-C ends nimbus, which then finishes the clip.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let encoder = command.spawn().map_err(|cause| match cause.kind() {
            ErrorKind::NotFound => Error::usage(format!(
                "{}: clips are encoded by ffmpeg, which is not in PATH; expected it there, or -o \
                 DIR for single pictures",
                place.display()
            )),
            _ => Error::Io { path: "ffmpeg".into(), what: cause.to_string() },
        })?;
        Ok(Clip { encoder, folder, place: place.to_owned(), n_frames: 0 })
    }

    /// Adds a picture: 8-bit sRGB, three bytes a pixel, row 0 at the top.
    ///
    /// # Errors
    /// The encoder has failed; the error has its message.
    pub fn add(&mut self, rgb: &[u8]) -> Result<()> {
        let written = match &mut self.encoder.stdin {
            Some(stdin) => stdin.write_all(rgb),
            None => Err(ErrorKind::BrokenPipe.into()),
        };
        if written.is_err() {
            return Err(self.failed());
        }
        self.n_frames += 1;
        Ok(())
    }

    /// Returns the number of pictures.
    pub fn n_frames(&self) -> u32 {
        self.n_frames
    }

    /// Ends the clip and puts it into its place.
    ///
    /// # Errors
    /// The encoder has failed, or the file cannot be moved.
    pub fn finish(mut self) -> Result<()> {
        drop(self.encoder.stdin.take());
        if !self.encoder.wait().is_ok_and(|status| status.success()) {
            return Err(self.failed());
        }
        std::fs::rename(self.folder.path.join(FILE), &self.place)
            .map_err(|cause| Error::io(&self.place, cause))
    }

    /// Returns what the encoder says of its failure.
    fn failed(&mut self) -> Error {
        drop(self.encoder.stdin.take());
        let mut text = String::new();
        if let Some(mut stderr) = self.encoder.stderr.take() {
            // Without a message its end alone is told.
            drop(stderr.read_to_string(&mut text));
        }
        let text = text.trim();
        let what = if text.is_empty() { "has ended before the clip was finished" } else { text };
        Error::Io { path: "ffmpeg".into(), what: what.to_owned() }
    }
}

impl Drop for Clip {
    fn drop(&mut self) {
        // Ended or not: neither process nor file is left.
        drop(self.encoder.kill());
        drop(self.encoder.wait());
    }
}
