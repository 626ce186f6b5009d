//! Interactive windows: `nimbus view` shows a scene, `nimbus edit` edits a cloud's boxes.
//!
//! Both windows follow one pattern. Input events change plain state: [`scene_window::ViewState`]
//! in the viewer, [`editor::EditorController`] in the editor. A render thread draws that state
//! into a window target, and panels (egui) are drawn over the picture. The state compiles and is
//! tested without a window.

#[cfg(feature = "window")]
mod colors;
mod digits;
#[cfg(feature = "window")]
mod display_loss;
#[cfg(feature = "window")]
pub mod edit_window;
pub mod editor;
#[cfg(feature = "window")]
mod egui_layer;
pub mod error_probe;
pub mod fly_camera;
#[cfg(feature = "window")]
mod free_path;
#[cfg(feature = "window")]
mod layout;
#[cfg(feature = "window")]
mod messages;
#[cfg(feature = "window")]
mod native_window;
#[cfg(feature = "window")]
mod overlay_text;
#[cfg(feature = "window")]
mod posed_player;
pub mod scene_window;
mod shortcut;
mod sync;
#[cfg(all(test, feature = "window"))]
mod widget_check;
#[cfg(feature = "window")]
mod window_target;
