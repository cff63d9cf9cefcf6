/* Random numbers that are a pure function of (seed, stream, index): Philox4x32-10 and the normal
 * quantile AS 241, as in python/ahrs_fmu/counter_random.py, bit for bit. Always double, also in single
 * precision builds, and free of libm but for sqrt. Compile without contraction of a*b+c. */
#ifndef AHRS_RANDOM_H
#define AHRS_RANDOM_H

#include <math.h>
#include <stdint.h>
#include <string.h>

/* Four independent words of a counter. */
static inline void ahrs_random_words(uint64_t seed, uint64_t stream, uint64_t index, uint32_t out[4]) {
    uint32_t c0 = (uint32_t)index;
    uint32_t c1 = (uint32_t)(index >> 32);
    uint32_t c2 = (uint32_t)stream;
    uint32_t c3 = (uint32_t)(stream >> 32);
    uint32_t k0 = (uint32_t)seed;
    uint32_t k1 = (uint32_t)(seed >> 32);
    for (int round = 0; round < 10; ++round) {
        const uint64_t first = UINT64_C(0xD2511F53) * c0;
        const uint64_t second = UINT64_C(0xCD9E8D57) * c2;
        c0 = (uint32_t)(second >> 32) ^ c1 ^ k0;
        c1 = (uint32_t)second;
        c2 = (uint32_t)(first >> 32) ^ c3 ^ k1;
        c3 = (uint32_t)first;
        k0 += UINT32_C(0x9E3779B9);
        k1 += UINT32_C(0xBB67AE85);
    }
    out[0] = c0;
    out[1] = c1;
    out[2] = c2;
    out[3] = c3;
}

/* Two independent numbers, uniform in the open interval (0, 1). */
static inline void ahrs_random_uniform_pair(uint64_t seed, uint64_t stream, uint64_t index, double out[2]) {
    uint32_t w[4];
    ahrs_random_words(seed, stream, index, w);
    for (int i = 0; i < 2; ++i) {
        const uint64_t bits = (((uint64_t)w[2 * i + 1] << 32) | w[2 * i]) >> 12;
        out[i] = ((double)bits + 0.5) * 0x1p-52;
    }
}

static inline double ahrs_random_polynomial(const double *coefficients, int count, double x) {
    double value = coefficients[0];
    for (int i = 1; i < count; ++i) {
        value = value * x + coefficients[i];
    }
    return value;
}

/* Natural logarithm of a positive normal number: 2 artanh((m - 1) / (m + 1)) + e ln 2. */
static inline double ahrs_random_log(double x) {
    static const double terms[11] = {1.0 / 21, 1.0 / 19, 1.0 / 17, 1.0 / 15, 1.0 / 13, 1.0 / 11,
                                     1.0 / 9,  1.0 / 7,  1.0 / 5,  1.0 / 3,  1.0};
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    double e = (double)((int)(bits >> 52) - 1022);
    bits = (bits & UINT64_C(0x000FFFFFFFFFFFFF)) | UINT64_C(0x3FE0000000000000);
    double m;
    memcpy(&m, &bits, sizeof m);
    if (m < 0.7071067811865476) {
        m = m + m;
        e = e - 1.0;
    }
    const double s = (m - 1.0) / (m + 1.0);
    return 2.0 * s * ahrs_random_polynomial(terms, 11, s * s) + e * 0.6931471805599453;
}

/* Standard normal number of probability p in (0, 1). */
static inline double ahrs_random_normal_quantile(double p) {
    /* Numerator and denominator, highest power first: centre, shoulder, tail. */
    static const double coefficients[3][2][8] = {
        {{2509.0809287301226727, 33430.575583588128105, 67265.770927008700853, 45921.953931549871457,
          13731.693765509461125, 1971.5909503065514427, 133.14166789178437745, 3.387132872796366608},
         {5226.495278852545925, 28729.085735721942674, 39307.89580009271061, 21213.794301586595867,
          5394.1960214247511077, 687.1870074920579083, 42.313330701600911252, 1.0}},
        {{7.7454501427834140764e-4, 0.0227238449892691845833, 0.24178072517745061177, 1.27045825245236838258,
          3.64784832476320460504, 5.7694972214606914055, 4.6303378461565452959, 1.42343711074968357734},
         {1.05075007164441684324e-9, 5.475938084995344946e-4, 0.0151986665636164571966, 0.14810397642748007459,
          0.68976733498510000455, 1.6763848301838038494, 2.05319162663775882187, 1.0}},
        {{2.01033439929228813265e-7, 2.71155556874348757815e-5, 0.0012426609473880784386, 0.026532189526576123093,
          0.29656057182850489123, 1.7848265399172913358, 5.4637849111641143699, 6.6579046435011037772},
         {2.04426310338993978564e-15, 1.4215117583164458887e-7, 1.8463183175100546818e-5, 7.868691311456132591e-4,
          0.0148753612908506148525, 0.13692988092273580531, 0.59983220655588793769, 1.0}},
    };
    const double q = p - 0.5;
    if (q >= -0.425 && q <= 0.425) {
        const double r = 0.180625 - q * q;
        return q * (ahrs_random_polynomial(coefficients[0][0], 8, r) /
                    ahrs_random_polynomial(coefficients[0][1], 8, r));
    }
    const double r = sqrt(-ahrs_random_log(p < 0.5 ? p : 1.0 - p));
    const int region = r <= 5.0 ? 1 : 2;
    const double x = r - (region == 1 ? 1.6 : 5.0);
    const double magnitude = ahrs_random_polynomial(coefficients[region][0], 8, x) /
                             ahrs_random_polynomial(coefficients[region][1], 8, x);
    return p < 0.5 ? -magnitude : magnitude;
}

/* Two independent standard normal numbers. */
static inline void ahrs_random_normal_pair(uint64_t seed, uint64_t stream, uint64_t index, double out[2]) {
    ahrs_random_uniform_pair(seed, stream, index, out);
    out[0] = ahrs_random_normal_quantile(out[0]);
    out[1] = ahrs_random_normal_quantile(out[1]);
}

#endif
