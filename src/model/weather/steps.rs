//! Times of a file's steps: parsing and printing, order, and interpolation between them.

/// Longest interval that is interpolated, s. Blobs on fixed seeds are off by half of their spread
/// between steps 10 minutes apart, and by three quarters between steps 3 hours apart
/// (model.md §15).
pub const LONGEST_INTERPOLATED_S: f64 = 600.0;

const SECONDS_A_DAY: f64 = 86_400.0;

/// Returns the days from 1970-01-01 of a date of the proleptic Gregorian calendar. *Source*:
/// Hinnant, "chrono-compatible low-level date algorithms".
fn days(year: i64, month: u32, day: u32) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let of_era = year.rem_euclid(400);
    let month_from_march = i64::from((month + 9) % 12);
    let of_year = (153 * month_from_march + 2) / 5 + i64::from(day) - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468
}

/// Returns year, month and day of such a day.
fn date(days: i64) -> (i64, u32, u32) {
    let z = days + 719_468;
    let era = z.div_euclid(146_097);
    let of_era = z.rem_euclid(146_097);
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let from_march = (5 * of_year + 2) / 153;
    let day = (of_year - (153 * from_march + 2) / 5 + 1) as u32;
    let month = if from_march < 10 { from_march + 3 } else { from_march - 9 } as u32;
    (year_of_era + era * 400 + i64::from(month <= 2), month, day)
}

/// Parses WRF's "YYYY-MM-DD_HH:MM:SS" to seconds from 1970-01-01 00:00 UTC; `None` for any other
/// text.
pub fn parse(text: &str) -> Option<f64> {
    let bytes = text.as_bytes();
    let separators = [(4, b'-'), (7, b'-'), (13, b':'), (16, b':')];
    let is_like = bytes.len() == 19
        && matches!(bytes[10], b'_' | b'T' | b' ')
        && separators.iter().all(|&(at, separator)| bytes[at] == separator);
    if !is_like {
        return None;
    }
    let number = |from: usize, to: usize| -> Option<u32> {
        bytes[from..to]
            .iter()
            .try_fold(0, |n, b| b.is_ascii_digit().then(|| n * 10 + u32::from(b - b'0')))
    };
    let (year, month, day) = (i64::from(number(0, 4)?), number(5, 7)?, number(8, 10)?);
    let (hour, minute, second) = (number(11, 13)?, number(14, 16)?, number(17, 19)?);
    let of_date = days(year, month, day);
    // An invalid date such as 30 February does not survive the round trip.
    if !(1..=12).contains(&month)
        || date(of_date) != (year, month, day)
        || hour > 23
        || minute > 59
        || second > 60
    {
        return None;
    }
    Some(of_date as f64 * SECONDS_A_DAY + f64::from(hour * 3600 + minute * 60 + second))
}

/// Formats a time as "YYYY-MM-DD HH:MM:SS" (UTC), to the nearest second; times beyond the years 0
/// to 9999 as seconds.
pub fn format(time_s: f64) -> String {
    let whole = time_s.round();
    if !whole.is_finite() {
        return format!("{time_s} s");
    }
    let (of_date, of_day) = ((whole / SECONDS_A_DAY).floor(), whole.rem_euclid(SECONDS_A_DAY));
    let (year, month, day) = date(of_date.clamp(-1e9, 1e9) as i64);
    if !(0..=9999).contains(&year) {
        return format!("{time_s} s");
    }
    let (hour, minute, second) = (of_day / 3600.0, of_day % 3600.0 / 60.0, of_day % 60.0);
    format!("{year:04}-{month:02}-{day:02} {:02}:{:02}:{second:02}", hour as u32, minute as u32)
}

/// Returns the first step whose time is not after that of the step before it.
pub fn first_out_of_order(times_s: &[f64]) -> Option<usize> {
    let is_later = |w: &[f64]| w[1] > w[0];
    times_s.windows(2).position(|w| !is_later(w)).map(|i| i + 1)
}

/// Returns the step before `t_s`, of steps at rising `times_s`, and the weight of the step after
/// it; the step itself has the rest. Steps at most [`LONGEST_INTERPOLATED_S`] apart are
/// interpolated; otherwise the earlier one counts. The first step stands for all earlier
/// times, the last for all later ones. `None` without steps or for NaN.
pub fn between(times_s: &[f64], t_s: f64) -> Option<(usize, f64)> {
    if times_s.is_empty() || t_s.is_nan() {
        return None;
    }
    let n_before = times_s.partition_point(|&time| time <= t_s);
    let i = n_before.saturating_sub(1);
    if n_before == 0 || n_before == times_s.len() || t_s == times_s[i] {
        return Some((i, 0.0));
    }
    let gap = times_s[i + 1] - times_s[i];
    Some((i, if gap > LONGEST_INTERPOLATED_S { 0.0 } else { (t_s - times_s[i]) / gap }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_parse_and_print_alike() {
        assert_eq!(parse("1970-01-01_00:00:00"), Some(0.0));
        // From `date -u -d 2005-08-28T12:00:00 +%s`.
        assert_eq!(parse("2005-08-28_12:00:00"), Some(1_125_230_400.0));
        assert_eq!(parse("2000-02-29_23:59:59"), Some(951_868_799.0));
        // Idealised cases begin in the year 1: 719162 days before 1970.
        assert_eq!(parse("0001-01-01_00:46:00"), Some(-719_162.0 * 86_400.0 + 2760.0));
        for text in [
            "2005-08-28_12:00:00",
            "0001-01-01_00:46:00",
            "1999-12-31_23:59:59",
            "2400-02-29_00:00:00",
        ] {
            assert_eq!(format(parse(text).unwrap()), text.replace('_', " "));
        }
        let wrong = [
            "",
            "2005-08-28",
            "2005-02-29_00:00:00",
            "2005-13-01_00:00:00",
            "2005-00-01_00:00:00",
            "2005-08-28_24:00:00",
            "2005-08-28_12:60:00",
            "20a5-08-28_12:00:00",
            "2005-08-28_12:00:0é",
            "2005/08/28_12:00:00",
        ];
        for text in wrong {
            assert_eq!(parse(text), None, "{text}");
        }
        assert!(format(1e300).ends_with("000 s") && format(f64::NAN) == "NaN s");
    }

    #[test]
    fn order_of_times() {
        assert_eq!(first_out_of_order(&[]), None);
        assert_eq!(first_out_of_order(&[1.0, 2.0, 3.0]), None);
        assert_eq!(first_out_of_order(&[1.0, 2.0, 2.0]), Some(2));
        assert_eq!(first_out_of_order(&[1.0, 0.0, 2.0]), Some(1));
        assert_eq!(first_out_of_order(&[1.0, f64::NAN]), Some(1));
    }

    #[test]
    fn moments_between_steps() {
        let times = [0.0, 120.0, 720.0, 1320.5];
        let at = |t: f64| between(&times, t).unwrap();
        assert_eq!(at(-5.0), (0, 0.0));
        assert_eq!(at(0.0), (0, 0.0));
        assert_eq!(at(30.0), (0, 0.25));
        assert_eq!(at(120.0), (1, 0.0));
        // Ten minutes are interpolated, half a second more is not.
        assert_eq!(at(420.0), (1, 0.5));
        assert_eq!(at(1320.0), (2, 0.0));
        assert_eq!(at(1320.5), (3, 0.0));
        assert_eq!(at(f64::INFINITY), (3, 0.0));
        assert_eq!(between(&[7.0], 9.0), Some((0, 0.0)));
        assert_eq!(between(&[], 9.0), None);
        assert_eq!(between(&times, f64::NAN), None);
    }
}
