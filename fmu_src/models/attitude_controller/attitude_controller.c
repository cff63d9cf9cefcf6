/* Attitude controller: cascade, feed-forward, mixer (docs/vehicle.md section 2). */
#include "ahrs_attitude_controller.h"
#include "quat.h"

#define ROTORS 4
#define SQRT_HALF AHRS_C(0.70710678118654752440)

/* Larger inputs, and those that are no number, are not obeyed: the last command stands. */
#define RATE_LIMIT AHRS_C(1e3)         /* rad/s */
#define ACCELERATION_LIMIT AHRS_C(1e5) /* rad/s2 */
#define THRUST_LIMIT AHRS_C(1e6)       /* N */

/* Front right, rear left, front left, rear right: sign of a rotor's thrust in the moments about x, y and z. */
static const ahrs_real SIGN[ROTORS][3] = {{-1, 1, 1}, {1, -1, 1}, {1, 1, -1}, {-1, -1, -1}};

/* What the mixer could give. */
typedef struct {
    ahrs_real thrust[ROTORS];
    bool tilt_cut, turn_cut, collective_moved;
} mix;

static ahrs_vec3 by_axis(const ahrs_real k[3], ahrs_vec3 v) { return (ahrs_vec3){k[0] * v.x, k[1] * v.y, k[2] * v.z}; }

static ahrs_vec3 limited(ahrs_vec3 v, const ahrs_real limit[3]) {
    return (ahrs_vec3){ahrs_clamp(v.x, -limit[0], limit[0]), ahrs_clamp(v.y, -limit[1], limit[1]),
                       ahrs_clamp(v.z, -limit[2], limit[2])};
}

/* Largest factor in [0, 1] with which no rotor leaves the limits. */
static ahrs_real fitting_part(const ahrs_real base[ROTORS], const ahrs_real wanted[ROTORS], ahrs_real low,
                              ahrs_real high) {
    ahrs_real part = 1;
    for (int i = 0; i < ROTORS; i++) {
        const ahrs_real room = ahrs_max(0, wanted[i] > 0 ? high - base[i] : base[i] - low);
        if (ahrs_abs(wanted[i]) > room) {
            part = ahrs_min(part, room / ahrs_abs(wanted[i]));
        }
    }
    return part;
}

/* Thrusts for a total thrust and a moment: roll and pitch first, then collective, then yaw. */
static mix mixed(const ahrs_attitude_controller_params *p, ahrs_real thrust, ahrs_vec3 torque) {
    const ahrs_real low = p->thrust_coefficient * p->rotor_speed_min * p->rotor_speed_min;
    const ahrs_real high = p->thrust_coefficient * p->rotor_speed_max * p->rotor_speed_max;
    const ahrs_real per_tilt = 1 / (4 * p->arm_length * SQRT_HALF);
    const ahrs_real per_turn = p->thrust_coefficient / (4 * p->torque_coefficient);
    ahrs_real base[ROTORS], turn[ROTORS];
    ahrs_real least = AHRS_REAL_MAX, most = -AHRS_REAL_MAX;
    for (int i = 0; i < ROTORS; i++) {
        base[i] = (SIGN[i][0] * torque.x + SIGN[i][1] * torque.y) * per_tilt;
        turn[i] = SIGN[i][2] * torque.z * per_turn;
        least = ahrs_min(least, base[i]);
        most = ahrs_max(most, base[i]);
    }
    mix m = {.tilt_cut = most - least > high - low};
    const ahrs_real tilt_part = m.tilt_cut ? (high - low) / (most - least) : 1;
    const ahrs_real wanted = thrust / 4;
    const ahrs_real collective = ahrs_clamp(wanted, low - tilt_part * least, high - tilt_part * most);
    m.collective_moved = collective < wanted || collective > wanted;
    for (int i = 0; i < ROTORS; i++) {
        base[i] = collective + tilt_part * base[i];
    }
    const ahrs_real turn_part = fitting_part(base, turn, low, high);
    m.turn_cut = turn_part < 1;
    for (int i = 0; i < ROTORS; i++) {
        m.thrust[i] = ahrs_clamp(base[i] + turn_part * turn[i], low, high);
    }
    return m;
}

