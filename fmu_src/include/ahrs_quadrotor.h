/* Generated from models/quadrotor/quadrotor.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_QUADROTOR_H
#define AHRS_QUADROTOR_H

#include "ahrs_real.h"

/* Quadrotor with six degrees of freedom. Rigid body on the quaternion, four rotors with first-order lag,
 * thrust, drag torque, rotor drag, body drag and wind, integrated by a Runge-Kutta method of fourth order.
 * Axes are north-east-down and forward-right-down. The defaults are those of a vehicle of 1 kg
 * (docs/vehicle.md).
 */

typedef struct {
    ahrs_real sample_time; /* Interval between outputs [s] */
    ahrs_real gravity; /* Local gravity [m/s2] */
    ahrs_real inner_step; /* Longest step of the integration [s] */
    ahrs_real mass; /* Mass [kg] */
    ahrs_real inertia[3]; /* Principal moments of inertia about the centre of mass [kg.m2] */
    ahrs_real arm_length; /* From the centre to a rotor, seen from above [m] */
    ahrs_real rotor_height; /* Rotor plane above the centre of mass [m] */
    ahrs_real thrust_coefficient; /* Thrust over squared rotor speed [N.s2/rad2] */
    ahrs_real torque_coefficient; /* Drag torque over squared rotor speed [N.m.s2/rad2] */
    ahrs_real rotor_drag_coefficient; /* Force in the rotor plane over rotor speed and air speed [N.s2/m/rad] */
    ahrs_real rotor_inertia; /* Inertia of a rotor about its shaft [kg.m2] */
    ahrs_real rotor_time_constant; /* Time constant of the rotor speed [s] */
    ahrs_real rotor_speed_min; /* Lowest rotor speed that is obeyed [rad/s] */
    ahrs_real rotor_speed_max; /* Highest rotor speed that is obeyed [rad/s] */
    ahrs_real drag_area[3]; /* Drag coefficient times area, body axes [m2] */
    ahrs_real air_density; /* Density of the air [kg/m3] */
    ahrs_real imu_position[3]; /* Place of the IMU, body axes, from the centre of mass [m] */
    ahrs_real initial_position[3]; /* Position at the start, navigation axes [m] */
    ahrs_real initial_velocity[3]; /* Velocity at the start, navigation axes [m/s] */
    ahrs_real initial_q[4]; /* Attitude at the start; scaled to unit length [1] */
    ahrs_real initial_rate[3]; /* Angular rate at the start, body axes [rad/s] */
    ahrs_real initial_rotor_speed; /* Speed of all rotors at the start; the default is hover [rad/s] */
    ahrs_real leg_length; /* Feet below the centre of mass, used when there is a ground [m] */
    ahrs_real ground_stiffness; /* Stiffness of the ground per foot [N/m] */
    ahrs_real ground_damping; /* Damping of the ground per foot [N.s/m] */
    ahrs_real ground_friction; /* Friction over normal force [1] */
    ahrs_real slip_speed; /* Speed below which friction fades out [m/s] */
    int32_t ground; /* The plane of zero height carries the landing gear */
} ahrs_quadrotor_params;

typedef struct {
    ahrs_real rotor_speed_command[4]; /* Commanded rotor speeds: front right, rear left, front left, rear right [rad/s] */
    ahrs_real wind[3]; /* Velocity of the air, navigation axes [m/s] */
} ahrs_quadrotor_inputs;

typedef struct {
    ahrs_real q[4]; /* True attitude, body to navigation, Hamilton product, scalar first [1] */
    ahrs_real roll; /* True roll angle (z-y-x order) [rad] */
    ahrs_real pitch; /* True pitch angle (z-y-x order) [rad] */
    ahrs_real yaw; /* True yaw angle (z-y-x order), from north, clockwise seen from above [rad] */
    ahrs_real rate[3]; /* True angular rate, body axes [rad/s] */
    ahrs_real specific_force[3]; /* Specific force at the IMU, body axes [m/s2] */
    ahrs_real position[3]; /* Position of the centre of mass, navigation axes [m] */
    ahrs_real velocity[3]; /* Velocity of the centre of mass, navigation axes [m/s] */
    ahrs_real rotor_speed[4]; /* Rotor speeds [rad/s] */
} ahrs_quadrotor_outputs_t;

typedef struct {
    ahrs_real position[3]; /* Position, navigation axes [m] */
    ahrs_real velocity[3]; /* Velocity, navigation axes [m/s] */
    ahrs_real q[4]; /* Attitude, body to navigation [1] */
    ahrs_real rate[3]; /* Angular rate, body axes [rad/s] */
    ahrs_real rotor_speed[4]; /* Rotor speeds [rad/s] */
    ahrs_real command[4]; /* Last usable command, within its limits [rad/s] */
    ahrs_real wind[3]; /* Last usable wind [m/s] */
    ahrs_real specific_force[3]; /* Specific force at the IMU at the end of the last step [m/s2] */
} ahrs_quadrotor_state;

/* Parameters and inputs to their defaults. */
void ahrs_quadrotor_defaults(ahrs_quadrotor_params *p, ahrs_quadrotor_inputs *u);

/* State as before the first sample. */
void ahrs_quadrotor_init(ahrs_quadrotor_state *s, const ahrs_quadrotor_params *p);

/* One sample, dt seconds after the one before; dt = 0 takes in the inputs at the start. */
void ahrs_quadrotor_update(ahrs_quadrotor_state *s, const ahrs_quadrotor_params *p, const ahrs_quadrotor_inputs *u, ahrs_real dt);

void ahrs_quadrotor_outputs(const ahrs_quadrotor_state *s, const ahrs_quadrotor_params *p, ahrs_quadrotor_outputs_t *y);

#endif
