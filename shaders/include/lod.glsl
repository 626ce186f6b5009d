// What the kernels of the pass "lod" share (src/passes/lod.rs).

// 1: some particles have textures, and are left alone.
#ifndef TEXTURED
#define TEXTURED 0
#endif

// The key of a blob that stays alone.
const uint NO_KEY = 0xFFFFFFFFu;
const float CLASSES_PER_OCTAVE = 4.0;
// Classes below 31, so that no key is NO_KEY.
const int N_CLASSES = 31;
const uint CELLS_PER_AXIS = 512;
// Places of the order that a run lies in: one blob stands for so many at most.
const uint RUN = 256;
