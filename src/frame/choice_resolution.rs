//! What `draw.resolution = "auto"` takes: the scene's first frame is drawn in every size, timed, and compared with the
//! picture at full size.

use std::time::Instant;

use super::culling::record_sort;
use super::ms;
use super::packet::Packet;
use super::readback::floats;
use super::render::Renderer;
use crate::error::Result;
use crate::model::resolution::Resolution;

/// Timed turns of each size; before them one that is not, in which a driver may compile.
const N_TURNS: usize = 3;

/// One size: the median of its times, ms of device time (of wall time without timestamps), for surfaces, blobs and what
/// puts them together; and how far its picture is from that of full size, root mean square over all pixels of premultiplied
/// linear red, green, blue and alpha.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tried {
    pub resolution: Resolution,
    pub ms: f64,
    pub rmse: f64,
}

/// The fastest size whose picture is near enough.
#[derive(Debug, Clone, PartialEq)]
pub struct SizeChoice {
    pub resolution: Resolution,
    pub tried: Vec<Tried>,
    /// What was near enough.
    pub error: f64,
}

impl SizeChoice {
    /// `tried` begins with the full size.
    pub fn of(tried: Vec<Tried>, error: f64) -> SizeChoice {
        let near = tried.iter().filter(|t| t.rmse <= error);
        let taken = near.min_by(|a, b| a.ms.total_cmp(&b.ms)).map_or(Resolution::Full, |t| t.resolution);
        SizeChoice { resolution: taken, tried, error }
    }

    /// As users are told.
    pub fn text(&self) -> String {
        let of = |t: &Tried| match t.resolution {
            Resolution::Full => format!("{} takes {:.2} ms", t.resolution.name(), t.ms),
            _ => format!("{} takes {:.2} ms with an RMSE of {:.2e}", t.resolution.name(), t.ms, t.rmse),
        };
        let all: Vec<String> = self.tried.iter().map(of).collect();
        let (taken, error) = (self.resolution.name(), self.error);
        format!(
            "draw.resolution = \"auto\" took {taken} (draw.error {error:.2e}): at the first frame {}",
            all.join(", ")
        )
    }
}

impl Renderer {
    /// Draws `packet`'s frame in every size, and from now on in the fastest one that differs from the full one by `error` at
    /// most. What the others need is given back. The next frame is like a first one.
    pub fn choose_resolution(&mut self, packet: &Packet, error: f64) -> Result<SizeChoice> {
        self.step(packet.clone())?;
        let mut full = Vec::new();
        let mut tried = Vec::new();
        for resolution in self.drawing.resolutions() {
            self.drawing.take(resolution);
            self.keep_and_sort(packet)?;
            let ms = self.time_size(packet)?;
            let picture = self.drawn_now()?;
            if full.is_empty() {
                full.clone_from(&picture);
            }
            tried.push(Tried { resolution, ms, rmse: rmse(&picture, &full) });
        }
        let choice = SizeChoice::of(tried, error);
        self.drawing.take(choice.resolution);
        self.drawing.keep_taken();
        self.traits.shrunk = choice.resolution != Resolution::Full;
        self.reset();
        Ok(choice)
    }

    /// What is kept depends on the picture that it is drawn into.
    fn keep_and_sort(&mut self, packet: &Packet) -> Result<()> {
        let Renderer { host, drawing, buffers: b, settings: s, culling, sort, .. } = self;
        let Some(culling) = culling else { return Ok(()) };
        host.run(|rec| {
            culling.record(rec, b, (packet, drawing), s)?;
            record_sort(rec, sort, b, packet, s)
        })?;
        Ok(())
    }

    /// Draws what is sorted, with all that belongs to its picture, several times; the median of the times, ms.
    fn time_size(&mut self, packet: &Packet) -> Result<f64> {
        let Renderer { host, drawing, buffers, settings, traits, .. } = self;
        let mut times = Vec::new();
        for i in 0..=N_TURNS {
            let begin = Instant::now();
            let draw = |rec: &mut crate::gpu::Recorder<'_>| {
                rec.scope("draw", |rec| drawing.record_all(rec, traits.path, buffers, packet, settings))
            };
            let scopes = host.run(draw)?;
            if i > 0 {
                times.push(scopes.first().map_or(ms(begin, Instant::now()), |scope| scope.ms()));
            }
        }
        times.sort_by(f64::total_cmp);
        Ok(times[times.len() / 2])
    }

    /// The picture that was just drawn outside of a frame.
    fn drawn_now(&mut self) -> Result<Vec<f32>> {
        let Renderer { host, drawing, readback, traits, settings, .. } = self;
        host.run(|rec| {
            drawing.record_read(rec, traits.path, drawing.i_picture(), readback);
            Ok(())
        })?;
        Ok(floats(settings.format, readback.read(settings.n_bytes() as usize)?))
    }
}

/// Infinite where a number is none.
fn rmse(a: &[f32], b: &[f32]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
    let rmse = (sum / a.len().max(1) as f64).sqrt();
    if rmse.is_nan() { f64::INFINITY } else { rmse }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fastest_that_is_near_enough_is_taken_and_all_are_told() {
        let of = |resolution, ms, rmse| Tried { resolution, ms, rmse };
        let tried = |half_ms| {
            let half = of(Resolution::Half, half_ms, 1e-4);
            vec![of(Resolution::Full, 4.0, 0.0), half, of(Resolution::Quarter, 0.5, 2e-3)]
        };
        let choice = SizeChoice::of(tried(1.0), 1e-3);
        assert_eq!(choice.resolution, Resolution::Half);
        let text = "draw.resolution = \"auto\" took 0.5 (draw.error 1.00e-3): at the first frame 1.0 takes 4.00 ms, \
                    0.5 takes 1.00 ms with an RMSE of 1.00e-4, 0.25 takes 0.50 ms with an RMSE of 2.00e-3";
        assert_eq!(choice.text(), text);
        assert_eq!(SizeChoice::of(tried(5.0), 1e-3).resolution, Resolution::Full);
        assert_eq!(SizeChoice::of(tried(1.0), 1e-2).resolution, Resolution::Quarter);
        assert_eq!(SizeChoice::of(tried(1.0), 0.0).resolution, Resolution::Full);
        // Half of two numbers is off by 0.2: sqrt(0.04/2).
        assert!((rmse(&[1.0, 0.2], &[1.0, 0.0]) - 0.02f64.sqrt()).abs() < 1e-8);
        assert_eq!(rmse(&[f32::NAN], &[0.0]), f64::INFINITY);
    }
}
