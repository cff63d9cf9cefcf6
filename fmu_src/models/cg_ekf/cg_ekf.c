/* Attitude by conjugate gradients, smoothed by an extended Kalman filter (docs/algorithms.md section 4).
 *
 * The prediction is a rotation of four dimensions times a number, and both noises are multiples of the unit matrix: so
 * the covariance is one as well, and the filter needs only that number. */
#include "ahrs_cg_ekf.h"
#include "increment.h"
#include "noise.h"

enum { RESTART = 4, NEWTON_STEPS = 6 };

static const ahrs_real GRADIENT_LEAST = AHRS_C(1e-10);
static const ahrs_real CURVATURE_LEAST = AHRS_C(1e-12); /* less belongs to a direction so short that its first guess will do */

/* Directions in navigation axes and where they are measured in the body. One that is not usable is zero in both. */
typedef struct {
    ahrs_vec3 gravity, field;
} directions;

static ahrs_real dot(directions a, directions b) {
    return ahrs_vec3_dot(a.gravity, b.gravity) + ahrs_vec3_dot(a.field, b.field);
}

/* n (x) q for a vector n */
static ahrs_quat from_left(ahrs_vec3 n, ahrs_quat q) { return ahrs_quat_mul((ahrs_quat){0, n.x, n.y, n.z}, q); }

/* Vector part of p* (x) n (x) q: for p = q the direction n seen from the body, for a change d of q half of what that
 * changes by. */
static ahrs_vec3 between(ahrs_quat p, ahrs_vec3 n, ahrs_quat q) {
    const ahrs_quat t = ahrs_quat_mul(ahrs_quat_conj(p), from_left(n, q));
    return (ahrs_vec3){t.x, t.y, t.z};
}

static directions seen(ahrs_quat p, const directions *nav, ahrs_quat q) {
    return (directions){between(p, nav->gravity, q), between(p, nav->field, q)};
}

static directions misfit(ahrs_quat q, const directions *nav, const directions *measured) {
    const directions s = seen(q, nav, q);
    return (directions){ahrs_vec3_sub(s.gravity, measured->gravity), ahrs_vec3_sub(s.field, measured->field)};
}

/* v without its part along q, which would change the length of q only. */
static ahrs_quat across(ahrs_quat q, ahrs_quat v) { return ahrs_quat_sub(v, ahrs_quat_scale(q, ahrs_quat_dot(q, v))); }

/* Gradient of |e|^2/2 among unit quaternions. */
static ahrs_quat gradient(ahrs_quat q, const directions *nav, directions e) {
    const ahrs_quat gravity = ahrs_quat_mul(from_left(nav->gravity, q), (ahrs_quat){0, e.gravity.x, e.gravity.y, e.gravity.z});
    const ahrs_quat field = ahrs_quat_mul(from_left(nav->field, q), (ahrs_quat){0, e.field.x, e.field.y, e.field.z});
    return across(q, ahrs_quat_scale(ahrs_quat_add(gravity, field), -2));
}

/* How far to go from q along d. The misfit along the line is exactly e0 + L e1 + L^2 e2, half its square a quartic. */
static ahrs_real step_along(ahrs_quat q, ahrs_quat d, const directions *nav, directions e0) {
    const directions half = seen(q, nav, d), e2 = seen(d, nav, d);
    const directions e1 = {ahrs_vec3_scale(half.gravity, 2), ahrs_vec3_scale(half.field, 2)};
    const ahrs_real c0 = dot(e0, e1), c1 = dot(e1, e1) + 2 * dot(e0, e2), c2 = 3 * dot(e1, e2), c3 = 2 * dot(e2, e2);
    if (!(dot(e1, e1) > 0)) {
        return 0;
    }
    ahrs_real length = -c0 / dot(e1, e1);
    for (int32_t i = 0; i < NEWTON_STEPS; i++) {
        const ahrs_real slope = c0 + length * (c1 + length * (c2 + length * c3));
        const ahrs_real curvature = c1 + length * (2 * c2 + length * 3 * c3);
        if (!(curvature > CURVATURE_LEAST)) {
            break;
        }
        length -= slope / curvature;
    }
    return length;
}

