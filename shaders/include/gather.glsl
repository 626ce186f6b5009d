// What one facet receives from one source (docs/model.md §7, §11 "second"). Needs the buffers of second_gather.comp
// or of second_tensor.comp.

const float PI_INVERSE = 0.318309886183791;
// A lobe is met within this many of its widths (e^-18 of its peak beyond).
const float LOBE_REACH = 6.0;
// Cells no wider than this many widths of a lobe, times pair_size: at the default 0.5 the half vector turns by 3/4 of a
// width from one to the next, and the midpoint rule on a Gaussian is then exact to 1e-7.
const float LOBE_STEP = 3.0;
// Cells of one facet that are looked at, at most: no scene holds a device longer than its watchdog waits.
const uint MAX_STEPS = 65536u;

// By how much a cell of this width over its distance is too wide for the region's lobes, its half vector being `gap` from
// the normal and turning by `turn` within the cell: for the narrowest that can be met of all that its material has over
// time, so that the cells are the same at any time.
float lobe_excess(Region region, float gap, float turn, float width) {
    float beyond = sqrt(2.0 * gap) - turn;
    bool met = beyond < LOBE_REACH * region.lobe_width_most;
    float narrowest = max(region.lobe_width, beyond / LOBE_REACH);
    return met ? width / (LOBE_STEP * push.pair_size * narrowest) : 0.0;
}

// cos cos / (d^2 + A/pi) of unit `way` from receiver to source; 0 where either turns its back.
float form(vec3 receiver_normal, vec3 source_normal, vec3 way, float d2, float area) {
    float at_source = -dot(source_normal, way), at_receiver = dot(receiver_normal, way);
    return max(at_source, 0.0) * max(at_receiver, 0.0) / (d2 + area * PI_INVERSE);
}

// 1 where no surface of the veil hides q from p. Nothing is looked at where nothing would come.
float visible(Pairing pairing, Veil veil, vec3 p, vec3 q, bool wanted) {
    uint n = wanted ? veil.n : 0u;
    bool clear = true;
    for (uint k = 0u; k < n; ++k) {
        clear = clear && !hides(regions[occluder_of(pairing, veil, k)], p, q);
    }
    return clear ? 1.0 : 0.0;
}

#if MARCH
// e^{-(1-g) tau} between p and q through the density grid: equal steps over what lies in the grid's box, no longer than
// the march's own and no more than the pair's greatest number, midpoint samples.
float attenuation(vec3 p, vec3 q, bool wanted) {
    vec3 d = q - p;
    vec3 low = push.grid.low;
    vec3 high = low + push.grid.cell * vec3(push.grid.n_cells);
    // A way along an axis' planes divides by zero: the infinities sort themselves out, 0/0 is kept out.
    vec3 inverse = 1.0 / mix(d, vec3(1e-30), equal(d, vec3(0.0)));
    vec3 a = (low - p) * inverse, b = (high - p) * inverse;
    vec3 nearer = min(a, b), farther = max(a, b);
    float enter = max(max(nearer.x, nearer.y), max(nearer.z, 0.0));
    float leave = min(min(farther.x, farther.y), min(farther.z, 1.0));
    float part = max(leave - enter, 0.0);
    float distance = part * length(d);
    uint n = wanted && distance > 0.0 ? clamp(uint(ceil(distance / push.step_length)), 1u, push.pair_steps) : 0u;
    float sum = 0.0;
    for (uint k = 0; k < n; ++k) {
        sum += density_at(p + d * (enter + part * (float(k) + 0.5) / float(n)));
    }
    float depth = n > 0u ? push.backward * sum * distance / float(n) : 0.0;
    return depth > 0.0 ? exp(-depth) : 1.0;
}
#endif

// The lobe of a cell of a source toward `outgoing`, by light: radiance per area of the source times its whole area.
// `gap`: the least 1 - cos gamma of any light.
vec3 lobe_flux(uint i_source, Region emitter, vec3 p, vec3 normal, vec3 outgoing, out float gap) {
    vec3 sum = vec3(0.0);
    gap = 2.0;
    for (uint l = 0u; l < push.n_lights; ++l) {
        Light light = lights[l];
        float g = light.kind == LIGHT_SKY ? 0.0 : fluxes[i_source * push.n_lights + l].w;
        float w = half_vector_gap(normal, arrival_at(light, p).toward, outgoing);
        gap = g > 0.0 ? min(gap, w) : gap;
        sum += light.energy * (g * lobe_at(emitter.i_lobe, w));
    }
    return emitter.ks * sum;
}

// The least 1 - cos gamma that a cell of a source has between `outgoing` and any light that reaches it, as lobe_flux has it.
float lobe_gap(uint i_source, vec3 p, vec3 normal, vec3 outgoing) {
    float gap = 2.0;
    for (uint l = 0u; l < push.n_lights; ++l) {
        Light light = lights[l];
        float g = light.kind == LIGHT_SKY ? 0.0 : fluxes[i_source * push.n_lights + l].w;
        float w = half_vector_gap(normal, arrival_at(light, p).toward, outgoing);
        gap = g > 0.0 ? min(gap, w) : gap;
    }
    return gap;
}

// A cell of a facet: 4^level of them, row by row in Z order. Clouds' facets have no axes and are one cell.
struct Cell { uint level; uvec2 at; };

float cell_scale(Cell cell) { return uintBitsToFloat((127u - cell.level) << 23); }

// The next cell in Z order, (0, 0) of level 0 after the last.
Cell next_cell(Cell cell) {
    // Last children of last children are done together.
    uint up = min(uint(findLSB(~(cell.at.x & cell.at.y))), cell.level);
    cell.level -= up;
    cell.at >>= up;
    bool odd = (cell.at.x & 1u) != 0u;
    uvec2 next = odd ? uvec2(cell.at.x - 1u, cell.at.y + 1u) : uvec2(cell.at.x + 1u, cell.at.y);
    cell.at = cell.level == 0u ? uvec2(0u) : next;
    return cell;
}
