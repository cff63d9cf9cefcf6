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

#endif
