#![no_main]

#[path = "../../tests/harness/readers.rs"]
mod readers;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = readers::ply(bytes);
});