static void command(ahrs_attitude_controller_state *s, const ahrs_attitude_controller_params *p, const mix *m) {
    for (int i = 0; i < ROTORS; i++) {
        s->rotor_speed_command[i] = ahrs_sqrt(m->thrust[i] / p->thrust_coefficient);
    }
    s->saturated = m->tilt_cut || m->turn_cut || m->collective_moved;
}

void ahrs_attitude_controller_init(ahrs_attitude_controller_state *s, const ahrs_attitude_controller_params *p) {
    *s = (ahrs_attitude_controller_state){.saturated = 0};
    const mix m = mixed(p, p->initial_thrust, (ahrs_vec3){0, 0, 0});
    command(s, p, &m);
    s->saturated = 0;
}

static bool is_within(const ahrs_real v[3], ahrs_real limit) {
    return ahrs_abs(v[0]) <= limit && ahrs_abs(v[1]) <= limit && ahrs_abs(v[2]) <= limit;
}

static bool is_attitude(const ahrs_real q[4]) {
    const ahrs_real norm2 = ahrs_quat_dot(ahrs_quat_of(q), ahrs_quat_of(q));
    return norm2 > AHRS_C(0.5) && norm2 < 2;
}

static bool usable(const ahrs_attitude_controller_inputs *u) {
    return is_attitude(u->q) && is_attitude(u->q_ref) && is_within(u->rate, RATE_LIMIT) &&
           is_within(u->rate_ref, RATE_LIMIT) && is_within(u->angular_acceleration_ref, ACCELERATION_LIMIT) &&
           ahrs_abs(u->thrust) <= THRUST_LIMIT;
}

void ahrs_attitude_controller_update(ahrs_attitude_controller_state *s, const ahrs_attitude_controller_params *p,
                                     const ahrs_attitude_controller_inputs *u, ahrs_real dt) {
    if (!(dt > 0 && ahrs_is_finite(dt)) || !usable(u)) {
        return;
    }
    const ahrs_vec3 rate = ahrs_vec3_of(u->rate);
    const ahrs_quat away = ahrs_quat_mul(ahrs_quat_conj(ahrs_quat_of(u->q)), ahrs_quat_of(u->q_ref));
    const ahrs_quat difference = ahrs_quat_near(away, AHRS_QUAT_IDENTITY);
    const ahrs_vec3 half_error = {difference.x, difference.y, difference.z};
    const ahrs_vec3 feed_rate = ahrs_quat_rotate(difference, ahrs_vec3_of(u->rate_ref));
    const ahrs_vec3 wanted_rate =
        limited(ahrs_vec3_add_scaled(feed_rate, 2, by_axis(p->attitude_gain, half_error)), p->rate_limit);
    const ahrs_vec3 rate_error = ahrs_vec3_sub(wanted_rate, rate);

    const ahrs_vec3 integral = ahrs_vec3_of(s->integral);
    const ahrs_vec3 feed = ahrs_quat_rotate(difference, ahrs_vec3_of(u->angular_acceleration_ref));
    const ahrs_vec3 acceleration = ahrs_vec3_add(ahrs_vec3_add(by_axis(p->rate_gain, rate_error), integral), feed);
    const ahrs_vec3 gyroscopic = ahrs_vec3_cross(rate, by_axis(p->inertia, rate));
    const ahrs_vec3 torque = ahrs_vec3_add(by_axis(p->inertia, acceleration), gyroscopic);

    const mix m = mixed(p, u->thrust, torque);
    command(s, p, &m);
    ahrs_vec3_to(s->torque, torque);

    const ahrs_vec3 grown = ahrs_vec3_add_scaled(integral, dt, by_axis(p->rate_integral_gain, rate_error));
    const ahrs_vec3 next = {m.tilt_cut ? integral.x : grown.x, m.tilt_cut ? integral.y : grown.y,
                            m.turn_cut ? integral.z : grown.z};
    ahrs_vec3_to(s->integral, limited(next, p->integral_limit));
}

void ahrs_attitude_controller_outputs(const ahrs_attitude_controller_state *s, const ahrs_attitude_controller_params *p,
                                      ahrs_attitude_controller_outputs_t *y) {
    (void)p;
    ahrs_vec3_to(y->torque, ahrs_vec3_of(s->torque));
    for (int i = 0; i < ROTORS; i++) {
        y->rotor_speed_command[i] = s->rotor_speed_command[i];
    }
    y->saturated = s->saturated;
}
