//! Which frame of a scene is shown: playing, paused, stepped, sought.

/// A scene's frames run in a circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Playback {
    /// The frame that is asked for next.
    i_frame: u32,
    n_frames: u32,
    is_paused: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Plays on, or stops.
    Toggle,
    /// So many frames on, or back; pauses.
    Step(i32),
    /// Plays or pauses as before from that frame on.
    Seek(u32),
}

impl Playback {
    /// From the first of `n_frames`.
    pub fn new(n_frames: u32) -> Playback {
        Playback { i_frame: 0, n_frames: n_frames.max(1), is_paused: false }
    }

    /// The same of another number of frames.
    pub fn among(self, n_frames: u32) -> Playback {
        let n_frames = n_frames.max(1);
        Playback { i_frame: self.i_frame % n_frames, n_frames, ..self }
    }

    pub fn is_paused(&self) -> bool {
        self.is_paused
    }

    pub fn n_frames(&self) -> u32 {
        self.n_frames
    }

    pub fn i_frame(&self) -> u32 {
        self.i_frame
    }

    pub fn after(self, action: Action) -> Playback {
        match action {
            Action::Toggle => Playback { is_paused: !self.is_paused, ..self },
            Action::Step(n) => {
                Playback { i_frame: self.around(i64::from(n)), is_paused: true, ..self }
            }
            Action::Seek(i_frame) => Playback { i_frame: i_frame % self.n_frames, ..self },
        }
    }

    /// The frame to draw now, and what is asked for after it.
    pub fn next(self) -> (u32, Playback) {
        let after =
            if self.is_paused { self } else { Playback { i_frame: self.around(1), ..self } };
        (self.i_frame, after)
    }

    fn around(&self, n: i64) -> u32 {
        // Within the number of frames, which fits.
        (i64::from(self.i_frame) + n).rem_euclid(i64::from(self.n_frames)) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(mut p: Playback, n: usize) -> (Vec<u32>, Playback) {
        let mut frames = vec![];
        for _ in 0..n {
            let (i, next) = p.next();
            frames.push(i);
            p = next;
        }
        (frames, p)
    }

    #[test]
    fn frames_run_in_a_circle_until_somebody_stops_them() {
        let (frames, p) = shown(Playback::new(3), 5);
        assert_eq!(frames, [0, 1, 2, 0, 1]);
        let paused = p.after(Action::Toggle);
        assert_eq!(shown(paused, 3).0, [2, 2, 2]);
        assert_eq!(shown(paused.after(Action::Step(1)), 2).0, [0, 0]);
        assert_eq!(shown(paused.after(Action::Step(-3)), 1).0, [2]);
        assert_eq!(shown(paused.after(Action::Toggle), 2).0, [2, 0]);
        // Who steps pauses; who seeks goes on.
        assert!(Playback::new(3).after(Action::Step(1)).is_paused());
        assert_eq!(shown(p.after(Action::Seek(4)), 2).0, [1, 2]);
        assert_eq!(shown(Playback::new(0), 2).0, [0, 0]);
        assert_eq!(Playback::new(u32::MAX).after(Action::Step(-1)).i_frame(), u32::MAX - 1);
    }
}
