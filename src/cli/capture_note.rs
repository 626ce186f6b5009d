//! The message about a frame that `--capture` asked for.

use crate::gpu::Captured;
use crate::io::console::say;

/// Prints where RenderDoc's capture is, or that there is none; nothing if no frame was asked for.
pub fn print(captured: Option<Captured>, frame: Option<u32>, is_quiet: bool) {
    let Some(frame) = frame else { return };
    match captured {
        Some(captured) if captured.is_done => {
            if !is_quiet {
                say!("{}", captured.text());
            }
        }
        // A failure is told with --quiet, too: what was asked for is missing.
        Some(captured) => say!("warning: {}", captured.text()),
        None => say!("warning: frame {frame} was not drawn, so that nothing is captured"),
    }
}
