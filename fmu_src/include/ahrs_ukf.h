/* Generated from models/ukf/ukf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_UKF_H
#define AHRS_UKF_H

#include "ahrs_estimator.h"

/* Unscented Kalman filter with gyroscope bias, in square-root form. States and noise are those of the
 * multiplicative extended Kalman filter; means and covariances are taken over twelve points around the
 * estimate and the estimate itself. The defaults weight the points equally and the estimate not at all,
 * which are the cubature rules. A small alpha draws the points together, until in single precision little
 * more than rounding is left of their differences.
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
    ahrs_real alpha; /* Spread of the points, in standard deviations over the square root of 6 + kappa [1] */
    ahrs_real beta; /* Additional weight of the estimate in the covariances [1] */
    ahrs_real kappa; /* Further spread of the points: with alpha = 1 the weight of the estimate is kappa/(6 + kappa) [1] */
} ahrs_ukf_params;

typedef ahrs_estimator_inputs ahrs_ukf_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
    ahrs_real attitude_std[3]; /* Standard deviation of the attitude error about the body axes, as the filter believes it [rad] */
    int32_t covariance_reset; /* The covariance was reset at the last sample */
} ahrs_ukf_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real bias[3]; /* Gyroscope bias [rad/s] */
    ahrs_real root[21]; /* Root of the covariance of rotation error (rad, body axes) and bias error (rad/s): lower triangle, row by row [1] */
} ahrs_ukf_state;

/* Parameters and inputs to their defaults. */
void ahrs_ukf_defaults(ahrs_ukf_params *p, ahrs_ukf_inputs *u);

/* State as before the first sample. */
void ahrs_ukf_init(ahrs_ukf_state *s, const ahrs_ukf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
void ahrs_ukf_update(ahrs_ukf_state *s, const ahrs_ukf_params *p, const ahrs_ukf_inputs *u, ahrs_real dt);

void ahrs_ukf_outputs(const ahrs_ukf_state *s, const ahrs_ukf_params *p, ahrs_ukf_outputs_t *y);

#endif
