//! Properties of generated values, which are the same in every run.

use std::fmt::Debug;

use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestError, TestRng, TestRunner};

/// Checks a property for `cases` values. The first value that fails is reduced and fails the test.
pub fn check<S>(cases: u32, strategy: S, law: impl Fn(S::Value) -> Result<(), TestCaseError>)
where
    S: Strategy,
    S::Value: Debug,
{
    let config =
        Config { cases, failure_persistence: None, max_shrink_iters: 2000, ..Config::default() };
    let mut runner =
        TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    match runner.run(&strategy, law) {
        Ok(()) => {}
        Err(TestError::Fail(why, what)) => panic!("{why}\nfor {what:#?}"),
        Err(abort) => panic!("{abort}"),
    }
}
