// Light of suns and lamps that cells send out (model.md §18). Needs medium.glsl and the
// texels `arrived`: by cell albedo' U beside the extinction, and albedo' W along each axis.

vec4 arrived_at(int k) { return uintBitsToFloat(TEXEL(arrived, k)); }
float mean_of(vec3 v) { return dot(v, vec3(1.0 / 3.0)); }

struct OfSuns {
    // albedo' U
    vec3 all;
    // The share that comes along `way`; the rest comes evenly from all sides.
    float directed;
    vec3 way;
};

OfSuns of_suns(int c) {
    vec3 all = arrived_at(4 * c).rgb;
    vec3 flux = vec3(
        mean_of(arrived_at(4 * c + 1).rgb), mean_of(arrived_at(4 * c + 2).rgb),
        mean_of(arrived_at(4 * c + 3).rgb)
    );
    float fluence = mean_of(all), most = max(abs(flux.x), max(abs(flux.y), abs(flux.z)));
    // The square of less, deep in a cloud, would have few digits.
    if (fluence <= 0.0 || most < 1e-30) {
        return OfSuns(all, 0.0, vec3(0.0));
    }
    vec3 part = flux / most;
    return OfSuns(all, min(most / fluence * length(part), 1.0), normalize(part));
}

// Returns 4 pi times Henyey's and Greenstein's phase function from the way to w.
float lobe(OfSuns suns, float g, vec3 w) {
    // Light that goes back is that of -g from behind.
    vec3 bend = w - (g < 0.0 ? -suns.way : suns.way);
    return henyey_greenstein(abs(g), 0.5 * dot(bend, bend)) / INV_FOUR_PI;
}
