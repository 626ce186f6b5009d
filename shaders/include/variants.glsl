// The variants of the blobs' draw paths, by specialization constants.

// 0: particle colours as given; 1: the radiance of the particle's facet.
layout(constant_id = 0) const uint LIT = 1;
// 1: the quad has its centre's depth, near/z, and surfaces hide it.
layout(constant_id = 1) const uint BEHIND = 0;
// 0: a facet a particle; 1: i_facet names the facet.
layout(constant_id = 2) const uint GROUPED = 0;
// 1: a group draws some of its particles, and these have weights.
layout(constant_id = 3) const uint WEIGHTED = 0;
// 1: some blobs have textures.
layout(constant_id = 4) const uint TEXTURED = 0;
// 1: a sprite ends where its optical depth falls under a threshold.
layout(constant_id = 5) const uint THRESHOLD = 0;
// 1: some blobs are upright ellipsoids; 2: some ellipsoids are turned.
layout(constant_id = 6) const uint ELLIPSOIDS = 0;
// 1: no blob's optical depth is above 1/8, and none has a texture.
layout(constant_id = 9) const uint THIN = 0;
