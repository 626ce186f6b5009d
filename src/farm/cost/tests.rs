use super::*;
use crate::measure::random::{SplitMix64, normal};

const TRUTH: CostModel = CostModel {
    setup_s: Some(2.0),
    step_s: Some(0.01),
    particle_step_s: Some(1e-7),
    cell_s: Some(6e-9),
    pixel_sample_s: Some(4e-9),
    facet_pair_s: Some(3e-10),
    texture_s: Some(0.05),
};

fn work(particle_steps: f64, pixel_samples: f64, facet_pairs: f64) -> Work {
    Work { particle_steps, pixel_samples, facet_pairs, ..Work::default() }
}

/// What TRUTH says of some work, times `noise`.
fn timed(work: Work, noise: f64) -> Timed {
    Timed { setups: 1.0, work, seconds: TRUTH.seconds(1.0, &work).unwrap() * noise }
}

/// Work over three decades of each, as a study of scenes has; times are off by a lognormal with
/// this sd.
fn runs(seed: u64, n: usize, sd: f64) -> Vec<Timed> {
    let random = &mut SplitMix64(seed);
    let mut amounts =
        |middle: f64| normal(random, n).iter().map(|z| middle * z.exp()).collect::<Vec<f64>>();
    let (steps, particles, pixels, pairs) =
        (amounts(300.0), amounts(1e8), amounts(2e9), amounts(3e10));
    let (cells, textures) = (amounts(1e9), amounts(40.0));
    let noise: Vec<f64> = normal(random, n).iter().map(|z| (sd * z).exp()).collect();
    let of = |i: usize| Work {
        steps: steps[i],
        cells: cells[i],
        textures: textures[i],
        ..work(particles[i], pixels[i], pairs[i])
    };
    (0..n).map(|i| timed(of(i), noise[i])).collect()
}

#[test]
fn work_adds_up_and_is_multiplied() {
    assert_eq!(work(1.0, 2.0, 3.0) + work(10.0, 20.0, 30.0) * 0.5, work(6.0, 12.0, 18.0));
}

#[test]
fn seconds_by_hand() {
    // 3 · 2 + 1e8 · 1e-7 + 1e9 · 4e-9 + 1e10 · 3e-10 = 6 + 10 + 4 + 3, and 200 · 0.01 + 20 · 0.05 +
    // 1e9 · 6e-9 = 9.
    let rest = Work { steps: 200.0, cells: 1e9, textures: 20.0, ..work(1e8, 1e9, 1e10) };
    let seconds = TRUTH.seconds(3.0, &rest).unwrap();
    assert!((seconds - 32.0).abs() < 1e-13, "{seconds}");
}

#[test]
fn exact_times_give_the_coefficients_back() {
    let fit = fit(&runs(1, 12, 0.0)).unwrap();
    for (fitted, truth) in fit.model.each_s().into_iter().zip(TRUTH.each_s()) {
        assert!((fitted.unwrap() / truth.unwrap() - 1.0).abs() < 1e-11, "{fitted:?} for {truth:?}");
    }
    assert!(fit.largest_relative_error < 1e-12 && fit.left_out_median.unwrap() < 1e-10, "{fit:?}");
    assert_eq!((fit.n, fit.n_left_out, fit.not_told_apart.len()), (12, 12, 0));
}

#[test]
fn two_rows_by_hand() {
    // 1 set-up takes 2 s, 1 set-up and 1e6 particle steps 3 s: 2 s and 1e-6 s.
    let row = |particle_steps, seconds| Timed {
        setups: 1.0,
        work: work(particle_steps, 0.0, 0.0),
        seconds,
    };
    let fit = fit(&[row(0.0, 2.0), row(1e6, 3.0)]).unwrap();
    assert!((fit.model.setup_s.unwrap() - 2.0).abs() < 1e-14);
    assert!((fit.model.particle_step_s.unwrap() - 1e-6).abs() < 1e-20);
    // Without the second, particle steps are not measured; without the first, one row is for two
    // terms.
    assert_eq!((fit.left_out_median, fit.n_left_out), (None, 0));
}

#[test]
fn relative_errors_are_what_is_least() {
    // Only set-ups, 1 s and 4 s: Σ (c/t − 1)² is least at c = Σ 1/t / Σ 1/t² = 1.25/1.0625 = 20/17,
    // not at the mean.
    let row = |seconds| Timed { setups: 1.0, work: Work::default(), seconds };
    let fit = fit(&[row(1.0), row(4.0)]).unwrap();
    assert!((fit.model.setup_s.unwrap() - 20.0 / 17.0).abs() < 1e-14);
    // 3/17 and (68 − 20)/68 = 12/17; their median is 15/34. Each by the other: 4/1 − 1 and 3/4,
    // median 15/8.
    assert!((fit.largest_relative_error - 12.0 / 17.0).abs() < 1e-14);
    assert!((fit.median_relative_error - 15.0 / 34.0).abs() < 1e-14);
    assert!((fit.left_out_median.unwrap() - 15.0 / 8.0).abs() < 1e-14);
}

