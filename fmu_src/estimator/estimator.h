/* What all estimators share: which samples are usable, the first attitude, motion compensation, gating, frames and
 * the common outputs. An estimator's update is
 *
 *     switch (ahrs_estimator_begin(&s->common, &p->common, u, dt, &z)) { ... }   what to do with this sample
 *     predict with z.rate, correct with z.accel and z.mag where they are usable
 *     ahrs_estimator_end(&s->common, &p->common, &z, q);                         the new attitude
 *
 * Inside, the axes are forward-right-down and north-east-down with magnetic north (docs/algorithms.md section 0). */
#ifndef ESTIMATOR_H
#define ESTIMATOR_H

#include "ahrs_estimator.h"
#include "conditions.h"
#include "preprocessing.h"
#include "quat.h"

/* Larger samples are not physical and count as no measurement; their squares still fit into a float. */
#define AHRS_GYRO_LIMIT AHRS_C(1e3)
#define AHRS_ACCEL_LIMIT AHRS_C(1e4)
#define AHRS_MAG_LIMIT AHRS_C(1.0)

#define AHRS_ACCEL_LEAST AHRS_C(0.1)  /* of gravity: below is free fall */
#define AHRS_MAG_LEAST AHRS_C(1e-3)   /* of the reference field */
#define AHRS_MAG_SINE AHRS_C(0.05)    /* of the angle between field and gravity: below there is no heading */
#define AHRS_LONGEST_STEP AHRS_C(0.5) /* s: after a longer gap the attitude is carried on, not corrected */
#define AHRS_REST_RATE AHRS_C(0.1)    /* rad/s: faster is motion */
#define AHRS_REST_FORCE AHRS_C(0.5)   /* m/s2: specific force further from gravity is motion */

typedef enum {
    AHRS_WAIT,  /* nothing to do: no attitude yet, or no time has passed */
    AHRS_START, /* an attitude is in the common state, the first or one with a new zero of the gyroscope: begin from it */
    AHRS_TURN,  /* as AHRS_RUN, after taking over the attitude in the common state: its heading was turned */
    AHRS_RUN    /* predict and correct */
} ahrs_action;

/* One sample in inner axes. Vectors that are not usable are zero. */
typedef struct {
    ahrs_vec3 rate;  /* rad/s */
    ahrs_vec3 force; /* m/s2, the accelerometer as read */
    ahrs_vec3 accel; /* m/s2, without the motion acceleration where that is compensated */
    ahrs_vec3 mag;   /* T */
    ahrs_vec3 motion; /* m/s2, expected motion acceleration; only where it is compensated or not measured */
    bool force_usable, accel_usable, mag_usable;
    ahrs_real dt;      /* s, of the prediction */
    ahrs_real gain_dt; /* s, of the correction: 0 after a gap */
} ahrs_sample;

/* Forward-left-up to forward-right-down, and back. */
AHRS_INLINE ahrs_vec3 ahrs_swap_body(int32_t frame, ahrs_vec3 v) {
    return AHRS_UNLIKELY(frame == AHRS_FRAME_ENU) ? (ahrs_vec3){v.x, -v.y, -v.z} : v;
}

/* North-east-down with forward-right-down to east-north-up with forward-left-up, and back: two half turns. */
static inline ahrs_quat ahrs_swap_frames(ahrs_quat q) {
    const ahrs_real r = AHRS_C(0.70710678118654752440);
    return (ahrs_quat){r * (q.w + q.z), r * (q.x + q.y), r * (q.x - q.y), r * (q.w - q.z)};
}

/* Turns the navigation frame of an inner attitude by the declination, in the inner axes. */
static inline ahrs_quat ahrs_decline(ahrs_quat q, ahrs_real declination) {
    ahrs_real sine, cosine;
    ahrs_sincos(AHRS_C(0.5) * declination, &sine, &cosine);
    return ahrs_quat_mul((ahrs_quat){cosine, 0, 0, sine}, q);
}

static inline ahrs_quat ahrs_to_output_frame(const ahrs_estimator_params *p, ahrs_quat q) {
    const ahrs_quat declined = p->declination != 0 ? ahrs_decline(q, p->declination) : q;
    return p->frame == AHRS_FRAME_ENU ? ahrs_swap_frames(declined) : declined;
}

static inline ahrs_quat ahrs_from_output_frame(const ahrs_estimator_params *p, ahrs_quat q) {
    const ahrs_quat inner = p->frame == AHRS_FRAME_ENU ? ahrs_swap_frames(q) : q;
    return p->declination != 0 ? ahrs_decline(inner, -p->declination) : inner;
}

