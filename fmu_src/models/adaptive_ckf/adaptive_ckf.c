/* Cubature Kalman filter on the quaternion with Sage-Husa noise estimation (docs/algorithms.md section 3). */
#include "ahrs_adaptive_ckf.h"
#include "attitude_error.h"
#include "increment.h"
#include "noise.h"
#include "quaternion_covariance.h"

/* The measurement: specific force, and heading where there is one. */
enum { N = 4, HEADING = 3, TRIANGLE = AHRS_TRIANGLE(4) };

/* Beyond this pitch (85 deg) the heading is not measured. */
static const ahrs_real SINE_OF_PITCH_MAX = AHRS_C(0.9961946980917455);

/* Sum of the variances of the quaternion's elements, that of a rotation by one radian: as good as unknown. */
static const ahrs_real SPREAD_MAX = AHRS_C(0.25);

/* A correction on its way: innovation v, its covariance S, gain K, and K v. */
typedef struct {
    int32_t rows; /* of the measurement */
    ahrs_real innovation[N], spread[TRIANGLE], gain[N][N], change[N];
} correction;

static void copy(const ahrs_real *from, ahrs_real *to) {
    for (int32_t i = 0; i < TRIANGLE; i++) {
        to[i] = from[i];
    }
}

/* Angle in [-pi, pi] of one in [-3 pi, 3 pi]. */
static ahrs_real wrapped(ahrs_real angle) {
    return angle > AHRS_PI ? angle - 2 * AHRS_PI : (angle < -AHRS_PI ? angle + 2 * AHRS_PI : angle);
}

static ahrs_real heading_of(ahrs_quat q) { return ahrs_atan2(ahrs_quat_east(q).x, ahrs_quat_north(q).x); }

/* Specific force and heading of an attitude that need not be of unit length; the heading near a reference. */
static void expected(const ahrs_adaptive_ckf_params *p, ahrs_quat q, ahrs_real near, ahrs_real z[N]) {
    ahrs_vec3_to(z, ahrs_vec3_scale(ahrs_quat_down(q), -p->common.gravity));
    z[HEADING] = near + wrapped(heading_of(q) - near);
}

/* Derivative of `expected` by the elements of q, row by row. */
static void jacobian(const ahrs_adaptive_ckf_params *p, ahrs_quat q, ahrs_real h[N][N]) {
    const ahrs_real g2 = -2 * p->common.gravity;
    const ahrs_real y = ahrs_quat_east(q).x, x = ahrs_quat_north(q).x;
    const ahrs_real k = 2 / (x * x + y * y);
    ahrs_quat_to(h[0], ahrs_quat_scale((ahrs_quat){-q.y, q.z, -q.w, q.x}, g2));
    ahrs_quat_to(h[1], ahrs_quat_scale((ahrs_quat){q.x, q.w, q.z, q.y}, g2));
    ahrs_quat_to(h[2], ahrs_quat_scale((ahrs_quat){q.w, -q.x, -q.y, q.z}, g2));
    const ahrs_quat dy = {q.z, q.y, q.x, q.w}, dx = {q.w, q.x, -q.y, -q.z};
    ahrs_quat_to(h[HEADING], ahrs_quat_scale(ahrs_quat_sub(ahrs_quat_scale(dy, x), ahrs_quat_scale(dx, y)), k));
}

/* Process noise per sample as the parameters give it. */
static void given_process_noise(const ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p, ahrs_quat q,
                                const ahrs_sample *z, ahrs_real out[TRIANGLE]) {
    ahrs_quat_covariance_set(out, p->quaternion_noise * p->quaternion_noise * z->dt);
    if (p->process_noise == AHRS_ADAPTIVE_CKF_PROCESS_NOISE_GYRO) {
        ahrs_quat_covariance_spread(out, q, AHRS_C(0.25) * ahrs_turn_variance(&s->common, z, p->gyro_noise));
    }
}

/* Keeps the points of a quaternion that nothing measures near unit length. */
static void limit_spread(ahrs_real covariance[TRIANGLE]) {
    ahrs_real sum = 0;
    for (int32_t i = 0; i < N; i++) {
        sum += ahrs_of(covariance, i, i);
    }
    const ahrs_real scale = sum > SPREAD_MAX ? SPREAD_MAX / sum : 1;
    for (int32_t i = 0; i < TRIANGLE; i++) {
        covariance[i] *= scale;
    }
}

static void start(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p) {
    const ahrs_sample nominal = {.dt = p->common.sample_time, .gain_dt = p->common.sample_time};
    const ahrs_real accel = ahrs_sample_variance(&p->common, p->accel_noise) +
                            ahrs_motion_variance(&p->common, &nominal, p->motion_noise);
    ahrs_quat_covariance_set(s->covariance, AHRS_C(0.25) * p->initial_attitude_std * p->initial_attitude_std);
    given_process_noise(s, p, ahrs_quat_of(s->common.q), &nominal, s->process);
    ahrs_quat_covariance_set(s->measurement, accel);
    *ahrs_at(s->measurement, HEADING, HEADING) = ahrs_sample_variance(&p->common, p->heading_noise);
    s->fading = p->forgetting;
    for (int32_t i = 0; i < p->warm_up; i++) {
        s->fading *= p->forgetting;
    }
}

