//! Errors of Vulkan calls.

use ash::prelude::VkResult;

use crate::error::{Error, Result};

/// Turns the result of a Vulkan call into ours.
pub(super) trait Call<T> {
    /// Names the call in the error, and the object it was made for where that has a name.
    fn of_call(self, call: &str, object: &str) -> Result<T>;
}

impl<T> Call<T> for VkResult<T> {
    fn of_call(self, call: &str, object: &str) -> Result<T> {
        self.map_err(|e| Error::vulkan(format!("{call} {object}").trim_end(), e))
    }
}