#[test]
fn noisy_runs_predict_work_that_was_not_seen() {
    // A tenth of noise: the median of |e^{0.1 z} − 1| is 0.067 and, where the fit adds its own, no
    // more than half as much again with 35 runs for seven coefficients; the aim is 0.25.
    for seed in 0..20 {
        let fit = fit(&runs(100 + seed, 35, 0.1)).unwrap();
        let unseen = runs(200 + seed, 200, 0.1);
        let pair = |row: &Timed| (fit.model.seconds(1.0, &row.work).unwrap(), row.seconds);
        let compared = Compared::of(&unseen.iter().map(pair).collect::<Vec<_>>()).unwrap();
        assert!(compared.median < 0.11 && compared.n == 200, "{compared:?}");
        // The median of 35 has a standard error of about a sixth of it.
        assert!(
            (fit.left_out_median.unwrap() - compared.median).abs() < 0.1,
            "{fit:?}\n{compared:?}"
        );
        assert!(fit.median_relative_error <= fit.largest_relative_error);
    }
}

#[test]
fn coefficients_never_are_negative() {
    // Half the noise of the signal, and a term that takes no time.
    for seed in 0..200 {
        let fit = fit(&runs(300 + seed, 7, 0.5)).unwrap();
        assert!(fit.model.check().is_ok(), "{fit:?}");
        assert!(fit.median_relative_error.is_finite());
    }
}

#[test]
fn what_was_not_measured_is_not_predicted() {
    let rows: Vec<Timed> =
        (1..=4).map(|i| timed(work(1e8 * f64::from(i), 0.0, 0.0), 1.0)).collect();
    let model = fit(&rows).unwrap().model;
    assert_eq!((model.pixel_sample_s, model.facet_pair_s), (None, None));
    assert!(model.seconds(1.0, &work(1e8, 0.0, 0.0)).is_ok());
    let message = model.seconds(1.0, &work(1e8, 5.0, 0.0)).unwrap_err();
    assert!(message.contains("the cost of pixel samples was not measured"), "{message}");
    // And is not in the file, and back.
    let text = serde_json::to_string(&model).unwrap();
    assert!(!text.contains("pixel_sample_s"), "{text}");
    assert_eq!(serde_json::from_str::<CostModel>(&text).unwrap(), model);
    assert!(serde_json::from_str::<CostModel>(r#"{"setup_s": 1.0, "facets_s": 2.0}"#).is_err());
}

#[test]
fn terms_that_grow_together_are_named() {
    // Every run starts once and draws the same picture.
    let rows: Vec<Timed> =
        (1..=5).map(|i| timed(work(1e8 * f64::from(i), 1e9, 0.0), 1.0)).collect();
    let fit = fit(&rows).unwrap();
    assert_eq!(fit.not_told_apart, ["setups", "pixel samples"]);
    // Together they are what they are: 2 s + 1e9 · 4e-9 s.
    let together = fit.model.seconds(1.0, &work(0.0, 1e9, 0.0)).unwrap();
    assert!((together - 6.0).abs() < 1e-11, "{together}");
}

#[test]
fn bad_rows_are_refused_with_what_was_expected() {
    let good = timed(work(1e8, 1e9, 0.0), 1.0);
    let message = |rows: &[Timed]| fit(rows).unwrap_err();
    for seconds in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let text = message(&[good, Timed { seconds, ..good }]);
        assert!(
            text.contains("run 2") && text.contains("expected a finite time above 0"),
            "{text}"
        );
    }
    for amount in [-1.0, f64::NAN, f64::INFINITY] {
        let text = message(&[Timed { work: work(1.0, amount, 0.0), ..good }]);
        assert!(text.contains("pixel samples, expected a finite number from 0"), "{text}");
    }
    let text = message(&[good, good]);
    assert!(
        text.contains("2 runs, expected at least 3: one for each of setups, particle steps, pixel"),
        "{text}"
    );
    assert!(message(&[]).contains("0 runs have nothing in them"));
    assert!(
        message(&[Timed { setups: 0.0, work: Work::default(), seconds: 1.0 }])
            .contains("nothing in them")
    );
}

#[test]
fn a_model_from_a_file_is_checked() {
    assert!(TRUTH.check().is_ok());
    assert!(CostModel::default().check().unwrap_err().contains("expected one at least"));
    for bad in [-1e-9, f64::NAN, f64::INFINITY] {
        let model = CostModel { facet_pair_s: Some(bad), ..TRUTH };
        assert!(model.check().unwrap_err().contains("the cost of facet pairs"), "{bad}");
    }
    assert!(TRUTH.seconds(f64::NAN, &Work::default()).unwrap_err().contains("NaN setups"));
}

#[test]
fn errors_compared_by_hand() {
    assert_eq!(relative_error(3.0, 4.0), 0.25);
    // 0.1, 0.2, 0.3, 0.4, 0.5 in some order; p90 lies at position 3.6.
    let pairs = [(12.0, 10.0), (5.0, 10.0), (13.0, 10.0), (9.0, 10.0), (14.0, 10.0), (1.0, 0.0)];
    let compared = Compared::of(&pairs).unwrap();
    assert_eq!((compared.n, compared.n_not_finite, compared.largest), (5, 1, 0.5));
    assert!(
        (compared.median - 0.3).abs() < 1e-15 && (compared.p90 - 0.46).abs() < 1e-15,
        "{compared:?}"
    );
    assert_eq!(Compared::of(&[(1.0, 0.0)]), None);
}
