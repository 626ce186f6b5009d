//! Width of the keys that particles are sorted by (passes.md "sort").

/// Bits of the sort key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SortBits {
    /// 16 if such keys resolve the depths that matter, else 32.
    Auto,
    /// 16 bits.
    Narrow,
    /// 32 bits.
    Wide,
}

/// Greatest step of a 16-bit key, as a share of σ. The order of two blobs whose centres are closer
/// is only a convention of thin sprites.
const SORT_STEP: f64 = 1.0 / 64.0;

impl SortBits {
    /// Returns the number of bits; `None` if it depends on the scene.
    pub fn number(self) -> Option<u32> {
        match self {
            SortBits::Auto => None,
            SortBits::Narrow => Some(16),
            SortBits::Wide => Some(32),
        }
    }

    /// Returns 16 or 32 for depths within ± `radius` and groups whose mean σ is at least `sigma`.
    pub fn of(self, radius: f64, sigma: f64) -> u32 {
        match self {
            SortBits::Narrow => 16,
            SortBits::Auto if 2.0 * radius / 65536.0 <= SORT_STEP * sigma => 16,
            _ => 32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn narrow_keys_are_taken_where_a_step_is_short_against_sigma() {
        // A step is 2 radius/65536: 1/64 of sigma = 1 at radius 512.
        let bits = |radius| SortBits::Auto.of(radius, 1.0);
        assert_eq!([bits(0.0), bits(512.0), bits(512.1), bits(f64::INFINITY)], [16, 16, 32, 32]);
        assert_eq!(SortBits::Auto.of(512.0, 0.9), 32);
        assert_eq!(SortBits::Auto.of(f64::NAN, 1.0), 32);
        assert_eq!([SortBits::Narrow.of(1e9, 1.0), SortBits::Wide.of(0.0, 1.0)], [16, 32]);
    }
}
