// Barriers within a workgroup, cheap where it is one subgroup (ONE_SUBGROUP). A full barrier makes
// llvmpipe store all registers, among them sums that it would rather compute again.

#ifndef ONE_SUBGROUP
#define ONE_SUBGROUP 0
#endif
#if ONE_SUBGROUP
#extension GL_KHR_shader_subgroup_basic : require
#endif

// Returns the number of an invocation in its workgroup. In a workgroup that is one subgroup it is
// that of subgroup operations, which Vulkan does not promise to be the local index.
uint lane() {
#if ONE_SUBGROUP
    return gl_SubgroupInvocationID;
#else
    return gl_LocalInvocationID.x;
#endif
}

void wait_for_all() {
#if ONE_SUBGROUP
    subgroupMemoryBarrierShared();
    subgroupBarrier();
#else
    barrier();
#endif
}