/* The attitude of the least misfit, searched from q. */
static ahrs_quat fit(ahrs_quat q, const directions *nav, const directions *measured, int32_t iterations) {
    ahrs_quat direction = {0, 0, 0, 0};
    ahrs_real before = 1;
    for (int32_t i = 0; i < iterations; i++) {
        const directions e = misfit(q, nav, measured);
        const ahrs_quat uphill = gradient(q, nav, e);
        const ahrs_real norm2 = ahrs_quat_dot(uphill, uphill);
        if (!(norm2 > GRADIENT_LEAST * GRADIENT_LEAST)) {
            break;
        }
        const ahrs_real beta = i % RESTART == 0 ? 0 : norm2 / before;
        direction = ahrs_quat_sub(ahrs_quat_scale(across(q, direction), beta), uphill);
        if (!(ahrs_quat_dot(direction, uphill) < 0)) {
            direction = ahrs_quat_negate(uphill);
        }
        q = ahrs_quat_unit(ahrs_quat_add(q, ahrs_quat_scale(direction, step_along(q, direction, nav, e))));
        before = norm2;
    }
    return q;
}

static ahrs_quat measured_attitude(const ahrs_cg_ekf_state *s, const ahrs_cg_ekf_params *p, ahrs_quat predicted,
                                   const ahrs_sample *z) {
    const ahrs_vec3 field = {s->common.field[0], 0, s->common.field[1]};
    directions nav = {{0, 0, 0}, {0, 0, 0}}, measured = nav;
    if (z->accel_usable) {
        nav.gravity = (ahrs_vec3){0, 0, -1};
        measured.gravity = ahrs_vec3_unit(z->accel);
    }
    if (z->mag_usable && ahrs_vec3_norm2(field) > 0) {
        nav.field = ahrs_vec3_unit(field);
        measured.field = ahrs_vec3_unit(z->mag);
    }
    return fit(predicted, &nav, &measured, p->iterations);
}

static ahrs_real initial_variance(const ahrs_cg_ekf_params *p) {
    return AHRS_C(0.25) * p->initial_attitude_std * p->initial_attitude_std;
}

void ahrs_cg_ekf_init(ahrs_cg_ekf_state *s, const ahrs_cg_ekf_params *p) {
    ahrs_estimator_init(&s->common);
    s->variance = initial_variance(p);
}

void ahrs_cg_ekf_update(ahrs_cg_ekf_state *s, const ahrs_cg_ekf_params *p, const ahrs_cg_ekf_inputs *u, ahrs_real dt) {
    ahrs_sample z;
    const ahrs_action action = ahrs_estimator_begin(&s->common, &p->common, u, dt, &z);
    if (action == AHRS_START) {
        s->variance = initial_variance(p);
    }
    if (action == AHRS_WAIT || action == AHRS_START) {
        return;
    }
    const ahrs_quat turn = ahrs_increment_second(ahrs_vec3_scale(z.rate, z.dt));
    ahrs_quat q = ahrs_quat_unit(ahrs_quat_mul(ahrs_quat_of(s->common.q), turn));
    s->variance = ahrs_quat_dot(turn, turn) * s->variance +
                  AHRS_C(0.25) * ahrs_turn_variance(&s->common, &z, p->gyro_noise);
    if (!(s->variance <= AHRS_REAL_MAX)) {
        s->variance = initial_variance(p);
        s->common.conditions |= AHRS_COVARIANCE_RESET;
    }
    if (z.gain_dt > 0 && (z.accel_usable || z.mag_usable)) {
        const ahrs_real moved = ahrs_motion_variance(&p->common, &z, p->motion_noise);
        const ahrs_real attitude = ahrs_sample_variance(&p->common, p->attitude_noise);
        const ahrs_real r = AHRS_C(0.25) * (attitude + moved / (p->common.gravity * p->common.gravity));
        const ahrs_real gain = s->variance / (s->variance + r);
        const ahrs_quat measured = ahrs_quat_near(measured_attitude(s, p, q, &z), q);
        q = ahrs_quat_add(q, ahrs_quat_scale(ahrs_quat_sub(measured, q), gain));
        s->variance = gain * r;
    }
    ahrs_estimator_end(&s->common, &p->common, &z, ahrs_quat_unit(q));
}

void ahrs_cg_ekf_outputs(const ahrs_cg_ekf_state *s, const ahrs_cg_ekf_params *p, ahrs_cg_ekf_outputs_t *y) {
    const ahrs_real std = 2 * ahrs_sqrt(s->variance);
    ahrs_estimator_outputs(&s->common, &p->common, (ahrs_vec3){0, 0, 0}, &y->common);
    ahrs_vec3_to(y->attitude_std, (ahrs_vec3){std, std, std});
    y->covariance_reset = ahrs_condition(&s->common, AHRS_COVARIANCE_RESET);
}
