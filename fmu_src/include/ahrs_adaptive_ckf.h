/* Generated from models/adaptive_ckf/adaptive_ckf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_ADAPTIVE_CKF_H
#define AHRS_ADAPTIVE_CKF_H

#include "ahrs_estimator.h"

/* Cubature Kalman filter on the quaternion with adaptive noise. The state is the quaternion, predicted by
 * the gyroscope and measured by the specific force and the heading. The covariances of measurement and
 * process noise may be estimated while the filter runs, after Sage and Husa. It learns no gyroscope bias:
 * the process noise has to cover it.
 */

/* Which noise covariances are estimated */
enum {
    AHRS_ADAPTIVE_CKF_ADAPTATION_NONE = 0, /* none: both are as given */
    AHRS_ADAPTIVE_CKF_ADAPTATION_R_ONLY = 1, /* that of the measurement, always positive definite */
    AHRS_ADAPTIVE_CKF_ADAPTATION_QR_SAFE = 2, /* both, by terms that keep them positive definite, within limits */
    AHRS_ADAPTIVE_CKF_ADAPTATION_TEXTBOOK = 3, /* both; that of the process may lose its meaning, and the filter resets */
    AHRS_ADAPTIVE_CKF_ADAPTATION_PRINTED = 4, /* both, with the misprint of the source; the filter resets likewise */
};

/* Form of the process noise */
enum {
    AHRS_ADAPTIVE_CKF_PROCESS_NOISE_GYRO = 0, /* gyro_noise across the quaternion, and quaternion_noise in all directions */
    AHRS_ADAPTIVE_CKF_PROCESS_NOISE_ISOTROPIC = 1, /* quaternion_noise in all directions only */
};

typedef struct {
    ahrs_estimator_params common;
    ahrs_real gyro_noise; /* White noise of the gyroscope, rad/s/sqrt(Hz), large enough to cover its bias; used when process_noise is gyro */
    ahrs_real accel_noise; /* White noise of the accelerometer with the motion, m/s2/sqrt(Hz), before it is estimated */
    ahrs_real heading_noise; /* White noise of the measured heading, rad/sqrt(Hz), before it is estimated */
    ahrs_real quaternion_noise; /* White noise of the change of every quaternion element, 1/s/sqrt(Hz) */
    ahrs_real motion_noise; /* Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation */
    ahrs_real initial_attitude_std; /* Standard deviation of the first attitude [rad] */
    ahrs_real forgetting; /* Weight of the estimated noise covariances from one sample to the next [1] */
    ahrs_real measurement_variance_min; /* Least eigenvalue of the measurement covariance, in m2/s4 and rad2, when adaptation is r_only or qr_safe */
    ahrs_real measurement_variance_max; /* Largest eigenvalue of the measurement covariance, in m2/s4 and rad2, when adaptation is r_only or qr_safe */
    ahrs_real process_variance_min; /* Least eigenvalue of the process covariance per sample, when adaptation is qr_safe [1] */
    ahrs_real process_variance_max; /* Largest eigenvalue of the process covariance per sample, when adaptation is qr_safe [1] */
    int32_t adaptation; /* Which noise covariances are estimated (enumeration adaptation) */
    int32_t process_noise; /* Form of the process noise, before it is estimated (enumeration process_noise) */
    int32_t warm_up; /* Samples that the given noise covariances count for when the estimation begins */
} ahrs_adaptive_ckf_params;

typedef ahrs_estimator_inputs ahrs_adaptive_ckf_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
    ahrs_real attitude_std[3]; /* Standard deviation of the attitude error about the body axes, as the filter believes it [rad] */
    int32_t covariance_reset; /* The covariance was reset at the last sample */
} ahrs_adaptive_ckf_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real covariance[10]; /* Covariance of the quaternion: lower triangle, row by row [1] */
    ahrs_real process[10]; /* Covariance of the process noise per sample, likewise [1] */
    ahrs_real measurement[10]; /* Covariance of the measurement noise (specific force, heading), likewise [1] */
    ahrs_real fading; /* Power of the forgetting factor: how much of the given covariances is left [1] */
} ahrs_adaptive_ckf_state;

/* Parameters and inputs to their defaults. */
void ahrs_adaptive_ckf_defaults(ahrs_adaptive_ckf_params *p, ahrs_adaptive_ckf_inputs *u);

/* State as before the first sample. */
void ahrs_adaptive_ckf_init(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
void ahrs_adaptive_ckf_update(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p, const ahrs_adaptive_ckf_inputs *u, ahrs_real dt);

void ahrs_adaptive_ckf_outputs(const ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p, ahrs_adaptive_ckf_outputs_t *y);

#endif
