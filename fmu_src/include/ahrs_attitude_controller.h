/* Generated from models/attitude_controller/attitude_controller.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_ATTITUDE_CONTROLLER_H
#define AHRS_ATTITUDE_CONTROLLER_H

#include "ahrs_real.h"

/* Attitude controller of a quadrotor. Cascade of attitude and rate controller with feed-forward of the
 * reference's motion, and a mixer that turns thrust and moment into rotor speeds within their limits. The
 * defaults fit the vehicle of docs/vehicle.md.
 */

typedef struct {
    ahrs_real sample_time; /* Interval of the controller [s] */
    ahrs_real attitude_gain[3]; /* Wanted rate over attitude error, body axes [1/s] */
    ahrs_real rate_gain[3]; /* Angular acceleration over rate error, body axes [1/s] */
    ahrs_real rate_integral_gain[3]; /* Angular acceleration over integrated rate error, body axes [1/s2] */
    ahrs_real rate_limit[3]; /* Greatest wanted rate, body axes [rad/s] */
    ahrs_real integral_limit[3]; /* Greatest integral part, body axes [rad/s2] */
    ahrs_real inertia[3]; /* Principal moments of inertia of the vehicle [kg.m2] */
    ahrs_real arm_length; /* From the centre to a rotor, seen from above [m] */
    ahrs_real thrust_coefficient; /* Thrust over squared rotor speed [N.s2/rad2] */
    ahrs_real torque_coefficient; /* Drag torque over squared rotor speed [N.m.s2/rad2] */
    ahrs_real rotor_speed_min; /* Lowest rotor speed [rad/s] */
    ahrs_real rotor_speed_max; /* Highest rotor speed [rad/s] */
    ahrs_real initial_thrust; /* Total thrust before the first sample [N] */
} ahrs_attitude_controller_params;

typedef struct {
    ahrs_real q_ref[4]; /* Wanted attitude, body to navigation [1] */
    ahrs_real rate_ref[3]; /* Angular rate of the wanted attitude, its own axes [rad/s] */
    ahrs_real angular_acceleration_ref[3]; /* Angular acceleration of the wanted attitude, its own axes [rad/s2] */
    ahrs_real thrust; /* Wanted total thrust [N] */
    ahrs_real q[4]; /* Estimated attitude, body to navigation [1] */
    ahrs_real rate[3]; /* Estimated angular rate, body axes [rad/s] */
} ahrs_attitude_controller_inputs;

typedef struct {
    ahrs_real rotor_speed_command[4]; /* Rotor speeds: front right, rear left, front left, rear right [rad/s] */
    ahrs_real torque[3]; /* Wanted moment before the limits, body axes [N.m] */
    int32_t saturated; /* The rotors could not give what was wanted */
} ahrs_attitude_controller_outputs_t;

typedef struct {
    ahrs_real integral[3]; /* Integrated rate error, body axes [rad/s2] */
    ahrs_real torque[3]; /* Wanted moment, body axes [N.m] */
    ahrs_real rotor_speed_command[4]; /* Rotor speeds from the last sample on [rad/s] */
    int32_t saturated; /* The rotors could not give what was wanted */
} ahrs_attitude_controller_state;

/* Parameters and inputs to their defaults. */
void ahrs_attitude_controller_defaults(ahrs_attitude_controller_params *p, ahrs_attitude_controller_inputs *u);

/* State as before the first sample. */
void ahrs_attitude_controller_init(ahrs_attitude_controller_state *s, const ahrs_attitude_controller_params *p);

/* One sample, dt seconds after the one before; dt = 0 takes in the inputs at the start. */
void ahrs_attitude_controller_update(ahrs_attitude_controller_state *s, const ahrs_attitude_controller_params *p, const ahrs_attitude_controller_inputs *u, ahrs_real dt);

void ahrs_attitude_controller_outputs(const ahrs_attitude_controller_state *s, const ahrs_attitude_controller_params *p, ahrs_attitude_controller_outputs_t *y);

#endif
