// Philox4x32-10 (Salmon et al. 2011), as in src/model/philox.rs.

uvec4 philox4x32_10(uvec2 key, uvec4 counter) {
    for (int i = 0; i < 10; ++i) {
        uint high0, low0, high1, low1;
        umulExtended(0xD2511F53u, counter.x, high0, low0);
        umulExtended(0xCD9E8D57u, counter.z, high1, low1);
        counter = uvec4(high1 ^ counter.y ^ key.x, low1, high0 ^ counter.w ^ key.y, low0);
        key += uvec2(0x9E3779B9u, 0xBB67AE85u);
    }
    return counter;
}

// Returns the upper 24 bits as numbers in [0, 1), exact in a float.
vec4 uniforms(uvec4 words) { return vec4(words >> 8) * (1.0 / 16777216.0); }