/* Whether the angle between field and vertical leaves a heading; never for a zero field. */
static inline bool ahrs_has_horizontal_part(ahrs_vec3 mag, ahrs_vec3 vertical) {
    const ahrs_real along = ahrs_vec3_dot(vertical, mag);
    return along * along < (1 - AHRS_MAG_SINE * AHRS_MAG_SINE) * (ahrs_vec3_norm2(vertical) * ahrs_vec3_norm2(mag));
}

/* Attitude from specific force and field, accelerometer first, exact for all attitudes (docs/algorithms.md
 * section 2). With a zero field the heading is zero. */
static inline ahrs_quat ahrs_attitude_of(ahrs_vec3 force, ahrs_vec3 mag) {
    const ahrs_vec3 down = ahrs_vec3_unit(ahrs_vec3_negate(force));
    if (ahrs_vec3_norm2(mag) > 0) {
        const ahrs_vec3 east = ahrs_vec3_unit(ahrs_vec3_cross(down, mag));
        return ahrs_quat_from_mat3((ahrs_mat3){{ahrs_vec3_cross(east, down), east, down}});
    }
    const ahrs_real roll = ahrs_atan2(down.y, down.z);
    const ahrs_real pitch = ahrs_atan2(-down.x, ahrs_sqrt(down.y * down.y + down.z * down.z));
    return ahrs_quat_from_euler((ahrs_vec3){roll, pitch, 0});
}

/* Reads one sample: which parts are usable by themselves, and all of it in inner axes. Comparisons of squared norms
 * fail for NaN and infinity. */
AHRS_INLINE ahrs_sample ahrs_read_sample(ahrs_estimator_state *s, const ahrs_estimator_params *p,
                                         const ahrs_estimator_inputs *u, ahrs_real dt) {
    ahrs_sample z = {.dt = dt, .gain_dt = dt > AHRS_LONGEST_STEP ? 0 : dt};
    const ahrs_vec3 gyro = ahrs_swap_body(p->frame, ahrs_vec3_of(u->gyro));
    const ahrs_vec3 accel = ahrs_swap_body(p->frame, ahrs_vec3_of(u->accel));
    const ahrs_vec3 mag = ahrs_swap_body(p->frame, ahrs_calibrated_mag(p, u->mag));
    if (ahrs_vec3_norm2(gyro) <= AHRS_GYRO_LIMIT * AHRS_GYRO_LIMIT) {
        z.rate = gyro;
        ahrs_vec3_to(s->gyro, z.rate);
    } else {
        z.rate = ahrs_vec3_of(s->gyro);
        s->conditions |= AHRS_GYRO_HELD;
    }
    const ahrs_real least = AHRS_ACCEL_LEAST * p->gravity;
    const ahrs_real force2 = ahrs_vec3_norm2(accel), mag2 = ahrs_vec3_norm2(mag);
    if (u->accel_valid && force2 > least * least && force2 <= AHRS_ACCEL_LIMIT * AHRS_ACCEL_LIMIT) {
        z.force = accel;
        z.force_usable = true;
    }
    if (AHRS_UNLIKELY(p->accel_cutoff > 0)) {
        z.force = ahrs_smooth_force(s, p, accel, z.force_usable, dt);
        z.force_usable = ahrs_vec3_norm2(z.force) > least * least;
    }
    const ahrs_real field2 = s->field[0] * s->field[0] + s->field[1] * s->field[1]; /* 0 until it is known */
    if (u->mag_valid && mag2 > AHRS_MAG_LEAST * AHRS_MAG_LEAST * field2 && mag2 <= AHRS_MAG_LIMIT * AHRS_MAG_LIMIT) {
        z.mag = mag;
        z.mag_usable = z.force_usable ? ahrs_has_horizontal_part(mag, z.force)
                                      : ahrs_has_horizontal_part(mag, ahrs_quat_down(ahrs_quat_of(s->q)));
    }
    return z;
}

/* Keeps the reference field: as given, or as this sample shows it at the present attitude. */
static inline void ahrs_learn_field(ahrs_estimator_state *s, const ahrs_estimator_params *p, ahrs_vec3 mag) {
    if (p->field_reference == AHRS_FIELD_REFERENCE_GIVEN) {
        ahrs_real sine, cosine;
        ahrs_sincos(p->field_dip, &sine, &cosine);
        s->field[0] = p->field_magnitude * cosine;
        s->field[1] = p->field_magnitude * sine;
        s->conditions |= AHRS_HAS_FIELD;
    } else if (ahrs_vec3_norm2(mag) > 0) {
        const ahrs_vec3 m = ahrs_quat_rotate(ahrs_quat_of(s->q), mag);
        s->field[0] = ahrs_sqrt(m.x * m.x + m.y * m.y);
        s->field[1] = m.z;
        s->conditions |= AHRS_HAS_FIELD;
    }
}

