/* Inertial measurement unit with magnetometer (docs/vehicle.md section 3). Sample for sample the model of
 * ahrs_fmu.sensors, with vibration besides. */
#include "ahrs_imu.h"
#include "quat.h"
#include "random.h"

#define ROTORS 4
#define HISTORY 32 /* readings in the ring of a triad */
#define TWO_PI (2 * AHRS_PI)

/* Larger truths are not physical; like those that are no number they leave the last ones standing. */
#define FORCE_LIMIT AHRS_C(1e6) /* m/s2 */
#define SPEED_LIMIT AHRS_C(1e5) /* rad/s, of a rotor and of the body */

/* Random streams: eight for each triad, then one for each rotor. */
enum { STREAM_GYRO = 0, STREAM_ACCEL = 8, STREAM_MAG = 16, STREAM_ROTOR = 24, STREAM_SLOW = 4 };

static const ahrs_real SENSE[ROTORS] = {-1, -1, 1, 1}; /* of rotation about the body's z axis */

/* Parameters of one triad of sensors, and where its state is. */
typedef struct {
    ahrs_real noise_density, noise_std, turn_on_bias, bias_instability, bias_time, bias_walk;
    ahrs_real bandwidth, delay, rate, quantisation, saturation;
    const ahrs_real *bias, *scale, *misalignment;
    ahrs_real *walk, *wander, *low_pass, *history, *reading;
    int32_t *fresh;
    uint64_t stream;
} triad;

#define TRIAD(s, p, name, first_stream)                                                                            \
    {                                                                                                              \
        (p)->name##_noise_density, (p)->name##_noise_std, (p)->name##_turn_on_bias, (p)->name##_bias_instability,  \
            (p)->name##_bias_time, (p)->name##_bias_walk, (p)->name##_bandwidth, (p)->name##_delay,                \
            (p)->name##_rate, (p)->name##_quantisation, (p)->name##_saturation, (p)->name##_bias,                  \
            (p)->name##_scale, (p)->name##_misalignment, (s)->name##_walk, (s)->name##_wander,                     \
            (s)->name##_low_pass, (s)->name##_history, (s)->name##_reading, &(s)->name##_fresh, first_stream       \
    }

/* When and with which seed a sample is drawn. */
typedef struct {
    uint64_t seed;
    int32_t count;
    ahrs_real dt;
} instant;

static void draw(const instant *now, uint64_t stream, int32_t index, ahrs_real out[2]) {
    double pair[2];
    ahrs_random_normal_pair(now->seed, stream, (uint64_t)index, pair);
    out[0] = (ahrs_real)pair[0];
    out[1] = (ahrs_real)pair[1];
}

/* Bias of one axis now: constant, turn-on, random walk from zero, Gauss-Markov from its stationary distribution. */
static ahrs_real bias_of(const triad *t, const instant *now, int32_t axis, ahrs_real walk_draw) {
    const uint64_t stream = t->stream + STREAM_SLOW + (uint64_t)axis;
    ahrs_real bias = t->bias[axis];
    if (now->count > 0) {
        t->walk[axis] += t->bias_walk * ahrs_sqrt(now->dt) * walk_draw;
    }
    bias += t->walk[axis];
    if (t->bias_instability > 0 || t->turn_on_bias > 0) {
        ahrs_real first[2], here[2];
        draw(now, stream, 0, first);
        draw(now, stream, now->count, here);
        if (now->count > 0) {
            const ahrs_real memory = ahrs_exp_decay(now->dt / t->bias_time);
            const ahrs_real drive = t->bias_instability * ahrs_sqrt(1 - memory * memory);
            t->wander[axis] = memory * t->wander[axis] + drive * here[0];
        } else {
            t->wander[axis] = t->bias_instability * here[0];
        }
        bias += t->wander[axis] + t->turn_on_bias * first[1];
    }
    return bias;
}

/* The truth in the sensor's own axes: a small rotation against the body, then the scale. */
static ahrs_vec3 in_sensor_axes(const triad *t, ahrs_vec3 truth) {
    const ahrs_vec3 turned = ahrs_vec3_add(truth, ahrs_vec3_cross(truth, ahrs_vec3_of(t->misalignment)));
    return (ahrs_vec3){turned.x * (1 + t->scale[0]), turned.y * (1 + t->scale[1]), turned.z * (1 + t->scale[2])};
}

/* Nearest whole number, ties to even: adding this much pushes the fraction out of the significand. */
static ahrs_real rounded(ahrs_real x) {
    const ahrs_real big = AHRS_C(1.5) / AHRS_REAL_EPSILON;
    return ahrs_abs(x) < big / 2 ? (x + big) - big : x;
}

