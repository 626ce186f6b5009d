//! Weather files that are cut off or damaged: each is refused with one message, and none crashes,
//! hangs or takes memory without end.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use crate::readers;
use crate::weather_files::{Made, message_of};
use nimbus::model::philox::philox4x32_10;

fn small_netcdf4() -> Vec<u8> {
    let path: PathBuf =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/weather/small-netcdf4.nc");
    fs::read(path).expect("a file")
}

/// A file of each kind, cut off everywhere: in its header, at its last step, by one byte. NetCDF-4
/// tells by its superblock, the others by what their header declares.
#[test]
fn files_that_are_cut_off_are_refused() {
    let whole = small_netcdf4();
    let n = whole.len();
    for keep in [100, n / 2, n - 1] {
        let message = message_of(&whole[..keep]);
        assert_eq!(
            message,
            format!(
                "the file is cut off: it has {keep} bytes, and by its own superblock it ends at {n}"
            )
        );
    }
    for version in [1, 2, 5] {
        let whole = Made::wrf(version, 2).bytes();
        for keep in [10, 200, whole.len() / 2, whole.len() - 400, whole.len() - 4, whole.len() - 1]
        {
            let message = message_of(&whole[..keep]);
            assert!(
                message.starts_with("the file is damaged or cut off: "),
                "{version}, {keep} of {}: {message}",
                whole.len()
            );
        }
    }
}

/// Time after which a reader counts as hanging.
const LONGEST: Duration = Duration::from_secs(300);
/// Most memory of the whole test, KiB.
const MOST_MEMORY: u64 = 1 << 20;

/// Returns a file with some bytes changed by a seed: set, replaced by the ends of integers' ranges,
/// moved, or cut off.
fn mutate(whole: &[u8], seed: u32) -> Vec<u8> {
    const ENDS: [[u8; 4]; 5] =
        [[255; 4], [0x7f, 255, 255, 255], [0; 4], [0, 0, 0, 1], [0x80, 0, 0, 0]];
    let mut bytes = whole.to_vec();
    for i in 0..1 + seed % 4 {
        let [at, kind, value, length] = philox4x32_10([seed, 0x6d75_7461], [i, 0, 0, 0]);
        // Half of them where the file says what is in it.
        let n = if kind & 0x100 == 0 { bytes.len() } else { bytes.len().min(2048) };
        let at = at as usize % n.max(1);
        match kind % 4 {
            0 => bytes[at] = value as u8,
            1 => bytes[at..]
                .iter_mut()
                .zip(ENDS[value as usize % ENDS.len()])
                .for_each(|(b, end)| *b = end),
            2 => {
                let (from, length) = (value as usize % n, (length as usize % 64).min(n - at));
                let part: Vec<u8> = bytes.iter().skip(from).take(length).copied().collect();
                bytes[at..at + part.len()].copy_from_slice(&part);
            }
            _ if length % 8 == 0 => bytes.truncate(at + 1),
            _ => bytes[at] ^= 1 << (value % 8),
        }
    }
    bytes
}

/// Reads `NIMBUS_MUTATIONS` (150 without it) mutations of each kind of file.
#[test]
fn damaged_files_are_read_or_refused() {
    let n: u32 = std::env::var("NIMBUS_MUTATIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(150);
    let wholes = [
        Made::wrf(1, 2).bytes(),
        Made::wrf(2, 2).bytes(),
        Made::wrf(5, 2).bytes(),
        small_netcdf4(),
    ];
    for (i_kind, whole) in wholes.into_iter().enumerate() {
        assert_eq!(readers::weather(&whole), Ok(()), "the whole file is read");
        let mut n_refused = 0;
        for seed in 0..n {
            let bytes = mutate(&whole, seed.wrapping_mul(4).wrapping_add(i_kind as u32));
            let (done, wait) = mpsc::channel();
            let worker = thread::spawn(move || drop(done.send(readers::weather(&bytes))));
            match wait.recv_timeout(LONGEST) {
                Ok(outcome) => n_refused += u32::from(outcome.is_err()),
                Err(mpsc::RecvTimeoutError::Timeout) => {
                    panic!("kind {i_kind}, seed {seed}: takes longer than {LONGEST:?}")
                }
                Err(mpsc::RecvTimeoutError::Disconnected) => {
                    let cause = worker.join().err();
                    panic!(
                        "kind {i_kind}, seed {seed}: {:?}",
                        cause.and_then(|c| c.downcast::<String>().ok())
                    );
                }
            }
        }
        println!("kind {i_kind}: {n_refused} of {n} refused");
        // Mutations that change nothing that is read are few.
        assert!(n_refused > n / 10, "kind {i_kind}: {n_refused} refused");
    }
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status
        .lines()
        .find_map(|l| l.strip_prefix("VmHWM:")?.split_whitespace().next()?.parse::<u64>().ok());
    assert!(peak.is_none_or(|peak| peak < MOST_MEMORY), "{peak:?} KiB");
}

/// Small files that declare large variables.
#[test]
fn declared_sizes_are_checked_before_memory_is_allocated() {
    let declared = |lengths: [u64; 3], version| {
        let mut made = Made::wrf(version, 0);
        for (i, length) in [2, 3, 4].into_iter().zip(lengths) {
            made.dims[i].1 = length;
        }
        made.dims[5].1 = lengths[2] + 1;
        message_of(&made.bytes())
    };
    for version in [1, 2, 5] {
        let message = declared([60_000, 60_000, 60_000], version);
        assert!(
            message.contains("variable P: 0 steps")
                || message.starts_with("the file is damaged or cut off"),
            "{message}"
        );
    }
}
