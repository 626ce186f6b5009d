//! Semaphores and command pools.

use std::sync::Arc;

use ash::vk;

use super::call::Call;
use super::device::{Owned, SharedDevice};
use crate::error::Result;

impl SharedDevice {
    /// Creates a semaphore; a timeline semaphore starts at 0.
    pub fn semaphore(
        self: &Arc<Self>,
        name: &str,
        kind: vk::SemaphoreType,
    ) -> Result<Owned<vk::Semaphore>> {
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(kind);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        let raw =
            unsafe { self.raw.create_semaphore(&info, None) }.of_call("vkCreateSemaphore", name)?;
        Ok(self.own(raw, name, ash::Device::destroy_semaphore))
    }

    /// Creates a command pool of the device's queue family.
    pub fn command_pool(self: &Arc<Self>, name: &str) -> Result<Owned<vk::CommandPool>> {
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(self.queue_family);
        let raw = unsafe { self.raw.create_command_pool(&info, None) }
            .of_call("vkCreateCommandPool", name)?;
        Ok(self.own(raw, name, ash::Device::destroy_command_pool))
    }
}
