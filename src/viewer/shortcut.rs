//! Keyboard shortcuts, as both windows list and look them up.

/// A key with its command.
#[derive(Debug, Clone, Copy)]
pub struct Shortcut<C> {
    /// Name of the key with its modifiers. Letters and signs are their own names.
    pub key: &'static str,
    /// The command that the key invokes.
    pub command: C,
    /// The command in words, for the list of keys in a window.
    #[cfg_attr(not(feature = "window"), allow(dead_code, reason = "only windows list keys"))]
    pub description: &'static str,
}

impl<C: Copy + PartialEq> Shortcut<C> {
    /// Creates a shortcut.
    pub const fn new(key: &'static str, command: C, description: &'static str) -> Shortcut<C> {
        Shortcut { key, command, description }
    }

    /// Returns the command of the key with this name.
    pub fn command_of(shortcuts: &[Shortcut<C>], key: &str) -> Option<C> {
        shortcuts.iter().find(|s| s.key == key).map(|s| s.command)
    }

    /// Returns the description and the first key of a command.
    #[cfg(feature = "window")]
    pub fn tooltip(shortcuts: &[Shortcut<C>], command: C) -> Option<String> {
        let s = shortcuts.iter().find(|s| s.command == command)?;
        Some(format!("{} ({})", s.description, s.key))
    }
}
