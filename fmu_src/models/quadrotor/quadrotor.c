/* Quadrotor: rigid body, rotors, drag, wind, ground (docs/vehicle.md section 1). */
#include "ahrs_quadrotor.h"
#include "quat.h"

#define ROTORS 4

/* Front right, rear left, front left, rear right: place in units of the rotors' front and right distance, sense of
 * rotation about the body's z axis. */
static const struct {
    ahrs_real front, right, sense;
} ROTOR[ROTORS] = {{1, 1, -1}, {-1, -1, -1}, {1, -1, 1}, {-1, 1, 1}};

#define SQRT_HALF AHRS_C(0.70710678118654752440)
#define MOST_INNER_STEPS AHRS_C(1e6)
#define WIND_LIMIT AHRS_C(1e3) /* m/s, per axis */

/* The integrated state, and its rate of change in the same members. */
typedef struct {
    ahrs_vec3 position, velocity;
    ahrs_quat q;
    ahrs_vec3 rate;
    ahrs_real rotor_speed[ROTORS];
} motion;

static motion motion_of(const ahrs_quadrotor_state *s) {
    motion x = {ahrs_vec3_of(s->position), ahrs_vec3_of(s->velocity), ahrs_quat_of(s->q), ahrs_vec3_of(s->rate), {0}};
    for (int i = 0; i < ROTORS; i++) {
        x.rotor_speed[i] = s->rotor_speed[i];
    }
    return x;
}

static void keep(ahrs_quadrotor_state *s, const motion *x) {
    ahrs_vec3_to(s->position, x->position);
    ahrs_vec3_to(s->velocity, x->velocity);
    ahrs_quat_to(s->q, x->q);
    ahrs_vec3_to(s->rate, x->rate);
    for (int i = 0; i < ROTORS; i++) {
        s->rotor_speed[i] = x->rotor_speed[i];
    }
}

/* x + h d */
static motion advanced(const motion *x, ahrs_real h, const motion *d) {
    motion y = {ahrs_vec3_add_scaled(x->position, h, d->position), ahrs_vec3_add_scaled(x->velocity, h, d->velocity),
                {x->q.w + h * d->q.w, x->q.x + h * d->q.x, x->q.y + h * d->q.y, x->q.z + h * d->q.z},
                ahrs_vec3_add_scaled(x->rate, h, d->rate), {0}};
    for (int i = 0; i < ROTORS; i++) {
        y.rotor_speed[i] = x->rotor_speed[i] + h * d->rotor_speed[i];
    }
    return y;
}

static ahrs_vec3 scaled_by_axis(const ahrs_real k[3], ahrs_vec3 v) {
    return (ahrs_vec3){k[0] * v.x, k[1] * v.y, k[2] * v.z};
}

/* Force and moment on the body, body axes. */
typedef struct {
    ahrs_vec3 force, moment;
} wrench;

static void add_force(wrench *w, ahrs_vec3 force, ahrs_vec3 place) {
    w->force = ahrs_vec3_add(w->force, force);
    w->moment = ahrs_vec3_add(w->moment, ahrs_vec3_cross(place, force));
}

static void add_rotors(wrench *w, const ahrs_quadrotor_params *p, const motion *x, ahrs_vec3 air) {
    const ahrs_real distance = p->arm_length * SQRT_HALF;
    for (int i = 0; i < ROTORS; i++) {
        const ahrs_vec3 hub = {ROTOR[i].front * distance, ROTOR[i].right * distance, -p->rotor_height};
        const ahrs_vec3 hub_air = ahrs_vec3_add(air, ahrs_vec3_cross(x->rate, hub));
        const ahrs_real speed = x->rotor_speed[i];
        const ahrs_real drag = p->rotor_drag_coefficient * speed;
        add_force(w, (ahrs_vec3){-drag * hub_air.x, -drag * hub_air.y, -p->thrust_coefficient * speed * speed}, hub);
        w->moment.z -= ROTOR[i].sense * p->torque_coefficient * speed * speed;
    }
}

static void add_body_drag(wrench *w, const ahrs_quadrotor_params *p, ahrs_vec3 air) {
    const ahrs_real pressure = AHRS_C(0.5) * p->air_density * ahrs_vec3_norm(air);
    w->force = ahrs_vec3_add_scaled(w->force, -pressure, scaled_by_axis(p->drag_area, air));
}

