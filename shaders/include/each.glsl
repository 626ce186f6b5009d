// One invocation a record; the host deals them to rows of workgroups where a device has no room for
// one row. A test and no loop: where invocations run together a loop is gone through once more than
// its turns, with nothing to do (llvmpipe).
#define FOR_EACH(i, n) \
    uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x + gl_LocalInvocationID.x; \
    if (i < (n))
