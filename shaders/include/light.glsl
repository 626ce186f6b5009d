// How a light reaches a point with nothing in between (src/model/light.rs).

// Optical depth of a way that a surface bars, and to a light without energy. No factor on depths,
// be it 0, lets light through.
const float BARRED_DEPTH = 1e30;

struct Arrival {
    vec3 toward;
    float distance;
    float falloff;
};

Arrival arrival_at(Light light, vec3 p) {
    if (light.kind != LIGHT_POINT) {
        return Arrival(light.toward, 3.4e38, 1.0);
    }
    vec3 offset = light.position - p;
    float d = length(offset);
    // At the light itself any direction will do.
    vec3 toward = d > 0.0 ? offset / d : vec3(0.0, 1.0, 0.0);
    float reach = max(d, light.radius);
    float cone = clamp(light.cone_scale * dot(toward, light.toward) + light.cone_offset, 0.0, 1.0);
    return Arrival(toward, d, cone * cone / (reach * reach));
}

// Returns the irradiance on facets at `cosine` to the light as a share of its energy; v is what
// arrives of the energy before the cosine.
vec4 share_by(Light light, float cosine, vec4 v) {
    return light.kind == LIGHT_SKY ? v * (0.5 + 0.5 * cosine) + light.constant
                                   : v * max(cosine, 0.0);
}

// Returns the same for a facet of normal n; v is the transmittance toward the light.
float share_of(Light light, Arrival a, vec3 n, float v) {
    return share_by(light, dot(n, a.toward), vec4(a.falloff * v)).x;
}
