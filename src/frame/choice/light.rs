//! The choice of `lighting.mode = "auto"`: the rungs of [`RUNGS`] are timed on the scene's first
//! frame, and the nearest to transport that the budget allows is taken.

use std::sync::Arc;

use super::knobs::toml_name;
use crate::error::{Error, Result};
use crate::frame::sides::open_sides;
use crate::gpu::{Compiler, Device};
use crate::model::scene::{LightBudget, Lighting, LightingMode, RUNGS, Rung, Scene};

/// Timed frames of each rung; the least time counts, which is that on an idle device.
const N_FRAMES: u32 = 3;

/// The light that "auto" took.
#[derive(Debug, Clone, PartialEq)]
pub struct LightChoice {
    /// Place of the rung in [`RUNGS`].
    pub taken: usize,
    /// Error of each rung against transport, as the scene is drawn.
    pub errors: Vec<f64>,
    /// Device time of a frame by rung, ms; `None` where it was not needed or does not fit.
    pub times_ms: Vec<Option<f64>>,
    /// The same of "first", where no budget was given.
    pub first_ms: Option<f64>,
    /// The budget.
    pub budget: LightBudget,
}

impl LightChoice {
    /// Returns the choice as a sentence for users.
    pub fn text(&self) -> String {
        let budget = [
            self.first_ms.map(|ms| format!("\"first\" takes {ms:.2} ms")),
            self.budget.ms.map(|ms| format!("lighting.budget_ms {ms}")),
            self.budget.error.map(|error| format!("lighting.budget_error {error}")),
        ];
        let budget: Vec<String> = budget.into_iter().flatten().collect();
        let of = |i: usize| {
            let ms = self.times_ms[i]?;
            Some(format!("{} takes {ms:.2} ms (error {})", name(&RUNGS[i]), self.errors[i]))
        };
        let missed = self.budget.error.is_some_and(|most| self.errors[self.taken] > most);
        let missed = if missed { ", an error that none in time has" } else { "" };
        let times: Vec<String> = (0..RUNGS.len()).filter_map(of).collect();
        let of_times = if times.is_empty() { "" } else { ": a frame with " };
        let limits = match budget.is_empty() {
            true => String::new(),
            false => format!(" ({}{missed})", budget.join(", ")),
        };
        format!(
            "lighting.mode = \"auto\" took {}{limits}{of_times}{}",
            name(&RUNGS[self.taken]),
            times.join(", ")
        )
    }

    /// Returns the rung that the budget allows, by the times: of those with at most its error the
    /// fastest; without one, the nearest to transport that takes at most `limit_ms`. Where none
    /// fits, the fastest.
    fn allowed(&self, limit_ms: Option<f64>) -> usize {
        let all = || self.times_ms.iter().enumerate().filter_map(|(i, ms)| Some((i, (*ms)?)));
        let fits = |ms: f64| limit_ms.is_none_or(|limit| ms <= limit);
        let fastest = |of: &dyn Fn((usize, f64)) -> bool| {
            let fast = all().filter(|of_rung| of(*of_rung)).min_by(|a, b| a.1.total_cmp(&b.1));
            fast.map(|(i, _)| i)
        };
        let near = self
            .budget
            .error
            .and_then(|most| fastest(&|(i, ms)| self.errors[i] <= most && fits(ms)));
        let nearest = || {
            let in_time = all().filter(|(_, ms)| fits(*ms)).map(|(i, _)| i);
            in_time.min_by(|i, j| self.errors[*i].total_cmp(&self.errors[*j]))
        };
        near.or_else(nearest).or_else(|| fastest(&|_| true)).unwrap_or(RUNGS.len() - 1)
    }
}

fn name(rung: &Rung) -> String {
    let mode = toml_name(&LightingMode::NAMES, rung.mode);
    let bounces = match rung.bounces {
        0 => String::new(),
        1 => ", 1 bounce".to_owned(),
        n => format!(", {n} bounces"),
    };
    format!("{mode} ({} cells{bounces})", rung.grid)
}

