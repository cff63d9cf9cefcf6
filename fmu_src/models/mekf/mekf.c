/* Multiplicative extended Kalman filter with gyroscope bias (docs/algorithms.md section 1).
 *
 * The errors are a rotation about the body axes and the bias, with the covariance P = [A B; B' C] in 3 x 3 blocks. A
 * direction measured with noise of equal size on all axes tells of the rotation only, and both directions together
 * through one matrix W = H' R^-1 H of three rows. With the factors A = L D L' and B = L D Z the part of the bias that the
 * rotation does not explain, S = C - Z' D Z, stays as it is, and with D^-1 + L' W L = U E U' the correction is
 *
 *     L := L U'^-1,   D := E^-1,   Z := U^-1 Z,
 *
 * sums of squares throughout, so that the covariance stays positive definite. With the misfit r = H' R^-1 (y - h) the
 * attitude is corrected by A r and the bias by B' r. */
#include "ahrs_mekf.h"
#include "attitude_error.h"
#include "noise.h"

typedef struct {
    ahrs_sym3 a;
    ahrs_mat3 b;
    ahrs_sym3 c;
} blocks;

static blocks load(const ahrs_mekf_state *s) {
    return (blocks){ahrs_sym3_of(s->attitude_covariance), ahrs_mat3_of(s->cross_covariance),
                    ahrs_sym3_of(s->bias_covariance)};
}

static void store(ahrs_mekf_state *s, const blocks *p) {
    ahrs_sym3_to(s->attitude_covariance, p->a);
    ahrs_mat3_to(s->cross_covariance, p->b);
    ahrs_sym3_to(s->bias_covariance, p->c);
}

static blocks initial(const ahrs_mekf_params *p) {
    const ahrs_real attitude = p->initial_attitude_std * p->initial_attitude_std;
    const ahrs_real bias = p->initial_bias_std * p->initial_bias_std;
    return (blocks){.a = {attitude, 0, attitude, 0, 0, attitude}, .c = {bias, 0, bias, 0, 0, bias}};
}

/* The covariance after the body has turned by r and the bias error has added to the rotation error for T seconds. */
AHRS_INLINE blocks predicted(const blocks *p, ahrs_quat r, ahrs_real T, ahrs_real turn, ahrs_real walk) {
    const ahrs_mat3 back = ahrs_quat_to_mat3(r);
    const ahrs_mat3 b = ahrs_mat3_transposed_mul(back, p->b), c = ahrs_sym3_full(p->c);
    const ahrs_mat3 a = ahrs_mat3_transposed_mul(back, ahrs_sym3_full(p->a));
    const ahrs_sym3 turned = ahrs_sym3_product(a, back);
    const ahrs_real cross = AHRS_C(0.5) * T * T * walk;
    blocks next;
    for (int32_t i = 0; i < 3; i++) {
        next.b.row[i] = ahrs_vec3_add_scaled(b.row[i], -T, c.row[i]);
    }
    next.a = (ahrs_sym3){turned.xx - T * (b.row[0].x + next.b.row[0].x), turned.yx - T * (b.row[1].x + next.b.row[0].y),
                         turned.yy - T * (b.row[1].y + next.b.row[1].y), turned.zx - T * (b.row[2].x + next.b.row[0].z),
                         turned.zy - T * (b.row[2].y + next.b.row[1].z), turned.zz - T * (b.row[2].z + next.b.row[2].z)};
    next.a = ahrs_sym3_add_diagonal(next.a, turn + T * T * T * walk / 3);
    next.b.row[0].x -= cross;
    next.b.row[1].y -= cross;
    next.b.row[2].z -= cross;
    next.c = ahrs_sym3_add_diagonal(p->c, T * walk);
    return next;
}

/* A rotation error has no meaning beyond half a turn: a heading that nothing measures stays at that. Scaling the cross
 * covariance as much as the attitude's keeps the whole positive definite, and heading and bias apart. */
static void limit_attitude(blocks *p) {
    const ahrs_real sum = p->a.xx + p->a.yy + p->a.zz;
    if (AHRS_UNLIKELY(sum > AHRS_PI * AHRS_PI)) {
        const ahrs_real scale = AHRS_PI * AHRS_PI / sum;
        p->a = ahrs_sym3_scale(p->a, scale);
        for (int32_t i = 0; i < 3; i++) {
            p->b.row[i] = ahrs_vec3_scale(p->b.row[i], scale);
        }
    }
}

/* One measured direction, in units of its noise: what is expected, and what it says about the rotation. */
typedef struct {
    ahrs_vec3 expected, misfit;
} direction;

static direction compared(ahrs_vec3 measured, ahrs_vec3 expected, ahrs_real variance) {
    const ahrs_real weight = 1 / variance;
    const ahrs_vec3 cross = ahrs_vec3_cross(measured, expected);
    return (direction){ahrs_vec3_scale(expected, ahrs_sqrt(weight)), ahrs_vec3_scale(cross, weight)};
}

