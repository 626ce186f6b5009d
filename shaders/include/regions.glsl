// Reads a region by its number, as texels. A device without vectors in memory loads a storage
// buffer's records invocation by invocation, each in a branch of its own. It loads texels all at
// once (docs/reference/measured.md). Needs `usamplerBuffer regions`.

Region region_at(uint i) {
    int k = int(i) * 7;
    uvec4 kd = texelFetch(regions, k), ks = texelFetch(regions, k + 1);
    uvec4 center = texelFetch(regions, k + 2), u = texelFetch(regions, k + 3),
          v = texelFetch(regions, k + 4);
    uvec4 normal = texelFetch(regions, k + 5), rest = texelFetch(regions, k + 6);
    return Region(
        uintBitsToFloat(kd.xyz), kd.w, uintBitsToFloat(ks.xyz), ks.w, uintBitsToFloat(center.xyz),
        center.w, uintBitsToFloat(u.xyz), u.w, uintBitsToFloat(v.xyz), v.w,
        uintBitsToFloat(normal.xyz), normal.w, uintBitsToFloat(rest.x), uintBitsToFloat(rest.y),
        rest.z, rest.w
    );
}
