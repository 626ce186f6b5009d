//! Descriptor sets, from pools that are reset at each recording of their command buffer.

use std::sync::Arc;

use ash::vk;

use super::call::Call;
use super::device::{Owned, SharedDevice};
use crate::error::Result;

const SETS_PER_POOL: u32 = 64;

/// Pools of descriptor sets, which grow with the need.
pub(super) struct DescriptorPools {
    pools: Vec<Owned<vk::DescriptorPool>>,
    /// The pool that the next set comes from.
    i_pool: usize,
    shared: Arc<SharedDevice>,
}

impl DescriptorPools {
    pub fn new(shared: &Arc<SharedDevice>) -> DescriptorPools {
        DescriptorPools { pools: vec![], i_pool: 0, shared: shared.clone() }
    }

    /// Takes all sets back. No submission may still use one.
    pub fn reset(&mut self) -> Result<()> {
        self.i_pool = 0;
        let flags = vk::DescriptorPoolResetFlags::empty();
        self.pools.iter().try_for_each(|pool| {
            unsafe { self.shared.raw.reset_descriptor_pool(pool.raw, flags) }
                .of_call("vkResetDescriptorPool", "")
        })
    }

    /// Returns a set; makes a new pool where all are used up, as in the first frame.
    pub fn allocate(&mut self, layout: vk::DescriptorSetLayout) -> Result<vk::DescriptorSet> {
        let layouts = [layout];
        loop {
            if self.i_pool == self.pools.len() {
                self.grow()?;
            }
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(self.pools[self.i_pool].raw)
                .set_layouts(&layouts);
            match unsafe { self.shared.raw.allocate_descriptor_sets(&info) } {
                Err(vk::Result::ERROR_OUT_OF_POOL_MEMORY | vk::Result::ERROR_FRAGMENTED_POOL) => {
                    self.i_pool += 1
                }
                made => return made.of_call("vkAllocateDescriptorSets", "").map(|sets| sets[0]),
            }
        }
    }

    fn grow(&mut self) -> Result<()> {
        let size =
            |ty, a_set: u32| vk::DescriptorPoolSize { ty, descriptor_count: a_set * SETS_PER_POOL };
        let sizes = [
            size(vk::DescriptorType::STORAGE_BUFFER, 8),
            size(vk::DescriptorType::UNIFORM_TEXEL_BUFFER, 2),
            size(vk::DescriptorType::STORAGE_TEXEL_BUFFER, 1),
        ];
        let info =
            vk::DescriptorPoolCreateInfo::default().max_sets(SETS_PER_POOL).pool_sizes(&sizes);
        let raw = unsafe { self.shared.raw.create_descriptor_pool(&info, None) }
            .of_call("vkCreateDescriptorPool", "")?;
        let destroy = ash::Device::destroy_descriptor_pool;
        self.pools.push(self.shared.own(raw, "descriptors", destroy));
        Ok(())
    }
}