/// Returns `scene` with the rung that its budget allows in place of "auto", and the choice.
///
/// # Errors
/// Fails if a frame cannot be drawn, other than by exceeding a limit of the device.
pub(in crate::frame) fn choose_light(
    device: &Device,
    compiler: &Compiler,
    scene: Arc<Scene>,
) -> Result<(Arc<Scene>, Option<LightChoice>)> {
    if scene.lighting.mode != LightingMode::Auto {
        return Ok((scene, None));
    }
    if scene.n_particles() == 0 {
        return Ok((Arc::new(scene.lit().into_owned()), None));
    }
    let LightBudget { ms, error } = scene.lighting.budget;
    let mut choice = LightChoice {
        taken: RUNGS.len() - 1,
        errors: RUNGS.iter().map(|rung| scene.error_of(rung)).collect(),
        times_ms: vec![None; RUNGS.len()],
        first_ms: None,
        budget: scene.lighting.budget,
    };
    let time = |scene: Scene| frame_ms(device, compiler, scene);
    if ms.is_none() && error.is_none() {
        // As fast as the paper's sprites.
        let plain = scene.on(&RUNGS[0]);
        let lighting = Lighting { mode: LightingMode::First, ..scene.lighting };
        choice.first_ms = time(Scene { lighting, ..plain })?;
    }
    let limit_ms = ms.or(choice.first_ms);
    let nearest = choice.errors.iter().copied().fold(f64::INFINITY, f64::min);
    // Others serve where none of those within the error is in time.
    let is_needed = |of: f64| limit_ms.is_some() || error.is_none_or(|most| of <= most);
    for (i, rung) in RUNGS.iter().enumerate() {
        if !is_needed(choice.errors[i]) && choice.errors[i] > nearest {
            continue;
        }
        let ms = time(scene.on(rung))?;
        choice.times_ms[i] = ms;
        // The next ones take longer.
        if ms.zip(limit_ms).is_some_and(|(ms, limit)| ms > 2.0 * limit) {
            break;
        }
    }
    choice.taken = choice.allowed(limit_ms);
    Ok((Arc::new(scene.on(&RUNGS[choice.taken])), Some(choice)))
}

/// Returns the least device time of a scene's first frame, ms, as if everything moved; wall time
/// without timestamps. `None` if it does not fit the device.
fn frame_ms(device: &Device, compiler: &Compiler, scene: Scene) -> Result<Option<f64>> {
    let scene = Arc::new(Scene { draw: scene.draw.exact(), ..scene });
    let (mut renderer, mut game) = match open_sides(device, compiler, &scene, true) {
        Err(Error::Limit { .. }) => return Ok(None),
        opened => opened?,
    };
    renderer.move_all();
    let mut least = f64::INFINITY;
    // The first frame makes particles and textures.
    for i in 0..=N_FRAMES {
        let done = renderer.step(game.step(0)?)?;
        let of_passes: f64 = done.passes.iter().map(|p| p.ms()).sum();
        let ms = if done.passes.is_empty() { done.wait_ms } else { of_passes };
        least = if i > 0 { least.min(ms) } else { least };
    }
    Ok(Some(least))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choice(times_ms: Vec<Option<f64>>, error: Option<f64>) -> LightChoice {
        let errors = RUNGS.iter().map(|rung| rung.errors[1]).collect();
        let budget = LightBudget { ms: None, error };
        LightChoice { taken: 0, errors, times_ms, first_ms: None, budget }
    }

    #[test]
    fn the_nearest_in_time_or_the_fastest_near_enough_is_taken() {
        let n = RUNGS.len();
        let times: Vec<Option<f64>> = (0..n).map(|i| Some(1.0 + i as f64)).collect();
        let allowed = |times: &[Option<f64>], limit_ms, error| {
            choice(times.to_vec(), error).allowed(limit_ms)
        };
        let middle = Some(RUNGS[2].errors[1]);
        assert_eq!(allowed(&times, Some(3.5), None), 2);
        assert_eq!(allowed(&times, None, middle), 2);
        assert_eq!(allowed(&times, Some(100.0), middle), 2);
        // Nearer than asked for is taken only where it does not cost more.
        let mut even = times.clone();
        even[3] = Some(2.5);
        assert_eq!(allowed(&even, None, middle), 3);
        // An error that no rung in time has: the nearest in time. A time that none has: the
        // fastest.
        assert_eq!(allowed(&times, Some(2.5), middle), 1);
        assert_eq!(allowed(&times, Some(0.5), None), 0);
        // Nearness counts, and not the place: thin sprites lose with bounces in some scenes.
        let mut thin = choice(times.clone(), None);
        thin.errors[4] = 0.01;
        assert_eq!((thin.allowed(None), thin.allowed(Some(4.5))), (4, 3));
        assert_eq!(allowed(&times, None, Some(1e-9)), n - 1);
        // A rung that does not fit the device is not taken.
        let mut few = times;
        few[2] = None;
        assert_eq!(allowed(&few, Some(3.5), None), 1);
        assert_eq!(allowed(&vec![None; n], Some(1.0), None), n - 1);
    }

    #[test]
    fn a_choice_is_told_with_its_times_and_its_budget() {
        let mut times_ms = vec![None; RUNGS.len()];
        (times_ms[0], times_ms[4]) = (Some(1.234), Some(5.0));
        let budget = LightBudget { ms: Some(4.0), error: None };
        let of = LightChoice { budget, ..choice(times_ms, None) };
        let [first, fifth] = [0, 4].map(|i| format!("(error {})", RUNGS[i].errors[1]));
        let (cells, fifth_cells) = (RUNGS[0].grid, RUNGS[4].grid);
        assert_eq!(
            of.text(),
            format!(
                "lighting.mode = \"auto\" took \"similarity\" ({cells} cells) (lighting.budget_ms \
                 4): a frame with \"similarity\" ({cells} cells) takes 1.23 ms {first}, \
                 \"diffusion\" ({fifth_cells} cells, 2 bounces) takes 5.00 ms {fifth}"
            )
        );
    }
}
