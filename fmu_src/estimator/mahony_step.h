/* One sample of Mahony's filter with decoupled heading (docs/algorithms.md section 2). */
#ifndef AHRS_MAHONY_STEP_H
#define AHRS_MAHONY_STEP_H

#include "attitude_error.h"

typedef struct {
    ahrs_real kp, ki, bias_limit;
} ahrs_mahony_gains;

/* The error is that of the predicted attitude; rate, bias and correction then turn the attitude together. */
static inline ahrs_quat ahrs_mahony_step(ahrs_quat q, ahrs_real bias[3], ahrs_mahony_gains k, const ahrs_sample *z) {
    const ahrs_vec3 before = ahrs_vec3_of(bias);
    const ahrs_vec3 turn = ahrs_vec3_scale(ahrs_vec3_sub(z->rate, before), z->dt);
    const ahrs_vec3 e = ahrs_decoupled_error(ahrs_quat_to_mat3(ahrs_quat_turn(q, turn)), z);
    const ahrs_vec3 after = ahrs_vec3_limited(ahrs_vec3_add_scaled(before, -k.ki * z->gain_dt, e), k.bias_limit);
    const ahrs_vec3 rate = ahrs_vec3_scale(ahrs_vec3_sub(z->rate, after), z->dt);
    const ahrs_quat corrected = ahrs_quat_turn(q, ahrs_vec3_add_scaled(rate, k.kp * z->gain_dt, e));
    ahrs_vec3_to(bias, after);
    return ahrs_quat_refine(corrected);
}

#endif
