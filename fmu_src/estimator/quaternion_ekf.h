/* Extended Kalman filter with the quaternion as state and a measured quaternion (docs/algorithms.md section 2). */
#ifndef AHRS_QUATERNION_EKF_H
#define AHRS_QUATERNION_EKF_H

#include "increment.h"
#include "noise.h"
#include "quaternion_covariance.h"

typedef struct {
    ahrs_real gyro_noise, attitude_noise, accel_distrust, motion_noise, initial_attitude_std;
} ahrs_quaternion_ekf;

static inline void ahrs_quaternion_ekf_start(const ahrs_quaternion_ekf *k, ahrs_real covariance[AHRS_TRIANGLE(4)]) {
    ahrs_quat_covariance_set(covariance, AHRS_C(0.25) * k->initial_attitude_std * k->initial_attitude_std);
}

/* The attitude after the rate, not of unit length. */
static inline ahrs_quat ahrs_quaternion_ekf_predict(const ahrs_quaternion_ekf *k, const ahrs_estimator_state *s,
                                                    ahrs_real covariance[AHRS_TRIANGLE(4)], ahrs_vec3 rate,
                                                    const ahrs_sample *z) {
    const ahrs_quat q = ahrs_quat_of(s->q);
    const ahrs_quat turn = ahrs_increment_first(ahrs_vec3_scale(rate, z->dt));
    ahrs_quat_covariance_turn(covariance, turn);
    ahrs_quat_covariance_spread(covariance, q, AHRS_C(0.25) * ahrs_turn_variance(s, z, k->gyro_noise));
    return ahrs_quat_mul(q, turn);
}

/* Variance of an element of the measured quaternion: more as the specific force is less like gravity. */
static inline ahrs_real ahrs_quaternion_ekf_variance(const ahrs_quaternion_ekf *k, const ahrs_estimator_params *p,
                                                     const ahrs_sample *z) {
    const ahrs_real excess = ahrs_abs(ahrs_vec3_norm(z->force) - p->gravity);
    const ahrs_real moved = ahrs_motion_variance(p, z, k->motion_noise) / (p->gravity * p->gravity);
    return AHRS_C(0.25) * (ahrs_sample_variance(p, k->attitude_noise) * (1 + k->accel_distrust * excess) + moved);
}

/* With the measurement noise r I, K = P (P + r I)^-1 is symmetric and the covariance after the correction is r K.
 * False where the covariance has no meaning left; it is then the one to begin with. */
static inline bool ahrs_quaternion_ekf_correct(const ahrs_quaternion_ekf *k, ahrs_real covariance[AHRS_TRIANGLE(4)],
                                               ahrs_quat *q, ahrs_quat measured, ahrs_real r) {
    ahrs_real sum[AHRS_TRIANGLE(4)], gain[4][4], e[4];
    for (int32_t i = 0; i < AHRS_TRIANGLE(4); i++) {
        sum[i] = covariance[i];
    }
    ahrs_add_diagonal(4, sum, r);
    if (!ahrs_cholesky(4, sum, sum)) {
        ahrs_quaternion_ekf_start(k, covariance);
        return false;
    }
    for (int32_t i = 0; i < 4; i++) {
        for (int32_t j = 0; j < 4; j++) {
            gain[i][j] = ahrs_of(covariance, i, j);
        }
        ahrs_solve_lower(4, sum, gain[i]);
        ahrs_solve_upper(4, sum, gain[i]);
    }
    const ahrs_quat v = ahrs_quat_sub(ahrs_quat_near(measured, *q), *q);
    for (int32_t i = 0; i < 4; i++) {
        e[i] = ahrs_quat_dot(ahrs_quat_of(gain[i]), v);
        for (int32_t j = 0; j <= i; j++) {
            *ahrs_at(covariance, i, j) = AHRS_C(0.5) * r * (gain[i][j] + gain[j][i]);
        }
    }
    *q = ahrs_quat_add(*q, ahrs_quat_of(e));
    if (!ahrs_quat_covariance_keep(covariance)) {
        ahrs_quaternion_ekf_start(k, covariance);
        return false;
    }
    return true;
}

#endif
