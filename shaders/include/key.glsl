// Returns the sort key of a depth relative to that of the lighting origin; ascending keys run far
// to near (passes.md "sort").
uint key_of(float z, uint n_bits, float depth_high, float steps_per_depth) {
    if (n_bits == 16) {
        return uint(clamp((depth_high - z) * steps_per_depth, 0.0, 65535.0));
    }
    uint bits = floatBitsToUint(z);
    return ~((bits & 0x80000000u) != 0 ? ~bits : bits | 0x80000000u);
}
