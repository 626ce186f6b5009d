// The buffers that first.comp and first_tensor.comp read. Needs records.glsl and light.glsl.

const float INV_PI = 0.318309886183791;

READS(0, Facet, facets)
READS(1, Light, lights)
READS(2, float, transmittance)
TEXELS(3, regions)
#include "regions.glsl"
FLOATS(4, table)

#include "lobe.glsl"
