//! Playback position in a scene: playing, paused, stepped or sought.

/// A position among a scene's frames, which repeat in a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Playback {
    /// The frame that is drawn next.
    i_frame: u32,
    n_frames: u32,
    is_paused: bool,
}

/// A change of the playback position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seek {
    /// Pauses or plays.
    TogglePause,
    /// Moves by a number of frames, and pauses.
    By(i32),
    /// Jumps to a frame; playback stays paused or running.
    To(u32),
}

impl Playback {
    /// Starts at the first of `n_frames` frames.
    pub fn new(n_frames: u32) -> Playback {
        Playback { i_frame: 0, n_frames: n_frames.max(1), is_paused: false }
    }

    /// Returns this position in a scene of `n_frames` frames.
    pub fn with_n_frames(self, n_frames: u32) -> Playback {
        let n_frames = n_frames.max(1);
        Playback { i_frame: self.i_frame % n_frames, n_frames, ..self }
    }

    /// Returns whether the same frame is drawn again and again.
    pub fn is_paused(&self) -> bool {
        self.is_paused
    }

    /// Returns the number of frames, at least 1.
    pub fn n_frames(&self) -> u32 {
        self.n_frames
    }

    /// Returns the frame that is drawn next.
    pub fn i_frame(&self) -> u32 {
        self.i_frame
    }

    /// Returns the position after `seek`.
    pub fn after(self, seek: Seek) -> Playback {
        match seek {
            Seek::TogglePause => Playback { is_paused: !self.is_paused, ..self },
            Seek::By(n) => Playback { i_frame: self.offset(n), is_paused: true, ..self },
            Seek::To(i_frame) => Playback { i_frame: i_frame % self.n_frames, ..self },
        }
    }

    /// Returns the frame to draw now, and moves on unless paused.
    pub fn next_frame(&mut self) -> u32 {
        let i_frame = self.i_frame;
        if !self.is_paused {
            self.i_frame = self.offset(1);
        }
        i_frame
    }

    fn offset(&self, n: i32) -> u32 {
        // The remainder is below n_frames, so it fits.
        (i64::from(self.i_frame) + i64::from(n)).rem_euclid(i64::from(self.n_frames)) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(p: &mut Playback, n: usize) -> Vec<u32> {
        (0..n).map(|_| p.next_frame()).collect()
    }

    #[test]
    fn frames_loop_until_paused() {
        let mut p = Playback::new(3);
        assert_eq!(frames(&mut p, 5), [0, 1, 2, 0, 1]);
        let mut paused = p.after(Seek::TogglePause);
        assert_eq!(frames(&mut paused, 3), [2, 2, 2]);
        assert_eq!(paused.after(Seek::By(1)).next_frame(), 0);
        assert_eq!(paused.after(Seek::By(-3)).next_frame(), 2);
        assert_eq!(frames(&mut paused.after(Seek::TogglePause), 2), [2, 0]);
        assert!(Playback::new(3).after(Seek::By(1)).is_paused());
        assert_eq!(frames(&mut p.after(Seek::To(4)), 2), [1, 2]);
        assert_eq!(frames(&mut Playback::new(0), 2), [0, 0]);
        assert_eq!(Playback::new(u32::MAX).after(Seek::By(-1)).i_frame(), u32::MAX - 1);
    }
}
