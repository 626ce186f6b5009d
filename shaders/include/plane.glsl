// A plane C + s u + t v, solved for a ray by Cramer's rule: U x V, C.(U x V); V x C, |u|; C x U,
// |v|.
// C is relative to the eye; U = u/|u| and V = v/|v|, all along (right, up, forward). |.| is the
// greatest component, since f32 holds no product of two lengths of 1e-15 with a third.
struct RayPlane {
    vec4 normal;
    vec4 s;
    vec4 t;
};

float greatest(vec3 v) {
    v = abs(v);
    return max(max(v.x, v.y), v.z);
}

// Returns the plane of unit directions u and v through c.
RayPlane ray_plane(vec3 c, vec3 u, vec3 v, float length_u, float length_v) {
    vec3 n = cross(u, v);
    return RayPlane(vec4(n, dot(c, n)), vec4(cross(v, c), length_u), vec4(cross(c, u), length_v));
}
