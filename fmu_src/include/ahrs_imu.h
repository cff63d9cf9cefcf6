/* Generated from models/imu/imu.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_IMU_H
#define AHRS_IMU_H

#include "ahrs_real.h"

/* Inertial measurement unit with magnetometer. From the truth of a vehicle to what an estimator gets to see:
 * axes, bias, drift, noise, bandwidth, delay, output rate, quantisation, saturation, hard and soft iron, and
 * vibration tied to the rotors' speeds. Noise is a function of seed and sample number, the same on every
 * machine. The defaults are those of an MPU-9250 after calibration (docs/vehicle.md).
 */

typedef struct {
    ahrs_real sample_time; /* Interval between samples [s] */
    ahrs_real declination; /* Magnetic declination, east positive [rad] */
    ahrs_real field_magnitude; /* Magnitude of the local field [T] */
    ahrs_real field_dip; /* Dip of the local field below the horizon [rad] */
    ahrs_real vibration_accel; /* Acceleration by the imbalance of one rotor at vibration_speed [m/s2] */
    ahrs_real vibration_blade; /* Vertical acceleration by the two blades of one rotor at vibration_speed [m/s2] */
    ahrs_real vibration_gyro; /* Angular rate by the imbalance of one rotor at vibration_speed [rad/s] */
    ahrs_real vibration_speed; /* Rotor speed at which the vibration has the amplitudes given; they grow with its square [rad/s] */
    ahrs_real hard_iron[3]; /* Field that the vehicle adds, body axes [T] */
    ahrs_real soft_iron[9]; /* Matrix that distorts the field, row by row [1] */
    ahrs_real gyro_noise_density; /* White noise of the gyroscope, rad/s/sqrt(Hz) */
    ahrs_real gyro_noise_std; /* Further white noise of the gyroscope per sample, whatever the interval [rad/s] */
    ahrs_real gyro_bias[3]; /* Constant bias of the gyroscope [rad/s] */
    ahrs_real gyro_turn_on_bias; /* Standard deviation of a bias of the gyroscope that is drawn once [rad/s] */
    ahrs_real gyro_bias_instability; /* Standard deviation of the wandering bias of the gyroscope [rad/s] */
    ahrs_real gyro_bias_time; /* Correlation time of the wandering bias of the gyroscope [s] */
    ahrs_real gyro_bias_walk; /* Random walk of the bias of the gyroscope, rad/s2/sqrt(Hz) */
    ahrs_real gyro_scale[3]; /* Relative scale error of the gyroscope [1] */
    ahrs_real gyro_misalignment[3]; /* Small rotation of the axes of the gyroscope against the body [rad] */
    ahrs_real gyro_bandwidth; /* Corner frequency of the low-pass in the gyroscope; 0 is none [Hz] */
    ahrs_real gyro_delay; /* Transport delay of the gyroscope, rounded to whole samples [s] */
    ahrs_real gyro_rate; /* Output rate of the gyroscope; between outputs the last reading is held and not valid; 0 is every sample [Hz] */
    ahrs_real gyro_quantisation; /* Least significant bit of the gyroscope; 0 is none [rad/s] */
    ahrs_real gyro_saturation; /* Largest magnitude of a reading of the gyroscope; 0 is no limit [rad/s] */
    ahrs_real accel_noise_density; /* White noise of the accelerometer, m/s2/sqrt(Hz) */
    ahrs_real accel_noise_std; /* Further white noise of the accelerometer per sample, whatever the interval [m/s2] */
    ahrs_real accel_bias[3]; /* Constant bias of the accelerometer [m/s2] */
    ahrs_real accel_turn_on_bias; /* Standard deviation of a bias of the accelerometer that is drawn once [m/s2] */
    ahrs_real accel_bias_instability; /* Standard deviation of the wandering bias of the accelerometer [m/s2] */
    ahrs_real accel_bias_time; /* Correlation time of the wandering bias of the accelerometer [s] */
    ahrs_real accel_bias_walk; /* Random walk of the bias of the accelerometer, m/s3/sqrt(Hz) */
    ahrs_real accel_scale[3]; /* Relative scale error of the accelerometer [1] */
    ahrs_real accel_misalignment[3]; /* Small rotation of the axes of the accelerometer against the body [rad] */
    ahrs_real accel_bandwidth; /* Corner frequency of the low-pass in the accelerometer; 0 is none [Hz] */
    ahrs_real accel_delay; /* Transport delay of the accelerometer, rounded to whole samples [s] */
    ahrs_real accel_rate; /* Output rate of the accelerometer; between outputs the last reading is held and not valid; 0 is every sample [Hz] */
    ahrs_real accel_quantisation; /* Least significant bit of the accelerometer; 0 is none [m/s2] */
    ahrs_real accel_saturation; /* Largest magnitude of a reading of the accelerometer; 0 is no limit [m/s2] */
    ahrs_real mag_noise_density; /* White noise of the magnetometer, T/sqrt(Hz) */
    ahrs_real mag_noise_std; /* Further white noise of the magnetometer per sample, whatever the interval [T] */
    ahrs_real mag_bias[3]; /* Constant bias of the magnetometer [T] */
    ahrs_real mag_turn_on_bias; /* Standard deviation of a bias of the magnetometer that is drawn once [T] */
    ahrs_real mag_bias_instability; /* Standard deviation of the wandering bias of the magnetometer [T] */
    ahrs_real mag_bias_time; /* Correlation time of the wandering bias of the magnetometer [s] */
    ahrs_real mag_bias_walk; /* Random walk of the bias of the magnetometer, T/s/sqrt(Hz) */
    ahrs_real mag_scale[3]; /* Relative scale error of the magnetometer [1] */
    ahrs_real mag_misalignment[3]; /* Small rotation of the axes of the magnetometer against the body [rad] */
    ahrs_real mag_bandwidth; /* Corner frequency of the low-pass in the magnetometer; 0 is none [Hz] */
    ahrs_real mag_delay; /* Transport delay of the magnetometer, rounded to whole samples [s] */
    ahrs_real mag_rate; /* Output rate of the magnetometer; between outputs the last reading is held and not valid; 0 is every sample [Hz] */
    ahrs_real mag_quantisation; /* Least significant bit of the magnetometer; 0 is none [T] */
    ahrs_real mag_saturation; /* Largest magnitude of a reading of the magnetometer; 0 is no limit [T] */
    int32_t seed; /* Seed of every random number */
    int32_t errors; /* False: a perfect sensor that samples */
} ahrs_imu_params;

