// How deep a blob is seen (model.md §18, src/model/shade.rs).

// A blob of optical depth t is seen h(t) = t (a + b t) sigma before its centre, and beyond a depth
// no nearer to its front.
const float DEEPEST_SEEN = 8.0;
const vec2 SEEN_BEFORE = vec2(0.2943, -0.01546);
