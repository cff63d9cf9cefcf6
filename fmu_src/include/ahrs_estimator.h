/* Generated from estimator/estimator.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_ESTIMATOR_H
#define AHRS_ESTIMATOR_H

#include "ahrs_real.h"

/* Navigation frame with its body frame */
enum {
    AHRS_FRAME_NED = 0, /* north-east-down, body forward-right-down; level rest reads (0, 0, -g) */
    AHRS_FRAME_ENU = 1, /* east-north-up, body forward-left-up; level rest reads (0, 0, +g) */
};

/* Where the local magnetic field is known from */
enum {
    AHRS_FIELD_REFERENCE_LEARNED = 0, /* from the samples that initialise the attitude */
    AHRS_FIELD_REFERENCE_GIVEN = 1, /* from field_magnitude and field_dip */
};

/* Where the first attitude comes from */
enum {
    AHRS_INITIALISATION_SENSORS = 0, /* from accelerometer and magnetometer */
    AHRS_INITIALISATION_GIVEN = 1, /* from q0 */
};

/* The worst condition now; one numbering for all estimators */
enum {
    AHRS_STATUS_NOMINAL = 0, /* every sensor is used */
    AHRS_STATUS_MAG_DISTURBED = 1, /* the magnetic field differs from the reference */
    AHRS_STATUS_MAG_UNUSED = 2, /* heading is integrated from the gyroscope */
    AHRS_STATUS_ACCEL_UNUSED = 3, /* tilt is integrated from the gyroscope */
    AHRS_STATUS_GYRO_HELD = 4, /* the gyroscope sample is unusable: the last usable rate is held */
    AHRS_STATUS_STEP_REJECTED = 5, /* the time step is negative or not a number: nothing was done */
    AHRS_STATUS_COVARIANCE_RESET = 6, /* the covariance had lost its meaning and was reset */
    AHRS_STATUS_IMPLAUSIBLE = 7, /* the sensors contradict each other: check axes and signs */
    AHRS_STATUS_INITIALISING_IN_MOTION = 8, /* no attitude yet, and the vehicle moves while samples are averaged */
    AHRS_STATUS_INITIALISING = 9, /* no attitude yet: waiting for usable samples or averaging them */
};

typedef struct {
    ahrs_real sample_time; /* Sample interval of the estimator [s] */
    ahrs_real declination; /* Magnetic declination, east positive: turns the navigation frame from magnetic to true north [rad] */
    ahrs_real gravity; /* Local gravity [m/s2] */
    ahrs_real field_magnitude; /* Magnitude of the local field, used when field_reference is given [T] */
    ahrs_real field_dip; /* Dip of the local field below the horizon, used when field_reference is given [rad] */
    ahrs_real q0[4]; /* First attitude, in the frame of the output, used when initialisation is given; scaled to unit length [1] */
    ahrs_real init_time; /* Time over which samples are averaged for the first attitude; 0 takes the first usable sample [s] */
    ahrs_real motion_time_constant; /* How long an acceleration is taken for motion before it is taken for tilt; infinity never takes it back [s] */
    ahrs_real accel_gate; /* Deviation of the specific force from gravity beyond which the accelerometer is ignored [m/s2] */
    ahrs_real accel_gate_time; /* Longest time without the accelerometer; then it is used until it has been inside the gate once [s] */
    ahrs_real gyro_zero_std; /* Standard deviation per sample and axis above which the vehicle is not at rest: about three times the sensor's [rad/s] */
    ahrs_real gyro_zero_limit; /* Largest zero of the gyroscope that is believed; more is a rotation [rad/s] */
    ahrs_real accel_cutoff; /* Cut-off of a second-order Butterworth low-pass behind the accelerometer; 0 switches it off [Hz] */
    ahrs_real mag_offset[3]; /* Hard iron, subtracted from the magnetometer, body axes [T] */
    ahrs_real mag_gain[3]; /* What the magnetometer without its offset is multiplied with, body axes [1] */
    int32_t frame; /* Navigation and body frame of inputs and outputs (enumeration frame) */
    int32_t field_reference; /* Where the local magnetic field is known from (enumeration field_reference) */
    int32_t initialisation; /* Where the first attitude comes from (enumeration initialisation) */
    int32_t motion_compensation; /* Subtract the estimated motion acceleration from the accelerometer; tilt is then observed more slowly */
    int32_t accel_gating; /* Ignore the accelerometer while its magnitude is far from gravity */
    int32_t gyro_zero_samples; /* Samples at rest over which the zero of the gyroscope is averaged, then subtracted; 0 switches it off */
} ahrs_estimator_params;

