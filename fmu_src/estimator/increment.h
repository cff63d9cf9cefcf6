/* Rotation of one sample as truncated series in the angle increment d = rate times interval; q (x) increment is the
 * attitude after it, not of unit length (docs/algorithms.md section 1). */
#ifndef AHRS_INCREMENT_H
#define AHRS_INCREMENT_H

#include "quat.h"

/* rad: beyond this the series mean nothing, and the exact rotation takes their place. */
#define AHRS_INCREMENT_MAX AHRS_C(1.0)

AHRS_INLINE bool ahrs_increment_is_large(ahrs_real s) { return AHRS_UNLIKELY(s > AHRS_INCREMENT_MAX * AHRS_INCREMENT_MAX); }

/* First order: 1 + OM(d)/2. */
static inline ahrs_quat ahrs_increment_first(ahrs_vec3 d) {
    if (ahrs_increment_is_large(ahrs_vec3_norm2(d))) {
        return ahrs_quat_exp(d);
    }
    return (ahrs_quat){1, AHRS_C(0.5) * d.x, AHRS_C(0.5) * d.y, AHRS_C(0.5) * d.z};
}

/* Second order. */
static inline ahrs_quat ahrs_increment_second(ahrs_vec3 d) {
    const ahrs_real s = ahrs_vec3_norm2(d);
    if (ahrs_increment_is_large(s)) {
        return ahrs_quat_exp(d);
    }
    return (ahrs_quat){1 - AHRS_C(0.125) * s, AHRS_C(0.5) * d.x, AHRS_C(0.5) * d.y, AHRS_C(0.5) * d.z};
}

/* Fourth order. */
static inline ahrs_quat ahrs_increment(ahrs_vec3 d) {
    const ahrs_real s = ahrs_vec3_norm2(d);
    if (ahrs_increment_is_large(s)) {
        return ahrs_quat_exp(d);
    }
    const ahrs_real k = AHRS_C(0.5) - s / 48;
    return (ahrs_quat){1 - s / 8 + s * s / 384, k * d.x, k * d.y, k * d.z};
}

#endif