static inline bool ahrs_moves(const ahrs_estimator_params *p, const ahrs_sample *z) {
    return ahrs_vec3_norm2(z->rate) > AHRS_REST_RATE * AHRS_REST_RATE ||
           (z->force_usable && ahrs_abs(ahrs_vec3_norm(z->force) - p->gravity) > AHRS_REST_FORCE);
}

/* Averages usable samples into the first attitude; true when it is complete. */
static inline bool ahrs_initialise_from_sensors(ahrs_estimator_state *s, const ahrs_estimator_params *p,
                                                const ahrs_sample *z) {
    if (ahrs_condition(s, AHRS_ACCEL_SUMMED)) {
        s->elapsed += z->dt;
    }
    if (z->force_usable) {
        ahrs_vec3_to(s->accel_sum, ahrs_vec3_add(ahrs_vec3_of(s->accel_sum), z->force));
        s->conditions |= AHRS_ACCEL_SUMMED;
    }
    if (z->mag_usable) {
        ahrs_vec3_to(s->mag_sum, ahrs_vec3_add(ahrs_vec3_of(s->mag_sum), z->mag));
        s->conditions |= AHRS_MAG_SUMMED;
    }
    if (ahrs_moves(p, z)) {
        s->conditions |= AHRS_MOVED;
    }
    const ahrs_vec3 force = ahrs_vec3_of(s->accel_sum), mag = ahrs_vec3_of(s->mag_sum);
    if (!ahrs_condition(s, AHRS_ACCEL_SUMMED) || !(ahrs_vec3_norm2(force) > 0)) {
        return false;
    }
    const bool heading = ahrs_condition(s, AHRS_MAG_SUMMED) && ahrs_has_horizontal_part(mag, force);
    ahrs_quat_to(s->q, ahrs_attitude_of(force, heading ? mag : (ahrs_vec3){0, 0, 0}));
    ahrs_set_condition(s, AHRS_HAS_HEADING, heading);
    return s->elapsed >= p->init_time;
}

/* The motion acceleration: what the accelerometer reads beyond gravity. */
AHRS_INLINE ahrs_vec3 ahrs_motion(const ahrs_estimator_state *s, const ahrs_estimator_params *p) {
    return ahrs_vec3_add_scaled(ahrs_vec3_of(s->force), p->gravity, ahrs_quat_down(ahrs_quat_of(s->q)));
}

/* Keeps the force that makes this motion acceleration at the present attitude. */
AHRS_INLINE void ahrs_set_motion(ahrs_estimator_state *s, const ahrs_estimator_params *p, ahrs_vec3 motion) {
    ahrs_vec3_to(s->force, ahrs_vec3_add_scaled(motion, -p->gravity, ahrs_quat_down(ahrs_quat_of(s->q))));
}

static inline void ahrs_start(ahrs_estimator_state *s, const ahrs_estimator_params *p, const ahrs_sample *z) {
    s->conditions |= AHRS_HAS_ATTITUDE;
    ahrs_learn_field(s, p, z->mag_usable ? z->mag : (ahrs_vec3){0, 0, 0});
    if (z->force_usable) {
        ahrs_vec3_to(s->force, z->force);
    } else {
        ahrs_set_motion(s, p, (ahrs_vec3){0, 0, 0});
    }
    ahrs_set_condition(s, AHRS_ACCEL_USED, z->force_usable);
    ahrs_set_condition(s, AHRS_MAG_USED, z->mag_usable);
}

/* Whether the accelerometer is so far from gravity that it is ignored, for a limited time. */
AHRS_INLINE bool ahrs_is_gated(ahrs_estimator_state *s, const ahrs_estimator_params *p, const ahrs_sample *z) {
    if (ahrs_abs(ahrs_vec3_norm(z->force) - p->gravity) <= p->accel_gate) {
        s->gated = 0;
        return false;
    }
    s->gated = ahrs_min(s->gated + z->dt, p->accel_gate_time + 1);
    return s->gated <= p->accel_gate_time;
}

