//! Errors of Vulkan calls.

use ash::prelude::VkResult;
use ash::vk;

use crate::error::{Error, Result};

/// Turns the result of a Vulkan call into ours.
pub(super) trait Call<T> {
    /// Names the call in the error, and the object it was made for where that has a name.
    fn of_call(self, call: &str, object: &str) -> Result<T>;
}

impl<T> Call<T> for VkResult<T> {
    fn of_call(self, call: &str, object: &str) -> Result<T> {
        self.map_err(|e| Error::vulkan(format!("{call} {object}").trim_end(), cause(e)))
    }
}

/// Returns the reason of a failed call for a user.
fn cause(result: vk::Result) -> String {
    match result {
        vk::Result::ERROR_DEVICE_LOST => "the device is lost: it hung, was reset or was removed; \
            the log of the system (`dmesg`) may say why"
            .to_owned(),
        vk::Result::TIMEOUT => {
            "the device has not finished in time and is taken for hung".to_owned()
        }
        other => other.to_string(),
    }
}