/* Four feet below the rotors on a plane that is elastic, damped and rough. */
static void add_ground(wrench *w, const ahrs_quadrotor_params *p, const motion *x) {
    const ahrs_real distance = p->arm_length * SQRT_HALF;
    for (int i = 0; i < ROTORS; i++) {
        const ahrs_vec3 foot = {ROTOR[i].front * distance, ROTOR[i].right * distance, p->leg_length};
        const ahrs_real depth = x->position.z + ahrs_quat_rotate(x->q, foot).z;
        if (depth > 0) {
            const ahrs_vec3 slip = ahrs_quat_rotate(x->q, ahrs_vec3_cross(x->rate, foot));
            const ahrs_vec3 v = ahrs_vec3_add(x->velocity, slip);
            const ahrs_real normal = ahrs_max(0, p->ground_stiffness * depth + p->ground_damping * v.z);
            const ahrs_real rounded = ahrs_sqrt(v.x * v.x + v.y * v.y + p->slip_speed * p->slip_speed);
            const ahrs_real rough = p->ground_friction * normal / rounded;
            add_force(w, ahrs_quat_rotate_back(x->q, (ahrs_vec3){-rough * v.x, -rough * v.y, -normal}), foot);
        }
    }
}

/* Rate of change of the motion; the wrench is given too, for the specific force. */
static motion derivative(const ahrs_quadrotor_state *s, const ahrs_quadrotor_params *p, const motion *x, wrench *w) {
    motion d = {.position = x->velocity};
    ahrs_real momentum = 0; /* of the rotors about the body's z axis, and its rate of change */
    ahrs_real reaction = 0;
    for (int i = 0; i < ROTORS; i++) {
        d.rotor_speed[i] = (s->command[i] - x->rotor_speed[i]) / p->rotor_time_constant;
        momentum += ROTOR[i].sense * p->rotor_inertia * x->rotor_speed[i];
        reaction += ROTOR[i].sense * p->rotor_inertia * d.rotor_speed[i];
    }
    const ahrs_vec3 air = ahrs_quat_rotate_back(x->q, ahrs_vec3_sub(x->velocity, ahrs_vec3_of(s->wind)));
    *w = (wrench){.force = {0, 0, 0}};
    add_rotors(w, p, x, air);
    add_body_drag(w, p, air);
    if (p->ground) {
        add_ground(w, p, x);
    }
    d.velocity = ahrs_quat_rotate(x->q, ahrs_vec3_scale(w->force, 1 / p->mass));
    d.velocity.z += p->gravity;

    const ahrs_quat turned = ahrs_quat_mul(x->q, (ahrs_quat){0, x->rate.x, x->rate.y, x->rate.z});
    d.q = ahrs_quat_scale(turned, AHRS_C(0.5));

    ahrs_vec3 carried = scaled_by_axis(p->inertia, x->rate);
    carried.z += momentum;
    ahrs_vec3 moment = ahrs_vec3_sub(w->moment, ahrs_vec3_cross(x->rate, carried));
    moment.z -= reaction;
    d.rate = (ahrs_vec3){moment.x / p->inertia[0], moment.y / p->inertia[1], moment.z / p->inertia[2]};
    return d;
}

/* One step of the classical Runge-Kutta method. */
static motion integrated(const ahrs_quadrotor_state *s, const ahrs_quadrotor_params *p, const motion *x, ahrs_real h) {
    wrench unused;
    const motion k1 = derivative(s, p, x, &unused);
    const motion x2 = advanced(x, h / 2, &k1);
    const motion k2 = derivative(s, p, &x2, &unused);
    const motion x3 = advanced(x, h / 2, &k2);
    const motion k3 = derivative(s, p, &x3, &unused);
    const motion x4 = advanced(x, h, &k3);
    const motion k4 = derivative(s, p, &x4, &unused);
    motion y = advanced(x, h / 6, &k1);
    y = advanced(&y, h / 3, &k2);
    y = advanced(&y, h / 3, &k3);
    y = advanced(&y, h / 6, &k4);
    y.q = ahrs_quat_unit(y.q);
    return y;
}