/* Mean and covariances of the measurement over the cubature points, gain and change of the state. False where the
 * covariance is not positive definite. */
static bool measure(const ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p, const ahrs_sample *z,
                    ahrs_quat q, correction *c) {
    enum { POINTS = 2 * N };
    const ahrs_real weight = 1 / (ahrs_real)POINTS;
    ahrs_real root[TRIANGLE], side[N][N], y[POINTS][N], mean[N] = {0};
    if (!ahrs_cholesky(N, s->covariance, root)) {
        return false;
    }
    const ahrs_real heading = heading_of(q);
    for (int32_t i = 0; i < N; i++) {
        for (int32_t j = 0; j < N; j++) {
            side[i][j] = j < i ? 0 : 2 * root[AHRS_TRIANGLE(j) + i]; /* 2 = sqrt(N) */
        }
        expected(p, ahrs_quat_add(q, ahrs_quat_of(side[i])), heading, y[i]);
        expected(p, ahrs_quat_sub(q, ahrs_quat_of(side[i])), heading, y[i + N]);
    }
    for (int32_t a = 0; a < c->rows; a++) {
        for (int32_t i = 0; i < POINTS; i++) {
            mean[a] += weight * y[i][a];
        }
    }
    for (int32_t a = 0; a < c->rows; a++) {
        for (int32_t b = 0; b <= a; b++) {
            ahrs_real sum = ahrs_of(s->measurement, a, b);
            for (int32_t i = 0; i < POINTS; i++) {
                sum += weight * (y[i][a] - mean[a]) * (y[i][b] - mean[b]);
            }
            *ahrs_at(c->spread, a, b) = sum;
        }
        for (int32_t j = 0; j < N; j++) {
            c->gain[j][a] = 0;
            for (int32_t i = 0; i < N; i++) {
                c->gain[j][a] += weight * side[i][j] * (y[i][a] - y[i + N][a]);
            }
        }
    }
    ahrs_vec3_to(c->innovation, ahrs_vec3_sub(z->accel, ahrs_vec3_of(mean)));
    if (c->rows > HEADING) {
        const ahrs_real measured = heading_of(ahrs_attitude_of(z->accel, z->mag));
        c->innovation[HEADING] = wrapped(wrapped(measured - mean[HEADING]));
    }
    if (!ahrs_cholesky(c->rows, c->spread, root)) {
        return false;
    }
    for (int32_t j = 0; j < N; j++) {
        ahrs_solve_lower(c->rows, root, c->gain[j]);
        ahrs_solve_upper(c->rows, root, c->gain[j]);
        c->change[j] = 0;
        for (int32_t a = 0; a < c->rows; a++) {
            c->change[j] += c->gain[j][a] * c->innovation[a];
        }
    }
    return true;
}

/* P := P - K S K' */
static void subtract_gain(const correction *c, ahrs_real covariance[TRIANGLE]) {
    for (int32_t i = 0; i < N; i++) {
        for (int32_t j = 0; j <= i; j++) {
            ahrs_real sum = 0;
            for (int32_t a = 0; a < c->rows; a++) {
                for (int32_t b = 0; b < c->rows; b++) {
                    sum += c->gain[i][a] * ahrs_of(c->spread, a, b) * c->gain[j][b];
                }
            }
            *ahrs_at(covariance, i, j) -= sum;
        }
    }
}

/* Brings the eigenvalues of a covariance into their range, where they are not. */
static void keep_within(ahrs_real a[TRIANGLE], ahrs_real low, ahrs_real high) {
    ahrs_real upside[TRIANGLE];
    for (int32_t i = 0; i < TRIANGLE; i++) {
        upside[i] = -a[i];
    }
    if (!ahrs_is_above(N, a, low) || !ahrs_is_above(N, upside, -high)) {
        ahrs_clamp_eigenvalues(N, a, low, high);
    }
}

/* R := (1 - d) R + d (e e' + H P H') with e = (I - H K) v: what the correction leaves of the innovation. The published
 * forms know no limits. */
static void adapt_measurement(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p, const correction *c,
                              ahrs_quat q, ahrs_real d) {
    ahrs_real h[N][N], left[N];
    jacobian(p, q, h);
    for (int32_t a = 0; a < c->rows; a++) {
        left[a] = c->innovation[a] - ahrs_quat_dot(ahrs_quat_of(h[a]), ahrs_quat_of(c->change));
    }
    for (int32_t a = 0; a < c->rows; a++) {
        for (int32_t b = 0; b <= a; b++) {
            ahrs_real sum = left[a] * left[b];
            for (int32_t i = 0; i < N; i++) {
                for (int32_t j = 0; j < N; j++) {
                    sum += h[a][i] * ahrs_of(s->covariance, i, j) * h[b][j];
                }
            }
            ahrs_real *const r = ahrs_at(s->measurement, a, b);
            *r = (1 - d) * *r + d * sum;
        }
    }
    if (p->adaptation <= AHRS_ADAPTIVE_CKF_ADAPTATION_QR_SAFE) {
        keep_within(s->measurement, p->measurement_variance_min, p->measurement_variance_max);
    }
}