/* Turns the attitude about the vertical so that the field points north. */
static inline void ahrs_align_heading(ahrs_estimator_state *s, ahrs_vec3 mag) {
    const ahrs_quat q = ahrs_quat_of(s->q);
    const ahrs_vec3 m = ahrs_quat_rotate(q, mag);
    ahrs_real sine, cosine;
    ahrs_sincos(AHRS_C(-0.5) * ahrs_atan2(m.y, m.x), &sine, &cosine);
    ahrs_quat_to(s->q, ahrs_quat_near(ahrs_quat_mul((ahrs_quat){cosine, 0, 0, sine}, q), q));
    s->conditions |= AHRS_HAS_HEADING;
}

/* Takes heading and reference field, what of them is missing, from a sample; true if the attitude was turned. */
static inline bool ahrs_take_up_field(ahrs_estimator_state *s, const ahrs_estimator_params *p, ahrs_vec3 mag) {
    const bool turn = !ahrs_condition(s, AHRS_HAS_HEADING);
    if (turn) {
        ahrs_align_heading(s, mag);
    }
    if (!ahrs_condition(s, AHRS_HAS_FIELD)) {
        ahrs_learn_field(s, p, mag);
    }
    return turn;
}

/* The part of a sample that needs an attitude: reference field, gating, motion compensation. */
AHRS_INLINE ahrs_action ahrs_prepare_sample(ahrs_estimator_state *s, const ahrs_estimator_params *p, ahrs_sample *z) {
    bool turn = false;
    const int32_t known = AHRS_HAS_HEADING | AHRS_HAS_FIELD;
    if (AHRS_UNLIKELY(z->mag_usable && (s->conditions & known) != known)) {
        const ahrs_vec3 mag = z->mag; /* a copy, so that the sample may stay in registers */
        turn = ahrs_take_up_field(s, p, mag);
    }
    z->accel_usable = z->force_usable && !(p->accel_gating && ahrs_is_gated(s, p, z));
    z->accel = z->force;
    if (p->motion_compensation || !z->force_usable) {
        z->motion = ahrs_motion(s, p);
    }
    if (p->motion_compensation) {
        z->motion = ahrs_vec3_scale(z->motion, ahrs_exp_decay(z->dt / p->motion_time_constant));
        z->accel = ahrs_vec3_sub(z->force, z->motion);
        z->accel_usable = z->accel_usable && ahrs_vec3_norm2(z->accel) > 0;
    }
    if (z->force_usable) {
        ahrs_vec3_to(s->force, z->force);
    }
    const bool correcting = z->gain_dt > 0;
    s->conditions |= (z->accel_usable && correcting ? AHRS_ACCEL_USED : 0) |
                     (z->mag_usable && correcting ? AHRS_MAG_USED : 0);
    return turn ? AHRS_TURN : AHRS_RUN;
}

static inline void ahrs_estimator_init(ahrs_estimator_state *s) {
    *s = (ahrs_estimator_state){.q = {1, 0, 0, 0}};
}

/* The first attitude, as soon as there is one. */
static inline ahrs_action ahrs_initialise(ahrs_estimator_state *s, const ahrs_estimator_params *p,
                                          const ahrs_sample *z) {
    if (p->initialisation == AHRS_INITIALISATION_GIVEN) {
        ahrs_quat_to(s->q, ahrs_from_output_frame(p, ahrs_quat_unit(ahrs_quat_of(p->q0))));
        s->conditions |= AHRS_HAS_HEADING;
    } else if (!ahrs_initialise_from_sensors(s, p, z)) {
        return AHRS_WAIT;
    }
    ahrs_start(s, p, z);
    return AHRS_START;
}

/* Takes in one sample and tells the estimator what to do with it. */
AHRS_INLINE ahrs_action ahrs_estimator_begin(ahrs_estimator_state *s, const ahrs_estimator_params *p,
                                             const ahrs_estimator_inputs *u, ahrs_real dt, ahrs_sample *z) {
    const bool has_attitude = ahrs_condition(s, AHRS_HAS_ATTITUDE);
    if (AHRS_UNLIKELY(!(dt > 0 && dt <= AHRS_REAL_MAX))) {
        if (dt != 0) {
            s->conditions |= AHRS_STEP_REJECTED;
            return AHRS_WAIT;
        }
        if (has_attitude) {
            return AHRS_WAIT;
        }
    }
    s->conditions &= ~AHRS_MOMENTARY;
    *z = ahrs_read_sample(s, p, u, dt);
    bool zeroed = false;
    if (AHRS_UNLIKELY(p->gyro_zero_samples > 0 && !ahrs_condition(s, AHRS_GYRO_HELD))) {
        zeroed = z->force_usable && ahrs_learn_gyro_zero(s, p, z->rate, ahrs_vec3_norm(z->force));
        z->rate = ahrs_vec3_sub(z->rate, ahrs_gyro_zero(s));
        ahrs_vec3_to(s->gyro, z->rate);
    }
    if (AHRS_UNLIKELY(!has_attitude)) {
        const ahrs_sample first = *z; /* a copy, so that the sample itself may stay in registers */
        return ahrs_initialise(s, p, &first);
    }
    const ahrs_action action = ahrs_prepare_sample(s, p, z);
    return zeroed ? AHRS_START : action;
}

