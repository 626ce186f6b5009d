// How deep a blob is seen (model.md §18, src/model/shade.rs).

// Optical depth beyond which a blob is not seen any nearer to its front, and the coefficients of
// h(t) = t (a + b t), the distance in σ before its centre.
const float DEEPEST_SEEN = 8.0;
const vec2 SEEN_BEFORE = vec2(0.2943, -0.01546);
