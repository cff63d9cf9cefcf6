/* Unit quaternions, Hamilton product, scalar first, passed by value.
 * As an attitude q turns body vectors into navigation vectors: v_n = q v_b q* (docs/algorithms.md section 0). */
#ifndef AHRS_QUAT_H
#define AHRS_QUAT_H

#include "mat3.h"
#include "trig.h"

typedef struct {
    ahrs_real w, x, y, z;
} ahrs_quat;

#define AHRS_QUAT_IDENTITY ((ahrs_quat){1, 0, 0, 0})

static inline ahrs_quat ahrs_quat_of(const ahrs_real q[4]) { return (ahrs_quat){q[0], q[1], q[2], q[3]}; }

static inline void ahrs_quat_to(ahrs_real out[4], ahrs_quat q) {
    out[0] = q.w;
    out[1] = q.x;
    out[2] = q.y;
    out[3] = q.z;
}

static inline ahrs_quat ahrs_quat_mul(ahrs_quat p, ahrs_quat q) {
    return (ahrs_quat){(p.w * q.w - p.x * q.x) - (p.y * q.y + p.z * q.z),
                       (p.w * q.x + p.x * q.w) + (p.y * q.z - p.z * q.y),
                       (p.w * q.y + p.y * q.w) + (p.z * q.x - p.x * q.z),
                       (p.w * q.z + p.z * q.w) + (p.x * q.y - p.y * q.x)};
}

static inline ahrs_quat ahrs_quat_conj(ahrs_quat q) { return (ahrs_quat){q.w, -q.x, -q.y, -q.z}; }
static inline ahrs_quat ahrs_quat_negate(ahrs_quat q) { return (ahrs_quat){-q.w, -q.x, -q.y, -q.z}; }
static inline ahrs_real ahrs_quat_dot(ahrs_quat p, ahrs_quat q) { return (p.w * q.w + p.x * q.x) + (p.y * q.y + p.z * q.z); }

static inline ahrs_quat ahrs_quat_add(ahrs_quat p, ahrs_quat q) {
    return (ahrs_quat){p.w + q.w, p.x + q.x, p.y + q.y, p.z + q.z};
}

static inline ahrs_quat ahrs_quat_sub(ahrs_quat p, ahrs_quat q) {
    return (ahrs_quat){p.w - q.w, p.x - q.x, p.y - q.y, p.z - q.z};
}

static inline ahrs_quat ahrs_quat_scale(ahrs_quat q, ahrs_real k) {
    return (ahrs_quat){q.w * k, q.x * k, q.y * k, q.z * k};
}

/* q, or -q where that is nearer to the reference: the same attitude without a jump of sign. */
static inline ahrs_quat ahrs_quat_near(ahrs_quat q, ahrs_quat reference) {
    return ahrs_quat_dot(q, reference) < 0 ? ahrs_quat_negate(q) : q;
}

/* The caller makes sure that q is not zero. */
static inline ahrs_quat ahrs_quat_unit(ahrs_quat q) { return ahrs_quat_scale(q, 1 / ahrs_sqrt(ahrs_quat_dot(q, q))); }

/* Takes out the rounding of a product of unit quaternions: one Newton step of 1/sqrt at 1. */
static inline ahrs_quat ahrs_quat_refine(ahrs_quat q) {
    return ahrs_quat_scale(q, AHRS_C(1.5) - AHRS_C(0.5) * ahrs_quat_dot(q, q));
}

/* cos(n/2) and sin(n/2)/n of a rotation vector whose length n has the square n2. */
AHRS_INLINE void ahrs_half_angle(ahrs_real n2, ahrs_real *cosine, ahrs_real *sinc) {
    if (AHRS_UNLIKELY(n2 > AHRS_C(0.01))) {
        const ahrs_real n = ahrs_sqrt(n2);
        ahrs_real s, c;
        ahrs_sincos(AHRS_C(0.5) * n, &s, &c);
        *cosine = c;
        *sinc = s / n;
    } else {
        /* The rotation of one sample seldom exceeds 0.1 rad: the series are short. */
        const ahrs_real n4 = n2 * n2;
        *cosine = (1 - n2 * (AHRS_C(1.0) / 8)) + n4 * (AHRS_C(1.0) / 384 - n2 * (AHRS_C(1.0) / 46080));
        *sinc = (AHRS_C(0.5) - n2 * (AHRS_C(1.0) / 48)) + n4 * (AHRS_C(1.0) / 3840 - n2 * (AHRS_C(1.0) / 645120));
    }
}

/* Rotation vector to quaternion: [cos(|v|/2), sin(|v|/2) v/|v|]. */
AHRS_INLINE ahrs_quat ahrs_quat_exp(ahrs_vec3 v) {
    ahrs_real c, k;
    ahrs_half_angle(ahrs_vec3_norm2(v), &c, &k);
    return (ahrs_quat){c, k * v.x, k * v.y, k * v.z};
}

/* q exp(v), the attitude q after the body has turned by v. The product of q and the vector, [0, v], does not wait for
 * the series. */
AHRS_INLINE ahrs_quat ahrs_quat_turn(ahrs_quat q, ahrs_vec3 v) {
    ahrs_real c, k;
    ahrs_half_angle(ahrs_vec3_norm2(v), &c, &k);
    return (ahrs_quat){c * q.w - k * (q.x * v.x + q.y * v.y + q.z * v.z),
                       c * q.x + k * (q.w * v.x + q.y * v.z - q.z * v.y),
                       c * q.y + k * (q.w * v.y + q.z * v.x - q.x * v.z),
                       c * q.z + k * (q.w * v.z + q.x * v.y - q.y * v.x)};
}

