/* Covariance of a filter that calibrates sensors (docs/accuracy.md): twelve states of the gyroscope, then those of the
 * magnetometer: field, hard iron and latency; or field and hard iron alone.
 *
 * Both halves are kept, row by row, and get the same bits, so that all work runs along rows; these are padded with
 * zeros to whole quads. Measurements are taken one after the other; the covariance follows once for all of them. Sizes
 * are arguments, so that they are constants wherever a function is inlined. */
#ifndef CALIBRATION_COVARIANCE_H
#define CALIBRATION_COVARIANCE_H

#include "mat3.h"

enum {
    AHRS_CAL_GYRO = 12,
    AHRS_CAL_IRON = 3, AHRS_CAL_LATENCY = 6, AHRS_CAL_MAG = 8, /* among the states of the magnetometer */
    AHRS_CAL_ROW = AHRS_CAL_GYRO + AHRS_CAL_MAG /* width of the covariance */
};

/* Sum of products in four parts that do not wait for each other; n is a multiple of four. */
AHRS_INLINE ahrs_real ahrs_cal_dot(int32_t n, const ahrs_real *a, const ahrs_real *b) {
    ahrs_real sum[4] = {a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]};
    for (int32_t i = 4; i < n; i += 4) {
        sum[0] += a[i] * b[i];
        sum[1] += a[i + 1] * b[i + 1];
        sum[2] += a[i + 2] * b[i + 2];
        sum[3] += a[i + 3] * b[i + 3];
    }
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/* y = P h for n rows h that see the gyroscope only, and n rows y. */
AHRS_INLINE void ahrs_cal_gyro_products(int32_t n, const ahrs_real *restrict cov, const ahrs_real *restrict h,
                                        ahrs_real *restrict y) {
    enum { WIDTH = AHRS_CAL_ROW, SIZE = AHRS_CAL_GYRO };
    for (int32_t k = 0; k < SIZE; k += 3) {
        const ahrs_real *const p = cov + WIDTH * k;
        for (int32_t j = 0; j < WIDTH; j++) {
            for (int32_t r = 0; r < n; r++) {
                const ahrs_real *const w = h + SIZE * r + k;
                const ahrs_real sum = (p[j] * w[0] + p[WIDTH + j] * w[1]) + p[2 * WIDTH + j] * w[2];
                y[WIDTH * r + j] = k > 0 ? y[WIDTH * r + j] + sum : sum;
            }
        }
    }
}

/* The three rows [I, R, c] of a magnetometer, padded. */
AHRS_INLINE void ahrs_cal_mag_rows(const ahrs_mat3 *R, ahrs_vec3 c, ahrs_real h[3 * AHRS_CAL_MAG]) {
    const ahrs_real lag[3] = {c.x, c.y, c.z};
    for (int32_t i = 0; i < 3 * AHRS_CAL_MAG; i++) {
        h[i] = 0;
    }
    for (int32_t r = 0; r < 3; r++) {
        ahrs_real *const own = h + AHRS_CAL_MAG * r;
        own[r] = 1;
        ahrs_vec3_to(own + AHRS_CAL_IRON, R->row[r]);
        own[AHRS_CAL_LATENCY] = lag[r];
    }
}

/* y = P h for these rows; `mag` are the rows of P that belong to the magnetometer, of `width`. */
AHRS_INLINE void ahrs_cal_mag_products(int32_t width, bool latency, const ahrs_real *restrict mag,
                                       const ahrs_real *restrict h, ahrs_real *restrict y) {
    for (int32_t j = 0; j < width; j++) {
        const ahrs_real *const p = mag + j;
        for (int32_t r = 0; r < 3; r++) {
            const ahrs_real *const w = h + AHRS_CAL_MAG * r + AHRS_CAL_IRON;
            const ahrs_real field = (p[width * r] + p[width * 3] * w[0]) + (p[width * 4] * w[1] + p[width * 5] * w[2]);
            y[width * r + j] = latency ? field + p[width * AHRS_CAL_LATENCY] * w[3] : field;
        }
    }
}

/* Measurements of n rows h times the state with one variance, one after the other; h stands at `first` of the state and
 * has rows of `size`. y goes in as P h, in rows of `width`, and comes out so that P less its squares is the new
 * covariance; the corrections are collected in dx. False where the covariance has lost its meaning. */
AHRS_INLINE bool ahrs_cal_measure(int32_t n, int32_t first, int32_t size, int32_t width, const ahrs_real *restrict h,
                                  const ahrs_real *restrict innovation, ahrs_real variance, ahrs_real *restrict y,
                                  ahrs_real *restrict dx) {
    for (int32_t r = 0; r < n; r++) {
        ahrs_real *const own = y + width * r;
        const ahrs_real sum = variance + ahrs_cal_dot(size, h + size * r, own + first);
        const ahrs_real rest = innovation[r] - ahrs_cal_dot(size, h + size * r, dx + first);
        if (!(sum >= variance && ahrs_is_finite(sum) && ahrs_is_finite(rest))) {
            return false;
        }
        const ahrs_real scale = 1 / ahrs_sqrt(sum), step = scale * rest;
        for (int32_t j = 0; j < width; j++) {
            own[j] *= scale;
            dx[j] += own[j] * step;
        }
        for (int32_t later = r + 1; later < n; later++) {
            ahrs_real *const other = y + width * later;
            const ahrs_real along = ahrs_cal_dot(size, h + size * later, own + first);
            for (int32_t j = 0; j < width; j++) {
                other[j] -= along * own[j];
            }
        }
    }
    return true;
}

/* P := P - the squares of n vectors y, for the first `rows` rows: the lower half, to whole quads, and its image. */
AHRS_INLINE void ahrs_cal_subtract(int32_t n, int32_t rows, int32_t width, const ahrs_real *restrict y,
                                   ahrs_real *restrict cov) {
    for (int32_t i = 0; i < rows; i++) {
        ahrs_real *const row = cov + width * i;
        const int32_t quads = i / 4 + 1;
        for (int32_t j = 0; j < 4 * quads; j++) {
            ahrs_real sum = y[i] * y[j];
            for (int32_t r = 1; r < n; r++) {
                sum += y[width * r + i] * y[width * r + j];
            }
            row[j] -= sum;
        }
        for (int32_t j = 0; j < 4 * (quads - 1); j++) {
            cov[width * j + i] = row[j];
        }
    }
}

#endif
