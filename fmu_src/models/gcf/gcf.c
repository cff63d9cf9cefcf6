/* Generalized complementary filter (docs/algorithms.md section 6). */
#include "ahrs_gcf.h"
#include "estimator.h"

/* The axes the errors are formed with: north and down seen in body axes. */
typedef struct {
    ahrs_vec3 north, down;
} nav_axes;

/* Layout of the store. */
enum { STORE_NORTH = 0, STORE_EAST = 3, STORE_DOWN = 6 };

static ahrs_vec3 stored(const ahrs_gcf_state *s, int32_t at) { return ahrs_vec3_of(&s->store[at]); }
static void keep(ahrs_gcf_state *s, int32_t at, ahrs_vec3 v) { ahrs_vec3_to(&s->store[at], v); }

/* Puts an attitude into the form that the realisation stores. */
static void store_attitude(ahrs_gcf_state *s, const ahrs_gcf_params *p, ahrs_quat q) {
    switch (p->realisation) {
    case AHRS_GCF_REALISATION_VECTOR:
    case AHRS_GCF_REALISATION_DCM:
        keep(s, STORE_NORTH, ahrs_quat_north(q));
        keep(s, STORE_EAST, ahrs_quat_east(q));
        keep(s, STORE_DOWN, ahrs_quat_down(q));
        break;
    case AHRS_GCF_REALISATION_EULER:
        keep(s, 0, ahrs_quat_to_euler(q));
        break;
    default:
        ahrs_quat_to(s->common.q, q);
    }
}

/* The attitude that is stored, as a quaternion. */
static ahrs_quat attitude(const ahrs_gcf_state *s, const ahrs_gcf_params *p) {
    switch (p->realisation) {
    case AHRS_GCF_REALISATION_VECTOR: {
        const ahrs_vec3 north = stored(s, STORE_NORTH), down = stored(s, STORE_DOWN);
        return ahrs_quat_from_mat3((ahrs_mat3){{north, ahrs_vec3_cross(down, north), down}});
    }
    case AHRS_GCF_REALISATION_DCM:
        return ahrs_quat_from_mat3(
            (ahrs_mat3){{stored(s, STORE_NORTH), stored(s, STORE_EAST), stored(s, STORE_DOWN)}});
    case AHRS_GCF_REALISATION_EULER:
        return ahrs_quat_from_euler(stored(s, 0));
    default:
        return ahrs_quat_of(s->common.q);
    }
}

static nav_axes axes(const ahrs_gcf_state *s, const ahrs_gcf_params *p) {
    if (p->realisation == AHRS_GCF_REALISATION_VECTOR || p->realisation == AHRS_GCF_REALISATION_DCM) {
        return (nav_axes){stored(s, STORE_NORTH), stored(s, STORE_DOWN)};
    }
    const ahrs_quat q = attitude(s, p);
    return (nav_axes){ahrs_quat_north(q), ahrs_quat_down(q)};
}

/* Seen from the body, axes fixed in space turn backwards as the body turns by r. Two vectors are kept of unit length
 * and at right angles; down leads, because it is the better known. */
static void rotate_vectors(ahrs_gcf_state *s, ahrs_quat r) {
    const ahrs_vec3 down = ahrs_vec3_unit(ahrs_quat_rotate_back(r, stored(s, STORE_DOWN)));
    const ahrs_vec3 turned = ahrs_quat_rotate_back(r, stored(s, STORE_NORTH));
    const ahrs_vec3 north = ahrs_vec3_unit(ahrs_vec3_add_scaled(turned, -ahrs_vec3_dot(turned, down), down));
    keep(s, STORE_DOWN, down);
    keep(s, STORE_NORTH, north);
}

/* C := C R(r), then one step C := (3 C - C C' C)/2 towards the nearest rotation matrix. */
static void rotate_matrix(ahrs_gcf_state *s, ahrs_quat r) {
    const ahrs_mat3 stored_c = {{stored(s, STORE_NORTH), stored(s, STORE_EAST), stored(s, STORE_DOWN)}};
    const ahrs_mat3 c = ahrs_mat3_mul(stored_c, ahrs_quat_to_mat3(r));
    for (int32_t i = 0; i < 3; i++) {
        const ahrs_vec3 overlap = ahrs_mat3_apply(c, c.row[i]);
        const ahrs_vec3 back = ahrs_mat3_apply_transposed(c, overlap);
        const ahrs_vec3 row = ahrs_vec3_add_scaled(ahrs_vec3_scale(c.row[i], AHRS_C(1.5)), AHRS_C(-0.5), back);
        keep(s, STORE_NORTH + 3 * i, row);
    }
}

/* attitude := attitude (x) exp(v) */
static void rotate(ahrs_gcf_state *s, const ahrs_gcf_params *p, ahrs_vec3 v) {
    const ahrs_quat r = ahrs_quat_exp(v);
    switch (p->realisation) {
    case AHRS_GCF_REALISATION_VECTOR:
        rotate_vectors(s, r);
        break;
    case AHRS_GCF_REALISATION_DCM:
        rotate_matrix(s, r);
        break;
    default:
        store_attitude(s, p, ahrs_quat_mul(attitude(s, p), r));
    }
}