/* Quaternion to the shortest rotation vector. */
static inline ahrs_vec3 ahrs_quat_log(ahrs_quat q) {
    const ahrs_quat p = q.w < 0 ? ahrs_quat_negate(q) : q;
    const ahrs_vec3 v = {p.x, p.y, p.z};
    const ahrs_real sine = ahrs_vec3_norm(v);
    /* Below this the angle and its sine agree to the last bit. */
    const ahrs_real k = sine < AHRS_C(1e-4) * ahrs_sqrt(AHRS_REAL_EPSILON) ? 2 / p.w : 2 * ahrs_atan2(sine, p.w) / sine;
    return ahrs_vec3_scale(v, k);
}

/* The rows of C_nb: the navigation axes seen in body axes. */
enum { AHRS_NORTH, AHRS_EAST, AHRS_DOWN };

static inline ahrs_vec3 ahrs_quat_north(ahrs_quat q) {
    return (ahrs_vec3){(q.w * q.w + q.x * q.x) - (q.y * q.y + q.z * q.z), 2 * (q.x * q.y - q.w * q.z),
                       2 * (q.x * q.z + q.w * q.y)};
}

static inline ahrs_vec3 ahrs_quat_east(ahrs_quat q) {
    return (ahrs_vec3){2 * (q.x * q.y + q.w * q.z), (q.w * q.w - q.x * q.x) + (q.y * q.y - q.z * q.z),
                       2 * (q.y * q.z - q.w * q.x)};
}

static inline ahrs_vec3 ahrs_quat_down(ahrs_quat q) {
    return (ahrs_vec3){2 * (q.x * q.z - q.w * q.y), 2 * (q.y * q.z + q.w * q.x),
                       (q.w * q.w - q.x * q.x) - (q.y * q.y - q.z * q.z)};
}

AHRS_INLINE ahrs_mat3 ahrs_quat_to_mat3(ahrs_quat q) {
    return (ahrs_mat3){{ahrs_quat_north(q), ahrs_quat_east(q), ahrs_quat_down(q)}};
}

/* Body to navigation, and back. */
static inline ahrs_vec3 ahrs_quat_rotate(ahrs_quat q, ahrs_vec3 v) { return ahrs_mat3_apply(ahrs_quat_to_mat3(q), v); }

static inline ahrs_vec3 ahrs_quat_rotate_back(ahrs_quat q, ahrs_vec3 v) {
    return ahrs_mat3_apply_transposed(ahrs_quat_to_mat3(q), v);
}

/* From a rotation matrix, whose entries give four times the products of one component with all of them. That
 * component, half the root of the pivot, is the largest one: no division is by a small number. */
static inline ahrs_quat ahrs_quat_from_mat3(ahrs_mat3 c) {
    const ahrs_vec3 *r = c.row;
    ahrs_quat q;
    ahrs_real pivot;
    if (r[0].x + r[1].y + r[2].z > 0) {
        pivot = 1 + r[0].x + r[1].y + r[2].z;
        q = (ahrs_quat){pivot, r[2].y - r[1].z, r[0].z - r[2].x, r[1].x - r[0].y};
    } else if (r[0].x >= r[1].y && r[0].x >= r[2].z) {
        pivot = 1 + r[0].x - r[1].y - r[2].z;
        q = (ahrs_quat){r[2].y - r[1].z, pivot, r[1].x + r[0].y, r[0].z + r[2].x};
    } else if (r[1].y >= r[2].z) {
        pivot = 1 - r[0].x + r[1].y - r[2].z;
        q = (ahrs_quat){r[0].z - r[2].x, r[1].x + r[0].y, pivot, r[2].y + r[1].z};
    } else {
        pivot = 1 - r[0].x - r[1].y + r[2].z;
        q = (ahrs_quat){r[1].x - r[0].y, r[0].z + r[2].x, r[2].y + r[1].z, pivot};
    }
    return ahrs_quat_scale(q, AHRS_C(0.5) / pivot * ahrs_sqrt(pivot));
}

/* Roll, pitch and yaw, z-y-x order (docs/algorithms.md section 0). */
static inline ahrs_vec3 ahrs_quat_to_euler(ahrs_quat q) {
    const ahrs_vec3 down = ahrs_quat_down(q);
    const ahrs_real north_x = (q.w * q.w + q.x * q.x) - (q.y * q.y + q.z * q.z);
    /* The arc tangent keeps its accuracy at 90 deg of pitch, where the arc sine loses half of the digits. */
    const ahrs_real level = ahrs_sqrt(down.y * down.y + down.z * down.z);
    return (ahrs_vec3){ahrs_atan2(down.y, down.z), ahrs_atan2(-down.x, level),
                       ahrs_atan2(2 * (q.x * q.y + q.w * q.z), north_x)};
}

static inline ahrs_quat ahrs_quat_from_euler(ahrs_vec3 euler) {
    ahrs_real sr, cr, sp, cp, sy, cy;
    ahrs_sincos(AHRS_C(0.5) * euler.x, &sr, &cr);
    ahrs_sincos(AHRS_C(0.5) * euler.y, &sp, &cp);
    ahrs_sincos(AHRS_C(0.5) * euler.z, &sy, &cy);
    return (ahrs_quat){cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
                       cr * cp * sy - sr * sp * cy};
}

#endif
