/* What may happen to the samples before an estimator sees them, each part switched on by parameters: the gyroscope's
 * zero, the magnetometer's calibration, the accelerometer's low-pass (docs/algorithms.md section 0). */
#ifndef AHRS_PREPROCESSING_H
#define AHRS_PREPROCESSING_H

#include "ahrs_estimator.h"
#include "conditions.h"
#include "trig.h"
#include "vec3.h"

#define AHRS_ZERO_FORCE AHRS_C(0.3) /* m/s2: mean specific force further from gravity is not rest */
#define AHRS_SQRT2 AHRS_C(1.41421356237309504880)

/* Of the cut-off period: after a longer step the low-pass begins anew. The parameters leave it below 0.4. */
#define AHRS_LOWPASS_STEP AHRS_C(0.45)

/* Hard iron and the unequal sensitivity of the axes taken out, in the axes of the user. No measurement, which is zero or
 * not a number, stays one. */
AHRS_INLINE ahrs_vec3 ahrs_calibrated_mag(const ahrs_estimator_params *p, const ahrs_real mag[3]) {
    const bool measured = mag[0] != 0 || mag[1] != 0 || mag[2] != 0;
    const ahrs_vec3 m = {(mag[0] - p->mag_offset[0]) * p->mag_gain[0], (mag[1] - p->mag_offset[1]) * p->mag_gain[1],
                         (mag[2] - p->mag_offset[2]) * p->mag_gain[2]};
    return measured ? m : (ahrs_vec3){0, 0, 0};
}

/* Takes one rate and the magnitude of the specific force into the means over a rest, until the zero is known; true when
 * it becomes so. A rest whose noise, force or mean rate is not that of a vehicle at rest is dropped for the next one. */
static inline bool ahrs_learn_gyro_zero(ahrs_estimator_state *s, const ahrs_estimator_params *p, ahrs_vec3 rate,
                                        ahrs_real force) {
    if (ahrs_condition(s, AHRS_HAS_GYRO_ZERO)) {
        return false;
    }
    if (s->zero_count == 0) {
        ahrs_vec3_to(s->gyro_zero, rate);
        s->gyro_spread = 0;
        s->force_excess = 0;
    }
    s->zero_count++;
    const ahrs_real n = (ahrs_real)s->zero_count;
    const ahrs_vec3 before = ahrs_vec3_of(s->gyro_zero);
    const ahrs_vec3 mean = ahrs_vec3_add_scaled(before, 1 / n, ahrs_vec3_sub(rate, before));
    ahrs_vec3_to(s->gyro_zero, mean);
    s->gyro_spread += ahrs_vec3_dot(ahrs_vec3_sub(rate, before), ahrs_vec3_sub(rate, mean));
    s->force_excess += (force - p->gravity - s->force_excess) / n;
    if (s->zero_count < p->gyro_zero_samples) {
        return false;
    }
    s->zero_count = 0;
    const bool at_rest = s->gyro_spread <= 3 * (n - 1) * (p->gyro_zero_std * p->gyro_zero_std) &&
                         ahrs_abs(s->force_excess) <= AHRS_ZERO_FORCE &&
                         ahrs_vec3_norm2(mean) <= p->gyro_zero_limit * p->gyro_zero_limit;
    ahrs_set_condition(s, AHRS_HAS_GYRO_ZERO, at_rest);
    return at_rest;
}

static inline ahrs_vec3 ahrs_gyro_zero(const ahrs_estimator_state *s) {
    return ahrs_condition(s, AHRS_HAS_GYRO_ZERO) ? ahrs_vec3_of(s->gyro_zero) : (ahrs_vec3){0, 0, 0};
}

/* Second-order Butterworth low-pass by the trapezoidal rule, warped so that the cut-off is exact. Its two states keep
 * their meaning when the step changes. It begins at rest in the first sample, and anew after one that is not usable;
 * the result is zero then. */
static inline ahrs_vec3 ahrs_smooth_force(ahrs_estimator_state *s, const ahrs_estimator_params *p, ahrs_vec3 force,
                                          bool usable, ahrs_real dt) {
    const ahrs_real turns = p->accel_cutoff * dt;
    const bool begins = !ahrs_condition(s, AHRS_SMOOTHS_FORCE) || turns > AHRS_LOWPASS_STEP;
    ahrs_set_condition(s, AHRS_SMOOTHS_FORCE, usable);
    if (!usable) {
        return (ahrs_vec3){0, 0, 0};
    }
    if (begins) {
        ahrs_vec3_to(s->force_low, force);
        ahrs_vec3_to(s->force_band, (ahrs_vec3){0, 0, 0});
        return force;
    }
    ahrs_real sine, cosine;
    ahrs_sincos(AHRS_PI * turns, &sine, &cosine);
    const ahrs_real g = sine / cosine;
    const ahrs_vec3 low = ahrs_vec3_of(s->force_low), band = ahrs_vec3_of(s->force_band);
    const ahrs_vec3 driven = ahrs_vec3_add_scaled(band, g, ahrs_vec3_sub(force, low));
    const ahrs_vec3 middle = ahrs_vec3_scale(driven, 1 / (1 + g * (g + AHRS_SQRT2)));
    const ahrs_vec3 smooth = ahrs_vec3_add_scaled(low, g, middle);
    ahrs_vec3_to(s->force_band, ahrs_vec3_sub(ahrs_vec3_scale(middle, 2), band));
    ahrs_vec3_to(s->force_low, ahrs_vec3_sub(ahrs_vec3_scale(smooth, 2), low));
    return smooth;
}

#endif