/* Takes over the attitude after a sample, a unit quaternion; one that has lost its meaning is initialised anew. */
AHRS_INLINE void ahrs_estimator_end(ahrs_estimator_state *s, const ahrs_estimator_params *p, const ahrs_sample *z,
                                    ahrs_quat q) {
    ahrs_quat next = q;
    /* The cosine of half the angle turned within the sample: near one, unless q has changed its sign or is lost. */
    const ahrs_real along = ahrs_quat_dot(q, ahrs_quat_of(s->q));
    if (AHRS_UNLIKELY(!(along > AHRS_C(0.75) && along < AHRS_C(1.25)))) {
        const ahrs_real norm2 = ahrs_quat_dot(q, q);
        if (!(norm2 > AHRS_C(0.5) && norm2 < AHRS_C(2.0))) {
            ahrs_estimator_init(s);
            return;
        }
        if (along < 0) {
            next = ahrs_quat_negate(q);
        }
    }
    ahrs_quat_to(s->q, next);
    if (AHRS_UNLIKELY(!z->force_usable)) {
        ahrs_set_motion(s, p, z->motion);
    }
}

static inline int32_t ahrs_status_of(const ahrs_estimator_state *s) {
    if (!ahrs_condition(s, AHRS_HAS_ATTITUDE)) {
        return ahrs_condition(s, AHRS_MOVED) ? AHRS_STATUS_INITIALISING_IN_MOTION : AHRS_STATUS_INITIALISING;
    }
    if (ahrs_condition(s, AHRS_IMPLAUSIBLE)) {
        return AHRS_STATUS_IMPLAUSIBLE;
    }
    if (ahrs_condition(s, AHRS_COVARIANCE_RESET)) {
        return AHRS_STATUS_COVARIANCE_RESET;
    }
    if (ahrs_condition(s, AHRS_STEP_REJECTED)) {
        return AHRS_STATUS_STEP_REJECTED;
    }
    if (ahrs_condition(s, AHRS_GYRO_HELD)) {
        return AHRS_STATUS_GYRO_HELD;
    }
    if (!ahrs_condition(s, AHRS_ACCEL_USED)) {
        return AHRS_STATUS_ACCEL_UNUSED;
    }
    if (!ahrs_condition(s, AHRS_MAG_USED)) {
        return AHRS_STATUS_MAG_UNUSED;
    }
    return ahrs_condition(s, AHRS_MAG_DISTURBED) ? AHRS_STATUS_MAG_DISTURBED : AHRS_STATUS_NOMINAL;
}

/* The common outputs; `bias` is the gyroscope bias that the estimator has learned, in inner axes. */
static inline void ahrs_estimator_outputs(const ahrs_estimator_state *s, const ahrs_estimator_params *p,
                                          ahrs_vec3 bias, ahrs_estimator_outputs_t *y) {
    const ahrs_quat q = ahrs_to_output_frame(p, ahrs_quat_of(s->q));
    const ahrs_vec3 euler = ahrs_quat_to_euler(q);
    ahrs_quat_to(y->q, q);
    y->roll = euler.x;
    y->pitch = euler.y;
    y->yaw = euler.z;
    ahrs_vec3_to(y->rate, ahrs_swap_body(p->frame, ahrs_vec3_sub(ahrs_vec3_of(s->gyro), bias)));
    ahrs_vec3_to(y->gyro_bias, ahrs_swap_body(p->frame, ahrs_vec3_add(bias, ahrs_gyro_zero(s))));
    const ahrs_vec3 motion = ahrs_condition(s, AHRS_HAS_ATTITUDE) ? ahrs_motion(s, p) : (ahrs_vec3){0, 0, 0};
    ahrs_vec3_to(y->motion_accel, ahrs_swap_body(p->frame, motion));
    y->status = ahrs_status_of(s);
    y->gyro_held = ahrs_condition(s, AHRS_GYRO_HELD);
    y->accel_used = ahrs_condition(s, AHRS_ACCEL_USED);
    y->mag_used = ahrs_condition(s, AHRS_MAG_USED);
}

#endif
