/* Generated from models/ukf/ukf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#include "ahrs_ukf.h"
#include "model.h"

#include <string.h>

typedef struct {
    ahrs_ukf_params params;
    ahrs_ukf_inputs inputs;
    ahrs_ukf_outputs_t outputs;
    ahrs_ukf_state state;
} instance;

static const fmu_variable variables[] = {
    {"gyro", 1, 3, offsetof(instance, inputs.gyro), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel", 4, 3, offsetof(instance, inputs.accel), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"mag", 7, 3, offsetof(instance, inputs.mag), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel_valid", 10, 1, offsetof(instance, inputs.accel_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"mag_valid", 11, 1, offsetof(instance, inputs.mag_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"q", 100, 4, offsetof(instance, outputs.common.q), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"roll", 104, 1, offsetof(instance, outputs.common.roll), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"pitch", 105, 1, offsetof(instance, outputs.common.pitch), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"yaw", 106, 1, offsetof(instance, outputs.common.yaw), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate", 107, 3, offsetof(instance, outputs.common.rate), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"gyro_bias", 110, 3, offsetof(instance, outputs.common.gyro_bias), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"motion_accel", 113, 3, offsetof(instance, outputs.common.motion_accel), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"attitude_std", 116, 3, offsetof(instance, outputs.attitude_std), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"status", 119, 1, offsetof(instance, outputs.common.status), FMU_ENUMERATION, FMU_OUTPUT, 0, 0.0, 9.0},
    {"gyro_held", 120, 1, offsetof(instance, outputs.common.gyro_held), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"accel_used", 121, 1, offsetof(instance, outputs.common.accel_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"mag_used", 122, 1, offsetof(instance, outputs.common.mag_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"covariance_reset", 123, 1, offsetof(instance, outputs.covariance_reset), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"sample_time", 200, 1, offsetof(instance, params.common.sample_time), FMU_REAL, FMU_FIXED, 0, 1e-05, 0.5},
    {"frame", 201, 1, offsetof(instance, params.common.frame), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"declination", 202, 1, offsetof(instance, params.common.declination), FMU_REAL, FMU_TUNABLE, 0, -3.141592653589793, 3.141592653589793},
    {"gravity", 203, 1, offsetof(instance, params.common.gravity), FMU_REAL, FMU_FIXED, 0, 0.1, 100.0},
    {"field_reference", 204, 1, offsetof(instance, params.common.field_reference), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"field_magnitude", 205, 1, offsetof(instance, params.common.field_magnitude), FMU_REAL, FMU_FIXED, 0, 1e-07, 0.01},
    {"field_dip", 206, 1, offsetof(instance, params.common.field_dip), FMU_REAL, FMU_FIXED, 0, -1.5707963267948966, 1.5707963267948966},
    {"initialisation", 207, 1, offsetof(instance, params.common.initialisation), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"q0", 208, 4, offsetof(instance, params.common.q0), FMU_REAL, FMU_FIXED, 0, -1.1, 1.1},
    {"init_time", 212, 1, offsetof(instance, params.common.init_time), FMU_REAL, FMU_FIXED, 0, 0.0, 600.0},
    {"motion_compensation", 213, 1, offsetof(instance, params.common.motion_compensation), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"motion_time_constant", 214, 1, offsetof(instance, params.common.motion_time_constant), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN | FMU_INFINITY_ALLOWED, 0.0, DBL_MAX},
    {"accel_gating", 215, 1, offsetof(instance, params.common.accel_gating), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"accel_gate", 216, 1, offsetof(instance, params.common.accel_gate), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"accel_gate_time", 217, 1, offsetof(instance, params.common.accel_gate_time), FMU_REAL, FMU_TUNABLE, 0, 0.0, 600.0},
    {"gyro_zero_samples", 220, 1, offsetof(instance, params.common.gyro_zero_samples), FMU_INTEGER, FMU_FIXED, 0, 0.0, 1000000.0},
    {"gyro_zero_std", 221, 1, offsetof(instance, params.common.gyro_zero_std), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"gyro_zero_limit", 222, 1, offsetof(instance, params.common.gyro_zero_limit), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"accel_cutoff", 223, 1, offsetof(instance, params.common.accel_cutoff), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"mag_offset", 224, 3, offsetof(instance, params.common.mag_offset), FMU_REAL, FMU_FIXED, 0, -0.01, 0.01},
    {"mag_gain", 227, 3, offsetof(instance, params.common.mag_gain), FMU_REAL, FMU_FIXED, 0, 0.01, 100.0},
    {"bias_limit", 1003, 1, offsetof(instance, params.bias_limit), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"gyro_noise", 1040, 1, offsetof(instance, params.gyro_noise), FMU_REAL, FMU_TUNABLE, 0, 1e-07, 100.0},
    {"gyro_bias_noise", 1041, 1, offsetof(instance, params.gyro_bias_noise), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"accel_noise", 1042, 1, offsetof(instance, params.accel_noise), FMU_REAL, FMU_TUNABLE, 0, 0.0001, 1000.0},
    {"mag_noise", 1043, 1, offsetof(instance, params.mag_noise), FMU_REAL, FMU_TUNABLE, 0, 1e-09, 1.0},
    {"motion_noise", 1047, 1, offsetof(instance, params.motion_noise), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000.0},
    {"initial_attitude_std", 1048, 1, offsetof(instance, params.initial_attitude_std), FMU_REAL, FMU_FIXED, 0, 0.0001, 1.0},
    {"initial_bias_std", 1049, 1, offsetof(instance, params.initial_bias_std), FMU_REAL, FMU_FIXED, 0, 1e-06, 10.0},
    {"alpha", 1090, 1, offsetof(instance, params.alpha), FMU_REAL, FMU_FIXED, 0, 0.0001, 2.0},
    {"beta", 1091, 1, offsetof(instance, params.beta), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"kappa", 1092, 1, offsetof(instance, params.kappa), FMU_REAL, FMU_FIXED, 0, -5.0, 100.0},
};

static bool limit_0(const void *data) {
    const ahrs_ukf_params *p = &((const instance *)data)->params;
    return (p->common.initialisation == AHRS_INITIALISATION_SENSORS) || (((((p->common.q0[0] * p->common.q0[0]) + (p->common.q0[1] * p->common.q0[1])) + (p->common.q0[2] * p->common.q0[2])) + (p->common.q0[3] * p->common.q0[3])) > AHRS_C(1e-06));
}

static const uint32_t limit_0_vrs[] = {207, 208};

static bool limit_1(const void *data) {
    const ahrs_ukf_params *p = &((const instance *)data)->params;
    return (!(p->common.motion_compensation)) || (p->common.motion_time_constant < AHRS_INFINITY);
}

static const uint32_t limit_1_vrs[] = {213, 214};

static bool limit_2(const void *data) {
    const ahrs_ukf_params *p = &((const instance *)data)->params;
    return (p->common.accel_cutoff * p->common.sample_time) < AHRS_C(0.4);
}

static const uint32_t limit_2_vrs[] = {223, 200};

static bool limit_3(const void *data) {
    const ahrs_ukf_params *p = &((const instance *)data)->params;
    return (p->alpha >= AHRS_C(0.01)) || (AHRS_REAL_EPSILON < AHRS_C(1e-09));
}

static const uint32_t limit_3_vrs[] = {1090};

static const fmu_limit limits[] = {
    {"initialisation == sensors or q0[0]*q0[0] + q0[1]*q0[1] + q0[2]*q0[2] + q0[3]*q0[3] > 1e-6", "q0 has no direction: give a quaternion of about unit length", false, limit_0_vrs, 2, limit_0},
    {"not motion_compensation or motion_time_constant < inf", "tilt is not observed at all with an infinite motion_time_constant: use it for bursts of less than half a minute only", true, limit_1_vrs, 2, limit_1},
    {"accel_cutoff*sample_time < 0.4", "the low-pass needs more than two samples per period: lower accel_cutoff or sample_time", false, limit_2_vrs, 2, limit_2},
    {"alpha >= 0.01 or epsilon < 1e-9", "in single precision little more than rounding is left of the points of so small an alpha: use double, or a larger alpha", false, limit_3_vrs, 1, limit_3},
};

void ahrs_ukf_defaults(ahrs_ukf_params *p, ahrs_ukf_inputs *u) {
    memset(p, 0, sizeof *p);
    memset(u, 0, sizeof *u);
    p->common.sample_time = AHRS_C(0.01);
    p->common.frame = 0;
    p->common.declination = AHRS_C(0.0);
    p->common.gravity = AHRS_C(9.80665);
    p->common.field_reference = 0;
    p->common.field_magnitude = AHRS_C(5e-05);
    p->common.field_dip = AHRS_C(1.1);
    p->common.initialisation = 0;
    p->common.q0[0] = AHRS_C(1.0);
    p->common.q0[1] = AHRS_C(0.0);
    p->common.q0[2] = AHRS_C(0.0);
    p->common.q0[3] = AHRS_C(0.0);
    p->common.init_time = AHRS_C(0.0);
    p->common.motion_compensation = 0;
    p->common.motion_time_constant = AHRS_C(1.0);
    p->common.accel_gating = 0;
    p->common.accel_gate = AHRS_C(1.0);
    p->common.accel_gate_time = AHRS_C(10.0);
    p->common.gyro_zero_samples = 0;
    p->common.gyro_zero_std = AHRS_C(0.02);
    p->common.gyro_zero_limit = AHRS_C(0.1);
    p->common.accel_cutoff = AHRS_C(0.0);
    p->common.mag_offset[0] = AHRS_C(0.0);
    p->common.mag_offset[1] = AHRS_C(0.0);
    p->common.mag_offset[2] = AHRS_C(0.0);
    p->common.mag_gain[0] = AHRS_C(1.0);
    p->common.mag_gain[1] = AHRS_C(1.0);
    p->common.mag_gain[2] = AHRS_C(1.0);
    p->bias_limit = AHRS_C(0.2);
    p->gyro_noise = AHRS_C(0.0002);
    p->gyro_bias_noise = AHRS_C(0.000175);
    p->accel_noise = AHRS_C(0.1);
    p->mag_noise = AHRS_C(1e-07);
    p->motion_noise = AHRS_C(0.5);
    p->initial_attitude_std = AHRS_C(0.1);
    p->initial_bias_std = AHRS_C(0.02);
    p->alpha = AHRS_C(1.0);
    p->beta = AHRS_C(0.0);
    p->kappa = AHRS_C(0.0);
    u->gyro[0] = AHRS_C(0.0);
    u->gyro[1] = AHRS_C(0.0);
    u->gyro[2] = AHRS_C(0.0);
    u->accel[0] = AHRS_C(0.0);
    u->accel[1] = AHRS_C(0.0);
    u->accel[2] = AHRS_C(0.0);
    u->mag[0] = AHRS_C(0.0);
    u->mag[1] = AHRS_C(0.0);
    u->mag[2] = AHRS_C(0.0);
    u->accel_valid = 1;
    u->mag_valid = 1;
}

static void defaults(void *data) {
    instance *i = data;
    memset(i, 0, sizeof *i);
    ahrs_ukf_defaults(&i->params, &i->inputs);
}

static void init(void *data) {
    instance *i = data;
    ahrs_ukf_init(&i->state, &i->params);
}

static void update(void *data, ahrs_real dt) {
    instance *i = data;
    ahrs_ukf_update(&i->state, &i->params, &i->inputs, dt);
}

static void compute_outputs(void *data) {
    instance *i = data;
    ahrs_ukf_outputs(&i->state, &i->params, &i->outputs);
}

extern const fmu_model ahrs_ukf_model;
const fmu_model ahrs_ukf_model = {
    "ukf", "UKF", sizeof(instance), {offsetof(instance, params), sizeof(((instance *)0)->params)}, {offsetof(instance, inputs), sizeof(((instance *)0)->inputs)}, {offsetof(instance, outputs), sizeof(((instance *)0)->outputs)}, {offsetof(instance, state), sizeof(((instance *)0)->state)},
    offsetof(instance, params.common.sample_time), 0.01,
    variables, sizeof variables / sizeof variables[0],
    limits, sizeof limits / sizeof limits[0],
    defaults, init, update, compute_outputs};
