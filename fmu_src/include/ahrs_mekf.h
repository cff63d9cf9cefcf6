/* Generated from models/mekf/mekf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_MEKF_H
#define AHRS_MEKF_H

#include "ahrs_estimator.h"

/* Multiplicative extended Kalman filter with gyroscope bias. The gyroscope without its estimated bias
 * predicts the attitude; specific force and magnetic field correct attitude and bias together. The
 * covariance is that of a small rotation about the body axes and of the bias. What the accelerometer feels
 * beside gravity counts as its noise: accel_noise has to cover the motion of the vehicle.
 */

typedef struct {
    ahrs_estimator_params common;
    ahrs_real bias_limit; /* Largest gyroscope bias that is learned, per axis [rad/s] */
    ahrs_real gyro_noise; /* White noise of the gyroscope, rad/s/sqrt(Hz) */
    ahrs_real gyro_bias_noise; /* Random walk of the gyroscope bias, rad/s/s/sqrt(Hz) */
    ahrs_real accel_noise; /* White noise of the accelerometer with the motion of the vehicle, m/s2/sqrt(Hz) */
    ahrs_real mag_noise; /* White noise of the magnetometer with disturbances of the field, T/sqrt(Hz) */
    ahrs_real motion_noise; /* Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation */
    ahrs_real initial_attitude_std; /* Standard deviation of the first attitude [rad] */
    ahrs_real initial_bias_std; /* Standard deviation of the gyroscope bias at the start [rad/s] */
} ahrs_mekf_params;

typedef ahrs_estimator_inputs ahrs_mekf_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
    ahrs_real attitude_std[3]; /* Standard deviation of the attitude error about the body axes, as the filter believes it [rad] */
    int32_t covariance_reset; /* The covariance was reset at the last sample */
} ahrs_mekf_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real bias[3]; /* Gyroscope bias [rad/s] */
    ahrs_real attitude_covariance[6]; /* Covariance of the rotation error about the body axes: lower triangle, row by row [rad2] */
    ahrs_real cross_covariance[9]; /* Covariance of rotation error (rows) and bias error (columns) [rad2/s] */
    ahrs_real bias_covariance[6]; /* Covariance of the bias error: lower triangle, row by row [rad2/s2] */
} ahrs_mekf_state;

/* Parameters and inputs to their defaults. */
void ahrs_mekf_defaults(ahrs_mekf_params *p, ahrs_mekf_inputs *u);

/* State as before the first sample. */
void ahrs_mekf_init(ahrs_mekf_state *s, const ahrs_mekf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
void ahrs_mekf_update(ahrs_mekf_state *s, const ahrs_mekf_params *p, const ahrs_mekf_inputs *u, ahrs_real dt);

void ahrs_mekf_outputs(const ahrs_mekf_state *s, const ahrs_mekf_params *p, ahrs_mekf_outputs_t *y);

#endif
