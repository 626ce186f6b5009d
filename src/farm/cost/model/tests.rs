use super::*;
use crate::measure::random::{SplitMix64, normal};

/// Set-up, step, particle step, cell, pixel sample, facet pair and texture.
const TRUTH: CostModel =
    CostModel([Some(2.0), Some(0.01), Some(1e-7), Some(6e-9), Some(4e-9), Some(3e-10), Some(0.05)]);

fn work(particle_steps: f64, pixel_samples: f64, facet_pairs: f64) -> Amounts {
    Amounts { particle_steps, pixel_samples, facet_pairs, ..Amounts::default() }
}

/// A run that takes what `TRUTH` predicts, times `noise`.
fn timed(work: Amounts, noise: f64) -> TimedRun {
    TimedRun { setups: 1.0, work, seconds: TRUTH.seconds(1.0, &work).unwrap() * noise }
}

/// Runs whose amounts span three decades each, as in a study of scenes. The logarithms of their
/// times are off by a normal error of this standard deviation.
fn runs(seed: u64, n: usize, sd: f64) -> Vec<TimedRun> {
    let random = &mut SplitMix64(seed);
    let mut amounts =
        |middle: f64| normal(random, n).iter().map(|z| middle * z.exp()).collect::<Vec<f64>>();
    let (steps, particles, pixels, pairs) =
        (amounts(300.0), amounts(1e8), amounts(2e9), amounts(3e10));
    let (cells, textures) = (amounts(1e9), amounts(40.0));
    let noise: Vec<f64> = normal(random, n).iter().map(|z| (sd * z).exp()).collect();
    let of = |i: usize| Amounts {
        steps: steps[i],
        cells: cells[i],
        textures: textures[i],
        ..work(particles[i], pixels[i], pairs[i])
    };
    (0..n).map(|i| timed(of(i), noise[i])).collect()
}

#[test]
fn amounts_are_added_and_multiplied() {
    assert_eq!(work(1.0, 2.0, 3.0) + work(10.0, 20.0, 30.0) * 0.5, work(6.0, 12.0, 18.0));
}

#[test]
fn seconds_are_the_sum_over_all_terms() {
    // 3 · 2 + 1e8 · 1e-7 + 1e9 · 4e-9 + 1e10 · 3e-10 = 6 + 10 + 4 + 3, and 200 · 0.01 + 20 · 0.05 +
    // 1e9 · 6e-9 = 9.
    let rest = Amounts { steps: 200.0, cells: 1e9, textures: 20.0, ..work(1e8, 1e9, 1e10) };
    let seconds = TRUTH.seconds(3.0, &rest).unwrap();
    assert!((seconds - 32.0).abs() < 1e-13, "{seconds}");
}

#[test]
fn coefficients_are_found_again_from_exact_times() {
    let fit = fit(&runs(1, 12, 0.0)).unwrap();
    for (fitted, truth) in fit.model.0.into_iter().zip(TRUTH.0) {
        assert!((fitted.unwrap() / truth.unwrap() - 1.0).abs() < 1e-11, "{fitted:?} for {truth:?}");
    }
    assert!(fit.largest_relative_error < 1e-12 && fit.left_out_median.unwrap() < 1e-10, "{fit:?}");
    assert_eq!((fit.n, fit.n_left_out, fit.not_told_apart.len()), (12, 12, 0));
}

#[test]
fn two_runs_determine_two_terms() {
    // 1 set-up takes 2 s, 1 set-up and 1e6 particle steps 3 s: 2 s and 1e-6 s.
    let row = |particle_steps, seconds| TimedRun {
        setups: 1.0,
        work: work(particle_steps, 0.0, 0.0),
        seconds,
    };
    let fit = fit(&[row(0.0, 2.0), row(1e6, 3.0)]).unwrap();
    assert!((fit.model.0[0].unwrap() - 2.0).abs() < 1e-14);
    assert!((fit.model.0[2].unwrap() - 1e-6).abs() < 1e-20);
    // Neither run can be predicted by the other: without the second, particle steps are unknown;
    // without the first, one run is left for two terms.
    assert_eq!((fit.left_out_median, fit.n_left_out), (None, 0));
}

#[test]
fn the_sum_of_squared_relative_errors_is_least() {
    // Only set-ups, 1 s and 4 s: Σ (c/t − 1)² is least at c = Σ 1/t / Σ 1/t² = 1.25/1.0625 = 20/17,
    // not at the mean.
    let row = |seconds| TimedRun { setups: 1.0, work: Amounts::default(), seconds };
    let fit = fit(&[row(1.0), row(4.0)]).unwrap();
    assert!((fit.model.0[0].unwrap() - 20.0 / 17.0).abs() < 1e-14);
    // 3/17 and (68 − 20)/68 = 12/17; their median is 15/34. Each by the other: 4/1 − 1 and 3/4,
    // median 15/8.
    assert!((fit.largest_relative_error - 12.0 / 17.0).abs() < 1e-14);
    assert!((fit.median_relative_error - 15.0 / 34.0).abs() < 1e-14);
    assert!((fit.left_out_median.unwrap() - 15.0 / 8.0).abs() < 1e-14);
}