/* Whole periods of `rate` up to sample k; the small part keeps a rate that divides the sample rate whole. */
static ahrs_real periods(ahrs_real rate, ahrs_real dt, int32_t k) {
    const ahrs_real x = (ahrs_real)k * (dt * rate) + AHRS_C(1e-9);
    const ahrs_real near = rounded(x);
    return near > x ? near - 1 : near;
}

static bool is_fresh(const triad *t, const instant *now) {
    return now->count == 0 || !(t->rate > 0) || t->rate * now->dt >= 1 ||
           periods(t->rate, now->dt, now->count) > periods(t->rate, now->dt, now->count - 1);
}

/* Takes one sample of a triad; gives the bias it had. */
static ahrs_vec3 sampled(triad t, const instant *now, ahrs_vec3 truth) {
    ahrs_real values[3], bias[3];
    ahrs_vec3_to(values, in_sensor_axes(&t, truth));
    const ahrs_real white = ahrs_sqrt(t.noise_density * t.noise_density / now->dt + t.noise_std * t.noise_std);
    const ahrs_real pole = t.bandwidth > 0 ? ahrs_exp_decay(TWO_PI * t.bandwidth * now->dt) : 0;
    const int32_t lag = (int32_t)rounded(t.delay / now->dt);
    *t.fresh = is_fresh(&t, now);
    for (int32_t axis = 0; axis < 3; axis++) {
        ahrs_real fast[2];
        draw(now, t.stream + (uint64_t)axis, now->count, fast);
        bias[axis] = bias_of(&t, now, axis, fast[1]);
        const ahrs_real value = values[axis] + bias[axis] + white * fast[0];
        t.low_pass[axis] = now->count > 0 ? (1 - pole) * value + pole * t.low_pass[axis] : value;
        t.history[axis * HISTORY + now->count % HISTORY] = t.low_pass[axis];
        if (*t.fresh) {
            const int32_t source = now->count > lag ? now->count - lag : 0;
            const ahrs_real late = t.history[axis * HISTORY + source % HISTORY];
            const ahrs_real step = t.quantisation;
            const ahrs_real stepped = step > 0 ? rounded(late / step) * step : late;
            t.reading[axis] = t.saturation > 0 ? ahrs_clamp(stepped, -t.saturation, t.saturation) : stepped;
        }
    }
    return ahrs_vec3_of(bias);
}

/* What the rotors shake: imbalance once per turn in their plane, two blades twice per turn along their axis. */
typedef struct {
    ahrs_vec3 accel, gyro;
} vibration;

static vibration shaken(ahrs_imu_state *s, const ahrs_imu_params *p, const ahrs_imu_inputs *u, const instant *now) {
    vibration v = {{0, 0, 0}, {0, 0, 0}};
    for (int i = 0; i < ROTORS; i++) {
        const bool usable = ahrs_abs(u->rotor_speed[i]) <= SPEED_LIMIT;
        const ahrs_real speed = usable ? u->rotor_speed[i] : s->last_rotor_speed[i];
        if (now->count == 0) {
            double start[2];
            ahrs_random_uniform_pair(now->seed, STREAM_ROTOR + (uint64_t)i, 0, start);
            s->phase[i] = TWO_PI * (ahrs_real)start[0];
        } else {
            const ahrs_real turned = s->phase[i] + now->dt * (speed + s->last_rotor_speed[i]) / 2;
            s->phase[i] = turned - TWO_PI * rounded(turned / TWO_PI);
        }
        s->last_rotor_speed[i] = speed;
        const ahrs_real ratio = speed / p->vibration_speed;
        ahrs_real sine, cosine;
        ahrs_sincos(s->phase[i], &sine, &cosine);
        const ahrs_vec3 in_plane = {ratio * ratio * cosine, ratio * ratio * SENSE[i] * sine, 0};
        v.accel = ahrs_vec3_add_scaled(v.accel, p->vibration_accel, in_plane);
        v.accel.z += p->vibration_blade * ratio * ratio * (cosine * cosine - sine * sine);
        v.gyro = ahrs_vec3_add_scaled(v.gyro, p->vibration_gyro, in_plane);
    }
    return v;
}

/* Earth's field in body axes. */
static ahrs_vec3 earth_field(const ahrs_imu_params *p, ahrs_quat q) {
    ahrs_real sine, cosine, east, north;
    ahrs_sincos(p->field_dip, &sine, &cosine);
    ahrs_sincos(p->declination, &east, &north);
    const ahrs_vec3 field = {cosine * north, cosine * east, sine};
    return ahrs_quat_rotate_back(q, ahrs_vec3_scale(field, p->field_magnitude));
}

