/* Generated from models/kcf/kcf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_KCF_H
#define AHRS_KCF_H

#include "ahrs_estimator.h"

/* Kalman-calibrated complementary filter. A complementary filter finds the tilt in a slowly moving inertial
 * frame; a slow Kalman filter learns what limits it while it runs: bias, scale and misalignment of the
 * gyroscope, hard iron and latency of the magnetometer, and the local field. A second hypothesis covers a
 * magnetometer that was never calibrated.
 */

/* What carries the sensor; sets the time constant of the tilt */
enum {
    AHRS_KCF_PROFILE_HAND = 0, /* worn or held by a person, robot arms: accelerations change sign within seconds; 3.5 s */
    AHRS_KCF_PROFILE_MULTIROTOR = 1, /* accelerations last for seconds, the gyroscope is good for ten: 10 s */
    AHRS_KCF_PROFILE_CUSTOM = 2, /* accel_time_constant says */
};

/* What a gyroscope sample stands for */
enum {
    AHRS_KCF_GYRO_SAMPLING_MEAN = 0, /* the mean rate over the sample interval, as integrating gyroscopes give it */
    AHRS_KCF_GYRO_SAMPLING_INSTANT = 1, /* the rate at the moment of the sample, as decimated recordings have it; matters below 100 Hz */
};

typedef struct {
    ahrs_estimator_params common;
    ahrs_real accel_time_constant; /* Time constant of the specific force in the inertial frame, used when profile is custom [s] */
    ahrs_real slow_period; /* Time between two slow steps, rounded to whole samples [s] */
    ahrs_real uncalibrated_odds; /* Odds that the magnetometer has an uncalibrated hard iron; 0 says that it is calibrated and ends the question [1] */
    ahrs_real uncalibrated_std; /* Hard iron of an uncalibrated magnetometer, standard deviation per axis, of the local field [1] */
    ahrs_real bias_std; /* Gyroscope bias before anything is learned, standard deviation per axis [rad/s] */
    ahrs_real bias_forget_time; /* Time after which a learned bias has become uncertain by 0.1 deg/s [s] */
    ahrs_real bias_limit; /* Largest gyroscope bias that is learned, per axis [rad/s] */
    ahrs_real motion_drift_std; /* Accuracy to which the drift of the tilt in motion shows an error of the gyroscope [rad/s] */
    ahrs_real rest_drift_std; /* Accuracy to which the low-passed gyroscope shows its bias at rest [rad/s] */
    ahrs_real gyro_scale_std; /* Scale error of the gyroscope, standard deviation per axis [1] */
    ahrs_real gyro_misalignment_std; /* Misalignment and cross coupling of the gyroscope, standard deviation per element [rad] */
    ahrs_real hard_iron_std; /* Hard iron that a calibration leaves, standard deviation per axis, of the local field [1] */
    ahrs_real mag_latency_std; /* Latency of the magnetometer against the gyroscope, standard deviation [s] */
    ahrs_real mag_density; /* Deviation of the mean of the field over one second, with everything that varies slowly in it, of the local field [1] */
    ahrs_real mag_noise; /* Usual deviation of one magnetometer sample from the expected field, of the local field [1] */
    ahrs_real mag_rate_noise; /* Additional deviation per angular rate [s] */
    ahrs_real mag_tilt_noise; /* Additional deviation while the first tilt settles [1] */
    ahrs_real hard_iron_walk; /* Random walk of the hard iron: standard deviation after one second, of the local field [1] */
    ahrs_real field_walk; /* Random walk of the local field: standard deviation after one second, of itself [1] */
    ahrs_real heading_walk; /* Random walk of the integrated heading: standard deviation after one second [rad] */
    ahrs_real heading_rate_walk; /* Random walk of the integrated heading per angular rate: standard deviation after one second at one rad/s [s] */
    ahrs_real jump_time; /* Time over which a misfit of the field is averaged before it counts as a change [s] */
    ahrs_real jump_threshold; /* Mean squared misfit, of the expected one, above which the field or the hard iron has changed [1] */
    ahrs_real jump_hard_iron; /* How fast a change makes the hard iron uncertain [1/s] */
    ahrs_real jump_field; /* How fast a change makes the local field uncertain [1/s] */
    ahrs_real outlier_weight; /* How much a misfit of one sample raises its noise [1] */
    int32_t profile; /* What carries the sensor (enumeration profile) */
    int32_t use_mag; /* False: six axes only, the heading is integrated from the gyroscope */
    int32_t spread; /* Spread the slow step over the samples until the next one, so that no sample costs much more than another; its result comes one slow period later */
    int32_t gyro_sampling; /* What a gyroscope sample stands for, used with refine (enumeration gyro_sampling) */
    int32_t refine; /* Correct the averaged tilt for what has since been learned of the gyroscope, join rate samples to second order, keep north through a change of the field; false: the plain equations, for comparison */
} ahrs_kcf_params;

