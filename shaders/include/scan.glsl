// A prefix sum over the invocations of a workgroup. The includer defines SCANNED, their number.

shared uint sums[SCANNED];

// Returns the sum of the totals of the invocations before this one (Hillis-Steele).
uint sum_before(uint total) {
    uint t = gl_LocalInvocationID.x;
    sums[t] = total;
    barrier();
    for (uint reach = 1; reach < SCANNED; reach *= 2) {
        uint left = t >= reach ? sums[t - reach] : 0u;
        barrier();
        sums[t] += left;
        barrier();
    }
    return sums[t] - total;
}