#[test]
fn noisy_runs_predict_unseen_work() {
    // A tenth of noise: the median of |e^{0.1 z} − 1| is 0.067 and, where the fit adds its own, no
    // more than half as much again with 35 runs for seven coefficients; the aim is 0.25.
    for seed in 0..20 {
        let fit = fit(&runs(100 + seed, 35, 0.1)).unwrap();
        let unseen = runs(200 + seed, 200, 0.1);
        let pair = |row: &TimedRun| (fit.model.seconds(1.0, &row.work).unwrap(), row.seconds);
        let compared = ErrorSummary::new(&unseen.iter().map(pair).collect::<Vec<_>>()).unwrap();
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
fn coefficients_are_not_negative() {
    // Noise of half the signal.
    for seed in 0..200 {
        let fit = fit(&runs(300 + seed, 7, 0.5)).unwrap();
        assert!(fit.model.check().is_ok(), "{fit:?}");
        assert!(fit.median_relative_error.is_finite());
    }
}

#[test]
fn amounts_that_were_not_measured_are_not_predicted() {
    let rows: Vec<TimedRun> =
        (1..=4).map(|i| timed(work(1e8 * f64::from(i), 0.0, 0.0), 1.0)).collect();
    let model = fit(&rows).unwrap().model;
    assert_eq!((model.0[4], model.0[5]), (None, None));
    assert!(model.seconds(1.0, &work(1e8, 0.0, 0.0)).is_ok());
    let message = model.seconds(1.0, &work(1e8, 5.0, 0.0)).unwrap_err();
    assert!(message.contains("the cost of pixel samples was not measured"), "{message}");
    // A file has only the measured coefficients.
    let text = serde_json::to_string(&model).unwrap();
    assert!(!text.contains("pixel_sample_s"), "{text}");
    assert_eq!(serde_json::from_str::<CostModel>(&text).unwrap(), model);
    assert!(serde_json::from_str::<CostModel>(r#"{"setup_s": 1.0, "facets_s": 2.0}"#).is_err());
}

#[test]
fn terms_that_grow_together_are_named() {
    // Every run starts once and draws the same picture.
    let rows: Vec<TimedRun> =
        (1..=5).map(|i| timed(work(1e8 * f64::from(i), 1e9, 0.0), 1.0)).collect();
    let fit = fit(&rows).unwrap();
    assert_eq!(fit.not_told_apart, ["setups", "pixel samples"]);
    // Their sum is known: 2 s + 1e9 · 4e-9 s.
    let together = fit.model.seconds(1.0, &work(0.0, 1e9, 0.0)).unwrap();
    assert!((together - 6.0).abs() < 1e-11, "{together}");
}

#[test]
fn impossible_runs_are_refused() {
    let good = timed(work(1e8, 1e9, 0.0), 1.0);
    let message = |rows: &[TimedRun]| fit(rows).unwrap_err();
    for seconds in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let text = message(&[good, TimedRun { seconds, ..good }]);
        assert!(
            text.contains("run 2") && text.contains("expected a finite time above 0"),
            "{text}"
        );
    }
    for amount in [-1.0, f64::NAN, f64::INFINITY] {
        let text = message(&[TimedRun { work: work(1.0, amount, 0.0), ..good }]);
        assert!(text.contains("pixel samples, expected a finite number from 0"), "{text}");
    }
    let text = message(&[good, good]);
    assert!(
        text.contains("2 runs, expected at least 3: one for each of setups, particle steps, pixel"),
        "{text}"
    );
    assert!(message(&[]).contains("0 runs have nothing in them"));
    assert!(
        message(&[TimedRun { setups: 0.0, work: Amounts::default(), seconds: 1.0 }])
            .contains("nothing in them")
    );
}

#[test]
fn a_model_from_a_file_is_checked() {
    assert!(TRUTH.check().is_ok());
    assert!(CostModel::default().check().unwrap_err().contains("expected one at least"));
    for bad in [-1e-9, f64::NAN, f64::INFINITY] {
        let model = CostModel(std::array::from_fn(|i| if i == 5 { Some(bad) } else { TRUTH.0[i] }));
        assert!(model.check().unwrap_err().contains("the cost of facet pairs"), "{bad}");
    }
    assert!(TRUTH.seconds(f64::NAN, &Amounts::default()).unwrap_err().contains("NaN setups"));
}

#[test]
fn a_summary_has_median_percentile_and_maximum() {
    assert_eq!(relative_error(3.0, 4.0), 0.25);
    // 0.1, 0.2, 0.3, 0.4, 0.5 in some order; p90 lies at position 3.6.
    let pairs = [(12.0, 10.0), (5.0, 10.0), (13.0, 10.0), (9.0, 10.0), (14.0, 10.0), (1.0, 0.0)];
    let compared = ErrorSummary::new(&pairs).unwrap();
    assert_eq!((compared.n, compared.n_not_finite, compared.largest), (5, 1, 0.5));
    assert!(
        (compared.median - 0.3).abs() < 1e-15 && (compared.p90 - 0.46).abs() < 1e-15,
        "{compared:?}"
    );
    assert_eq!(ErrorSummary::new(&[(1.0, 0.0)]), None);
}
