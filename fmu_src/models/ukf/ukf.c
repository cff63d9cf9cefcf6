/* Unscented Kalman filter with gyroscope bias, in square-root form (docs/algorithms.md section 1).
 *
 * The covariance is kept as its triangular root. The points lie in pairs around the estimate; a pair's difference and its
 * sum, instead of the points themselves, make columns in which most elements are zero. Root and noise are put side by side
 * and made triangular by reflections, which squares nothing and cannot lose positive definiteness. What is left of the
 * estimate's own weight, which may be negative, is added to the result. */
#include "ahrs_ukf.h"
#include "attitude_error.h"
#include "matrix.h"
#include "noise.h"

enum { N = 6, ROTATION = 3, Z = 6, PAIRS = N, COLUMNS = N + N + Z, ROOT = AHRS_TRIANGLE(N) };

/* rad2: the points of a rotation spread further than this would meet behind the back. */
static const ahrs_real ROTATION_VARIANCE_MAX = AHRS_C(1.0);

/* Distance of the points in standard deviations, the weight of each, and how a covariance is summed up: over deviations
 * from the mean or from the estimate, and `own` times the square of what lies between the two. Both sums are the same, but
 * about the mean `own` is the estimate's weight, -10^6 for alpha 0.001: then the other one is free of cancellation. */
typedef struct {
    ahrs_real distance, point, own;
    bool about_mean;
} weights;

/* One measured direction or two, in units of their noise. */
typedef struct {
    int32_t rows;
    bool accel, mag;
    ahrs_real gravity, north, down; /* what is expected */
    ahrs_real measured[Z];
} measurement;

static weights weights_of(const ahrs_ukf_params *p) {
    const ahrs_real spread = p->alpha * p->alpha * ((ahrs_real)N + p->kappa);
    const ahrs_real about_estimate = p->beta - p->alpha * p->alpha;
    const ahrs_real about_mean = 2 - (ahrs_real)N / spread + about_estimate;
    const bool mean = ahrs_abs(about_mean) <= ahrs_abs(about_estimate);
    return (weights){ahrs_sqrt(spread), AHRS_C(0.5) / spread, mean ? about_mean : about_estimate, mean};
}

static void start(ahrs_ukf_state *s, const ahrs_ukf_params *p) {
    for (int32_t i = 0; i < ROOT; i++) {
        s->root[i] = 0;
    }
    for (int32_t i = 0; i < N; i++) {
        *ahrs_at(s->root, i, i) = i < ROTATION ? p->initial_attitude_std : p->initial_bias_std;
    }
}

/* Column j of the root, rotation or bias, times a number. */
static ahrs_vec3 column(const ahrs_real root[ROOT], int32_t first, int32_t j, ahrs_real k) {
    ahrs_vec3 v = {0, 0, 0};
    if (j <= first) {
        v.x = root[AHRS_TRIANGLE(first) + j];
    }
    if (j <= first + 1) {
        v.y = root[AHRS_TRIANGLE(first + 1) + j];
    }
    if (j <= first + 2) {
        v.z = root[AHRS_TRIANGLE(first + 2) + j];
    }
    return ahrs_vec3_scale(v, k);
}

static void set_column(ahrs_real *rows, int32_t columns, int32_t j, ahrs_vec3 v) {
    rows[j] = v.x;
    rows[columns + j] = v.y;
    rows[2 * columns + j] = v.z;
}

/* Turning errors are kept where a rotation has a meaning; scaling rows of the root leaves it a root. */
static void limit_rotation(ahrs_real root[ROOT]) {
    ahrs_real sum = 0;
    for (int32_t i = 0; i < AHRS_TRIANGLE(ROTATION); i++) {
        sum += root[i] * root[i];
    }
    if (sum > ROTATION_VARIANCE_MAX) {
        const ahrs_real scale = ahrs_sqrt(ROTATION_VARIANCE_MAX / sum);
        for (int32_t i = 0; i < AHRS_TRIANGLE(ROTATION); i++) {
            root[i] *= scale;
        }
    }
}

