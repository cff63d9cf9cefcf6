/* Generalized complementary filter (docs/algorithms.md section 5). */
#include "ahrs_gcf.h"
#include "attitude_error.h"

/* An attitude in the form of its realisation: a quaternion (quaternion, euler), or the navigation axes seen from the
 * body, which are the rows of the rotation matrix (dcm) or the first and the last of them (vector). */
typedef struct {
    int32_t realisation;
    ahrs_quat q;
    ahrs_mat3 c;
} attitude;

/* From one stored row to the next: vector leaves out east. */
AHRS_INLINE int32_t row_step(int32_t realisation) { return realisation == AHRS_GCF_REALISATION_VECTOR ? 2 : 1; }

AHRS_INLINE bool has_axes(int32_t realisation) {
    return realisation == AHRS_GCF_REALISATION_VECTOR || realisation == AHRS_GCF_REALISATION_DCM;
}

AHRS_INLINE attitude attitude_from(int32_t realisation, ahrs_quat q) {
    attitude a = {.realisation = realisation, .q = q};
    if (has_axes(realisation)) {
        a.c = ahrs_quat_to_mat3(q);
    }
    return a;
}

AHRS_INLINE attitude load(const ahrs_gcf_state *s, int32_t realisation) {
    attitude a = {.realisation = realisation};
    if (has_axes(realisation)) {
        for (int32_t i = AHRS_NORTH; i <= AHRS_DOWN; i += row_step(realisation)) {
            a.c.row[i] = ahrs_vec3_of(&s->store[3 * i]);
        }
    } else if (realisation == AHRS_GCF_REALISATION_EULER) {
        a.q = ahrs_quat_from_euler(ahrs_vec3_of(s->store));
    } else {
        a.q = ahrs_quat_of(s->common.q);
    }
    return a;
}

AHRS_INLINE void store(ahrs_gcf_state *s, attitude a) {
    if (has_axes(a.realisation)) {
        for (int32_t i = AHRS_NORTH; i <= AHRS_DOWN; i += row_step(a.realisation)) {
            ahrs_vec3_to(&s->store[3 * i], a.c.row[i]);
        }
    } else if (a.realisation == AHRS_GCF_REALISATION_EULER) {
        ahrs_vec3_to(s->store, ahrs_quat_to_euler(a.q));
    }
}

/* The rows of the rotation matrix. */
AHRS_INLINE ahrs_mat3 axes_of(attitude a) {
    if (!has_axes(a.realisation)) {
        return ahrs_quat_to_mat3(a.q);
    }
    if (a.realisation == AHRS_GCF_REALISATION_VECTOR) {
        a.c.row[AHRS_EAST] = ahrs_vec3_cross(a.c.row[AHRS_DOWN], a.c.row[AHRS_NORTH]);
    }
    return a.c;
}

AHRS_INLINE ahrs_quat quaternion_of(attitude a) {
    return has_axes(a.realisation) ? ahrs_quat_from_mat3(axes_of(a)) : a.q;
}

/* Seen from the body, an axis fixed in space turns backwards as the body turns by v: u exp(-[v x]). */
AHRS_INLINE ahrs_vec3 turned_back(ahrs_vec3 u, ahrs_vec3 v, ahrs_real sinc, ahrs_real versine) {
    const ahrs_vec3 first = ahrs_vec3_cross(u, v), second = ahrs_vec3_cross(first, v);
    return ahrs_vec3_add_scaled(ahrs_vec3_add_scaled(u, sinc, first), versine, second);
}

/* The attitude after the body has turned by the rotation vector v. */
AHRS_INLINE attitude rotated(attitude a, ahrs_vec3 v) {
    if (!has_axes(a.realisation)) {
        a.q = ahrs_quat_turn(a.q, v);
        return a;
    }
    ahrs_real c, k;
    ahrs_half_angle(ahrs_vec3_norm2(v), &c, &k);
    const ahrs_real sinc = 2 * k * c, versine = 2 * k * k; /* sin n/n and (1 - cos n)/n^2 */
    a.c.row[AHRS_NORTH] = turned_back(a.c.row[AHRS_NORTH], v, sinc, versine);
    if (a.realisation == AHRS_GCF_REALISATION_DCM) {
        a.c.row[AHRS_EAST] = turned_back(a.c.row[AHRS_EAST], v, sinc, versine);
    }
    a.c.row[AHRS_DOWN] = turned_back(a.c.row[AHRS_DOWN], v, sinc, versine);
    return a;
}

/* One step C := (3 C - C C' C)/2 towards the nearest rotation matrix. */
static ahrs_mat3 refined_matrix(ahrs_mat3 c) {
    ahrs_mat3 refined;
    for (int32_t i = AHRS_NORTH; i <= AHRS_DOWN; i++) {
        const ahrs_vec3 back = ahrs_mat3_apply_transposed(c, ahrs_mat3_apply(c, c.row[i]));
        refined.row[i] = ahrs_vec3_add_scaled(ahrs_vec3_scale(c.row[i], AHRS_C(1.5)), AHRS_C(-0.5), back);
    }
    return refined;
}

/* Two vectors of unit length at right angles; down leads, because it is the better known. */
AHRS_INLINE ahrs_mat3 refined_vectors(ahrs_mat3 c) {
    const ahrs_vec3 north = c.row[AHRS_NORTH], down = c.row[AHRS_DOWN];
    c.row[AHRS_NORTH] = ahrs_vec3_add_scaled(ahrs_vec3_scale(north, AHRS_C(1.5) - AHRS_C(0.5) * ahrs_vec3_norm2(north)),
                                        -ahrs_vec3_dot(north, down), down);
    c.row[AHRS_DOWN] = ahrs_vec3_scale(down, AHRS_C(1.5) - AHRS_C(0.5) * ahrs_vec3_norm2(down));
    return c;
}

