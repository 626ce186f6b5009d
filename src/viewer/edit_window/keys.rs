//! Keys and buttons of the window system, as the editor names them.

use winit::event::MouseButton;
use winit::keyboard::{Key as WinitKey, NamedKey};

use crate::viewer::editor::{Button, Key};

/// Returns the editor's name of a mouse button.
pub fn button_of(button: MouseButton) -> Option<Button> {
    match button {
        MouseButton::Left => Some(Button::Left),
        MouseButton::Middle => Some(Button::Middle),
        MouseButton::Right => Some(Button::Right),
        _ => None,
    }
}

/// Returns the editor's name of a key.
pub fn key_of(key: &WinitKey) -> Option<Key> {
    match key {
        WinitKey::Character(text) => text.chars().next().map(Key::Char),
        WinitKey::Named(NamedKey::Delete) => Some(Key::Delete),
        WinitKey::Named(NamedKey::Backspace) => Some(Key::Backspace),
        WinitKey::Named(NamedKey::Escape) => Some(Key::Escape),
        WinitKey::Named(NamedKey::Tab) => Some(Key::Tab),
        _ => None,
    }
}