/* Root of the covariance after the step; the rotation itself goes into q. False where it is lost. */
static bool predict(ahrs_ukf_state *s, const ahrs_ukf_params *p, const ahrs_sample *z, const weights *w, ahrs_quat *q) {
    const ahrs_real T = z->dt, half = ahrs_sqrt(AHRS_C(0.5) * w->point);
    const ahrs_vec3 rate = ahrs_vec3_sub(z->rate, ahrs_vec3_of(s->bias));
    const ahrs_quat turn = ahrs_quat_exp(ahrs_vec3_scale(rate, T)), back = ahrs_quat_conj(turn);
    ahrs_vec3 side[PAIRS][2], mean = {0, 0, 0};
    ahrs_real a[N * COLUMNS] = {0}, *const bias_rows = &a[ROTATION * COLUMNS];
    for (int32_t j = 0; j < PAIRS; j++) {
        for (int32_t k = 0; k < 2; k++) {
            const ahrs_real c = k == 0 ? w->distance : -w->distance;
            const ahrs_vec3 rotation = column(s->root, 0, j, c), bias = column(s->root, ROTATION, j, c);
            const ahrs_quat turned = ahrs_quat_exp(ahrs_vec3_scale(ahrs_vec3_sub(rate, bias), T));
            side[j][k] = ahrs_quat_log(ahrs_quat_mul(back, ahrs_quat_mul(ahrs_quat_exp(rotation), turned)));
            mean = ahrs_vec3_add_scaled(mean, w->point, side[j][k]);
        }
    }
    for (int32_t j = 0; j < PAIRS; j++) {
        const ahrs_vec3 sum = ahrs_vec3_add_scaled(ahrs_vec3_add(side[j][0], side[j][1]), w->about_mean ? -2 : 0, mean);
        set_column(a, COLUMNS, j, ahrs_vec3_scale(ahrs_vec3_sub(side[j][0], side[j][1]), half));
        set_column(a, COLUMNS, j + PAIRS, ahrs_vec3_scale(sum, half));
        set_column(bias_rows, COLUMNS, j, column(s->root, ROTATION, j, 1));
    }
    const ahrs_real walk = p->gyro_bias_noise * p->gyro_bias_noise;
    const ahrs_real turning = ahrs_sqrt(ahrs_turn_variance(&s->common, z, p->gyro_noise) + T * T * T * walk / 3);
    const ahrs_real cross = AHRS_C(-0.5) * T * T * walk / turning;
    const ahrs_real alone = ahrs_sqrt(ahrs_max(T * walk - cross * cross, 0));
    for (int32_t i = 0; i < ROTATION; i++) {
        a[i * COLUMNS + 2 * PAIRS + i] = turning;
        bias_rows[i * COLUMNS + 2 * PAIRS + i] = cross;
        bias_rows[i * COLUMNS + 2 * PAIRS + ROTATION + i] = alone;
    }
    *q = ahrs_quat_mul(*q, ahrs_quat_mul(turn, ahrs_quat_exp(mean)));
    if (!ahrs_triangle_of(N, COLUMNS, a, s->root)) {
        return false;
    }
    const ahrs_real own = ahrs_sqrt(ahrs_abs(w->own));
    ahrs_real x[N] = {own * mean.x, own * mean.y, own * mean.z};
    if (own > 0 && !ahrs_add_square(N, s->root, x, w->own < 0 ? -1 : 1)) {
        return false;
    }
    limit_rotation(s->root);
    return true;
}

static measurement measurement_of(const ahrs_ukf_state *s, const ahrs_ukf_params *p, const ahrs_sample *z) {
    measurement m = {.accel = z->accel_usable, .mag = z->mag_usable};
    if (m.accel) {
        const ahrs_real variance =
            ahrs_sample_variance(&p->common, p->accel_noise) + ahrs_motion_variance(&p->common, z, p->motion_noise);
        const ahrs_real unit = 1 / ahrs_sqrt(variance);
        m.gravity = unit * p->common.gravity;
        ahrs_vec3_to(m.measured, ahrs_vec3_scale(z->accel, unit));
        m.rows = 3;
    }
    if (m.mag) {
        const ahrs_real unit = 1 / ahrs_sqrt(ahrs_sample_variance(&p->common, p->mag_noise));
        m.north = unit * s->common.field[0];
        m.down = unit * s->common.field[1];
        ahrs_vec3_to(&m.measured[m.rows], ahrs_vec3_scale(z->mag, unit));
        m.rows += 3;
    }
    return m;
}

static void expected(const measurement *m, ahrs_quat q, ahrs_real out[Z]) {
    const ahrs_vec3 down = ahrs_quat_down(q);
    int32_t row = 0;
    if (m->accel) {
        ahrs_vec3_to(out, ahrs_vec3_scale(down, -m->gravity));
        row = 3;
    }
    if (m->mag) {
        ahrs_vec3_to(&out[row], ahrs_vec3_add_scaled(ahrs_vec3_scale(ahrs_quat_north(q), m->north), m->down, down));
    }
}

/* Correction of attitude, bias and root; false where the root is lost. Measurement and state are made triangular
 * together: what stands below the measurement's own root is the gain, and beside it is the root that is left. */
