//! Parsers of argument values that several commands share.

use std::path::Path;

use clap::builder::RangedI64ValueParser;

use crate::gpu::LoweredLimits;
use crate::io::scene_file::MAX_SIDE;
use crate::reference::picture::MAX_SAMPLES;

/// Parses a number of at least 1.
pub fn at_least_one() -> RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(1..)
}

/// Parses a number from `least` to `most`; the message says why there are no more.
pub fn limited(
    least: u32,
    most: u32,
    why: &'static str,
) -> impl Fn(&str) -> Result<u32, String> + Clone + Send + Sync + 'static {
    move |text| {
        let n = text.parse().ok().filter(|n| (least..=most).contains(n));
        n.ok_or_else(|| {
            format!("expected a number from {least} to {most} ({why}), found \"{text}\"")
        })
    }
}

/// Reads a file of lowered limits.
pub fn parse_limits(path: &str) -> Result<LoweredLimits, String> {
    LoweredLimits::read(Path::new(path)).map_err(|e| e.to_string())
}

/// Parses the number of timed blocks of a configuration.
pub fn parse_rounds(text: &str) -> Result<u32, String> {
    limited(1, 10_000, "the times of all blocks are kept in memory")(text)
}

/// Parses the number of frames of a block of a study.
pub fn parse_block(text: &str) -> Result<u32, String> {
    limited(1, 10_000, "the times of all frames are kept in memory")(text)
}

/// Parses WIDTHxHEIGHT.
pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let wrong = || {
        format!(
            "expected WIDTHxHEIGHT such as 800x600, each from 1 to {MAX_SIDE}, found \"{text}\""
        )
    };
    let (w, h) = text.split_once(['x', 'X', '×']).ok_or_else(wrong)?;
    let parse =
        |t: &str| t.parse::<u32>().ok().filter(|n| (1..=MAX_SIDE).contains(n)).ok_or_else(wrong);
    Ok((parse(w)?, parse(h)?))
}

/// Parses a number of samples of a pixel.
pub fn parse_samples(text: &str) -> Result<u32, String> {
    let n = text.parse().ok().filter(|n| (1..=MAX_SAMPLES).contains(n));
    n.ok_or_else(|| {
        format!("expected a number of samples from 1 to {MAX_SAMPLES}, found \"{text}\"")
    })
}

/// Parses a finite number above 0.
pub fn parse_positive(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0);
    value.ok_or_else(|| format!("expected a number above 0, found \"{text}\""))
}

/// Parses a share, as "1%" or "0.01", above 0 and at most a half.
pub fn parse_precision(text: &str) -> Result<f64, String> {
    let value = parse_share(text).filter(|v| *v > 0.0 && *v <= 0.5);
    value.ok_or_else(|| format!("expected a share such as 1%, at most 50%, found \"{text}\""))
}

/// Parses a share, as "1%" or "0.01", from 0 to 1.
pub fn parse_margin(text: &str) -> Result<f64, String> {
    let value = parse_share(text).filter(|v| (0.0..=1.0).contains(v));
    value.ok_or_else(|| format!("expected a share such as 1%, at most 100%, found \"{text}\""))
}

fn parse_share(text: &str) -> Option<f64> {
    match text.trim().strip_suffix('%') {
        Some(percent) => Some(percent.trim_end().parse::<f64>().ok()? / 100.0),
        None => text.trim().parse().ok(),
    }
}

/// Parses a limit of time in seconds, at most a month.
pub fn parse_time_limit(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|v| (0.0..=2_592_000.0).contains(v));
    value.ok_or_else(|| format!("expected seconds, from 0 to 2592000, found \"{text}\""))
}

/// Parses pixels a degree, for FLIP, whose filters have about as many pixels.
pub fn parse_density(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|v| (1.0..=500.0).contains(v));
    value.ok_or_else(|| format!("expected a number from 1 to 500, found \"{text}\""))
}

/// Parses METRIC=VALUE.
pub fn parse_limit(text: &str) -> Result<(String, f64), String> {
    let wrong = || format!("expected METRIC=VALUE such as rmse=1e-3, found \"{text}\"");
    let (metric, value) = text.split_once('=').ok_or_else(wrong)?;
    Ok((metric.to_owned(), value.parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(wrong)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_parsed_with_and_without_percent() {
        for (text, value) in [("1%", 0.01), ("0.02", 0.02), (" 2.5 % ", 0.025), ("50%", 0.5)] {
            assert_eq!(parse_precision(text), Ok(value), "{text}");
        }
        assert_eq!((parse_margin("0"), parse_margin("100%")), (Ok(0.0), Ok(1.0)));
        for wrong in ["0", "51%", "-1%", "nan", "inf%", "%", "", "1%%", "ten"] {
            assert!(parse_precision(wrong).is_err(), "{wrong}");
        }
        assert!(parse_margin("101%").is_err() && parse_margin("-0.1").is_err());
    }

    #[test]
    fn sizes_are_parsed() {
        assert_eq!(parse_size("800x600"), Ok((800, 600)));
        assert_eq!(parse_size("16384x1"), Ok((16384, 1)));
        for wrong in ["800", "0x5", "ax3", "3x", "-1x2", "16385x1", "1x99999999999"] {
            assert!(parse_size(wrong).is_err(), "{wrong}");
        }
    }
}
