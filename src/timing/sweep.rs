//! Sweeps: the values that scene keys are given, and all their combinations.

use super::names::Setting;
use crate::error::{Error, Result};

/// The values that a run gives one scene key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Axis {
    /// Key of the scene, or [`SIZE_KEY`].
    pub key: String,
    /// Values, as `--set` takes them.
    pub values: Vec<String>,
}

/// The key that sets `film.width` and `film.height` at once.
pub const SIZE_KEY: &str = "size";

impl Axis {
    /// Parses "key=v1,v2,…", the value of the argument `flag`. Commas within brackets or quotes do
    /// not separate values.
    ///
    /// # Errors
    /// Fails if the key or a value is missing, or a value is there twice.
    pub fn parse(flag: &str, text: &str) -> Result<Axis> {
        let wrong = |what: &str| {
            // An error study compares pictures of one size.
            let or_size = if flag == "--sweep" { " or size=800x600,1024x768" } else { "" };
            let expected = "expected KEY=VALUE,VALUE,… such as draw.cutoff=2,3,4";
            Error::usage(format!("{flag} {text}: {what}; {expected}{or_size}"))
        };
        let (key, list) = text.split_once('=').ok_or_else(|| wrong("no `=`"))?;
        let values = split(list);
        if key.trim().is_empty() || values.iter().any(String::is_empty) {
            return Err(wrong(if key.trim().is_empty() { "no key" } else { "an empty value" }));
        }
        if let Some((_, twice)) = values.iter().enumerate().find(|(i, v)| values[..*i].contains(v))
        {
            return Err(wrong(&format!("{twice} twice")));
        }
        Ok(Axis { key: key.trim().to_owned(), values })
    }

    /// Parses every value of the argument `flag`.
    ///
    /// # Errors
    /// Fails if a text is not an axis, or two have the same key.
    pub fn parse_all(flag: &str, texts: &[String]) -> Result<Vec<Axis>> {
        let mut axes: Vec<Axis> = Vec::new();
        for text in texts {
            let axis = Axis::parse(flag, text)?;
            if axes.iter().any(|before| before.key == axis.key) {
                let key = axis.key;
                let what = format!("{flag} {key}: the key twice; name all its values in one");
                return Err(Error::usage(what));
            }
            axes.push(axis);
        }
        Ok(axes)
    }
}

/// Returns the settings of a point as the values of `--set`.
///
/// # Errors
/// Fails if a value of [`SIZE_KEY`] is not WIDTHxHEIGHT.
pub fn overrides(point: &[Setting]) -> Result<Vec<String>> {
    let mut all = Vec::new();
    for Setting { key, value } in point {
        if key != SIZE_KEY {
            all.push(format!("{key}={value}"));
            continue;
        }
        let sides =
            value.split_once('x').filter(|(w, h)| [w, h].iter().all(|n| n.parse::<u32>().is_ok()));
        let (width, height) = sides.ok_or_else(|| {
            let expected = "expected WIDTHxHEIGHT such as 800x600";
            Error::usage(format!("--sweep size: {expected}, found \"{value}\""))
        })?;
        all.extend([format!("film.width={width}"), format!("film.height={height}")]);
    }
    Ok(all)
}

/// Returns every point of the sweep, the last axis varying fastest. Without axes there is one
/// point, which has no settings.
pub fn points(axes: &[Axis]) -> Vec<Vec<Setting>> {
    let mut points = vec![vec![]];
    for Axis { key, values } in axes {
        let with = |point: Vec<Setting>| {
            values.iter().map(move |value| {
                let setting = Setting { key: key.clone(), value: value.clone() };
                [&point[..], &[setting]].concat()
            })
        };
        points = points.into_iter().flat_map(with).collect();
    }
    points
}

/// Splits a list at its commas and trims the parts.
fn split(list: &str) -> Vec<String> {
    let (mut parts, mut depth, mut quote) = (vec![String::new()], 0u32, None);
    for c in list.chars() {
        match (c, quote) {
            (',', None) if depth == 0 => {
                parts.push(String::new());
                continue;
            }
            (c, Some(open)) if c == open => quote = None,
            ('"' | '\'', None) => quote = Some(c),
            ('[' | '{', None) => depth += 1,
            (']' | '}', None) => depth = depth.saturating_sub(1),
            _ => {}
        }
        if let Some(last) = parts.last_mut() {
            last.push(c);
        }
    }
    parts.into_iter().map(|part| part.trim().to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timing::names::sweep_text;

    #[test]
    fn an_axis_is_a_key_and_values() {
        let axis = |text: &str| Axis::parse("--sweep", text).map(|a| (a.key, a.values.join("|")));
        let is = |key: &str, values: &str| Ok((key.to_owned(), values.to_owned()));
        assert_eq!(axis("draw.cutoff=2, 3"), is("draw.cutoff", "2|3"));
        assert_eq!(axis("size=800x600,1024x768"), is("size", "800x600|1024x768"));
        assert_eq!(axis("cloud.0.wind=[1,0,0],[2,0,0]"), is("cloud.0.wind", "[1,0,0]|[2,0,0]"));
        assert_eq!(axis("title='a,b',\"c]\""), is("title", "'a,b'|\"c]\""));
        for (wrong, what) in
            [("a", "no `=`"), ("=1", "no key"), ("a=1,", "an empty value"), ("a=1,1", "1 twice")]
        {
            assert!(axis(wrong).unwrap_err().to_string().contains(what), "{wrong}");
        }
    }

    #[test]
    fn points_are_all_combinations() {
        let axes = ["a=1,2", "size=3x4,5x6,7x8"].map(|t| Axis::parse("--sweep", t).unwrap());
        let all = points(&axes);
        assert_eq!((all.len(), points(&[]).len()), (6, 1));
        assert_eq!(sweep_text(&all[1]), "a=1, size=5x6");
        assert_eq!(overrides(&all[1]).unwrap(), ["a=1", "film.width=5", "film.height=6"]);
        let wrong = Setting { key: SIZE_KEY.to_owned(), value: "8".to_owned() };
        assert!(overrides(&[wrong]).unwrap_err().to_string().contains("found \"8\""));
    }
}
