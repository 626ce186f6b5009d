#version 460
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "each.glsl"

// Merges sources into clusters, one height of the tree at a time (model.md §7, passes.md
// "tree"). In: the clusters or facets below. Out: clusters with mean place, mean normal, radius,
// flux and second moments. Error: that of plain sums over at most 4 children.

layout(push_constant) uniform Push {
    uint i_first;
    uint n_merges;
    uint n_lights;
} push;
// Nodes by height.
READS(0, uint, merges)
READS(1, Node, nodes)
UPDATES(2, Source, sources)
UPDATES(3, vec4, fluxes)

void main() {
    FOR_EACH(k, push.n_merges) {
        uint i = merges[push.i_first + k];
        uint end = i + nodes[i].n_nodes;
        vec3 flux = vec3(0.0), by_flux = vec3(0.0), by_area = vec3(0.0), normal_by_flux = vec3(0.0),
             normal_by_area = vec3(0.0);
        float weight = 0.0, total_area = 0.0, square_area = 0.0;
        for (uint c = i + 1u; c < end; c += nodes[c].n_nodes) {
            Source child = sources[c];
            float w = child.sent.x + child.sent.y + child.sent.z, area = child.extent.x;
            weight += w;
            by_flux += w * child.place.xyz;
            normal_by_flux += w * child.face.xyz;
            by_area += area * child.place.xyz;
            normal_by_area += area * child.face.xyz;
            flux += child.sent.xyz;
            total_area += area;
            square_area += area * child.face.w;
        }
        // Without light areas are the weights; facets without area take the first child's place.
        bool shines = weight > 0.0;
        float whole = shines ? weight : total_area;
        float inverse = whole > 0.0 ? 1.0 / whole : 0.0;
        vec3 position =
            whole > 0.0 ? (shines ? by_flux : by_area) * inverse : sources[i + 1u].place.xyz;
        vec3 normal = whole > 0.0 ? (shines ? normal_by_flux : normal_by_area) * inverse
                                  : sources[i + 1u].face.xyz;
        float radius = 0.0;
        vec3 square = vec3(0.0), leaning = vec3(0.0);
        for (uint c = i + 1u; c < end; c += nodes[c].n_nodes) {
            Source child = sources[c];
            vec3 apart = child.place.xyz - position;
            radius = max(radius, length(apart) + child.place.w);
            float w =
                (shines ? child.sent.x + child.sent.y + child.sent.z : child.extent.x) * inverse;
            square += w * (child.extent.yzw + apart * apart);
            leaning += w * (child.leaning.xyz + apart.xxy * apart.yzz);
        }
        float area = total_area > 0.0 ? square_area / total_area : 0.0;
        sources[i] = Source(
            vec4(position, radius), vec4(flux, float(nodes[i].n_nodes)), vec4(normal, area),
            vec4(total_area, square), vec4(leaning, 0.0)
        );
        for (uint l = 0u; l < push.n_lights; ++l) {
            vec4 sum = vec4(0.0);
            for (uint c = i + 1u; c < end; c += nodes[c].n_nodes) {
                sum += fluxes[c * push.n_lights + l];
            }
            fluxes[i * push.n_lights + l] = sum;
        }
    }
}
