// Barriers within a workgroup, cheap where it is one subgroup (ONE_SUBGROUP). A full barrier makes
// llvmpipe store all registers, among them sums that it would rather compute again.

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
