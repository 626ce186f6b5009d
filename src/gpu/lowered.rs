//! Limits of another device, to run as that device would.

use std::path::Path;

use serde::Deserialize;

use super::device_info::DeviceInfo;
use super::limits::Limits;
use crate::error::{Error, Place, Result};
use crate::io::text_file::{SCENE_LIMIT, line_column, read_text};

/// Limits and features that a device is lowered to. A limit that the device does not reach stays
/// the device's.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LoweredLimits {
    /// Name of the device that the limits are of, for results.
    pub name: String,
    /// "discrete", "integrated", "virtual", "cpu" or "other", by which forms of kernels are chosen.
    pub kind: Option<String>,
    /// [`Limits::max_storage_buffer_bytes`]
    pub max_storage_buffer_bytes: Option<u64>,
    /// [`Limits::max_storage_buffers`]
    pub max_storage_buffers: Option<u32>,
    /// [`Limits::max_texels`]
    pub max_texels: Option<u64>,
    /// [`Limits::max_workgroups_x`]
    pub max_workgroups_x: Option<u32>,
    /// [`Limits::max_workgroup_invocations`]
    pub max_workgroup_invocations: Option<u32>,
    /// [`Limits::max_shared_memory_bytes`]
    pub max_shared_memory_bytes: Option<u32>,
    /// [`Limits::max_push_constant_bytes`]
    pub max_push_constant_bytes: Option<u32>,
    /// [`Limits::max_image_extent`]
    pub max_image_extent: Option<u32>,
    /// [`Limits::device_memory_bytes`]
    pub device_memory_bytes: Option<u64>,
    /// [`Limits::subgroup_size`]. Kernels get the workgroups that suit this size. Where the device
    /// has another size, they get no subgroup operations.
    pub subgroup_size: Option<u32>,
    /// [`Limits::has_subgroup_arithmetic`] and [`Limits::has_subgroup_shuffle`]
    pub has_subgroup_operations: Option<bool>,
    /// [`Limits::has_int64`]
    pub has_int64: Option<bool>,
    /// [`Limits::has_float64`]
    pub has_float64: Option<bool>,
    /// [`Limits::max_loop_iterations`]
    pub max_loop_iterations: Option<u32>,
    /// [`Limits::timestamp_valid_bits`]
    pub timestamp_valid_bits: Option<u32>,
}

const KINDS: [&str; 5] = ["discrete", "integrated", "virtual", "cpu", "other"];

impl LoweredLimits {
    /// Reads a TOML file of limits.
    ///
    /// # Errors
    /// The file cannot be read, or has an unknown key or a value of the wrong kind.
    pub fn read(path: &Path) -> Result<LoweredLimits> {
        let text = read_text(path, SCENE_LIMIT, "limits of a device as TOML")?;
        let fault = |offset: usize, what: String| {
            let (line, column) = line_column(&text, offset);
            Error::scene(Place::line(path, line, column), what)
        };
        let found: LoweredLimits = toml::from_str(&text).map_err(|e| {
            let at = e.span().map_or(0, |span| span.start);
            fault(at, e.message().trim().replace('\n', "; "))
        })?;
        if let Some(kind) = found.kind.as_ref().filter(|kind| !KINDS.contains(&kind.as_str())) {
            let at = text.find(kind.as_str()).unwrap_or(0);
            return Err(fault(at, format!("`kind`: expected one of {KINDS:?}, found {kind:?}")));
        }
        Ok(found)
    }
}

impl DeviceInfo {
    /// Returns the device with the lower of its own limits and the given ones.
    pub fn lowered(mut self, to: &LoweredLimits) -> DeviceInfo {
        fn lower<T: Ord + Copy>(own: &mut T, to: Option<T>) {
            *own = to.map_or(*own, |to| to.min(*own));
        }
        let own = &mut self.limits;
        lower(&mut own.max_storage_buffer_bytes, to.max_storage_buffer_bytes);
        lower(&mut own.max_storage_buffers, to.max_storage_buffers);
        lower(&mut own.max_texels, to.max_texels);
        lower(&mut own.max_workgroups_x, to.max_workgroups_x);
        lower(&mut own.max_workgroup_invocations, to.max_workgroup_invocations);
        lower(&mut own.max_shared_memory_bytes, to.max_shared_memory_bytes);
        lower(&mut own.max_push_constant_bytes, to.max_push_constant_bytes);
        lower(&mut own.max_image_extent, to.max_image_extent);
        lower(&mut own.device_memory_bytes, to.device_memory_bytes);
        lower(&mut own.has_int64, to.has_int64);
        lower(&mut own.has_float64, to.has_float64);
        lower(&mut own.has_subgroup_arithmetic, to.has_subgroup_operations);
        lower(&mut own.has_subgroup_shuffle, to.has_subgroup_operations);
        lower(&mut own.max_loop_iterations, to.max_loop_iterations);
        lower(&mut own.timestamp_valid_bits, to.timestamp_valid_bits);
        if let Some(size) = to.subgroup_size.filter(|size| *size != own.subgroup_size) {
            *own = Limits {
                subgroup_size: size,
                has_subgroup_arithmetic: false,
                has_subgroup_shuffle: false,
                is_subgroup_size_fixed: false,
                can_choose_subgroup_size: false,
                ..*own
            };
        }
        if let Some(kind) = KINDS.iter().find(|kind| to.kind.as_deref() == Some(**kind)) {
            self.kind = kind;
        }
        // Results of lowered limits differ in their times, and must not be taken for the device's.
        self.name = format!("{} (limits of {})", self.name, to.name);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<LoweredLimits> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.toml");
        std::fs::write(&path, text).expect("a file");
        LoweredLimits::read(&path)
    }

    #[test]
    fn faults_are_named_with_their_place() {
        for (text, says) in [
            ("name = \"a\"\nmax_texls = 3", "a.toml:2:1: unknown field `max_texls`"),
            ("max_texels = -3", "a.toml:1:14: "),
            ("kind = \"phone\"", "a.toml:1:9: `kind`: expected one of"),
            ("max_texels", "a.toml:1:"),
        ] {
            let message = read(text).expect_err(text).to_string();
            assert!(message.contains(says), "{text}: {message}");
        }
    }

    #[test]
    fn limits_are_lowered_and_never_raised() {
        let file = read(
            "name = \"phone\"\nkind = \"integrated\"\nmax_texels = 65536\n\
             max_workgroup_invocations = 4096\nhas_int64 = false\nhas_float64 = true\n",
        );
        let own = Limits {
            max_texels: 1 << 27,
            max_workgroup_invocations: 1024,
            has_int64: true,
            has_float64: false,
            subgroup_size: 8,
            has_subgroup_shuffle: true,
            is_subgroup_size_fixed: true,
            ..Limits::default()
        };
        let device = DeviceInfo::of_limits("a", "cpu", own).lowered(&file.expect("limits"));
        assert_eq!((device.kind, device.name.as_str()), ("integrated", "a (limits of phone)"));
        let Limits { max_texels, max_workgroup_invocations, .. } = device.limits;
        assert_eq!((max_texels, max_workgroup_invocations), (65536, 1024));
        assert!(!device.limits.has_int64 && !device.limits.has_float64);
        assert!(device.limits.is_one_subgroup(8));
        let wide = LoweredLimits { subgroup_size: Some(32), ..LoweredLimits::default() };
        let wide = DeviceInfo::of_limits("a", "cpu", own).lowered(&wide).limits;
        assert!(wide.subgroup_size == 32 && !wide.is_one_subgroup(32));
    }
}