/* Tilt from gravity, heading from the horizontal field: loop gain one on all axes. */
static ahrs_vec3 decoupled_error(nav_axes n, const ahrs_sample *z) {
    ahrs_vec3 e = {0, 0, 0};
    if (z->accel_usable) {
        e = ahrs_vec3_cross(n.down, ahrs_vec3_unit(z->accel)); /* a x s with s = -down */
    }
    if (z->mag_usable) {
        const ahrs_real x = ahrs_vec3_dot(n.north, z->mag);
        const ahrs_real y = ahrs_vec3_dot(ahrs_vec3_cross(n.down, n.north), z->mag);
        const ahrs_real norm2 = x * x + y * y;
        if (norm2 > 0) {
            e = ahrs_vec3_add_scaled(e, -y / ahrs_sqrt(norm2), n.down);
        }
    }
    return e;
}

/* Both cross products, measured x expected, weighted: loop gain kg (I - gg') + kh (I - hh'). */
static ahrs_vec3 coupled_error(const ahrs_gcf_state *s, const ahrs_gcf_params *p, nav_axes n, const ahrs_sample *z) {
    ahrs_vec3 e = {0, 0, 0};
    if (z->accel_usable) {
        e = ahrs_vec3_scale(ahrs_vec3_cross(n.down, ahrs_vec3_unit(z->accel)), p->kg);
    }
    const ahrs_vec3 field =
        ahrs_vec3_add_scaled(ahrs_vec3_scale(n.north, s->common.field[0]), s->common.field[1], n.down);
    if (z->mag_usable && ahrs_vec3_norm2(field) > 0) {
        const ahrs_vec3 cross = ahrs_vec3_cross(ahrs_vec3_unit(z->mag), ahrs_vec3_unit(field));
        e = ahrs_vec3_add_scaled(e, p->kh, cross);
    }
    return e;
}

/* The rotation from the stored attitude to the one that accelerometer and magnetometer show. Without a usable
 * magnetometer it is the shortest one that brings down to its measured direction. */
static ahrs_vec3 attitude_error(const ahrs_gcf_state *s, const ahrs_gcf_params *p, const ahrs_sample *z) {
    if (!z->accel_usable) {
        return decoupled_error(axes(s, p), z);
    }
    const ahrs_quat q = attitude(s, p);
    if (z->mag_usable) {
        return ahrs_quat_log(ahrs_quat_mul(ahrs_quat_conj(q), ahrs_attitude_of(z->accel, z->mag)));
    }
    const ahrs_vec3 down = ahrs_quat_down(q);
    const ahrs_vec3 measured = ahrs_vec3_unit(ahrs_vec3_negate(z->accel));
    const ahrs_vec3 cross = ahrs_vec3_cross(measured, down);
    const ahrs_real sine = ahrs_vec3_norm(cross);
    return sine > 0 ? ahrs_vec3_scale(cross, ahrs_atan2(sine, ahrs_vec3_dot(measured, down)) / sine) : cross;
}

static ahrs_vec3 error(const ahrs_gcf_state *s, const ahrs_gcf_params *p, const ahrs_sample *z) {
    if (p->form == AHRS_GCF_FORM_ATTITUDE) {
        return attitude_error(s, p, z);
    }
    const nav_axes n = axes(s, p);
    return p->error == AHRS_GCF_ERROR_COUPLED ? coupled_error(s, p, n, z) : decoupled_error(n, z);
}

static ahrs_vec3 limited(ahrs_vec3 v, ahrs_real limit) {
    return (ahrs_vec3){ahrs_clamp(v.x, -limit, limit), ahrs_clamp(v.y, -limit, limit), ahrs_clamp(v.z, -limit, limit)};
}

void ahrs_gcf_init(ahrs_gcf_state *s, const ahrs_gcf_params *p) {
    (void)p;
    *s = (ahrs_gcf_state){.bias = {0}};
    ahrs_estimator_init(&s->common);
}

void ahrs_gcf_update(ahrs_gcf_state *s, const ahrs_gcf_params *p, const ahrs_gcf_inputs *u, ahrs_real dt) {
    ahrs_sample z;
    switch (ahrs_estimator_begin(&s->common, &p->common, u, dt, &z)) {
    case AHRS_WAIT:
        return;
    case AHRS_START:
        ahrs_vec3_to(s->bias, (ahrs_vec3){0, 0, 0});
        ahrs_vec3_to(s->drift, (ahrs_vec3){0, 0, 0});
        store_attitude(s, p, ahrs_quat_of(s->common.q));
        return;
    case AHRS_TURN:
        store_attitude(s, p, ahrs_quat_of(s->common.q));
        break;
    case AHRS_RUN:
        break;
    }
    const ahrs_vec3 bias = ahrs_vec3_of(s->bias);
    rotate(s, p, ahrs_vec3_scale(ahrs_vec3_sub(z.rate, bias), z.dt));

    const ahrs_vec3 e = error(s, p, &z);
    const ahrs_real T = z.gain_dt;
    const ahrs_vec3 drift = ahrs_vec3_add_scaled(ahrs_vec3_of(s->drift), T * p->kii, e);
    const ahrs_vec3 slope = ahrs_vec3_add_scaled(drift, p->ki, e);
    ahrs_vec3_to(s->drift, drift);
    ahrs_vec3_to(s->bias, limited(ahrs_vec3_add_scaled(bias, -T, slope), p->bias_limit));
    rotate(s, p, ahrs_vec3_scale(e, p->kp * T));

    ahrs_estimator_end(&s->common, &p->common, &z, attitude(s, p));
}

void ahrs_gcf_outputs(const ahrs_gcf_state *s, const ahrs_gcf_params *p, ahrs_gcf_outputs_t *y) {
    ahrs_estimator_outputs(&s->common, &p->common, ahrs_vec3_of(s->bias), &y->common);
}
