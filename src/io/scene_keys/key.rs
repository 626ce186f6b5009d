//! Declarations of keys, and readers of tables of them.
//!
//! [`keys!`] declares the keys of a table once, each with its name, type, default, range, unit and
//! docs. From the declaration come the reader, which makes a struct of the model, and the list
//! that the reference (docs/reference/scene.md) is written from.

use serde_json::Value as Json;

use super::spec::About;
use crate::error::Result;
use crate::io::document::section::Section;

/// A key of a scene as the reference describes it.
pub struct Key {
    /// Name in the scene file.
    pub name: &'static str,
    /// Unit of its value; empty for a value without one.
    pub unit: &'static str,
    /// Its meaning, in one or two sentences.
    pub docs: &'static str,
    /// Returns its type, range and default.
    pub about: fn() -> About,
}

/// Keys that one [`keys!`] declares.
pub type Keys = &'static [&'static [Key]];

/// Declares keys and their reader.
///
/// Of a table: `LIST: fn read(s, more: Type…) -> Out { Struct; fields }`, where `s` is the
/// [`Section`] that is read and a field is one of
/// - `field: type, "unit";`, or without the unit, for the key of the field's name,
/// - `field ["key"]: type, "unit";` for a key of another name,
/// - either with `=> |key_type| value`, where `value` is a `Result` that the closure makes,
/// - `field => value;` for a field that is no key.
///
/// Of one key: `LIST: fn read(s, more: Type…) -> Out = "key": type, "unit";`, with or without the
/// closure. Doc comments are the key's docs. Keys are read in their order, which is their order
/// in the resolved scene too.
macro_rules! keys {
    ($list:ident: $vis:vis fn $read:ident($s:ident $(, $arg:ident: $arg_type:ty)*) -> $out:ty {
        $($make:ident)::+;
        $($(#[doc = $docs:literal])* $field:ident $([$key:literal])?
            $(: $type:expr $(, $unit:literal)?)? $(=> $with:expr)?;)*
    }) => {
        $vis const $list: $crate::io::scene_keys::key::Keys =
            &[$(keys!(@key [$($docs)*] [$field $($key)?] $($type $(, $unit)?)?)),*];

        $vis fn $read(
            $s: &mut $crate::io::document::section::Section $(, $arg: $arg_type)*
        ) -> $crate::error::Result<$out> {
            Ok($($make)::+ {
                $($field: keys!(@value $s [$field $($key)?] $($type)? $(=> $with)?)),*
            })
        }
    };
    ($(#[doc = $docs:literal])* $list:ident:
        $vis:vis fn $read:ident($s:ident $(, $arg:ident: $arg_type:ty)*) -> $out:ty =
        $key:literal: $type:expr $(, $unit:literal)? $(=> $with:expr)?;
    ) => {
        $vis const $list: $crate::io::scene_keys::key::Keys =
            &[keys!(@key [$($docs)*] [key $key] $type $(, $unit)?)];

        $vis fn $read(
            $s: &mut $crate::io::document::section::Section $(, $arg: $arg_type)*
        ) -> $crate::error::Result<$out> {
            Ok(keys!(@value $s [key $key] $type $(=> $with)?))
        }
    };
    (@key [$($docs:literal)*] [$($name:tt)*] $type:expr $(, $unit:literal)?) => {
        &[$crate::io::scene_keys::key::Key {
            name: keys!(@name $($name)*),
            unit: concat!($($unit)?),
            docs: concat!($($docs),*),
            about: || $type.about(),
        }]
    };
    (@key [] [$($name:tt)*]) => { &[] };
    (@value $s:ident [$($name:tt)*] $type:expr) => { $type.take($s, keys!(@name $($name)*))? };
    (@value $s:ident [$($name:tt)*] $type:expr => $with:expr) => {
        $crate::io::scene_keys::key::apply($type, $with)?
    };
    (@value $s:ident [$($name:tt)*] => $value:expr) => { $value };
    (@name $field:ident) => { stringify!($field) };
    (@name $field:ident $key:literal) => { $key };
}
pub(crate) use keys;

/// Calls `read` with a key's type; lets the compiler infer the closure's argument.
pub fn apply<S, T>(spec: S, read: impl FnOnce(S) -> Result<T>) -> Result<T> {
    read(spec)
}

/// Returns the names of the keys in several lists.
pub fn names(lists: &[Keys]) -> Vec<&'static str> {
    lists.iter().copied().flatten().copied().flatten().map(|key| key.name).collect()
}

/// Reads the table `key`, which has the keys in `lists`, with `read`.
pub fn read_table<'a, T>(
    root: &mut Section<'a>,
    key: &str,
    lists: &[Keys],
    read: impl FnOnce(&mut Section<'a>) -> Result<T>,
) -> Result<T> {
    let mut s = root.section(key)?;
    s.expect_keys(names(lists))?;
    let value = read(&mut s)?;
    root.record(key, s.finish());
    Ok(value)
}

/// Reads every table of the array `key` with `read`, which is given the values so far.
pub fn read_tables<'a, T>(
    root: &mut Section<'a>,
    key: &str,
    mut read: impl FnMut(&mut Section<'a>, &[T]) -> Result<T>,
) -> Result<Vec<T>> {
    let (mut values, mut resolved) = (Vec::new(), Vec::new());
    for mut s in root.sections(key)? {
        values.push(read(&mut s, &values)?);
        resolved.push(s.finish());
    }
    root.record(key, Json::Array(resolved));
    Ok(values)
}

/// Reads the array of tables `path`, whose `time_s` must grow. It stands in place of the keys
/// `instead_of`; when one of them is there as well, the message is `not_both`.
pub fn read_path<'a, T>(
    s: &mut Section<'a>,
    lists: &[Keys],
    (instead_of, not_both): (Keys, &str),
    time_s: fn(&T) -> f64,
    read: impl Fn(&mut Section<'a>, Option<&T>) -> Result<T>,
) -> Result<Vec<T>> {
    if let Some(key) = names(&[instead_of]).into_iter().find(|key| s.has(key)) {
        return Err(s.fault(key, not_both));
    }
    let path = read_tables(s, "path", |item, before| {
        item.expect_keys(names(lists))?;
        let value = read(item, before.last())?;
        let (time, last) = (time_s(&value), before.last().map(time_s));
        match last.filter(|last| time <= *last) {
            Some(last) => {
                Err(item.fault("time_s", format!("times must grow, found {time} after {last}")))
            }
            None => Ok(value),
        }
    })?;
    if path.is_empty() {
        let keys = names(lists).join(", ");
        return Err(s.fault("path", format!("expected at least one {{ {keys} }}")));
    }
    Ok(path)
}
