//! How wide the keys are that particles are sorted by (docs/model.md §11 "sort").

/// Bits of the sort key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SortBits {
    /// 16 where they tell depths apart that matter, else 32.
    Auto,
    Narrow,
    Wide,
}

/// Keys of 16 bits do where a step of theirs is no more than this share of σ: which of two blobs
/// whose centres lie so close is the nearer one, sprites only say by convention.
const SORT_STEP: f64 = 1.0 / 64.0;

impl SortBits {
    /// The number, where it does not depend on the scene.
    pub fn number(self) -> Option<u32> {
        match self {
            SortBits::Auto => None,
            SortBits::Narrow => Some(16),
            SortBits::Wide => Some(32),
        }
    }

    /// 16 or 32, for depths within ± `radius` and blobs whose groups' mean σ is `sigma` at least.
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
