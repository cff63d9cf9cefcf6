/* Noise densities as variances of one sample (docs/algorithms.md section 6). White noise of density N has the variance
 * N^2/T per sample of interval T, and an integrated one grows by N^2 T. */
#ifndef AHRS_NOISE_H
#define AHRS_NOISE_H

#include "estimator.h"

/* rad/s/sqrt(Hz): how wrong a rate is that was not measured, because a sample was unusable or the step too long. */
#define AHRS_HELD_NOISE AHRS_C(0.1)

/* Of white noise in one sample; the sensor's interval, whatever the step since the sample before. */
static inline ahrs_real ahrs_sample_variance(const ahrs_estimator_params *p, ahrs_real density) {
    return density * density / p->sample_time;
}

/* Of the rotation in one step, rad2. */
static inline ahrs_real ahrs_turn_variance(const ahrs_estimator_state *s, const ahrs_sample *z, ahrs_real density) {
    const bool held = ahrs_condition(s, AHRS_GYRO_HELD) || !(z->gain_dt > 0);
    return (density * density + (held ? AHRS_HELD_NOISE * AHRS_HELD_NOISE : 0)) * z->dt;
}

/* Of what motion compensation leaves of a changing acceleration, (m/s2)2: it is that of the sample before. */
static inline ahrs_real ahrs_motion_variance(const ahrs_estimator_params *p, const ahrs_sample *z, ahrs_real density) {
    return p->motion_compensation ? density * density * z->dt : 0;
}

#endif
