/* Generated from models/quadrotor/quadrotor.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#include "ahrs_quadrotor.h"
#include "model.h"

#include <string.h>

typedef struct {
    ahrs_quadrotor_params params;
    ahrs_quadrotor_inputs inputs;
    ahrs_quadrotor_outputs_t outputs;
    ahrs_quadrotor_state state;
} instance;

static const fmu_variable variables[] = {
    {"rotor_speed_command", 1, 4, offsetof(instance, inputs.rotor_speed_command), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"wind", 5, 3, offsetof(instance, inputs.wind), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"q", 100, 4, offsetof(instance, outputs.q), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"roll", 104, 1, offsetof(instance, outputs.roll), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"pitch", 105, 1, offsetof(instance, outputs.pitch), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"yaw", 106, 1, offsetof(instance, outputs.yaw), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate", 107, 3, offsetof(instance, outputs.rate), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"specific_force", 130, 3, offsetof(instance, outputs.specific_force), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"position", 133, 3, offsetof(instance, outputs.position), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"velocity", 136, 3, offsetof(instance, outputs.velocity), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"rotor_speed", 139, 4, offsetof(instance, outputs.rotor_speed), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"sample_time", 200, 1, offsetof(instance, params.sample_time), FMU_REAL, FMU_FIXED, 0, 1e-05, 0.5},
    {"gravity", 203, 1, offsetof(instance, params.gravity), FMU_REAL, FMU_FIXED, 0, 0.0, 100.0},
    {"inner_step", 1000, 1, offsetof(instance, params.inner_step), FMU_REAL, FMU_FIXED, 0, 1e-06, 0.1},
    {"mass", 1001, 1, offsetof(instance, params.mass), FMU_REAL, FMU_FIXED, 0, 0.001, 1000.0},
    {"inertia", 1002, 3, offsetof(instance, params.inertia), FMU_REAL, FMU_FIXED, 0, 1e-07, 1000.0},
    {"arm_length", 1005, 1, offsetof(instance, params.arm_length), FMU_REAL, FMU_FIXED, 0, 0.001, 10.0},
    {"rotor_height", 1006, 1, offsetof(instance, params.rotor_height), FMU_REAL, FMU_FIXED, 0, -1.0, 1.0},
    {"thrust_coefficient", 1007, 1, offsetof(instance, params.thrust_coefficient), FMU_REAL, FMU_FIXED, 0, 0.0, 1.0},
    {"torque_coefficient", 1008, 1, offsetof(instance, params.torque_coefficient), FMU_REAL, FMU_FIXED, 0, 0.0, 1.0},
    {"rotor_drag_coefficient", 1009, 1, offsetof(instance, params.rotor_drag_coefficient), FMU_REAL, FMU_FIXED, 0, 0.0, 1.0},
    {"rotor_inertia", 1010, 1, offsetof(instance, params.rotor_inertia), FMU_REAL, FMU_FIXED, 0, 0.0, 1.0},
    {"rotor_time_constant", 1011, 1, offsetof(instance, params.rotor_time_constant), FMU_REAL, FMU_FIXED, 0, 0.0001, 10.0},
    {"rotor_speed_min", 1012, 1, offsetof(instance, params.rotor_speed_min), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"rotor_speed_max", 1013, 1, offsetof(instance, params.rotor_speed_max), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"drag_area", 1014, 3, offsetof(instance, params.drag_area), FMU_REAL, FMU_FIXED, 0, 0.0, 100.0},
    {"air_density", 1017, 1, offsetof(instance, params.air_density), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"imu_position", 1018, 3, offsetof(instance, params.imu_position), FMU_REAL, FMU_FIXED, 0, -10.0, 10.0},
    {"initial_position", 1021, 3, offsetof(instance, params.initial_position), FMU_REAL, FMU_FIXED, 0, -DBL_MAX, DBL_MAX},
    {"initial_velocity", 1024, 3, offsetof(instance, params.initial_velocity), FMU_REAL, FMU_FIXED, 0, -DBL_MAX, DBL_MAX},
    {"initial_q", 1027, 4, offsetof(instance, params.initial_q), FMU_REAL, FMU_FIXED, 0, -1.1, 1.1},
    {"initial_rate", 1031, 3, offsetof(instance, params.initial_rate), FMU_REAL, FMU_FIXED, 0, -DBL_MAX, DBL_MAX},
    {"initial_rotor_speed", 1034, 1, offsetof(instance, params.initial_rotor_speed), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"ground", 1035, 1, offsetof(instance, params.ground), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"leg_length", 1036, 1, offsetof(instance, params.leg_length), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"ground_stiffness", 1037, 1, offsetof(instance, params.ground_stiffness), FMU_REAL, FMU_FIXED, 0, 0.0, 10000000.0},
    {"ground_damping", 1038, 1, offsetof(instance, params.ground_damping), FMU_REAL, FMU_FIXED, 0, 0.0, 100000.0},
    {"ground_friction", 1039, 1, offsetof(instance, params.ground_friction), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"slip_speed", 1040, 1, offsetof(instance, params.slip_speed), FMU_REAL, FMU_FIXED, 0, 0.0001, 10.0},
};

static bool limit_0(const void *data) {
    const ahrs_quadrotor_params *p = &((const instance *)data)->params;
    return p->rotor_speed_min <= p->rotor_speed_max;
}

static const uint32_t limit_0_vrs[] = {1012, 1013};

static bool limit_1(const void *data) {
    const ahrs_quadrotor_params *p = &((const instance *)data)->params;
    return ((((p->initial_q[0] * p->initial_q[0]) + (p->initial_q[1] * p->initial_q[1])) + (p->initial_q[2] * p->initial_q[2])) + (p->initial_q[3] * p->initial_q[3])) > AHRS_C(1e-06);
}

static const uint32_t limit_1_vrs[] = {1027};

static bool limit_2(const void *data) {
    const ahrs_quadrotor_params *p = &((const instance *)data)->params;
    return p->inner_step < p->rotor_time_constant;
}

static const uint32_t limit_2_vrs[] = {1000, 1011};

static bool limit_3(const void *data) {
    const ahrs_quadrotor_params *p = &((const instance *)data)->params;
    return p->sample_time < (100000 * p->inner_step);
}

static const uint32_t limit_3_vrs[] = {200, 1000};

static const fmu_limit limits[] = {
    {"rotor_speed_min <= rotor_speed_max", "no rotor speed is left: lower rotor_speed_min or raise rotor_speed_max", false, limit_0_vrs, 2, limit_0},
    {"initial_q[0]*initial_q[0] + initial_q[1]*initial_q[1] + initial_q[2]*initial_q[2] + initial_q[3]*initial_q[3] > 1e-6", "initial_q has no direction: give a quaternion of about unit length", false, limit_1_vrs, 1, limit_1},
    {"inner_step < rotor_time_constant", "the integration would not resolve the rotors: lower inner_step", false, limit_2_vrs, 2, limit_2},
    {"sample_time < 100000*inner_step", "a tick would take too many inner steps: raise inner_step or lower sample_time", false, limit_3_vrs, 2, limit_3},
};

void ahrs_quadrotor_defaults(ahrs_quadrotor_params *p, ahrs_quadrotor_inputs *u) {
    memset(p, 0, sizeof *p);
    memset(u, 0, sizeof *u);
    p->sample_time = AHRS_C(0.004);
    p->gravity = AHRS_C(9.80665);
    p->inner_step = AHRS_C(0.001);
    p->mass = AHRS_C(1.0);
    p->inertia[0] = AHRS_C(0.0095);
    p->inertia[1] = AHRS_C(0.01);
    p->inertia[2] = AHRS_C(0.018);
    p->arm_length = AHRS_C(0.225);
    p->rotor_height = AHRS_C(0.03);
    p->thrust_coefficient = AHRS_C(1.3e-05);
    p->torque_coefficient = AHRS_C(2.35e-07);
    p->rotor_drag_coefficient = AHRS_C(0.00015);
    p->rotor_inertia = AHRS_C(3e-05);
    p->rotor_time_constant = AHRS_C(0.03);
    p->rotor_speed_min = AHRS_C(100.0);
    p->rotor_speed_max = AHRS_C(750.0);
    p->drag_area[0] = AHRS_C(0.015);
    p->drag_area[1] = AHRS_C(0.015);
    p->drag_area[2] = AHRS_C(0.03);
    p->air_density = AHRS_C(1.225);
    p->imu_position[0] = AHRS_C(0.02);
    p->imu_position[1] = AHRS_C(0.01);
    p->imu_position[2] = AHRS_C(-0.015);
    p->initial_position[0] = AHRS_C(0.0);
    p->initial_position[1] = AHRS_C(0.0);
    p->initial_position[2] = AHRS_C(0.0);
    p->initial_velocity[0] = AHRS_C(0.0);
    p->initial_velocity[1] = AHRS_C(0.0);
    p->initial_velocity[2] = AHRS_C(0.0);
    p->initial_q[0] = AHRS_C(1.0);
    p->initial_q[1] = AHRS_C(0.0);
    p->initial_q[2] = AHRS_C(0.0);
    p->initial_q[3] = AHRS_C(0.0);
    p->initial_rate[0] = AHRS_C(0.0);
    p->initial_rate[1] = AHRS_C(0.0);
    p->initial_rate[2] = AHRS_C(0.0);
    p->initial_rotor_speed = AHRS_C(434.27);
    p->ground = 0;
    p->leg_length = AHRS_C(0.12);
    p->ground_stiffness = AHRS_C(2000.0);
    p->ground_damping = AHRS_C(20.0);
    p->ground_friction = AHRS_C(0.6);
    p->slip_speed = AHRS_C(0.05);
    u->rotor_speed_command[0] = AHRS_C(434.27);
    u->rotor_speed_command[1] = AHRS_C(434.27);
    u->rotor_speed_command[2] = AHRS_C(434.27);
    u->rotor_speed_command[3] = AHRS_C(434.27);
    u->wind[0] = AHRS_C(0.0);
    u->wind[1] = AHRS_C(0.0);
    u->wind[2] = AHRS_C(0.0);
}

static void defaults(void *data) {
    instance *i = data;
    memset(i, 0, sizeof *i);
    ahrs_quadrotor_defaults(&i->params, &i->inputs);
}

static void init(void *data) {
    instance *i = data;
    ahrs_quadrotor_init(&i->state, &i->params);
}

static void update(void *data, ahrs_real dt) {
    instance *i = data;
    ahrs_quadrotor_update(&i->state, &i->params, &i->inputs, dt);
}

static void compute_outputs(void *data) {
    instance *i = data;
    ahrs_quadrotor_outputs(&i->state, &i->params, &i->outputs);
}

extern const fmu_model ahrs_quadrotor_model;
const fmu_model ahrs_quadrotor_model = {
    "quadrotor", "Quadrotor", sizeof(instance), {offsetof(instance, params), sizeof(((instance *)0)->params)}, {offsetof(instance, inputs), sizeof(((instance *)0)->inputs)}, {offsetof(instance, outputs), sizeof(((instance *)0)->outputs)}, {offsetof(instance, state), sizeof(((instance *)0)->state)},
    offsetof(instance, params.sample_time), 0.004,
    variables, sizeof variables / sizeof variables[0],
    limits, sizeof limits / sizeof limits[0],
    defaults, init, update, compute_outputs};
