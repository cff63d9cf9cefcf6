/* Generated from models/attitude_controller/attitude_controller.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#include "ahrs_attitude_controller.h"
#include "model.h"

#include <string.h>

typedef struct {
    ahrs_attitude_controller_params params;
    ahrs_attitude_controller_inputs inputs;
    ahrs_attitude_controller_outputs_t outputs;
    ahrs_attitude_controller_state state;
} instance;

static const fmu_variable variables[] = {
    {"q_ref", 1, 4, offsetof(instance, inputs.q_ref), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate_ref", 5, 3, offsetof(instance, inputs.rate_ref), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"angular_acceleration_ref", 8, 3, offsetof(instance, inputs.angular_acceleration_ref), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"thrust", 11, 1, offsetof(instance, inputs.thrust), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"q", 12, 4, offsetof(instance, inputs.q), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate", 16, 3, offsetof(instance, inputs.rate), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"rotor_speed_command", 130, 4, offsetof(instance, outputs.rotor_speed_command), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"torque", 134, 3, offsetof(instance, outputs.torque), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"saturated", 137, 1, offsetof(instance, outputs.saturated), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"sample_time", 200, 1, offsetof(instance, params.sample_time), FMU_REAL, FMU_FIXED, 0, 1e-05, 0.5},
    {"attitude_gain", 1000, 3, offsetof(instance, params.attitude_gain), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000.0},
    {"rate_gain", 1003, 3, offsetof(instance, params.rate_gain), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000.0},
    {"rate_integral_gain", 1006, 3, offsetof(instance, params.rate_integral_gain), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100000.0},
    {"rate_limit", 1009, 3, offsetof(instance, params.rate_limit), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"integral_limit", 1012, 3, offsetof(instance, params.integral_limit), FMU_REAL, FMU_TUNABLE, 0, 0.0, 10000.0},
    {"inertia", 1015, 3, offsetof(instance, params.inertia), FMU_REAL, FMU_FIXED, 0, 1e-07, 1000.0},
    {"arm_length", 1018, 1, offsetof(instance, params.arm_length), FMU_REAL, FMU_FIXED, 0, 0.001, 10.0},
    {"thrust_coefficient", 1019, 1, offsetof(instance, params.thrust_coefficient), FMU_REAL, FMU_FIXED, FMU_MIN_OPEN, 0.0, 1.0},
    {"torque_coefficient", 1020, 1, offsetof(instance, params.torque_coefficient), FMU_REAL, FMU_FIXED, FMU_MIN_OPEN, 0.0, 1.0},
    {"rotor_speed_min", 1021, 1, offsetof(instance, params.rotor_speed_min), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"rotor_speed_max", 1022, 1, offsetof(instance, params.rotor_speed_max), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"initial_thrust", 1023, 1, offsetof(instance, params.initial_thrust), FMU_REAL, FMU_FIXED, 0, 0.0, 100000.0},
};

static bool limit_0(const void *data) {
    const ahrs_attitude_controller_params *p = &((const instance *)data)->params;
    return p->rotor_speed_min < p->rotor_speed_max;
}

static const uint32_t limit_0_vrs[] = {1021, 1022};

static bool limit_1(const void *data) {
    const ahrs_attitude_controller_params *p = &((const instance *)data)->params;
    return ((p->rate_gain[0] * p->sample_time) < 1) && ((p->rate_gain[1] * p->sample_time) < 1) && ((p->rate_gain[2] * p->sample_time) < 1);
}

static const uint32_t limit_1_vrs[] = {200, 1003};

static const fmu_limit limits[] = {
    {"rotor_speed_min < rotor_speed_max", "no rotor speed is left: lower rotor_speed_min or raise rotor_speed_max", false, limit_0_vrs, 2, limit_0},
    {"rate_gain[0]*sample_time < 1 and rate_gain[1]*sample_time < 1 and rate_gain[2]*sample_time < 1", "the rate loop would correct more than the whole error in one sample: lower rate_gain or sample_time", false, limit_1_vrs, 2, limit_1},
};

void ahrs_attitude_controller_defaults(ahrs_attitude_controller_params *p, ahrs_attitude_controller_inputs *u) {
    memset(p, 0, sizeof *p);
    memset(u, 0, sizeof *u);
    p->sample_time = AHRS_C(0.004);
    p->attitude_gain[0] = AHRS_C(6.0);
    p->attitude_gain[1] = AHRS_C(6.0);
    p->attitude_gain[2] = AHRS_C(2.5);
    p->rate_gain[0] = AHRS_C(20.0);
    p->rate_gain[1] = AHRS_C(20.0);
    p->rate_gain[2] = AHRS_C(6.0);
    p->rate_integral_gain[0] = AHRS_C(20.0);
    p->rate_integral_gain[1] = AHRS_C(20.0);
    p->rate_integral_gain[2] = AHRS_C(3.0);
    p->rate_limit[0] = AHRS_C(4.0);
    p->rate_limit[1] = AHRS_C(4.0);
    p->rate_limit[2] = AHRS_C(1.5);
    p->integral_limit[0] = AHRS_C(10.0);
    p->integral_limit[1] = AHRS_C(10.0);
    p->integral_limit[2] = AHRS_C(2.0);
    p->inertia[0] = AHRS_C(0.0095);
    p->inertia[1] = AHRS_C(0.01);
    p->inertia[2] = AHRS_C(0.018);
    p->arm_length = AHRS_C(0.225);
    p->thrust_coefficient = AHRS_C(1.3e-05);
    p->torque_coefficient = AHRS_C(2.35e-07);
    p->rotor_speed_min = AHRS_C(100.0);
    p->rotor_speed_max = AHRS_C(750.0);
    p->initial_thrust = AHRS_C(9.80665);
    u->q_ref[0] = AHRS_C(1.0);
    u->q_ref[1] = AHRS_C(0.0);
    u->q_ref[2] = AHRS_C(0.0);
    u->q_ref[3] = AHRS_C(0.0);
    u->rate_ref[0] = AHRS_C(0.0);
    u->rate_ref[1] = AHRS_C(0.0);
    u->rate_ref[2] = AHRS_C(0.0);
    u->angular_acceleration_ref[0] = AHRS_C(0.0);
    u->angular_acceleration_ref[1] = AHRS_C(0.0);
    u->angular_acceleration_ref[2] = AHRS_C(0.0);
    u->thrust = AHRS_C(9.80665);
    u->q[0] = AHRS_C(1.0);
    u->q[1] = AHRS_C(0.0);
    u->q[2] = AHRS_C(0.0);
    u->q[3] = AHRS_C(0.0);
    u->rate[0] = AHRS_C(0.0);
    u->rate[1] = AHRS_C(0.0);
    u->rate[2] = AHRS_C(0.0);
}

static void defaults(void *data) {
    instance *i = data;
    memset(i, 0, sizeof *i);
    ahrs_attitude_controller_defaults(&i->params, &i->inputs);
}

static void init(void *data) {
    instance *i = data;
    ahrs_attitude_controller_init(&i->state, &i->params);
}

static void update(void *data, ahrs_real dt) {
    instance *i = data;
    ahrs_attitude_controller_update(&i->state, &i->params, &i->inputs, dt);
}

static void compute_outputs(void *data) {
    instance *i = data;
    ahrs_attitude_controller_outputs(&i->state, &i->params, &i->outputs);
}

extern const fmu_model ahrs_attitude_controller_model;
const fmu_model ahrs_attitude_controller_model = {
    "attitude_controller", "AttitudeController", sizeof(instance), {offsetof(instance, params), sizeof(((instance *)0)->params)}, {offsetof(instance, inputs), sizeof(((instance *)0)->inputs)}, {offsetof(instance, outputs), sizeof(((instance *)0)->outputs)}, {offsetof(instance, state), sizeof(((instance *)0)->state)},
    offsetof(instance, params.sample_time), 0.004,
    variables, sizeof variables / sizeof variables[0],
    limits, sizeof limits / sizeof limits[0],
    defaults, init, update, compute_outputs};
