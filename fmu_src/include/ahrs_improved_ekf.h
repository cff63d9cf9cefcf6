/* Generated from models/improved_ekf/improved_ekf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_IMPROVED_EKF_H
#define AHRS_IMPROVED_EKF_H

#include "ahrs_estimator.h"

/* Extended Kalman filter on the quaternion, measured by accelerometer and magnetometer. The state is the
 * quaternion. The gyroscope predicts it, and the attitude that accelerometer and magnetometer show together
 * measures it; that measurement counts less while the specific force is not that of gravity. It learns no
 * gyroscope bias. In the steady state it is a first-order complementary filter whose crossover frequency is
 * gyro_noise/attitude_noise.
 */

typedef struct {
    ahrs_estimator_params common;
    ahrs_real gyro_noise; /* White noise of the gyroscope, rad/s/sqrt(Hz) */
    ahrs_real attitude_noise; /* White noise of the attitude from accelerometer and magnetometer at rest, rad/sqrt(Hz) */
    ahrs_real accel_distrust; /* Relative growth of the variance of that attitude with the deviation of the specific force from gravity [s2/m] */
    ahrs_real motion_noise; /* Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation */
    ahrs_real initial_attitude_std; /* Standard deviation of the first attitude [rad] */
} ahrs_improved_ekf_params;

typedef ahrs_estimator_inputs ahrs_improved_ekf_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
    ahrs_real attitude_std[3]; /* Standard deviation of the attitude error about the body axes, as the filter believes it [rad] */
    int32_t covariance_reset; /* The covariance was reset at the last sample */
} ahrs_improved_ekf_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real covariance[10]; /* Covariance of the quaternion: lower triangle, row by row [1] */
} ahrs_improved_ekf_state;

/* Parameters and inputs to their defaults. */
void ahrs_improved_ekf_defaults(ahrs_improved_ekf_params *p, ahrs_improved_ekf_inputs *u);

/* State as before the first sample. */
void ahrs_improved_ekf_init(ahrs_improved_ekf_state *s, const ahrs_improved_ekf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
void ahrs_improved_ekf_update(ahrs_improved_ekf_state *s, const ahrs_improved_ekf_params *p, const ahrs_improved_ekf_inputs *u, ahrs_real dt);

void ahrs_improved_ekf_outputs(const ahrs_improved_ekf_state *s, const ahrs_improved_ekf_params *p, ahrs_improved_ekf_outputs_t *y);

#endif
