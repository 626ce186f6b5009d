//! Pseudo-random numbers for resampling and for random orders.

/// The generator of Steele, Lea and Flood 2014.
pub(crate) struct SplitMix64(pub(crate) u64);

impl SplitMix64 {
    /// Returns a generator whose numbers depend on all of `parts`.
    pub(crate) fn of<const N: usize>(parts: [u64; N]) -> SplitMix64 {
        parts.into_iter().fold(SplitMix64(0), |mut random, part| {
            random.0 ^= part;
            SplitMix64(random.next())
        })
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a uniform number in [0, n), the high half of a product; its bias is below n / 2⁶⁴.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.next()) * n as u128) >> 64) as usize
    }

    /// Brings `items` into a random order (Fisher and Yates 1938).
    pub(crate) fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}

#[cfg(test)]
impl SplitMix64 {
    /// Returns a uniform number in [0, 1).
    fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a standard normal number (Box and Muller 1958).
    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// Returns standard normal values.
#[cfg(test)]
pub(crate) fn normal(random: &mut SplitMix64, n: usize) -> Vec<f64> {
    (0..n).map(|_| random.normal()).collect()
}

/// Returns realistic frame times: about `median`, lognormal with standard deviation `sd` of the
/// logarithm under a first-order autoregression with coefficient `rho`; one frame in twenty is late
/// by an exponential tenth on average. (Late frames raise the median by 0.1 `sd`.)
#[cfg(test)]
pub(crate) fn frame_times(
    random: &mut SplitMix64,
    n: usize,
    median: f64,
    sd: f64,
    rho: f64,
) -> Vec<f64> {
    const LATE_SHARE: f64 = 0.05;
    const LATE_BY: f64 = 0.1;
    let mut state = random.normal();
    let mut next = || {
        state = rho * state + (1.0 - rho * rho).sqrt() * random.normal();
        let is_late = random.uniform() < LATE_SHARE;
        let late_by = if is_late { -LATE_BY * (1.0 - random.uniform()).ln() } else { 0.0 };
        median * (sd * state).exp() * (1.0 + late_by)
    };
    (0..n).map(|_| next()).collect()
}

/// Returns the times of a block, about 1: those of [`frame_times`] times a factor of the block,
/// lognormal with standard deviation `of_block` of the logarithm.
#[cfg(test)]
pub(crate) fn block_times(
    random: &mut SplitMix64,
    n: usize,
    sd: f64,
    rho: f64,
    of_block: f64,
) -> Vec<f64> {
    let median = (of_block * random.normal()).exp();
    frame_times(random, n, median, sd, rho)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splitmix_gives_the_published_sequence() {
        // The first outputs for seed 1234567 (Rosetta Code, "Pseudo-random numbers/Splitmix64").
        let mut random = SplitMix64(1_234_567);
        assert_eq!(random.next(), 6_457_827_717_110_365_317);
        assert_eq!(random.next(), 3_203_168_211_198_807_973);
    }
}