static bool correct(ahrs_ukf_state *s, const measurement *m, const weights *w, ahrs_quat *q, ahrs_vec3 *bias) {
    const int32_t rows = m->rows, columns = rows + 2 * PAIRS, all = rows + N;
    const ahrs_real half = ahrs_sqrt(AHRS_C(0.5) * w->point), own = ahrs_sqrt(ahrs_abs(w->own));
    ahrs_real a[(Z + N) * COLUMNS] = {0}, root[AHRS_TRIANGLE(Z + N)], x[Z + N] = {0};
    ahrs_real centre[Z], mean[Z] = {0}, side[PAIRS][2][Z], e[Z], change[N] = {0};
    expected(m, *q, centre);
    for (int32_t j = 0; j < PAIRS; j++) {
        for (int32_t k = 0; k < 2; k++) {
            expected(m, ahrs_quat_turn(*q, column(s->root, 0, j, k == 0 ? w->distance : -w->distance)), side[j][k]);
            for (int32_t i = 0; i < rows; i++) {
                side[j][k][i] -= centre[i];
                mean[i] += w->point * side[j][k][i];
            }
        }
    }
    for (int32_t i = 0; i < rows; i++) {
        ahrs_real *const row = &a[i * columns];
        row[i] = 1;
        for (int32_t j = 0; j < PAIRS; j++) {
            row[rows + j] = half * (side[j][0][i] + side[j][1][i] - (w->about_mean ? 2 * mean[i] : 0));
            row[rows + PAIRS + j] = half * (side[j][0][i] - side[j][1][i]);
        }
        x[i] = own * mean[i];
        e[i] = m->measured[i] - centre[i] - mean[i];
    }
    for (int32_t i = 0; i < N; i++) {
        for (int32_t j = 0; j <= i; j++) {
            a[(rows + i) * columns + rows + PAIRS + j] = ahrs_of(s->root, i, j);
        }
    }
    if (!ahrs_triangle_of(all, columns, a, root) ||
        (own > 0 && !ahrs_add_square(all, root, x, w->own < 0 ? -1 : 1))) {
        return false;
    }
    ahrs_solve_lower(rows, root, e);
    for (int32_t i = 0; i < N; i++) {
        const ahrs_real *const row = &root[AHRS_TRIANGLE(rows + i)];
        for (int32_t k = 0; k < rows; k++) {
            change[i] += row[k] * e[k];
        }
        for (int32_t j = 0; j <= i; j++) {
            *ahrs_at(s->root, i, j) = row[rows + j];
        }
    }
    *q = ahrs_quat_turn(*q, ahrs_vec3_of(change));
    *bias = ahrs_vec3_add(*bias, ahrs_vec3_of(&change[ROTATION]));
    return true;
}

void ahrs_ukf_init(ahrs_ukf_state *s, const ahrs_ukf_params *p) {
    ahrs_estimator_init(&s->common);
    ahrs_vec3_to(s->bias, (ahrs_vec3){0, 0, 0});
    start(s, p);
}

void ahrs_ukf_update(ahrs_ukf_state *s, const ahrs_ukf_params *p, const ahrs_ukf_inputs *u, ahrs_real dt) {
    ahrs_sample z;
    const ahrs_action action = ahrs_estimator_begin(&s->common, &p->common, u, dt, &z);
    if (action == AHRS_START) {
        ahrs_vec3_to(s->bias, (ahrs_vec3){0, 0, 0});
        start(s, p);
    }
    if (action == AHRS_WAIT || action == AHRS_START) {
        return;
    }
    const weights w = weights_of(p);
    ahrs_quat q = ahrs_quat_of(s->common.q);
    ahrs_vec3 bias = ahrs_vec3_of(s->bias);
    bool kept = predict(s, p, &z, &w, &q);
    const measurement m = measurement_of(s, p, &z);
    if (kept && z.gain_dt > 0 && m.rows > 0) {
        kept = correct(s, &m, &w, &q, &bias);
    }
    if (!kept) {
        start(s, p);
        s->common.conditions |= AHRS_COVARIANCE_RESET;
    }
    ahrs_vec3_to(s->bias, ahrs_vec3_limited(bias, p->bias_limit));
    ahrs_estimator_end(&s->common, &p->common, &z, ahrs_quat_refine(q));
}

void ahrs_ukf_outputs(const ahrs_ukf_state *s, const ahrs_ukf_params *p, ahrs_ukf_outputs_t *y) {
    const ahrs_real *const r = s->root;
    ahrs_estimator_outputs(&s->common, &p->common, ahrs_vec3_of(s->bias), &y->common);
    ahrs_vec3_to(y->attitude_std, (ahrs_vec3){r[0], ahrs_sqrt(r[1] * r[1] + r[2] * r[2]),
                                              ahrs_sqrt(r[3] * r[3] + r[4] * r[4] + r[5] * r[5])});
    y->covariance_reset = ahrs_condition(&s->common, AHRS_COVARIANCE_RESET);
}