typedef ahrs_estimator_inputs ahrs_kcf_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
    ahrs_real hard_iron[3]; /* Learned hard iron, body axes: the magnetometer reads the field plus this [T] */
    ahrs_real gyro_scale[9]; /* Learned scale and misalignment of the gyroscope, row by row: it reads the rate plus bias plus this times its reading [1] */
    ahrs_real mag_latency; /* Learned latency of the magnetometer against the gyroscope [s] */
    ahrs_real local_field[2]; /* Learned local field: horizontal and downward part [T] */
    ahrs_real heading_std; /* Standard deviation of the heading, as the filter believes it [rad] */
    ahrs_real disturbance; /* Mean squared misfit of the field, of the expected one: about 1 or below when undisturbed [1] */
    ahrs_real uncalibrated; /* Probability that the magnetometer has an uncalibrated hard iron; 0 when the question is closed [1] */
    int32_t covariance_reset; /* The covariance was reset at the last sample */
    int32_t at_rest; /* Rest is detected: the gyroscope shows its bias */
    int32_t mag_disturbed; /* The field does not fit what has been learned, or is another one than at first */
    int32_t implausible; /* Gyroscope and accelerometer or magnetometer turn in opposite senses: check axes and signs */
} ahrs_kcf_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real x[19]; /* Gyroscope bias (3, rad/s), scale and misalignment (9, row by row); field (3, of its norm), hard iron (3, of the field), latency (s) [1] */
    ahrs_real cov[380]; /* Covariance of x, 19 rows of 20: padded with a zero [1] */
    ahrs_real q_int[4]; /* Integrated gyroscope: body to inertial frame [1] */
    ahrs_real q_tilt[4]; /* Inertial frame to level frame of free heading [1] */
    ahrs_real q_level[4]; /* q_tilt with the lag of the averaged force made good [1] */
    ahrs_real q_north[4]; /* Inertial frame to magnetic north-east-down: heading and q_level [1] */
    ahrs_real heading[2]; /* Cosine and sine of half the angle from the level frame to magnetic north [1] */
    ahrs_real block_time; /* Time since the last slow step [s] */
    ahrs_real force_time; /* Of which with a usable accelerometer [s] */
    ahrs_real sum_force[3]; /* Integral of the specific force in the inertial frame, sign of gravity [m/s] */
    ahrs_real sum_sens[39]; /* Integral of the sensitivity of the rate in the inertial frame to bias and scale, and of the corrections of the gyroscope (rad), three rows of 13 [s] */
    ahrs_real sum_rate2; /* Integral of the squared rate [rad2/s] */
    ahrs_real blind; /* Time for which the gyroscope has been held [s] */
    ahrs_real rate[3]; /* Rate of the sample before [rad/s] */
    ahrs_real mag[3]; /* Last usable magnetometer sample [T] */
    ahrs_real mag_q[4]; /* q_int at that sample [1] */
    ahrs_real mag_rate[3]; /* Rate at that sample [rad/s] */
    ahrs_real mag_time; /* Time since the last magnetometer update [s] */
    ahrs_real rest_one[6]; /* First integrator of the low-pass for rest detection: gyroscope, accelerometer [1] */
    ahrs_real rest_two[6]; /* Second integrator; while the low-pass starts, the sum of the samples [1] */
    ahrs_real rest_gyro[3]; /* Low-passed gyroscope [rad/s] */
    ahrs_real rest_gain[3]; /* Coefficients of the low-pass for rest_step [1] */
    ahrs_real rest_step; /* Sample interval of these coefficients [s] */
    ahrs_real rest_count; /* Samples in the sum while the low-pass starts, else 0 [1] */
    ahrs_real rest_age; /* Time since the low-pass started [s] */
    ahrs_real rest_time; /* Time for which gyroscope and accelerometer have been quiet [s] */
    ahrs_real tilt_age; /* Time over which the tilt has been averaged [s] */
    ahrs_real tilt_slope[3]; /* Rate of change of the low-passed force [m/s3] */
    ahrs_real tilt_force[3]; /* Low-passed specific force in the inertial frame, sign of gravity [m/s2] */
    ahrs_real sens_level[26]; /* Sensitivity of the tilt error to bias and scale and the corrections already in it, two rows of 13 [s] */
    ahrs_real sens_slope[26]; /* Its rate of change, as the low-pass sees it [1] */
    ahrs_real job_time; /* Interval of the slow step under way [s] */
    ahrs_real job_vertical[12]; /* Sensitivity of the heading to bias and scale over this interval [s] */
    ahrs_real job_drift[3]; /* Innovations of the gyroscope [rad/s] */
    ahrs_real job_rate2; /* Mean squared rate [rad2/s2] */
    ahrs_real job_q[4]; /* Level attitude at the magnetometer sample [1] */
    ahrs_real job_mag[3]; /* That sample, of the norm of the first [1] */
    ahrs_real job_rate[3]; /* Rate at that sample [rad/s] */
    ahrs_real job_mag_time; /* Time between this magnetometer update and the one before [s] */
    ahrs_real job_nu[3]; /* Innovation of the magnetometer [1] */
    ahrs_real job_noise[2]; /* Variance expected of one magnetometer sample, and of its update [1] */
    ahrs_real dx[20]; /* Corrections of x collected by the slow step under way, padded [1] */
    ahrs_real mag_scale; /* Inverse norm of the first magnetometer sample, 0 before [1/T] */
    ahrs_real misfit; /* Mean squared misfit of the field, of the expected one [1] */
    ahrs_real excess; /* Variance that the misfit has in excess, at the last update [1] */
    ahrs_real change_views; /* Views of the field with a misfit since it became suspect [1] */
    ahrs_real fit_views; /* Views of the field since it has been fitting [1] */
    ahrs_real old_misfit; /* Mean squared misfit of the old field, of the expected one [1] */
    ahrs_real calm_field[3]; /* Field before it changed, of its norm [1] */
    ahrs_real calm_iron[3]; /* Hard iron before that, of the field [1] */
    ahrs_real north_angle[2]; /* Cosine and sine of the angle from the other field to the old one [1] */
    ahrs_real alt_x[6]; /* Field and hard iron if it is not [1] */
    ahrs_real alt_cov[48]; /* Covariance of alt_x, 6 rows of 8: padded with zeros [1] */
    ahrs_real alt_q[4]; /* Level attitude when the question was asked [1] */
    ahrs_real alt_misfit; /* Mean squared misfit of the field that no hard iron explains [1] */
    ahrs_real alt_jump; /* Variance that changes have added to the hard iron since the question was asked [1] */
    ahrs_real alt_probability; /* Probability that the magnetometer is not calibrated [1] */
    ahrs_real turn[3]; /* Rotation since the last slow step, body axes [rad] */
    ahrs_real seen[6]; /* Specific force and field at the last slow step, body axes [1] */
    ahrs_real sense[6]; /* Correlation of the turn of the specific force, and of the field, with the gyroscope, per axis [1] */
    ahrs_real sense_power[6]; /* Power of the turn that the gyroscope predicts, per axis [1] */
    int32_t phase; /* Next part of the slow step */
    int32_t job; /* Bits: what the slow step under way has to do */
    int32_t change; /* The field: 0 as it was, 1 suspect, 2 another one, not known yet, 3 another one, known */
    int32_t iron_known; /* Whether the hard iron was as certain as a calibration leaves it when the field last fitted */
    int32_t question; /* Is the magnetometer calibrated: 0 not yet asked, 1 open, 2 answered */
} ahrs_kcf_state;

/* Parameters and inputs to their defaults. */
void ahrs_kcf_defaults(ahrs_kcf_params *p, ahrs_kcf_inputs *u);

/* State as before the first sample. */
void ahrs_kcf_init(ahrs_kcf_state *s, const ahrs_kcf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
void ahrs_kcf_update(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_kcf_inputs *u, ahrs_real dt);

void ahrs_kcf_outputs(const ahrs_kcf_state *s, const ahrs_kcf_params *p, ahrs_kcf_outputs_t *y);

#endif