static ahrs_vec3 with_iron(const ahrs_imu_params *p, ahrs_vec3 field) {
    const ahrs_mat3 soft = {
        {ahrs_vec3_of(&p->soft_iron[0]), ahrs_vec3_of(&p->soft_iron[3]), ahrs_vec3_of(&p->soft_iron[6])}};
    return ahrs_vec3_add(ahrs_mat3_apply(soft, field), ahrs_vec3_of(p->hard_iron));
}

static bool is_within(const ahrs_real v[3], ahrs_real limit) {
    return ahrs_abs(v[0]) <= limit && ahrs_abs(v[1]) <= limit && ahrs_abs(v[2]) <= limit;
}

/* Attitude, scaled to unit length, and specific force of this sample go into the state. Gives the rate as a gyroscope
 * that integrates has it: the mean since the last sample. */
static ahrs_vec3 take_motion(ahrs_imu_state *s, const ahrs_imu_inputs *u, const instant *now) {
    const ahrs_quat last = ahrs_quat_of(s->last_q), q = ahrs_quat_of(u->q);
    const ahrs_real norm2 = ahrs_quat_dot(q, q);
    if (norm2 > 0 && ahrs_is_finite(norm2)) {
        ahrs_quat_to(s->last_q, ahrs_quat_unit(q));
    }
    if (is_within(u->specific_force, FORCE_LIMIT)) {
        ahrs_vec3_to(s->last_force, ahrs_vec3_of(u->specific_force));
    }
    if (now->count == 0) {
        return is_within(u->rate, SPEED_LIMIT) ? ahrs_vec3_of(u->rate) : (ahrs_vec3){0, 0, 0};
    }
    const ahrs_quat turn = ahrs_quat_mul(ahrs_quat_conj(last), ahrs_quat_of(s->last_q));
    return ahrs_vec3_scale(ahrs_quat_log(turn), 1 / now->dt);
}

static void sample_perfectly(ahrs_imu_state *s, ahrs_vec3 rate, ahrs_vec3 force, ahrs_vec3 field) {
    ahrs_vec3_to(s->gyro_reading, rate);
    ahrs_vec3_to(s->accel_reading, force);
    ahrs_vec3_to(s->mag_reading, field);
    s->gyro_fresh = s->accel_fresh = s->mag_fresh = 1;
}

void ahrs_imu_init(ahrs_imu_state *s, const ahrs_imu_params *p) {
    (void)p;
    *s = (ahrs_imu_state){.last_q = {1, 0, 0, 0}};
}

void ahrs_imu_update(ahrs_imu_state *s, const ahrs_imu_params *p, const ahrs_imu_inputs *u, ahrs_real dt) {
    if (!(dt > 0 && ahrs_is_finite(dt))) {
        return;
    }
    const instant now = {(uint64_t)p->seed, s->count, dt};
    const ahrs_vec3 rate = take_motion(s, u, &now);
    const ahrs_vec3 force = ahrs_vec3_of(s->last_force);
    const ahrs_vec3 field = earth_field(p, ahrs_quat_of(s->last_q));
    if (p->errors) {
        const vibration v = shaken(s, p, u, &now);
        const triad gyro = TRIAD(s, p, gyro, STREAM_GYRO);
        const triad accel = TRIAD(s, p, accel, STREAM_ACCEL);
        const triad mag = TRIAD(s, p, mag, STREAM_MAG);
        ahrs_vec3_to(s->true_gyro_bias, sampled(gyro, &now, ahrs_vec3_add(rate, v.gyro)));
        (void)sampled(accel, &now, ahrs_vec3_add(force, v.accel));
        (void)sampled(mag, &now, with_iron(p, field));
    } else {
        sample_perfectly(s, rate, force, field);
    }
    s->count = s->count == INT32_MAX ? s->count : s->count + 1;
}

void ahrs_imu_outputs(const ahrs_imu_state *s, const ahrs_imu_params *p, ahrs_imu_outputs_t *y) {
    (void)p;
    ahrs_vec3_to(y->gyro, ahrs_vec3_of(s->gyro_reading));
    ahrs_vec3_to(y->accel, ahrs_vec3_of(s->accel_reading));
    ahrs_vec3_to(y->mag, ahrs_vec3_of(s->mag_reading));
    ahrs_vec3_to(y->true_gyro_bias, ahrs_vec3_of(s->true_gyro_bias));
    y->gyro_valid = s->gyro_fresh;
    y->accel_valid = s->accel_fresh;
    y->mag_valid = s->mag_fresh;
}