typedef struct {
    ahrs_real gyro[3]; /* Angular rate of the body, body axes: mean over the sample interval that ends now [rad/s] */
    ahrs_real accel[3]; /* Specific force (what an accelerometer reads), body axes; zero counts as no measurement [m/s2] */
    ahrs_real mag[3]; /* Magnetic flux density, body axes; zero counts as no measurement [T] */
    int32_t accel_valid; /* False: do not use the accelerometer now */
    int32_t mag_valid; /* False: do not use the magnetometer now */
} ahrs_estimator_inputs;

typedef struct {
    ahrs_real q[4]; /* Attitude quaternion, body to navigation, Hamilton product, scalar first [1] */
    ahrs_real roll; /* Roll angle (z-y-x order) [rad] */
    ahrs_real pitch; /* Pitch angle (z-y-x order) [rad] */
    ahrs_real yaw; /* Yaw angle (z-y-x order): NED from north, clockwise seen from above; ENU from east, counter-clockwise [rad] */
    ahrs_real rate[3]; /* Angular rate without the estimated bias, body axes [rad/s] */
    ahrs_real gyro_bias[3]; /* Estimated gyroscope bias, body axes [rad/s] */
    ahrs_real motion_accel[3]; /* Estimated motion acceleration (accelerometer without gravity), body axes [m/s2] */
    int32_t status; /* The worst condition now (enumeration status) */
    int32_t gyro_held; /* The last gyroscope sample was unusable and an earlier rate was held */
    int32_t accel_used; /* The last accelerometer sample corrected the attitude */
    int32_t mag_used; /* The last magnetometer sample corrected the attitude */
} ahrs_estimator_outputs_t;

typedef struct {
    ahrs_real q[4]; /* Attitude, body (forward-right-down) to magnetic north-east-down [1] */
    ahrs_real gyro[3]; /* Last usable rate [rad/s] */
    ahrs_real force[3]; /* Last usable specific force; without one, the force that keeps the motion acceleration [m/s2] */
    ahrs_real field[2]; /* Reference field: horizontal and downward part [T] */
    ahrs_real accel_sum[3]; /* Sum of the accelerometer samples that initialise the attitude [m/s2] */
    ahrs_real mag_sum[3]; /* Sum of the magnetometer samples that initialise the attitude [T] */
    ahrs_real elapsed; /* Time since the first sample that initialises the attitude [s] */
    ahrs_real gated; /* Time for which the accelerometer has been ignored because of its magnitude [s] */
    ahrs_real force_low[3]; /* Low-pass of the accelerometer: what it lets through [m/s2] */
    ahrs_real force_band[3]; /* Low-pass of the accelerometer: its second state, zero at rest [m/s2] */
    ahrs_real gyro_zero[3]; /* Zero of the gyroscope, or the mean that becomes it [rad/s] */
    ahrs_real gyro_spread; /* Sum of the squared deviations from that mean [rad2/s2] */
    ahrs_real force_excess; /* Mean of specific force minus gravity meanwhile [m/s2] */
    int32_t zero_count; /* Samples in these means */
    int32_t conditions; /* Bits of conditions.h: what is known, what was used, what went wrong at the last sample */
} ahrs_estimator_state;

#endif