/* Q := (1 - d) Q + d (K v v' K' + P - F P F'): without the last two terms for qr_safe, with the P of the sample before
 * for textbook, with the new one for printed. */
static void adapt_process(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p, const correction *c,
                          ahrs_quat turn, const ahrs_real turned[TRIANGLE], ahrs_real d) {
    ahrs_real again[TRIANGLE];
    const bool safe = p->adaptation == AHRS_ADAPTIVE_CKF_ADAPTATION_QR_SAFE;
    copy(p->adaptation == AHRS_ADAPTIVE_CKF_ADAPTATION_PRINTED ? s->covariance : turned, again);
    if (p->adaptation == AHRS_ADAPTIVE_CKF_ADAPTATION_PRINTED) {
        ahrs_quat_covariance_turn(again, turn);
    }
    for (int32_t i = 0; i < N; i++) {
        for (int32_t j = 0; j <= i; j++) {
            const ahrs_real growth = safe ? 0 : ahrs_of(s->covariance, i, j) - ahrs_of(again, i, j);
            ahrs_real *const noise = ahrs_at(s->process, i, j);
            *noise = (1 - d) * *noise + d * (c->change[i] * c->change[j] + growth);
        }
    }
    if (safe) {
        keep_within(s->process, p->process_variance_min, p->process_variance_max);
    }
}

/* One correction; false where a covariance has lost its meaning. */
static bool correct(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p, const ahrs_sample *z,
                    ahrs_quat turn, const ahrs_real turned[TRIANGLE], ahrs_quat *q) {
    const bool level = ahrs_abs(ahrs_quat_down(*q).x) < SINE_OF_PITCH_MAX;
    correction c = {.rows = level && ahrs_shows_attitude(z) ? N : HEADING};
    if (!measure(s, p, z, *q, &c)) {
        return false;
    }
    *q = ahrs_quat_add(*q, ahrs_quat_of(c.change));
    subtract_gain(&c, s->covariance);
    if (!ahrs_quat_covariance_keep(s->covariance)) {
        return false;
    }
    s->fading *= p->forgetting;
    const ahrs_real d = (1 - p->forgetting) / (1 - s->fading);
    if (p->adaptation != AHRS_ADAPTIVE_CKF_ADAPTATION_NONE) {
        adapt_measurement(s, p, &c, *q, d);
    }
    if (p->adaptation > AHRS_ADAPTIVE_CKF_ADAPTATION_R_ONLY) {
        adapt_process(s, p, &c, turn, turned, d);
    }
    return true;
}

void ahrs_adaptive_ckf_init(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p) {
    ahrs_estimator_init(&s->common);
    start(s, p);
}

void ahrs_adaptive_ckf_update(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p,
                              const ahrs_adaptive_ckf_inputs *u, ahrs_real dt) {
    ahrs_sample z;
    const ahrs_action action = ahrs_estimator_begin(&s->common, &p->common, u, dt, &z);
    if (action == AHRS_START) {
        start(s, p);
    }
    if (action == AHRS_WAIT || action == AHRS_START) {
        return;
    }
    ahrs_real turned[TRIANGLE];
    const ahrs_quat before = ahrs_quat_of(s->common.q);
    const ahrs_quat turn = ahrs_increment(ahrs_vec3_scale(z.rate, z.dt));
    ahrs_quat q = ahrs_quat_mul(before, turn);
    if (p->adaptation <= AHRS_ADAPTIVE_CKF_ADAPTATION_R_ONLY) {
        given_process_noise(s, p, before, &z, s->process);
    }
    ahrs_quat_covariance_turn(s->covariance, turn);
    copy(s->covariance, turned);
    for (int32_t i = 0; i < TRIANGLE; i++) {
        s->covariance[i] += s->process[i];
    }
    limit_spread(s->covariance);
    if (z.gain_dt > 0 && z.accel_usable && !correct(s, p, &z, turn, turned, &q)) {
        start(s, p);
        s->common.conditions |= AHRS_COVARIANCE_RESET;
        q = ahrs_quat_mul(before, turn);
    }
    ahrs_estimator_end(&s->common, &p->common, &z, ahrs_quat_unit(q));
}

void ahrs_adaptive_ckf_outputs(const ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p,
                               ahrs_adaptive_ckf_outputs_t *y) {
    ahrs_estimator_outputs(&s->common, &p->common, (ahrs_vec3){0, 0, 0}, &y->common);
    ahrs_vec3_to(y->attitude_std, ahrs_quat_covariance_std(s->covariance, ahrs_quat_of(s->common.q)));
    y->covariance_reset = ahrs_condition(&s->common, AHRS_COVARIANCE_RESET);
}
