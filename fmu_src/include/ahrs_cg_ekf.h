/* Generated from models/cg_ekf/cg_ekf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_CG_EKF_H
#define AHRS_CG_EKF_H

#include "ahrs_estimator.h"

/* Attitude by conjugate gradients, smoothed by an extended Kalman filter. Fletcher-Reeves conjugate
 * gradients, begun at the predicted attitude, find the attitude at which the directions of gravity and of
 * the magnetic field fit best, both with equal weight. It measures the quaternion of an extended Kalman
 * filter that the gyroscope predicts. It learns no gyroscope bias. In the steady state it is a first-order
 * complementary filter whose crossover frequency is gyro_noise/attitude_noise.
 */

typedef struct {
    ahrs_estimator_params common;
    ahrs_real gyro_noise; /* White noise of the gyroscope, rad/s/sqrt(Hz) */
    ahrs_real attitude_noise; /* White noise of the attitude that the search finds, rad/sqrt(Hz) */
    ahrs_real motion_noise; /* Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation */
    ahrs_real initial_attitude_std; /* Standard deviation of the first attitude [rad] */
    int32_t iterations; /* Most iterations of the search per sample; it ends before where the gradient vanishes */
} ahrs_cg_ekf_params;

typedef ahrs_estimator_inputs ahrs_cg_ekf_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
    ahrs_real attitude_std[3]; /* Standard deviation of the attitude error about the body axes, as the filter believes it [rad] */
    int32_t covariance_reset; /* The covariance was reset at the last sample */
} ahrs_cg_ekf_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real variance; /* Variance of every element of the quaternion; their covariance stays a multiple of the unit matrix [1] */
} ahrs_cg_ekf_state;

/* Parameters and inputs to their defaults. */
void ahrs_cg_ekf_defaults(ahrs_cg_ekf_params *p, ahrs_cg_ekf_inputs *u);

/* State as before the first sample. */
void ahrs_cg_ekf_init(ahrs_cg_ekf_state *s, const ahrs_cg_ekf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
void ahrs_cg_ekf_update(ahrs_cg_ekf_state *s, const ahrs_cg_ekf_params *p, const ahrs_cg_ekf_inputs *u, ahrs_real dt);

void ahrs_cg_ekf_outputs(const ahrs_cg_ekf_state *s, const ahrs_cg_ekf_params *p, ahrs_cg_ekf_outputs_t *y);

#endif