/* What an accelerometer at the IMU's place feels. */
static void feel(ahrs_quadrotor_state *s, const ahrs_quadrotor_params *p) {
    const motion x = motion_of(s);
    wrench w;
    const motion d = derivative(s, p, &x, &w);
    const ahrs_vec3 place = ahrs_vec3_of(p->imu_position);
    const ahrs_vec3 centripetal = ahrs_vec3_cross(x.rate, ahrs_vec3_cross(x.rate, place));
    const ahrs_vec3 lever = ahrs_vec3_add(ahrs_vec3_cross(d.rate, place), centripetal);
    ahrs_vec3_to(s->specific_force, ahrs_vec3_add_scaled(lever, 1 / p->mass, w.force));
}

/* A command that is no number, or a wind that cannot be, leaves the last one standing. */
static void take_inputs(ahrs_quadrotor_state *s, const ahrs_quadrotor_params *p, const ahrs_quadrotor_inputs *u) {
    for (int i = 0; i < ROTORS; i++) {
        if (ahrs_is_finite(u->rotor_speed_command[i])) {
            s->command[i] = ahrs_clamp(u->rotor_speed_command[i], p->rotor_speed_min, p->rotor_speed_max);
        }
    }
    const ahrs_vec3 wind = ahrs_vec3_of(u->wind);
    if (ahrs_abs(wind.x) <= WIND_LIMIT && ahrs_abs(wind.y) <= WIND_LIMIT && ahrs_abs(wind.z) <= WIND_LIMIT) {
        ahrs_vec3_to(s->wind, wind);
    }
}

static int32_t inner_steps(ahrs_real dt, ahrs_real longest) {
    const ahrs_real ratio = ahrs_min(dt / longest, MOST_INNER_STEPS);
    const int32_t whole = (int32_t)ratio;
    /* A ratio that is whole but for its rounding stays whole. */
    return ratio - (ahrs_real)whole > AHRS_C(1e-5) || whole == 0 ? whole + 1 : whole;
}

void ahrs_quadrotor_init(ahrs_quadrotor_state *s, const ahrs_quadrotor_params *p) {
    *s = (ahrs_quadrotor_state){.wind = {0}};
    ahrs_vec3_to(s->position, ahrs_vec3_of(p->initial_position));
    ahrs_vec3_to(s->velocity, ahrs_vec3_of(p->initial_velocity));
    ahrs_quat_to(s->q, ahrs_quat_unit(ahrs_quat_of(p->initial_q)));
    ahrs_vec3_to(s->rate, ahrs_vec3_of(p->initial_rate));
    for (int i = 0; i < ROTORS; i++) {
        s->rotor_speed[i] = p->initial_rotor_speed;
        s->command[i] = p->initial_rotor_speed;
    }
    feel(s, p);
}

void ahrs_quadrotor_update(ahrs_quadrotor_state *s, const ahrs_quadrotor_params *p, const ahrs_quadrotor_inputs *u,
                           ahrs_real dt) {
    if (!(dt > 0 && ahrs_is_finite(dt))) {
        return;
    }
    take_inputs(s, p, u);
    const int32_t steps = inner_steps(dt, p->inner_step);
    const ahrs_real h = dt / (ahrs_real)steps;
    motion x = motion_of(s);
    for (int32_t i = 0; i < steps; i++) {
        x = integrated(s, p, &x, h);
    }
    keep(s, &x);
    feel(s, p);
}

void ahrs_quadrotor_outputs(const ahrs_quadrotor_state *s, const ahrs_quadrotor_params *p,
                            ahrs_quadrotor_outputs_t *y) {
    (void)p;
    const ahrs_quat q = ahrs_quat_of(s->q);
    const ahrs_vec3 euler = ahrs_quat_to_euler(q);
    ahrs_quat_to(y->q, q);
    y->roll = euler.x;
    y->pitch = euler.y;
    y->yaw = euler.z;
    ahrs_vec3_to(y->rate, ahrs_vec3_of(s->rate));
    ahrs_vec3_to(y->specific_force, ahrs_vec3_of(s->specific_force));
    ahrs_vec3_to(y->position, ahrs_vec3_of(s->position));
    ahrs_vec3_to(y->velocity, ahrs_vec3_of(s->velocity));
    for (int i = 0; i < ROTORS; i++) {
        y->rotor_speed[i] = s->rotor_speed[i];
    }
}
