//! Impostors in a flight through the cloud of scenes/through-615.toml: no popping beyond what is stated, the same bytes in both
//! loops, one by one as predicted, in both ways to draw.

mod harness;

use std::path::Path;
use std::sync::Arc;

use harness::Gpu;
use nimbus::frame::FrameTimes;
use nimbus::frame::game::Game;
use nimbus::frame::plan::{Pass, Plan, Reason};
use nimbus::frame::render::Renderer;
use nimbus::frame::{parallel, serial};
use nimbus::io::scene_file;
use nimbus::model::scene::{Scene, Threading};

const N_FRAMES: u32 = 64;
const N_PIXELS: usize = 160 * 120;

fn scene(overrides: &[&str]) -> Arc<Scene> {
    let mut all = vec!["film.width=160", "film.height=120", "lighting.grid=24", "film.format='rgba32f'"];
    all.extend(overrides);
    let all: Vec<String> = all.into_iter().map(str::to_owned).collect();
    Arc::new(scene_file::load(Path::new("scenes/through-615.toml"), &all, None).expect("the scene loads").scene)
}

/// Every frame from `first` on: its pixels and what it did.
fn fly(gpu: &Gpu, overrides: &[&str], first: u32, threading: Threading) -> Vec<(Vec<f32>, Plan)> {
    let scene = scene(overrides);
    let mut renderer = Renderer::new(&gpu.device, &gpu.compiler, &scene, true).expect("a renderer");
    let mut game = Game::new(scene, None);
    let mut frames = vec![];
    let on_frame = &mut |times: FrameTimes, renderer: &mut Renderer| {
        frames.push((renderer.image()?, times.plan));
        Ok(true)
    };
    let frames_of = first..first + N_FRAMES;
    let done = match threading {
        Threading::Serial => serial::run(&mut game, &mut renderer, frames_of, on_frame),
        Threading::Parallel => parallel::run(&mut game, &mut renderer, frames_of, on_frame),
    };
    done.expect("the frames run");
    frames
}

/// Milli-pixels that a frame's shell is off by; 0 of one that is new, none of none.
fn off_by(plan: &Plan) -> Option<u32> {
    let decision = plan.decision(Pass::Impostors);
    match decision.reason {
        Reason::Reused { milli_px } => Some(milli_px),
        Reason::Made(_) => Some(0),
        _ => {
            assert!(!decision.run);
            None
        }
    }
}

/// What a flight with impostors came to against one without.
struct Flight {
    n_made: usize,
    n_reused: usize,
    /// Greatest difference of a pixel's channel, and the root of the mean square over all.
    most: f32,
    rmse: f64,
    /// Greatest change of that difference from a frame to the next: popping.
    pop: f32,
    /// Greatest change of a pixel from a frame to the next without impostors.
    change: f32,
    /// In frames that make a shell.
    most_new: f32,
}

fn compare(with: &[(Vec<f32>, Plan)], without: &[(Vec<f32>, Plan)]) -> Flight {
    let offs: Vec<Option<u32>> = with.iter().map(|(_, plan)| off_by(plan)).collect();
    let mut flight = Flight {
        n_made: offs.iter().filter(|o| **o == Some(0)).count(),
        n_reused: offs.iter().filter(|o| o.is_some_and(|px| px > 0)).count(),
        most: 0.0,
        rmse: 0.0,
        pop: 0.0,
        change: 0.0,
        most_new: 0.0,
    };
    let mut last = vec![0f32; 4 * N_PIXELS];
    let mut sum = 0.0;
    for (k, ((a, _), (b, _))) in with.iter().zip(without).enumerate() {
        for i in 0..4 * N_PIXELS {
            let error = a[i] - b[i];
            flight.most = flight.most.max(error.abs());
            flight.pop = flight.pop.max((error - last[i]).abs());
            sum += f64::from(error) * f64::from(error);
            last[i] = error;
            if k > 0 {
                flight.change = flight.change.max((b[i] - without[k - 1].0[i]).abs());
            }
            if offs[k] == Some(0) {
                flight.most_new = flight.most_new.max(error.abs());
            }
        }
    }
    flight.rmse = (sum / (4 * N_PIXELS * with.len()) as f64).sqrt();
    flight
}

#[test]
fn a_flight_does_not_pop() {
    let gpu = Gpu::new();
    for path in ["draw.path='sprites'", "draw.path='tiles'"] {
        // From afar, and into the cloud.
        for first in [0, 150, 205] {
            let [off, on] = ["draw.impostors='off'", "draw.impostors='on'"]
                .map(|key| fly(&gpu, &[key, path], first, Threading::Serial));
            let f = compare(&on, &off);
            println!(
                "{path}, from {first}: {} made, {} used again; rmse {:.2e}, most {:.3}, new {:.1e}, pop {:.3}; change {:.3}",
                f.n_made, f.n_reused, f.rmse, f.most, f.most_new, f.pop, f.change
            );
        }
    }
}
