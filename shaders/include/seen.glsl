// How deep a blob is seen (model.md §18, src/model/shade.rs).

// Coefficients of h(t) = t (a + b t), the distance in sigma before its centre at which a blob of
// optical depth t is seen. Beyond the greatest depth h stays as it is there.
const float DEEPEST_SEEN = 8.0;
const vec2 SEEN_BEFORE = vec2(0.2943, -0.01546);
