/* Generated from models/mahony_ekf/mahony_ekf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_MAHONY_EKF_H
#define AHRS_MAHONY_EKF_H

#include "ahrs_estimator.h"

/* Mahony's filter, smoothed by an extended Kalman filter. Mahony's filter runs by itself, and its quaternion
 * is the measurement of an extended Kalman filter on the quaternion. That filter adds a fast low-pass, whose
 * corner is gyro_noise/attitude_noise; the accuracy is Mahony's. The covariance is what the filter believes:
 * it does not know that its measurement comes from the same gyroscope.
 */

typedef struct {
    ahrs_estimator_params common;
    ahrs_real kp; /* Proportional gain: about the crossover frequency between accelerometer/magnetometer and gyroscope [rad/s] */
    ahrs_real ki; /* Integral gain: how fast the gyroscope bias is learned; 0 switches that off [rad2/s2] */
    ahrs_real bias_limit; /* Largest gyroscope bias that is learned, per axis [rad/s] */
    ahrs_real gyro_noise; /* White noise of the gyroscope, rad/s/sqrt(Hz) */
    ahrs_real attitude_noise; /* White noise of the attitude from the Mahony filter at rest, rad/sqrt(Hz) */
    ahrs_real accel_distrust; /* Relative growth of the variance of that attitude with the deviation of the specific force from gravity [s2/m] */
    ahrs_real motion_noise; /* Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation */
    ahrs_real initial_attitude_std; /* Standard deviation of the first attitude [rad] */
    int32_t bias_feed; /* Predict with the rate without Mahony's bias; false is the printed form, which lets a bias error back in */
} ahrs_mahony_ekf_params;

typedef ahrs_estimator_inputs ahrs_mahony_ekf_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
    ahrs_real attitude_std[3]; /* Standard deviation of the attitude error about the body axes, as the filter believes it [rad] */
    int32_t covariance_reset; /* The covariance was reset at the last sample */
} ahrs_mahony_ekf_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real covariance[10]; /* Covariance of the quaternion: lower triangle, row by row [1] */
    ahrs_real mahony[4]; /* Attitude of the Mahony filter [1] */
    ahrs_real bias[3]; /* Gyroscope bias of the Mahony filter [rad/s] */
} ahrs_mahony_ekf_state;

/* Parameters and inputs to their defaults. */
void ahrs_mahony_ekf_defaults(ahrs_mahony_ekf_params *p, ahrs_mahony_ekf_inputs *u);

/* State as before the first sample. */
void ahrs_mahony_ekf_init(ahrs_mahony_ekf_state *s, const ahrs_mahony_ekf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
void ahrs_mahony_ekf_update(ahrs_mahony_ekf_state *s, const ahrs_mahony_ekf_params *p, const ahrs_mahony_ekf_inputs *u, ahrs_real dt);

void ahrs_mahony_ekf_outputs(const ahrs_mahony_ekf_state *s, const ahrs_mahony_ekf_params *p, ahrs_mahony_ekf_outputs_t *y);

#endif
