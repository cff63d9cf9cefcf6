/* Three-dimensional vectors, passed by value. */
#ifndef AHRS_VEC3_H
#define AHRS_VEC3_H

#include "ahrs_real.h"

typedef struct {
    ahrs_real x, y, z;
} ahrs_vec3;

static inline ahrs_vec3 ahrs_vec3_of(const ahrs_real v[3]) { return (ahrs_vec3){v[0], v[1], v[2]}; }

static inline void ahrs_vec3_to(ahrs_real out[3], ahrs_vec3 v) {
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

static inline ahrs_vec3 ahrs_vec3_add(ahrs_vec3 a, ahrs_vec3 b) { return (ahrs_vec3){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline ahrs_vec3 ahrs_vec3_sub(ahrs_vec3 a, ahrs_vec3 b) { return (ahrs_vec3){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline ahrs_vec3 ahrs_vec3_scale(ahrs_vec3 a, ahrs_real k) { return (ahrs_vec3){a.x * k, a.y * k, a.z * k}; }
static inline ahrs_vec3 ahrs_vec3_negate(ahrs_vec3 a) { return (ahrs_vec3){-a.x, -a.y, -a.z}; }

/* a + k b */
static inline ahrs_vec3 ahrs_vec3_add_scaled(ahrs_vec3 a, ahrs_real k, ahrs_vec3 b) {
    return (ahrs_vec3){a.x + k * b.x, a.y + k * b.y, a.z + k * b.z};
}

static inline ahrs_real ahrs_vec3_dot(ahrs_vec3 a, ahrs_vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

static inline ahrs_vec3 ahrs_vec3_cross(ahrs_vec3 a, ahrs_vec3 b) {
    return (ahrs_vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline ahrs_real ahrs_vec3_norm2(ahrs_vec3 a) { return ahrs_vec3_dot(a, a); }
static inline ahrs_real ahrs_vec3_norm(ahrs_vec3 a) { return ahrs_sqrt(ahrs_vec3_norm2(a)); }

/* The caller makes sure that the vector is not zero. */
static inline ahrs_vec3 ahrs_vec3_unit(ahrs_vec3 a) { return ahrs_vec3_scale(a, 1 / ahrs_vec3_norm(a)); }

/* Every element within [-limit, limit]. */
static inline ahrs_vec3 ahrs_vec3_limited(ahrs_vec3 v, ahrs_real limit) {
    return (ahrs_vec3){ahrs_clamp(v.x, -limit, limit), ahrs_clamp(v.y, -limit, limit), ahrs_clamp(v.z, -limit, limit)};
}

static inline bool ahrs_vec3_is_finite(ahrs_vec3 a) {
    return ahrs_is_finite(a.x) && ahrs_is_finite(a.y) && ahrs_is_finite(a.z);
}

#endif
