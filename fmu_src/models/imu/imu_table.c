/* Generated from models/imu/imu.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#include "ahrs_imu.h"
#include "model.h"

#include <string.h>

typedef struct {
    ahrs_imu_params params;
    ahrs_imu_inputs inputs;
    ahrs_imu_outputs_t outputs;
    ahrs_imu_state state;
} instance;

static const fmu_variable variables[] = {
    {"q", 1, 4, offsetof(instance, inputs.q), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate", 5, 3, offsetof(instance, inputs.rate), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"specific_force", 8, 3, offsetof(instance, inputs.specific_force), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"rotor_speed", 11, 4, offsetof(instance, inputs.rotor_speed), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"gyro", 130, 3, offsetof(instance, outputs.gyro), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel", 133, 3, offsetof(instance, outputs.accel), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"mag", 136, 3, offsetof(instance, outputs.mag), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"gyro_valid", 139, 1, offsetof(instance, outputs.gyro_valid), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"accel_valid", 140, 1, offsetof(instance, outputs.accel_valid), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"mag_valid", 141, 1, offsetof(instance, outputs.mag_valid), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"true_gyro_bias", 142, 3, offsetof(instance, outputs.true_gyro_bias), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"sample_time", 200, 1, offsetof(instance, params.sample_time), FMU_REAL, FMU_FIXED, 0, 1e-05, 0.5},
    {"declination", 202, 1, offsetof(instance, params.declination), FMU_REAL, FMU_FIXED, 0, -3.141592653589793, 3.141592653589793},
    {"field_magnitude", 205, 1, offsetof(instance, params.field_magnitude), FMU_REAL, FMU_FIXED, 0, 0.0, 0.01},
    {"field_dip", 206, 1, offsetof(instance, params.field_dip), FMU_REAL, FMU_FIXED, 0, -1.5707963267948966, 1.5707963267948966},
    {"seed", 1000, 1, offsetof(instance, params.seed), FMU_INTEGER, FMU_FIXED, 0, 0.0, 2147483647.0},
    {"errors", 1001, 1, offsetof(instance, params.errors), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"vibration_accel", 1002, 1, offsetof(instance, params.vibration_accel), FMU_REAL, FMU_FIXED, 0, 0.0, 1000.0},
    {"vibration_blade", 1003, 1, offsetof(instance, params.vibration_blade), FMU_REAL, FMU_FIXED, 0, 0.0, 1000.0},
    {"vibration_gyro", 1004, 1, offsetof(instance, params.vibration_gyro), FMU_REAL, FMU_FIXED, 0, 0.0, 100.0},
    {"vibration_speed", 1005, 1, offsetof(instance, params.vibration_speed), FMU_REAL, FMU_FIXED, 0, 1.0, 10000.0},
    {"hard_iron", 1010, 3, offsetof(instance, params.hard_iron), FMU_REAL, FMU_FIXED, 0, -0.01, 0.01},
    {"soft_iron", 1013, 9, offsetof(instance, params.soft_iron), FMU_REAL, FMU_FIXED, 0, -10.0, 10.0},
    {"gyro_noise_density", 1100, 1, offsetof(instance, params.gyro_noise_density), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"gyro_noise_std", 1101, 1, offsetof(instance, params.gyro_noise_std), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"gyro_bias", 1102, 3, offsetof(instance, params.gyro_bias), FMU_REAL, FMU_FIXED, 0, -DBL_MAX, DBL_MAX},
    {"gyro_turn_on_bias", 1105, 1, offsetof(instance, params.gyro_turn_on_bias), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"gyro_bias_instability", 1106, 1, offsetof(instance, params.gyro_bias_instability), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"gyro_bias_time", 1107, 1, offsetof(instance, params.gyro_bias_time), FMU_REAL, FMU_FIXED, 0, 0.001, DBL_MAX},
    {"gyro_bias_walk", 1108, 1, offsetof(instance, params.gyro_bias_walk), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"gyro_scale", 1109, 3, offsetof(instance, params.gyro_scale), FMU_REAL, FMU_FIXED, 0, -1.0, 1.0},
    {"gyro_misalignment", 1112, 3, offsetof(instance, params.gyro_misalignment), FMU_REAL, FMU_FIXED, 0, -0.5, 0.5},
    {"gyro_bandwidth", 1115, 1, offsetof(instance, params.gyro_bandwidth), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"gyro_delay", 1116, 1, offsetof(instance, params.gyro_delay), FMU_REAL, FMU_FIXED, 0, 0.0, 1.0},
    {"gyro_rate", 1117, 1, offsetof(instance, params.gyro_rate), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"gyro_quantisation", 1118, 1, offsetof(instance, params.gyro_quantisation), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"gyro_saturation", 1119, 1, offsetof(instance, params.gyro_saturation), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"accel_noise_density", 1200, 1, offsetof(instance, params.accel_noise_density), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"accel_noise_std", 1201, 1, offsetof(instance, params.accel_noise_std), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"accel_bias", 1202, 3, offsetof(instance, params.accel_bias), FMU_REAL, FMU_FIXED, 0, -DBL_MAX, DBL_MAX},
    {"accel_turn_on_bias", 1205, 1, offsetof(instance, params.accel_turn_on_bias), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"accel_bias_instability", 1206, 1, offsetof(instance, params.accel_bias_instability), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"accel_bias_time", 1207, 1, offsetof(instance, params.accel_bias_time), FMU_REAL, FMU_FIXED, 0, 0.001, DBL_MAX},
    {"accel_bias_walk", 1208, 1, offsetof(instance, params.accel_bias_walk), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"accel_scale", 1209, 3, offsetof(instance, params.accel_scale), FMU_REAL, FMU_FIXED, 0, -1.0, 1.0},
    {"accel_misalignment", 1212, 3, offsetof(instance, params.accel_misalignment), FMU_REAL, FMU_FIXED, 0, -0.5, 0.5},
    {"accel_bandwidth", 1215, 1, offsetof(instance, params.accel_bandwidth), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"accel_delay", 1216, 1, offsetof(instance, params.accel_delay), FMU_REAL, FMU_FIXED, 0, 0.0, 1.0},
    {"accel_rate", 1217, 1, offsetof(instance, params.accel_rate), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"accel_quantisation", 1218, 1, offsetof(instance, params.accel_quantisation), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"accel_saturation", 1219, 1, offsetof(instance, params.accel_saturation), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"mag_noise_density", 1300, 1, offsetof(instance, params.mag_noise_density), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"mag_noise_std", 1301, 1, offsetof(instance, params.mag_noise_std), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"mag_bias", 1302, 3, offsetof(instance, params.mag_bias), FMU_REAL, FMU_FIXED, 0, -DBL_MAX, DBL_MAX},
    {"mag_turn_on_bias", 1305, 1, offsetof(instance, params.mag_turn_on_bias), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"mag_bias_instability", 1306, 1, offsetof(instance, params.mag_bias_instability), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"mag_bias_time", 1307, 1, offsetof(instance, params.mag_bias_time), FMU_REAL, FMU_FIXED, 0, 0.001, DBL_MAX},
    {"mag_bias_walk", 1308, 1, offsetof(instance, params.mag_bias_walk), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"mag_scale", 1309, 3, offsetof(instance, params.mag_scale), FMU_REAL, FMU_FIXED, 0, -1.0, 1.0},
    {"mag_misalignment", 1312, 3, offsetof(instance, params.mag_misalignment), FMU_REAL, FMU_FIXED, 0, -0.5, 0.5},
    {"mag_bandwidth", 1315, 1, offsetof(instance, params.mag_bandwidth), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"mag_delay", 1316, 1, offsetof(instance, params.mag_delay), FMU_REAL, FMU_FIXED, 0, 0.0, 1.0},
    {"mag_rate", 1317, 1, offsetof(instance, params.mag_rate), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"mag_quantisation", 1318, 1, offsetof(instance, params.mag_quantisation), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
    {"mag_saturation", 1319, 1, offsetof(instance, params.mag_saturation), FMU_REAL, FMU_FIXED, 0, 0.0, DBL_MAX},
};

static bool limit_0(const void *data) {
    const ahrs_imu_params *p = &((const instance *)data)->params;
    return p->gyro_delay < (AHRS_C(31.5) * p->sample_time);
}

static const uint32_t limit_0_vrs[] = {1116, 200};

static bool limit_1(const void *data) {
    const ahrs_imu_params *p = &((const instance *)data)->params;
    return p->accel_delay < (AHRS_C(31.5) * p->sample_time);
}

static const uint32_t limit_1_vrs[] = {1216, 200};

static bool limit_2(const void *data) {
    const ahrs_imu_params *p = &((const instance *)data)->params;
    return p->mag_delay < (AHRS_C(31.5) * p->sample_time);
}

static const uint32_t limit_2_vrs[] = {1316, 200};

static const fmu_limit limits[] = {
    {"gyro_delay < 31.5*sample_time", "the gyroscope remembers 32 samples: lower gyro_delay or raise sample_time", false, limit_0_vrs, 2, limit_0},
    {"accel_delay < 31.5*sample_time", "the accelerometer remembers 32 samples: lower accel_delay or raise sample_time", false, limit_1_vrs, 2, limit_1},
    {"mag_delay < 31.5*sample_time", "the magnetometer remembers 32 samples: lower mag_delay or raise sample_time", false, limit_2_vrs, 2, limit_2},
};

void ahrs_imu_defaults(ahrs_imu_params *p, ahrs_imu_inputs *u) {
    memset(p, 0, sizeof *p);
    memset(u, 0, sizeof *u);
    p->sample_time = AHRS_C(0.004);
    p->declination = AHRS_C(0.0);
    p->field_magnitude = AHRS_C(5e-05);
    p->field_dip = AHRS_C(1.1);
    p->seed = 1;
    p->errors = 1;
    p->vibration_accel = AHRS_C(0.3);
    p->vibration_blade = AHRS_C(0.5);
    p->vibration_gyro = AHRS_C(0.01);
    p->vibration_speed = AHRS_C(434.27);
    p->hard_iron[0] = AHRS_C(0.0);
    p->hard_iron[1] = AHRS_C(0.0);
    p->hard_iron[2] = AHRS_C(0.0);
    p->soft_iron[0] = AHRS_C(1.0);
    p->soft_iron[1] = AHRS_C(0.0);
    p->soft_iron[2] = AHRS_C(0.0);
    p->soft_iron[3] = AHRS_C(0.0);
    p->soft_iron[4] = AHRS_C(1.0);
    p->soft_iron[5] = AHRS_C(0.0);
    p->soft_iron[6] = AHRS_C(0.0);
    p->soft_iron[7] = AHRS_C(0.0);
    p->soft_iron[8] = AHRS_C(1.0);
    p->gyro_noise_density = AHRS_C(0.00012);
    p->gyro_noise_std = AHRS_C(0.0);
    p->gyro_bias[0] = AHRS_C(0.0);
    p->gyro_bias[1] = AHRS_C(0.0);
    p->gyro_bias[2] = AHRS_C(0.0);
    p->gyro_turn_on_bias = AHRS_C(0.0087);
    p->gyro_bias_instability = AHRS_C(8.7e-05);
    p->gyro_bias_time = AHRS_C(100.0);
    p->gyro_bias_walk = AHRS_C(5e-06);
    p->gyro_scale[0] = AHRS_C(0.0);
    p->gyro_scale[1] = AHRS_C(0.0);
    p->gyro_scale[2] = AHRS_C(0.0);
    p->gyro_misalignment[0] = AHRS_C(0.0);
    p->gyro_misalignment[1] = AHRS_C(0.0);
    p->gyro_misalignment[2] = AHRS_C(0.0);
    p->gyro_bandwidth = AHRS_C(92.0);
    p->gyro_delay = AHRS_C(0.0);
    p->gyro_rate = AHRS_C(0.0);
    p->gyro_quantisation = AHRS_C(0.0010642);
    p->gyro_saturation = AHRS_C(34.9066);
    p->accel_noise_density = AHRS_C(0.0021);
    p->accel_noise_std = AHRS_C(0.0);
    p->accel_bias[0] = AHRS_C(0.0);
    p->accel_bias[1] = AHRS_C(0.0);
    p->accel_bias[2] = AHRS_C(0.0);
    p->accel_turn_on_bias = AHRS_C(0.05);
    p->accel_bias_instability = AHRS_C(0.00098);
    p->accel_bias_time = AHRS_C(100.0);
    p->accel_bias_walk = AHRS_C(0.0);
    p->accel_scale[0] = AHRS_C(0.0);
    p->accel_scale[1] = AHRS_C(0.0);
    p->accel_scale[2] = AHRS_C(0.0);
    p->accel_misalignment[0] = AHRS_C(0.0);
    p->accel_misalignment[1] = AHRS_C(0.0);
    p->accel_misalignment[2] = AHRS_C(0.0);
    p->accel_bandwidth = AHRS_C(94.0);
    p->accel_delay = AHRS_C(0.0);
    p->accel_rate = AHRS_C(0.0);
    p->accel_quantisation = AHRS_C(0.004788);
    p->accel_saturation = AHRS_C(156.9);
    p->mag_noise_density = AHRS_C(0.0);
    p->mag_noise_std = AHRS_C(6e-07);
    p->mag_bias[0] = AHRS_C(0.0);
    p->mag_bias[1] = AHRS_C(0.0);
    p->mag_bias[2] = AHRS_C(0.0);
    p->mag_turn_on_bias = AHRS_C(0.0);
    p->mag_bias_instability = AHRS_C(0.0);
    p->mag_bias_time = AHRS_C(100.0);
    p->mag_bias_walk = AHRS_C(0.0);
    p->mag_scale[0] = AHRS_C(0.0);
    p->mag_scale[1] = AHRS_C(0.0);
    p->mag_scale[2] = AHRS_C(0.0);
    p->mag_misalignment[0] = AHRS_C(0.0);
    p->mag_misalignment[1] = AHRS_C(0.0);
    p->mag_misalignment[2] = AHRS_C(0.0);
    p->mag_bandwidth = AHRS_C(0.0);
    p->mag_delay = AHRS_C(0.0);
    p->mag_rate = AHRS_C(100.0);
    p->mag_quantisation = AHRS_C(1.5e-07);
    p->mag_saturation = AHRS_C(0.0048);
    u->q[0] = AHRS_C(1.0);
    u->q[1] = AHRS_C(0.0);
    u->q[2] = AHRS_C(0.0);
    u->q[3] = AHRS_C(0.0);
    u->rate[0] = AHRS_C(0.0);
    u->rate[1] = AHRS_C(0.0);
    u->rate[2] = AHRS_C(0.0);
    u->specific_force[0] = AHRS_C(0.0);
    u->specific_force[1] = AHRS_C(0.0);
    u->specific_force[2] = AHRS_C(-9.80665);
    u->rotor_speed[0] = AHRS_C(0.0);
    u->rotor_speed[1] = AHRS_C(0.0);
    u->rotor_speed[2] = AHRS_C(0.0);
    u->rotor_speed[3] = AHRS_C(0.0);
}

static void defaults(void *data) {
    instance *i = data;
    memset(i, 0, sizeof *i);
    ahrs_imu_defaults(&i->params, &i->inputs);
}

static void init(void *data) {
    instance *i = data;
    ahrs_imu_init(&i->state, &i->params);
}

static void update(void *data, ahrs_real dt) {
    instance *i = data;
    ahrs_imu_update(&i->state, &i->params, &i->inputs, dt);
}

static void compute_outputs(void *data) {
    instance *i = data;
    ahrs_imu_outputs(&i->state, &i->params, &i->outputs);
}

extern const fmu_model ahrs_imu_model;
const fmu_model ahrs_imu_model = {
    "imu", "IMU", sizeof(instance), {offsetof(instance, params), sizeof(((instance *)0)->params)}, {offsetof(instance, inputs), sizeof(((instance *)0)->inputs)}, {offsetof(instance, outputs), sizeof(((instance *)0)->outputs)}, {offsetof(instance, state), sizeof(((instance *)0)->state)},
    offsetof(instance, params.sample_time), 0.004,
    variables, sizeof variables / sizeof variables[0],
    limits, sizeof limits / sizeof limits[0],
    defaults, init, update, compute_outputs};