typedef struct {
    ahrs_real q[4]; /* True attitude, body (forward-right-down) to navigation (north-east-down) [1] */
    ahrs_real rate[3]; /* True angular rate, body axes; used for the first sample only, later ones measure the turn since the last [rad/s] */
    ahrs_real specific_force[3]; /* True specific force at the sensor, body axes [m/s2] */
    ahrs_real rotor_speed[4]; /* Rotor speeds, for the vibration [rad/s] */
} ahrs_imu_inputs;

typedef struct {
    ahrs_real gyro[3]; /* Measured angular rate, body axes [rad/s] */
    ahrs_real accel[3]; /* Measured specific force, body axes [m/s2] */
    ahrs_real mag[3]; /* Measured magnetic flux density, body axes [T] */
    ahrs_real true_gyro_bias[3]; /* True bias of the gyroscope, body axes [rad/s] */
    int32_t gyro_valid; /* The last sample brought a new reading of the gyroscope */
    int32_t accel_valid; /* The last sample brought a new reading of the accelerometer */
    int32_t mag_valid; /* The last sample brought a new reading of the magnetometer */
} ahrs_imu_outputs_t;

typedef struct {
    ahrs_real last_q[4]; /* Last usable attitude [1] */
    ahrs_real last_force[3]; /* Last usable specific force [m/s2] */
    ahrs_real phase[4]; /* Angles of the rotors [rad] */
    ahrs_real last_rotor_speed[4]; /* Last usable rotor speeds [rad/s] */
    ahrs_real gyro_walk[3]; /* Random walk of the bias of the gyroscope [rad/s] */
    ahrs_real gyro_wander[3]; /* Wandering bias of the gyroscope [rad/s] */
    ahrs_real gyro_low_pass[3]; /* Output of the low-pass in the gyroscope [rad/s] */
    ahrs_real gyro_history[96]; /* The last 32 readings of the gyroscope, as a ring [rad/s] */
    ahrs_real gyro_reading[3]; /* What the gyroscope shows [rad/s] */
    ahrs_real accel_walk[3]; /* Random walk of the bias of the accelerometer [m/s2] */
    ahrs_real accel_wander[3]; /* Wandering bias of the accelerometer [m/s2] */
    ahrs_real accel_low_pass[3]; /* Output of the low-pass in the accelerometer [m/s2] */
    ahrs_real accel_history[96]; /* The last 32 readings of the accelerometer, as a ring [m/s2] */
    ahrs_real accel_reading[3]; /* What the accelerometer shows [m/s2] */
    ahrs_real mag_walk[3]; /* Random walk of the bias of the magnetometer [T] */
    ahrs_real mag_wander[3]; /* Wandering bias of the magnetometer [T] */
    ahrs_real mag_low_pass[3]; /* Output of the low-pass in the magnetometer [T] */
    ahrs_real mag_history[96]; /* The last 32 readings of the magnetometer, as a ring [T] */
    ahrs_real mag_reading[3]; /* What the magnetometer shows [T] */
    ahrs_real true_gyro_bias[3]; /* True bias of the gyroscope [rad/s] */
    int32_t count; /* Samples so far */
    int32_t gyro_fresh; /* The last sample brought a new reading of the gyroscope */
    int32_t accel_fresh; /* The last sample brought a new reading of the accelerometer */
    int32_t mag_fresh; /* The last sample brought a new reading of the magnetometer */
} ahrs_imu_state;

/* Parameters and inputs to their defaults. */
void ahrs_imu_defaults(ahrs_imu_params *p, ahrs_imu_inputs *u);

/* State as before the first sample. */
void ahrs_imu_init(ahrs_imu_state *s, const ahrs_imu_params *p);

/* One sample, dt seconds after the one before; dt = 0 takes in the inputs at the start. */
void ahrs_imu_update(ahrs_imu_state *s, const ahrs_imu_params *p, const ahrs_imu_inputs *u, ahrs_real dt);

void ahrs_imu_outputs(const ahrs_imu_state *s, const ahrs_imu_params *p, ahrs_imu_outputs_t *y);

#endif