/* Information about the rotation: of a direction e that is (|e|^2 I - e e'). */
static ahrs_sym3 information(ahrs_vec3 e, ahrs_vec3 m) {
    return (ahrs_sym3){e.y * e.y + e.z * e.z + (m.y * m.y + m.z * m.z), -(e.x * e.y + m.x * m.y),
                       e.x * e.x + e.z * e.z + (m.x * m.x + m.z * m.z), -(e.x * e.z + m.x * m.z),
                       -(e.y * e.z + m.y * m.z),                        e.x * e.x + e.y * e.y + (m.x * m.x + m.y * m.y)};
}

/* Unit lower triangle. */
typedef struct {
    ahrs_real yx, zx, zy;
} unit_triangle;

static bool is_positive(ahrs_vec3 d) {
    return d.x > 0 && d.y > 0 && d.z > 0 && d.x <= AHRS_REAL_MAX && d.y <= AHRS_REAL_MAX && d.z <= AHRS_REAL_MAX;
}

/* a = L D L' */
AHRS_INLINE ahrs_vec3 factored(ahrs_sym3 a, unit_triangle *l) {
    const ahrs_real inverse = 1 / a.xx;
    *l = (unit_triangle){.yx = a.yx * inverse, .zx = a.zx * inverse};
    const ahrs_real y = a.yy - l->yx * a.yx, zy = a.zy - l->zx * a.yx;
    l->zy = zy / y;
    return (ahrs_vec3){a.xx, y, a.zz - l->zx * a.zx - l->zy * zy};
}

/* v = U E U'; U' is given. */
AHRS_INLINE ahrs_vec3 factored_from_below(ahrs_sym3 v, unit_triangle *u) {
    const ahrs_real inverse = 1 / v.zz;
    *u = (unit_triangle){.zx = v.zx * inverse, .zy = v.zy * inverse};
    const ahrs_real y = v.yy - u->zy * v.zy, yx = v.yx - u->zx * v.zy;
    u->yx = yx / y;
    return (ahrs_vec3){v.xx - u->zx * v.zx - u->yx * yx, y, v.zz};
}

/* L' w L */
AHRS_INLINE ahrs_sym3 enclosed(unit_triangle l, ahrs_sym3 w) {
    const ahrs_vec3 y = {w.yx + l.zy * w.zx, w.yy + l.zy * w.zy, w.zy + l.zy * w.zz};
    const ahrs_vec3 x = {w.xx + l.yx * w.yx + l.zx * w.zx, w.yx + l.yx * w.yy + l.zx * w.zy,
                         w.zx + l.yx * w.zy + l.zx * w.zz};
    return (ahrs_sym3){x.x + l.yx * x.y + l.zx * x.z, x.y + l.zy * x.z, y.y + l.zy * y.z, x.z, y.z, w.zz};
}

/* a + sign (the sum of the products of corresponding rows) */
AHRS_INLINE ahrs_sym3 with_products(ahrs_sym3 a, ahrs_real sign, ahrs_mat3 m, ahrs_mat3 n) {
    const ahrs_sym3 sum = ahrs_sym3_transposed_product(m, n);
    return (ahrs_sym3){a.xx + sign * sum.xx, a.yx + sign * sum.yx, a.yy + sign * sum.yy,
                       a.zx + sign * sum.zx, a.zy + sign * sum.zy, a.zz + sign * sum.zz};
}

/* False, and nothing that can be used, where the blocks were no covariance. */
AHRS_INLINE bool corrected(blocks *p, ahrs_sym3 w) {
    unit_triangle l, u, unused;
    const ahrs_vec3 d = factored(p->a, &l);
    const ahrs_vec3 inverse = {1 / d.x, 1 / d.y, 1 / d.z};
    ahrs_mat3 dz = p->b, z;
    dz.row[1] = ahrs_vec3_add_scaled(dz.row[1], -l.yx, dz.row[0]);
    dz.row[2] = ahrs_vec3_add_scaled(ahrs_vec3_add_scaled(dz.row[2], -l.zx, dz.row[0]), -l.zy, dz.row[1]);
    z.row[0] = ahrs_vec3_scale(dz.row[0], inverse.x);
    z.row[1] = ahrs_vec3_scale(dz.row[1], inverse.y);
    z.row[2] = ahrs_vec3_scale(dz.row[2], inverse.z);
    const ahrs_sym3 unexplained = with_products(p->c, -1, dz, z);

    ahrs_sym3 v = enclosed(l, w);
    v.xx += inverse.x;
    v.yy += inverse.y;
    v.zz += inverse.z;
    const ahrs_vec3 e = factored_from_below(v, &u);
    const bool kept = is_positive(d) && is_positive(e) && is_positive(factored(unexplained, &unused));

    const ahrs_vec3 left = {1 / e.x, 1 / e.y, 1 / e.z};
    l.yx -= u.yx;
    l.zy -= u.zy;
    l.zx -= u.zx + l.zy * u.yx;
    z.row[1] = ahrs_vec3_add_scaled(z.row[1], -u.zy, z.row[2]);
    z.row[0] = ahrs_vec3_add_scaled(ahrs_vec3_add_scaled(z.row[0], -u.yx, z.row[1]), -u.zx, z.row[2]);
    dz.row[0] = ahrs_vec3_scale(z.row[0], left.x);
    dz.row[1] = ahrs_vec3_scale(z.row[1], left.y);
    dz.row[2] = ahrs_vec3_scale(z.row[2], left.z);

    const ahrs_real yx = l.yx * left.x, zx = l.zx * left.x, zy = l.zy * left.y;
    p->a = (ahrs_sym3){left.x, yx, left.y + l.yx * yx, zx, zy + l.zx * yx, left.z + l.zy * zy + l.zx * zx};
    p->b.row[0] = dz.row[0];
    p->b.row[1] = ahrs_vec3_add_scaled(dz.row[1], l.yx, dz.row[0]);
    p->b.row[2] = ahrs_vec3_add_scaled(ahrs_vec3_add_scaled(dz.row[2], l.zy, dz.row[1]), l.zx, dz.row[0]);
    p->c = with_products(unexplained, 1, dz, z);
    return kept;
}

