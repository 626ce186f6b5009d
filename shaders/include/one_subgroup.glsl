// Waiting within a workgroup that is one subgroup (ONE_SUBGROUP) or not. A workgroup's barrier
// costs llvmpipe all that it holds in registers, and the sums it would rather do again than keep.

#ifndef ONE_SUBGROUP
#define ONE_SUBGROUP 0
#endif
#if ONE_SUBGROUP
#extension GL_KHR_shader_subgroup_basic : require
#endif

void wait_for_all() {
#if ONE_SUBGROUP
    subgroupMemoryBarrierShared();
    subgroupBarrier();
#else
    barrier();
#endif
}
