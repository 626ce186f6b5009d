//! The unchanged scene of a study: its values of the keys that the study varies, and its name with
//! them.

use serde_json::Value;

use super::records::{BASE, Configuration, Study};
use crate::timing::names::{Setting, sweep_text};

/// Most keys that the name of the unchanged scene has. More would widen the table beyond a
/// terminal, so that they have a line of their own.
const MOST_NAMED_KEYS: usize = 3;

impl Study {
    /// Returns the keys that some configuration sets, in order.
    fn varied_keys(&self) -> Vec<&str> {
        let mut keys: Vec<&str> = Vec::new();
        for Setting { key, .. } in self.configurations.iter().flat_map(|c| &c.settings) {
            if !keys.contains(&key.as_str()) {
                keys.push(key);
            }
        }
        keys
    }

    /// Returns the unchanged scene's values of the keys that some configuration sets, in order. A
    /// key of items whose values differ is left out.
    pub fn base_settings(&self) -> Vec<Setting> {
        let setting = |key: &str| {
            let segments: Vec<&str> = key.split('.').collect();
            let value = value_at(&self.made.scene, &segments)?;
            Some(Setting { key: key.to_owned(), value })
        };
        self.varied_keys().into_iter().filter_map(setting).collect()
    }

    /// Returns the name of a configuration in tables and charts. That of the unchanged scene has
    /// its values of the varied keys, unless they are many.
    pub fn label(&self, configuration: &Configuration) -> String {
        if configuration.name != BASE || self.varied_keys().len() > MOST_NAMED_KEYS {
            return configuration.name.clone();
        }
        match self.base_settings() {
            own if own.is_empty() => BASE.to_owned(),
            own => format!("{BASE} ({})", sweep_text(&own)),
        }
    }

    /// Returns a line with the unchanged scene's values of the varied keys, if they are too many
    /// for its name.
    pub fn base_line(&self) -> Option<String> {
        let own = self.base_settings();
        let is_long = self.varied_keys().len() > MOST_NAMED_KEYS && !own.is_empty();
        is_long.then(|| format!("{BASE}: {}", sweep_text(&own)))
    }
}

/// Returns the value of a key of a resolved scene, as `--set` takes it.
fn value_at(value: &Value, segments: &[&str]) -> Option<String> {
    let Some((first, rest)) = segments.split_first() else { return text(value) };
    match value {
        Value::Object(table) => value_at(table.get(*first)?, rest),
        Value::Array(items) if *first == "*" => {
            let mut values = items.iter().map(|item| value_at(item, rest));
            let one = values.next()??;
            values.all(|value| value.as_ref() == Some(&one)).then_some(one)
        }
        Value::Array(items) => value_at(items.get(first.parse::<usize>().ok()?)?, rest),
        _ => None,
    }
}

/// Returns a value as `--set` takes it; `None` for a table.
fn text(value: &Value) -> Option<String> {
    match value {
        Value::String(text) => Some(text.clone()),
        // 4 instead of 4.0, as users type it.
        Value::Number(number) if number.is_f64() => number.as_f64().map(|v| v.to_string()),
        Value::Number(_) | Value::Bool(_) => Some(value.to_string()),
        Value::Array(items) => {
            let items: Option<Vec<String>> = items.iter().map(text).collect();
            items.map(|items| format!("[{}]", items.join(",")))
        }
        Value::Null | Value::Object(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn values_are_found_by_their_keys_and_written_as_typed() {
        let scene = json!({
            "lighting": { "grid": 64, "step": 2.0, "mode": "first" },
            "surface": [{ "subdivide": [4, 4], "x": 1 }, { "subdivide": [4, 4], "x": 1.5 }],
        });
        for (key, value) in [
            ("lighting.grid", Some("64")),
            ("lighting.step", Some("2")),
            ("lighting.mode", Some("first")),
            ("surface.*.subdivide", Some("[4,4]")),
            ("surface.1.x", Some("1.5")),
            // Items that differ have no one value; the others do not exist or are tables.
            ("surface.*.x", None),
            ("surface.2.x", None),
            ("lighting", None),
            ("lighting.grid.x", None),
        ] {
            let segments: Vec<&str> = key.split('.').collect();
            assert_eq!(value_at(&scene, &segments).as_deref(), value, "{key}");
        }
    }
}