/* The rounding of rotations taken out, by one Newton step. */
AHRS_INLINE attitude refined(attitude a) {
    if (a.realisation == AHRS_GCF_REALISATION_DCM) {
        a.c = refined_matrix(a.c);
    } else if (a.realisation == AHRS_GCF_REALISATION_VECTOR) {
        a.c = refined_vectors(a.c);
    } else {
        a.q = ahrs_quat_refine(a.q);
    }
    return a;
}

/* Both cross products, measured x expected, weighted: loop gain kg (I - gg') + kh (I - hh'). */
AHRS_INLINE ahrs_vec3 coupled_error(const ahrs_gcf_state *s, const ahrs_gcf_params *p, ahrs_mat3 c,
                                    const ahrs_sample *z) {
    ahrs_vec3 e = {0, 0, 0};
    if (z->accel_usable) {
        e = ahrs_vec3_scale(ahrs_vec3_cross(c.row[AHRS_DOWN], ahrs_vec3_unit(z->accel)), p->kg);
    }
    const ahrs_vec3 field =
        ahrs_vec3_add_scaled(ahrs_vec3_scale(c.row[AHRS_NORTH], s->common.field[0]), s->common.field[1], c.row[AHRS_DOWN]);
    if (z->mag_usable && ahrs_vec3_norm2(field) > 0) {
        const ahrs_vec3 cross = ahrs_vec3_cross(ahrs_vec3_unit(z->mag), ahrs_vec3_unit(field));
        e = ahrs_vec3_add_scaled(e, p->kh, cross);
    }
    return e;
}

AHRS_INLINE ahrs_vec3 error_of(const ahrs_gcf_state *s, const ahrs_gcf_params *p, attitude a, const ahrs_sample *z) {
    ahrs_vec3 e;
    if (p->form == AHRS_GCF_FORM_ATTITUDE) {
        const attitude predicted = a; /* copies, so that the direct form may keep its own in registers */
        const ahrs_sample sample = *z;
        e = ahrs_attitude_error(quaternion_of(predicted), &sample);
    } else if (p->error == AHRS_GCF_ERROR_COUPLED) {
        e = coupled_error(s, p, axes_of(a), z);
    } else {
        e = ahrs_decoupled_error(axes_of(a), z);
    }
    return e;
}

void ahrs_gcf_init(ahrs_gcf_state *s, const ahrs_gcf_params *p) {
    (void)p;
    *s = (ahrs_gcf_state){.bias = {0}};
    ahrs_estimator_init(&s->common);
}

/* One prediction and one correction; the realisation is a constant wherever this is used. */
AHRS_INLINE void step(ahrs_gcf_state *s, const ahrs_gcf_params *p, const ahrs_sample *z, int32_t realisation) {
    const ahrs_real T = z->gain_dt;
    const ahrs_vec3 bias = ahrs_vec3_of(s->bias);
    const attitude predicted = rotated(load(s, realisation), ahrs_vec3_scale(ahrs_vec3_sub(z->rate, bias), z->dt));
    const ahrs_vec3 e = error_of(s, p, predicted, z);
    const attitude corrected = rotated(refined(predicted), ahrs_vec3_scale(e, p->kp * T));
    ahrs_vec3 slope = ahrs_vec3_scale(e, p->ki);
    if (p->kii != 0) { /* of third order */
        const ahrs_vec3 drift = ahrs_vec3_add_scaled(ahrs_vec3_of(s->drift), T * p->kii, e);
        ahrs_vec3_to(s->drift, drift);
        slope = ahrs_vec3_add(slope, drift);
    }
    ahrs_vec3_to(s->bias, ahrs_vec3_limited(ahrs_vec3_add_scaled(bias, -T, slope), p->bias_limit));
    store(s, corrected);
    ahrs_estimator_end(&s->common, &p->common, z, quaternion_of(corrected));
}

void ahrs_gcf_update(ahrs_gcf_state *s, const ahrs_gcf_params *p, const ahrs_gcf_inputs *u, ahrs_real dt) {
    ahrs_sample z;
    const ahrs_action action = ahrs_estimator_begin(&s->common, &p->common, u, dt, &z);
    if (action == AHRS_START) {
        ahrs_vec3_to(s->bias, (ahrs_vec3){0, 0, 0});
        ahrs_vec3_to(s->drift, (ahrs_vec3){0, 0, 0});
    }
    if (action == AHRS_START || action == AHRS_TURN) {
        store(s, attitude_from(p->realisation, ahrs_quat_of(s->common.q)));
    }
    if (action == AHRS_START || action == AHRS_WAIT) {
        return;
    }
    switch (p->realisation) {
    case AHRS_GCF_REALISATION_VECTOR:
        step(s, p, &z, AHRS_GCF_REALISATION_VECTOR);
        break;
    case AHRS_GCF_REALISATION_DCM:
        step(s, p, &z, AHRS_GCF_REALISATION_DCM);
        break;
    case AHRS_GCF_REALISATION_EULER:
        step(s, p, &z, AHRS_GCF_REALISATION_EULER);
        break;
    default:
        step(s, p, &z, AHRS_GCF_REALISATION_QUATERNION);
    }
}

void ahrs_gcf_outputs(const ahrs_gcf_state *s, const ahrs_gcf_params *p, ahrs_gcf_outputs_t *y) {
    ahrs_estimator_outputs(&s->common, &p->common, ahrs_vec3_of(s->bias), &y->common);
}
