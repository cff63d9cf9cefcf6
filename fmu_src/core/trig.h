/* Sine, cosine, arc tangent and exponential from + - * / and the square root, so that their bits do not depend
 * on a C library. Accurate to about one unit in the last place for the arguments an estimator meets. */
#ifndef AHRS_TRIG_H
#define AHRS_TRIG_H

#include "ahrs_real.h"

/* Beyond this angle the position within a turn is no longer known well enough to mean anything. */
#define AHRS_ANGLE_MAX AHRS_C(1e6)

/* The half turn split into parts of few bits, so that k times the leading parts is exact. */
#ifdef AHRS_SINGLE
#define AHRS_HALF_PI_1 1.5703125f
#define AHRS_HALF_PI_2 0.0004837512969970703f
#define AHRS_HALF_PI_3 7.54979e-08f
#define AHRS_LN2_1 0.693115234375f
#define AHRS_LN2_2 3.1946183e-05f
#else
#define AHRS_HALF_PI_1 1.5707963267341256
#define AHRS_HALF_PI_2 6.077100506303966e-11
#define AHRS_HALF_PI_3 2.0222662487959506e-21
#define AHRS_LN2_1 0.6931471804855391
#define AHRS_LN2_2 7.440617110012397e-11
#endif

/* cos(x) and sin(x)/x as series in x^2 for |x| <= pi/4, in pairs of terms that do not wait for each other. */
static inline ahrs_real ahrs_cos_series(ahrs_real x2) {
    const ahrs_real x4 = x2 * x2;
    const ahrs_real low = (1 - AHRS_C(0.5) * x2) + x4 * (AHRS_C(0.041666666666666664) - AHRS_C(0.001388888888888889) * x2);
    const ahrs_real high = (AHRS_C(2.48015873015873e-05) - AHRS_C(2.7557319223985893e-07) * x2) +
                           x4 * (AHRS_C(2.08767569878681e-09) - AHRS_C(1.1470745597729725e-11) * x2 +
                                 AHRS_C(4.779477332387385e-14) * x4);
    return low + (x4 * x4) * high;
}

static inline ahrs_real ahrs_sinc_series(ahrs_real x2) {
    const ahrs_real x4 = x2 * x2;
    const ahrs_real low = (1 - AHRS_C(0.16666666666666666) * x2) +
                          x4 * (AHRS_C(0.008333333333333333) - AHRS_C(0.0001984126984126984) * x2);
    const ahrs_real high = (AHRS_C(2.7557319223985893e-06) - AHRS_C(2.505210838544172e-08) * x2) +
                           x4 * (AHRS_C(1.6059043836821613e-10) - AHRS_C(7.647163731819816e-13) * x2);
    return low + (x4 * x4) * high;
}

static inline void ahrs_sincos(ahrs_real x, ahrs_real *sine, ahrs_real *cosine) {
    if (!(ahrs_abs(x) <= AHRS_ANGLE_MAX)) {
        *sine = 0;
        *cosine = 1;
        return;
    }
    const ahrs_real turns = x * (2 / AHRS_PI);
    const int32_t k = (int32_t)(turns + (turns < 0 ? AHRS_C(-0.5) : AHRS_C(0.5)));
    const ahrs_real n = (ahrs_real)k;
    const ahrs_real r = ((x - n * AHRS_HALF_PI_1) - n * AHRS_HALF_PI_2) - n * AHRS_HALF_PI_3;
    const ahrs_real c = ahrs_cos_series(r * r);
    const ahrs_real s = r * ahrs_sinc_series(r * r);
    switch (k & 3) {
    case 0: *sine = s; *cosine = c; break;
    case 1: *sine = c; *cosine = -s; break;
    case 2: *sine = -s; *cosine = -c; break;
    default: *sine = -c; *cosine = s; break;
    }
}

/* The angle of the point (x, y); 0 for the origin. */
static inline ahrs_real ahrs_atan2(ahrs_real y, ahrs_real x) {
    static const ahrs_real ATAN_EIGHTHS[9] = {
        AHRS_C(0.0), AHRS_C(0.12435499454676144), AHRS_C(0.24497866312686414),
        AHRS_C(0.35877067027057225), AHRS_C(0.4636476090008061), AHRS_C(0.5585993153435624),
        AHRS_C(0.6435011087932844), AHRS_C(0.7188299996216245), AHRS_C(0.7853981633974483)};
    const ahrs_real ax = ahrs_abs(x), ay = ahrs_abs(y);
    const bool steep = ay > ax;
    const ahrs_real large = steep ? ay : ax, small = steep ? ax : ay;
    if (!(large > 0) || !ahrs_is_finite(large)) {
        return 0;
    }
    /* atan(t) = atan(c) + atan((t - c)/(1 + t c)) with c the nearest eighth leaves |argument| <= 1/16. */
    const ahrs_real t = small / large;
    const int32_t k = (int32_t)(8 * t + AHRS_C(0.5));
    const ahrs_real c = (ahrs_real)k / 8;
    const ahrs_real z = (t - c) / (1 + t * c);
    const ahrs_real z2 = z * z;
    ahrs_real series = AHRS_C(0.07692307692307693);
    series = series * z2 - AHRS_C(0.09090909090909091);
    series = series * z2 + AHRS_C(0.1111111111111111);
    series = series * z2 - AHRS_C(0.14285714285714285);
    series = series * z2 + AHRS_C(0.2);
    series = series * z2 - AHRS_C(0.3333333333333333);
    ahrs_real angle = ATAN_EIGHTHS[k] + (z + z * z2 * series);
    angle = steep ? AHRS_PI / 2 - angle : angle;
    angle = x < 0 ? AHRS_PI - angle : angle;
    return y < 0 ? -angle : angle;
}

/* exp(-x) for x >= 0, infinity included. */
static inline ahrs_real ahrs_exp_decay(ahrs_real x) {
    static const ahrs_real INVERSE[15] = {
        AHRS_C(1.0) / 15, AHRS_C(1.0) / 14, AHRS_C(1.0) / 13, AHRS_C(1.0) / 12, AHRS_C(1.0) / 11,
        AHRS_C(1.0) / 10, AHRS_C(1.0) / 9,  AHRS_C(1.0) / 8,  AHRS_C(1.0) / 7,  AHRS_C(1.0) / 6,
        AHRS_C(1.0) / 5,  AHRS_C(1.0) / 4,  AHRS_C(1.0) / 3,  AHRS_C(1.0) / 2,  AHRS_C(1.0)};
    if (!(x < 80)) {
        return 0;
    }
    const int32_t k = (int32_t)(x * AHRS_C(1.4426950408889634) + AHRS_C(0.5));
    const ahrs_real n = (ahrs_real)k;
    const ahrs_real r = (x - n * AHRS_LN2_1) - n * AHRS_LN2_2;
    ahrs_real y = 1, half = AHRS_C(0.5);
    for (int32_t i = 0; i < 15; i++) {
        y = 1 - y * (r * INVERSE[i]);
    }
    /* y / 2^k, from powers of one half by squaring. */
    for (int32_t left = k; left > 0; left >>= 1) {
        y = left & 1 ? y * half : y;
        half *= half;
    }
    return y;
}

#endif
