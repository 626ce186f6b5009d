//! The limit of a reference picture's memory, checked before anything is allocated for it.

use crate::error::{Error, Result};

/// Most memory of a reference's pixels, bytes: 2 GiB less the memory of a scene and the program
/// itself.
const MOST_BYTES: u64 = 1600 << 20;
/// Most particles of a reference, which take 5 GiB.
const MOST_PARTICLES: u64 = 1 << 24;
/// Bytes of a pixel: colours, errors, depths and the picture's copies, as measured.
const PIXEL_BYTES: u64 = 256;
/// Bytes of a pixel in each of the partial sums of its samples ([`super::SampleSums`]).
const SUM_BYTES: u64 = 56;
/// Bytes of a particle and its facet, and of its row in a table, as measured.
const PARTICLE_BYTES: u64 = 320;

/// Checks that a reference at `n_pixels` with `n_samples` each, of a scene of `n_particles`, fits
/// in memory.
///
/// # Errors
/// Fails if it does not; the error says what it takes and what would fit.
pub fn check_memory(n_pixels: u64, n_samples: u32, n_particles: u64) -> Result<()> {
    check_sums(n_pixels, n_samples, n_particles, SUM_BYTES)
}

/// Checks the same of partial sums that have `sum_bytes` bytes for each pixel.
pub(super) fn check_sums(
    n_pixels: u64,
    n_samples: u32,
    n_particles: u64,
    sum_bytes: u64,
) -> Result<()> {
    // Sums are joined in pairs, so that there is one for each binary digit of the number.
    let n_sums = if n_samples > 1 { u64::from(n_samples.ilog2()) + 1 } else { 0 };
    let of_pixels = n_pixels.saturating_mul(PIXEL_BYTES + n_sums * sum_bytes);
    if n_particles > MOST_PARTICLES {
        return Err(Error::limit(format!(
            "a reference of {n_particles} particles takes {} MiB, the limit is {} MiB; expected \
             fewer particles",
            n_particles.saturating_mul(PARTICLE_BYTES) >> 20,
            (MOST_PARTICLES * PARTICLE_BYTES) >> 20
        )));
    }
    if of_pixels > MOST_BYTES {
        return Err(Error::limit(format!(
            "a reference of {n_pixels} pixels, {n_samples} samples each, takes {} MiB, the limit \
             is {} MiB; expected fewer pixels (--size, --pixels, --tile) or samples",
            of_pixels >> 20,
            MOST_BYTES >> 20
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_no_memory_holds_are_refused() {
        assert!(check_memory(1920 * 1080, 1 << 6, 100_000).is_ok());
        assert!(check_memory(500, 1, 10_000_000).is_ok());
        for (pixels, samples, particles) in
            [(1 << 28, 1, 0), (1 << 22, 1 << 20, 0), (1, 1, u64::MAX), (u64::MAX, 1, u64::MAX)]
        {
            let error = check_memory(pixels, samples, particles).unwrap_err();
            assert_eq!(error.exit_code(), 2, "{error}");
        }
    }
}
