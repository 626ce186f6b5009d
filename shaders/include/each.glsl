layout(local_size_x = 64) in;

// Runs its body in one invocation a record; the host deals invocations to rows of workgroups where
// one row is too short. It is a condition and not a loop: where invocations run in step (llvmpipe),
// a loop costs one more empty iteration.
#define FOR_EACH(i, n) \
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x \
             + gl_LocalInvocationID.x; \
    if (i < (n))