void ahrs_mekf_init(ahrs_mekf_state *s, const ahrs_mekf_params *p) {
    const blocks first = initial(p);
    ahrs_estimator_init(&s->common);
    ahrs_vec3_to(s->bias, (ahrs_vec3){0, 0, 0});
    store(s, &first);
}

void ahrs_mekf_update(ahrs_mekf_state *s, const ahrs_mekf_params *p, const ahrs_mekf_inputs *u, ahrs_real dt) {
    ahrs_sample z;
    const ahrs_action action = ahrs_estimator_begin(&s->common, &p->common, u, dt, &z);
    if (action == AHRS_START) {
        const blocks first = initial(p);
        ahrs_vec3_to(s->bias, (ahrs_vec3){0, 0, 0});
        store(s, &first);
    }
    if (action == AHRS_WAIT || action == AHRS_START) {
        return;
    }
    ahrs_vec3 bias = ahrs_vec3_of(s->bias);
    const ahrs_quat turn = ahrs_quat_exp(ahrs_vec3_scale(ahrs_vec3_sub(z.rate, bias), z.dt));
    const blocks before = load(s);
    blocks cov = predicted(&before, turn, z.dt, ahrs_turn_variance(&s->common, &z, p->gyro_noise),
                           p->gyro_bias_noise * p->gyro_bias_noise);
    limit_attitude(&cov);
    ahrs_quat q = ahrs_quat_refine(ahrs_quat_mul(ahrs_quat_of(s->common.q), turn));

    if (z.gain_dt > 0) {
        const ahrs_vec3 down = ahrs_quat_down(q), none = {0, 0, 0};
        direction gravity = {none, none}, field = {none, none};
        if (z.accel_usable) {
            const ahrs_real variance =
                ahrs_sample_variance(&p->common, p->accel_noise) + ahrs_motion_variance(&p->common, &z, p->motion_noise);
            gravity = compared(z.accel, ahrs_vec3_scale(down, -p->common.gravity), variance);
        }
        if (z.mag_usable) {
            const ahrs_vec3 north = ahrs_vec3_scale(ahrs_quat_north(q), s->common.field[0]);
            field = compared(z.mag, ahrs_vec3_add_scaled(north, s->common.field[1], down),
                             ahrs_sample_variance(&p->common, p->mag_noise));
        }
        if (corrected(&cov, information(gravity.expected, field.expected))) {
            const ahrs_vec3 misfit = ahrs_vec3_add(gravity.misfit, field.misfit);
            q = ahrs_quat_turn(q, ahrs_sym3_apply(cov.a, misfit));
            bias = ahrs_vec3_limited(ahrs_vec3_add(bias, ahrs_mat3_apply_transposed(cov.b, misfit)), p->bias_limit);
        } else {
            cov = initial(p);
            s->common.conditions |= AHRS_COVARIANCE_RESET;
        }
    }
    ahrs_vec3_to(s->bias, bias);
    store(s, &cov);
    ahrs_estimator_end(&s->common, &p->common, &z, ahrs_quat_refine(q));
}

void ahrs_mekf_outputs(const ahrs_mekf_state *s, const ahrs_mekf_params *p, ahrs_mekf_outputs_t *y) {
    const ahrs_sym3 a = ahrs_sym3_of(s->attitude_covariance);
    ahrs_estimator_outputs(&s->common, &p->common, ahrs_vec3_of(s->bias), &y->common);
    ahrs_vec3_to(y->attitude_std, (ahrs_vec3){ahrs_sqrt(a.xx), ahrs_sqrt(a.yy), ahrs_sqrt(a.zz)});
    y->covariance_reset = ahrs_condition(&s->common, AHRS_COVARIANCE_RESET);
}
