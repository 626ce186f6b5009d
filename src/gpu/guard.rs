//! Guard bands: a pattern behind the end of every buffer, inside the range that shaders see.
//!
//! A shader that writes beyond its buffer breaks the pattern, which is looked for after each pass.
//! One that reads there gets NaN as a float and a number that is too great as an integer, so that
//! its picture differs from the one without guard bands. Without them most drivers drop such writes
//! and return zeros, and some overwrite other memory.

use std::collections::HashMap;
use std::slice;
use std::sync::{Mutex, MutexGuard, PoisonError};

use ash::vk;

use crate::error::{Error, Result};

/// Bytes of a band: some workgroups of 64 records of 16 to 80 bytes.
pub(super) const BAND_BYTES: u64 = 1 << 16;

/// The bytes of a word of the pattern, 0xFFC5A5C5. It is NaN as a float, and none of the words that
/// shaders write to say "none", 0 and 0xFFFFFFFF.
const PATTERN: [u8; 4] = [0xC5, 0xA5, 0xC5, 0xFF];

/// The buffers that have a band.
#[derive(Default)]
pub(super) struct Guards(Mutex<HashMap<vk::Buffer, Guarded>>);

/// The mapped bytes of a buffer, and its own length without the band.
struct Guarded {
    start: *mut u8,
    n_all: usize,
    n_own: usize,
    name: String,
}

// SAFETY: the pointer is to memory that is mapped until the buffer is dropped, whichever thread
// reads it.
unsafe impl Send for Guarded {}

impl Guards {
    fn lock(&self) -> MutexGuard<'_, HashMap<vk::Buffer, Guarded>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Fills a new buffer, of which the first `n_own` bytes are its content, and watches it until
    /// [`Guards::forget`].
    pub fn watch(&self, buffer: vk::Buffer, name: &str, mapped: &mut [u8], n_own: usize) {
        fill(mapped);
        let (start, n_all) = (mapped.as_mut_ptr(), mapped.len());
        self.lock().insert(buffer, Guarded { start, n_all, n_own, name: name.to_owned() });
    }

    /// Stops watching a buffer, before its memory is freed.
    pub fn forget(&self, buffer: vk::Buffer) {
        self.lock().remove(&buffer);
    }

    /// Checks all bands after the pass `pass` has ended.
    ///
    /// # Errors
    /// A band is broken. It is mended, so that the next pass is not blamed.
    pub fn check(&self, pass: &str) -> Result<()> {
        let guards = self.lock();
        let mut broken: Vec<String> = guards.values().filter_map(Guarded::mend).collect();
        broken.sort();
        match broken.is_empty() {
            true => Ok(()),
            false => Err(Error::Check {
                what: format!("pass {pass} wrote beyond the end of {}", broken.join(", ")),
            }),
        }
    }
}

impl Guarded {
    /// Restores the band; says what was written, if anything.
    fn mend(&self) -> Option<String> {
        // SAFETY: the memory is mapped, and large enough, until `forget`. The device has been
        // waited for, and the host writes no bytes beyond a buffer's own.
        let band = unsafe {
            slice::from_raw_parts_mut(self.start.add(self.n_own), self.n_all - self.n_own)
        };
        let is_broken = |(i, byte): (usize, &u8)| *byte != PATTERN[(self.n_own + i) % 4];
        // A whole band equals itself a word further. This is compared many bytes at a time, and
        // the tests look at thousands of bands.
        let (begin, rest) = band.split_at(PATTERN.len().min(band.len()));
        if !begin.iter().enumerate().any(is_broken) && rest == &band[..rest.len()] {
            return None;
        }
        let first = band.iter().enumerate().position(is_broken)?;
        let n = band.iter().enumerate().filter(|at| is_broken(*at)).count();
        let at = self.n_own + first;
        for (i, byte) in band.iter_mut().enumerate() {
            *byte = PATTERN[(self.n_own + i) % 4];
        }
        let Guarded { name, n_own, .. } = self;
        Some(format!("{name} ({n_own} bytes): {n} bytes changed, the first at {at}"))
    }
}

/// Fills memory with the pattern.
fn fill(bytes: &mut [u8]) {
    let n_begin = PATTERN.len().min(bytes.len());
    bytes[..n_begin].copy_from_slice(&PATTERN[..n_begin]);
    let mut n = n_begin;
    while n < bytes.len() {
        let more = n.min(bytes.len() - n);
        bytes.copy_within(..more, n);
        n += more;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ash::vk::Handle;

    #[test]
    fn a_broken_band_is_named_once_with_its_first_byte() {
        let (guards, buffer) = (Guards::default(), vk::Buffer::from_raw(1));
        let mut memory = vec![0u8; 48];
        guards.watch(buffer, "room.thing", &mut memory, 20);
        assert_eq!(memory[4..8], 0xFFC5_A5C5u32.to_le_bytes());
        assert!(f32::from_bits(0xFFC5_A5C5).is_nan());
        // Its own bytes may change.
        memory[..20].fill(1);
        assert!(guards.check("own").is_ok());
        memory[25] = 0;
        memory[31] = 0;
        let message = guards.check("first").unwrap_err().to_string();
        let expected = "pass first wrote beyond the end of room.thing (20 bytes): 2 bytes changed, \
                        the first at 25";
        assert!(message.contains(expected), "{message}");
        assert!(guards.check("second").is_ok());
        guards.forget(buffer);
        memory[25] = 0;
        assert!(guards.check("third").is_ok());
    }
}
