/* 3 x 3 matrices, row by row, passed by value. */
#ifndef AHRS_MAT3_H
#define AHRS_MAT3_H

#include "vec3.h"

typedef struct {
    ahrs_vec3 row[3];
} ahrs_mat3;

static inline ahrs_vec3 ahrs_mat3_apply(ahrs_mat3 m, ahrs_vec3 v) {
    return (ahrs_vec3){ahrs_vec3_dot(m.row[0], v), ahrs_vec3_dot(m.row[1], v), ahrs_vec3_dot(m.row[2], v)};
}

/* transpose(m) v */
static inline ahrs_vec3 ahrs_mat3_apply_transposed(ahrs_mat3 m, ahrs_vec3 v) {
    const ahrs_vec3 xy = ahrs_vec3_add_scaled(ahrs_vec3_scale(m.row[0], v.x), v.y, m.row[1]);
    return ahrs_vec3_add_scaled(xy, v.z, m.row[2]);
}

static inline ahrs_mat3 ahrs_mat3_mul(ahrs_mat3 a, ahrs_mat3 b) {
    return (ahrs_mat3){{ahrs_mat3_apply_transposed(b, a.row[0]), ahrs_mat3_apply_transposed(b, a.row[1]),
                        ahrs_mat3_apply_transposed(b, a.row[2])}};
}

static inline ahrs_mat3 ahrs_mat3_of(const ahrs_real m[9]) {
    return (ahrs_mat3){{ahrs_vec3_of(m), ahrs_vec3_of(m + 3), ahrs_vec3_of(m + 6)}};
}

static inline void ahrs_mat3_to(ahrs_real out[9], ahrs_mat3 m) {
    ahrs_vec3_to(out, m.row[0]);
    ahrs_vec3_to(out + 3, m.row[1]);
    ahrs_vec3_to(out + 6, m.row[2]);
}

/* transpose(a) b */
static inline ahrs_mat3 ahrs_mat3_transposed_mul(ahrs_mat3 a, ahrs_mat3 b) {
    return (ahrs_mat3){{
        ahrs_mat3_apply_transposed(b, (ahrs_vec3){a.row[0].x, a.row[1].x, a.row[2].x}),
        ahrs_mat3_apply_transposed(b, (ahrs_vec3){a.row[0].y, a.row[1].y, a.row[2].y}),
        ahrs_mat3_apply_transposed(b, (ahrs_vec3){a.row[0].z, a.row[1].z, a.row[2].z}),
    }};
}

/* Symmetric 3 x 3 matrices: the lower triangle, row by row. */
typedef struct {
    ahrs_real xx, yx, yy, zx, zy, zz;
} ahrs_sym3;

static inline ahrs_sym3 ahrs_sym3_of(const ahrs_real a[6]) { return (ahrs_sym3){a[0], a[1], a[2], a[3], a[4], a[5]}; }

static inline void ahrs_sym3_to(ahrs_real out[6], ahrs_sym3 a) {
    out[0] = a.xx;
    out[1] = a.yx;
    out[2] = a.yy;
    out[3] = a.zx;
    out[4] = a.zy;
    out[5] = a.zz;
}

static inline ahrs_mat3 ahrs_sym3_full(ahrs_sym3 a) {
    return (ahrs_mat3){{{a.xx, a.yx, a.zx}, {a.yx, a.yy, a.zy}, {a.zx, a.zy, a.zz}}};
}

static inline ahrs_sym3 ahrs_sym3_scale(ahrs_sym3 a, ahrs_real k) {
    return (ahrs_sym3){k * a.xx, k * a.yx, k * a.yy, k * a.zx, k * a.zy, k * a.zz};
}

static inline ahrs_sym3 ahrs_sym3_add_diagonal(ahrs_sym3 a, ahrs_real k) {
    return (ahrs_sym3){a.xx + k, a.yx, a.yy + k, a.zx, a.zy, a.zz + k};
}

static inline ahrs_vec3 ahrs_sym3_apply(ahrs_sym3 a, ahrs_vec3 v) {
    return (ahrs_vec3){a.xx * v.x + a.yx * v.y + a.zx * v.z, a.yx * v.x + a.yy * v.y + a.zy * v.z,
                       a.zx * v.x + a.zy * v.y + a.zz * v.z};
}

/* Lower triangle of a b, for products that are symmetric. */
static inline ahrs_sym3 ahrs_sym3_product(ahrs_mat3 a, ahrs_mat3 b) {
    const ahrs_vec3 x = {b.row[0].x, b.row[1].x, b.row[2].x}, y = {b.row[0].y, b.row[1].y, b.row[2].y},
                    z = {b.row[0].z, b.row[1].z, b.row[2].z};
    return (ahrs_sym3){ahrs_vec3_dot(a.row[0], x), ahrs_vec3_dot(a.row[1], x), ahrs_vec3_dot(a.row[1], y),
                       ahrs_vec3_dot(a.row[2], x), ahrs_vec3_dot(a.row[2], y), ahrs_vec3_dot(a.row[2], z)};
}

/* The same of transpose(a) b. */
static inline ahrs_sym3 ahrs_sym3_transposed_product(ahrs_mat3 a, ahrs_mat3 b) {
    const ahrs_vec3 *const r = a.row, *const s = b.row;
    return (ahrs_sym3){r[0].x * s[0].x + r[1].x * s[1].x + r[2].x * s[2].x,
                       r[0].y * s[0].x + r[1].y * s[1].x + r[2].y * s[2].x,
                       r[0].y * s[0].y + r[1].y * s[1].y + r[2].y * s[2].y,
                       r[0].z * s[0].x + r[1].z * s[1].x + r[2].z * s[2].x,
                       r[0].z * s[0].y + r[1].z * s[1].y + r[2].z * s[2].y,
                       r[0].z * s[0].z + r[1].z * s[1].z + r[2].z * s[2].z};
}

#endif
