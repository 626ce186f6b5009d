// Reads a region by its number, as texels. A device without vectors in memory loads a storage
// buffer's records invocation by invocation, each in a branch of its own. It loads texels all at
// once (docs/reference/measured.md). Needs `TEXELS regions`, or REGION_WORDS(k), the k-th texel.

#ifndef REGION_WORDS
#define REGION_WORDS(k) TEXEL(regions, k)
#endif

Region region_at(uint i) {
    int k = int(i) * 7;
    uvec4 kd = REGION_WORDS(k), ks = REGION_WORDS(k + 1);
    uvec4 center = REGION_WORDS(k + 2), u = REGION_WORDS(k + 3),
          v = REGION_WORDS(k + 4);
    uvec4 normal = REGION_WORDS(k + 5), rest = REGION_WORDS(k + 6);
    return Region(
        uintBitsToFloat(kd.xyz), kd.w, uintBitsToFloat(ks.xyz), ks.w, uintBitsToFloat(center.xyz),
        center.w, uintBitsToFloat(u.xyz), u.w, uintBitsToFloat(v.xyz), v.w,
        uintBitsToFloat(normal.xyz), normal.w, uintBitsToFloat(rest.x), uintBitsToFloat(rest.y),
        rest.z, rest.w
    );
}
