//! Frames that fail, panic or are stopped leave nothing behind.

use super::*;

#[test]
fn an_error_of_the_game_step_ends_both_loops() {
    let gpu = Gpu::new();
    // From the second frame on the camera stands in its target.
    let mut broken = scene(&["time.step_s=1"]);
    broken.camera.keys[1].target = broken.camera.keys[1].position;
    let broken = Arc::new(broken);
    for threading in [Threading::Serial, Threading::Parallel] {
        let mut renderer =
            Renderer::new(&gpu.device, &gpu.compiler, &broken, true).expect("a renderer");
        let mut game = Game::new(broken.clone(), None);
        let mut n = 0;
        let on_frame = &mut |_: FrameTimes, _: &mut Renderer| {
            n += 1;
            Ok(true)
        };
        let done = match threading {
            Threading::Serial => serial::run(&mut game, &mut renderer, 0..u32::MAX, on_frame),
            Threading::Parallel => parallel::run(&mut game, &mut renderer, 0..u32::MAX, on_frame),
        };
        assert_eq!((done.expect_err("the error comes through").exit_code(), n), (2, 1));
    }
}

#[test]
fn a_packet_without_the_places_that_the_game_thread_computes_is_refused() {
    let gpu = Gpu::new();
    let scene = Arc::new(scene(&["threads.simulate=cpu"]));
    let mut renderer = Renderer::new(&gpu.device, &gpu.compiler, &scene, true).expect("a renderer");
    let packet = Game::new(scene.clone(), None).step(0).expect("a packet");
    let error = renderer.step(packet).map(|_| ()).expect_err("no places").to_string();
    assert!(error.contains("a packet without places of particles"), "{error}");
}

#[test]
fn a_panic_of_the_game_thread_ends_both_sides_with_what_it_said() {
    let gpu = Gpu::new();
    let scene = Arc::new(scene(&["threads.simulate=cpu"]));
    let mut renderer = Renderer::new(&gpu.device, &gpu.compiler, &scene, true).expect("a renderer");
    // Fewer particles than the scene has.
    let mut game = Game::new(scene.clone(), Some(vec![]));
    let done = parallel::run(&mut game, &mut renderer, 0..10, &mut |_, _| Ok(true))
        .expect_err("the panic comes through");
    assert!(
        done.exit_code() == 101 && done.to_string().contains("the game thread panicked: range end"),
        "{done}"
    );
}

#[test]
fn a_parallel_run_that_is_stopped_leaves_nothing_in_flight() {
    let gpu = Gpu::new();
    let (mut renderer, mut game) = started(&gpu, &[]);
    let mut seen = vec![];
    let on_frame = &mut |times: FrameTimes, _: &mut Renderer| {
        seen.push(times.i_frame);
        Ok(times.i_frame < 4)
    };
    parallel::run(&mut game, &mut renderer, 0..u32::MAX, on_frame).expect("a run");
    assert_eq!(seen, [0, 1, 2, 3, 4]);
    // Two may be in flight, and a third is refused.
    let mut begin = |i| renderer.begin(game.step(i).expect("a packet")).map(|_| ());
    assert!(begin(5).is_ok() && begin(6).is_ok() && begin(7).is_err());
}

#[test]
fn after_a_frame_that_failed_no_other_is_drawn_on_what_it_left() {
    let gpu = Gpu::new();
    let (mut renderer, mut game) = started(&gpu, &[]);
    let mut packet = game.step(0).expect("a packet");
    // More than there is room for.
    packet.lights = packet.lights.repeat(3);
    assert!(renderer.step(packet).is_err());
    let refused =
        renderer.step(game.step(1).expect("a packet")).map(|_| ()).expect_err("it is refused");
    assert!(refused.to_string().contains("a frame has failed"), "{refused}");
}
