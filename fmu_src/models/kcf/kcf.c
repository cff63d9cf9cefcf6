/* Kalman-calibrated complementary filter (docs/accuracy.md). The level frame is z down with a free heading; the
 * magnetometer counts in the norm of its first sample. */
#include "ahrs_kcf.h"
#include "calibration_covariance.h"
#include "estimator.h"

#include <string.h>

/* Layout of x: bias, scale and misalignment of the gyroscope; then the magnetometer. */
enum { GYRO = 0, SCALE = 3, G = AHRS_CAL_GYRO, FIELD = G, IRON = FIELD + AHRS_CAL_IRON,
       LATENCY = FIELD + AHRS_CAL_LATENCY, N = 19 };

/* Width of the rows of cov, and of alt_cov, which has the states of the magnetometer only, without latency. */
enum { ROW = AHRS_CAL_ROW, ALT_ROW = AHRS_CAL_MAG, ALT_N = AHRS_CAL_LATENCY };

/* A row of the sensitivities: the twelve of bias and scale, and what the filter has already corrected. */
enum { SENS = G + 1 };

/* What the slow step under way has to do. */
enum { JOB_REST = 1, JOB_DRIFT = 2, JOB_MAG = 4, JOB_MAG_FIRST = 8 };

/* Flags that outlive a sample. */
enum { MAG_FRESH = 16, SEEN_FORCE = 32, SEEN_MAG = 64, REALIGN = 128, FIRST_KEPT = 256 };

enum { QUESTION_NEW, QUESTION_OPEN, QUESTION_ANSWERED };

/* What has become of the field: it is as it was; it does not fit, for a reason that turning will show; it is another
 * one, not known yet; it is another one, and known. */
enum { FIELD_CALM, FIELD_SUSPECT, FIELD_STRANGE, FIELD_OTHER };

/* The parts of the slow step. */
enum { PHASE_GYRO, PHASE_FIELD, PHASE_MAG, PHASE_ALTERNATIVE, PHASE_APPLY, PHASE_EVIDENCE, PHASES };

static const ahrs_real SQRT2 = AHRS_C(1.41421356237309504880);
static const ahrs_real HAND_TIME = AHRS_C(3.5), MULTIROTOR_TIME = AHRS_C(10.0); /* s */
static const ahrs_real BIAS_GROWTH = AHRS_C(0.0017453292519943296);             /* rad/s, in bias_forget_time */

/* Just below 1.5 s and 0.5 s, so that a whole number of samples counts alike in both precisions. */
static const ahrs_real REST_TIME = AHRS_C(1.4999), REST_START_TIME = AHRS_C(0.4999);
static const ahrs_real REST_FILTER_TIME = AHRS_C(0.5); /* s */
static const ahrs_real REST_GYRO = AHRS_C(0.03490658503988659);                 /* rad/s */
static const ahrs_real REST_ACCEL = AHRS_C(0.5);                                /* m/s2 */

static const ahrs_real IRON_VARIANCE_MAX = AHRS_C(4.0); /* of the field: nothing more is unknown than that */
static const ahrs_real IRON_MAX = AHRS_C(10.0), SCALE_MAX = AHRS_C(0.2), LATENCY_MAX = AHRS_C(0.1);
/* A swapped sign makes the correlation -1 of the power. Little rotation has to show it more clearly. */
static const ahrs_real SENSE_POWER = AHRS_C(0.5), SENSE_OPPOSED = AHRS_C(0.3);
static const ahrs_real SENSE_LEAST_POWER = AHRS_C(0.15), SENSE_CLEARLY = AHRS_C(0.7);
static const ahrs_real SENSE_GRAVITY = AHRS_C(0.85);
static const ahrs_real LAG_MAX = AHRS_C(0.3); /* rad */
static const ahrs_real MISFIT_MAX = AHRS_C(1e4);
/* Views of the field after which a misfit is no hard iron, and after which a field without misfit is known. */
static const ahrs_real VIEWS_REFUTE = AHRS_C(6.0), VIEWS_PROVE = AHRS_C(2.0);
static const ahrs_real OLD_FIELD_TIME = AHRS_C(2.0), OLD_FIELD_FITS = AHRS_C(1.5); /* s, mean squared misfit */
static const ahrs_real MAG_TIME_MAX = AHRS_C(0.2); /* s: rarer samples count as single ones */

/* Independent views of the field: per second at rest, one per angle in motion, at most so many per second. */
static const ahrs_real VIEWS_AT_REST = AHRS_C(0.02), VIEW_ANGLE = AHRS_C(0.5), VIEWS_MAX = AHRS_C(1.0);
static const ahrs_real SETTLED = AHRS_C(20.0); /* time constants: what is left of the first tilt error is 2e-9 */
static const ahrs_real RATE_BANDWIDTH = AHRS_C(10.0); /* rad/s: people and vehicles turn to and fro no faster */
static const ahrs_real LOST = AHRS_C(0.03); /* rad2: an attitude less certain than 10 deg begins anew */
static const ahrs_real TURNED = AHRS_C(6e-4); /* squared difference of rotation matrices: 1 deg */
static const ahrs_real EVIDENCE_DECIDES = AHRS_C(2980.9579870417283); /* odds of e^8 */

static ahrs_real tau_accel(const ahrs_kcf_params *p) {
    return p->profile == AHRS_KCF_PROFILE_HAND         ? HAND_TIME
           : p->profile == AHRS_KCF_PROFILE_MULTIROTOR ? MULTIROTOR_TIME
                                                       : p->accel_time_constant;
}

static ahrs_real square(ahrs_real a) { return a * a; }

/* Variance of state i. */
static ahrs_real *variance_of(ahrs_real *cov, int i) { return cov + (ROW + 1) * i; }

static void reset_covariance(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    memset(s->cov, 0, sizeof s->cov);
    for (int i = 0; i < 3; i++) {
        *variance_of(s->cov, FIELD + i) = 1;
        *variance_of(s->cov, IRON + i) = square(p->hard_iron_std);
        *variance_of(s->cov, GYRO + i) = square(p->bias_std);
        for (int j = 0; j < 3; j++) {
            *variance_of(s->cov, SCALE + 3 * i + j) = square(i == j ? p->gyro_scale_std : p->gyro_misalignment_std);
        }
    }
    *variance_of(s->cov, LATENCY) = square(p->mag_latency_std);
}

static void lose_covariance(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    reset_covariance(s, p);
    memset(s->dx, 0, sizeof s->dx);
    s->common.conditions |= AHRS_COVARIANCE_RESET;
}

static ahrs_vec3 iron(const ahrs_kcf_state *s) { return ahrs_vec3_of(&s->x[IRON]); }

static ahrs_vec3 gyro_error(const ahrs_kcf_state *s, ahrs_vec3 gyro) {
    const ahrs_real *S = &s->x[SCALE];
    return (ahrs_vec3){s->x[GYRO] + (S[0] * gyro.x + S[1] * gyro.y + S[2] * gyro.z),
                       s->x[GYRO + 1] + (S[3] * gyro.x + S[4] * gyro.y + S[5] * gyro.z),
                       s->x[GYRO + 2] + (S[6] * gyro.x + S[7] * gyro.y + S[8] * gyro.z)};
}

/* Rotation vector over one sample, to second order in the change of the rate: Bortz' equation between two means, or
 * between two momentary rates on a straight line. */
static ahrs_vec3 rotation(ahrs_kcf_state *s, const ahrs_kcf_params *p, ahrs_vec3 rate, ahrs_real T) {
    const ahrs_vec3 before = ahrs_vec3_of(s->rate);
    ahrs_vec3_to(s->rate, rate);
    if (!p->refine || !(T > 0)) {
        return ahrs_vec3_scale(rate, T);
    }
    const ahrs_vec3 coning = ahrs_vec3_scale(ahrs_vec3_cross(before, rate), T * T / 12);
    const bool instant = p->gyro_sampling == AHRS_KCF_GYRO_SAMPLING_INSTANT;
    const ahrs_vec3 mean = instant ? ahrs_vec3_scale(ahrs_vec3_add(before, rate), AHRS_C(0.5)) : rate;
    return ahrs_vec3_add_scaled(coning, T, mean);
}

/* Integrates the rate and the sums that the slow step needs. */
static void integrate(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_sample *z, ahrs_real turn_time) {
    const ahrs_real T = z->dt;
    const ahrs_vec3 g = z->rate, c = gyro_error(s, g), w = ahrs_vec3_sub(g, c);
    const ahrs_vec3 angle = rotation(s, p, w, turn_time);
    const ahrs_quat q = ahrs_quat_refine(ahrs_quat_mul(ahrs_quat_of(s->q_int), ahrs_quat_exp(angle)));
    ahrs_quat_to(s->q_int, q);
    ahrs_vec3_to(s->turn, ahrs_vec3_add(ahrs_vec3_of(s->turn), angle));

    const ahrs_mat3 R = ahrs_quat_to_mat3(q);
    for (int i = 0; i < 3; i++) {
        ahrs_real *sum = &s->sum_sens[SENS * i];
        const ahrs_real r[3] = {T * R.row[i].x, T * R.row[i].y, T * R.row[i].z};
        for (int j = 0; j < 3; j++) {
            sum[j] += r[j];
            sum[3 + 3 * j] += r[j] * g.x;
            sum[4 + 3 * j] += r[j] * g.y;
            sum[5 + 3 * j] += r[j] * g.z;
        }
        sum[G] += r[0] * c.x + r[1] * c.y + r[2] * c.z;
    }
    s->sum_rate2 += T * ahrs_vec3_norm2(w);
    s->block_time += T;
    if (z->accel_usable) {
        ahrs_vec3_to(s->sum_force, ahrs_vec3_add_scaled(ahrs_vec3_of(s->sum_force), -T, ahrs_mat3_apply(R, z->accel)));
        s->force_time += T;
    }
    s->mag_time += T;
    if (z->mag_usable) {
        ahrs_vec3_to(s->mag, z->mag);
        ahrs_quat_to(s->mag_q, q);
        ahrs_vec3_to(s->mag_rate, w);
        s->job |= MAG_FRESH;
    }
}

/* Coefficients of the second-order Butterworth low-pass by the bilinear rule, as two integrators, so that they may
 * change from sample to sample. */
static void set_rest_filter(ahrs_kcf_state *s, ahrs_real T) {
    ahrs_real sine, cosine;
    ahrs_sincos(T / (SQRT2 * REST_FILTER_TIME), &sine, &cosine);
    const ahrs_real g = sine / cosine;
    s->rest_gain[0] = 1 / (1 + g * (g + SQRT2));
    s->rest_gain[1] = g * s->rest_gain[0];
    s->rest_gain[2] = g * s->rest_gain[1];
    s->rest_step = T;
}

static void detect_rest(ahrs_kcf_state *s, const ahrs_sample *z) {
    if (!z->force_usable || s->blind > 0) {
        s->rest_time = 0;
        return;
    }
    const ahrs_real in[6] = {z->rate.x, z->rate.y, z->rate.z, z->force.x, z->force.y, z->force.z};
    ahrs_real deviation[6];
    const bool starting = s->rest_age < REST_START_TIME;
    if (starting) {
        s->rest_age += z->dt;
        s->rest_count += 1;
        for (int i = 0; i < 6; i++) {
            s->rest_two[i] += in[i];
            const ahrs_real mean = s->rest_two[i] / s->rest_count;
            deviation[i] = in[i] - mean;
            s->rest_one[i] = 0;
            if (!(s->rest_age < REST_START_TIME)) {
                s->rest_two[i] = mean;
            }
        }
    } else {
        if (z->dt != s->rest_step) {
            set_rest_filter(s, z->dt);
        }
        const ahrs_real a = s->rest_gain[0], b = s->rest_gain[1], c = s->rest_gain[2];
        for (int i = 0; i < 6; i++) {
            const ahrs_real one = s->rest_one[i], two = s->rest_two[i], ahead = in[i] - two;
            const ahrs_real v = a * one + b * ahead, low = two + b * one + c * ahead;
            s->rest_one[i] = 2 * v - one;
            s->rest_two[i] = 2 * low - two;
            deviation[i] = in[i] - low;
        }
    }
    const ahrs_vec3 gyro = ahrs_vec3_of(deviation), accel = ahrs_vec3_of(deviation + 3);
    const ahrs_vec3 low = ahrs_vec3_sub(z->rate, gyro);
    ahrs_vec3_to(s->rest_gyro, low);
    const bool quiet = ahrs_vec3_norm2(gyro) < REST_GYRO * REST_GYRO &&
                       ahrs_vec3_norm2(accel) < REST_ACCEL * REST_ACCEL && ahrs_abs(low.x) <= REST_GYRO &&
                       ahrs_abs(low.y) <= REST_GYRO && ahrs_abs(low.z) <= REST_GYRO;
    s->rest_time = quiet ? ahrs_min(s->rest_time + z->dt, 2 * REST_TIME) : 0;
}

static bool at_rest(const ahrs_kcf_state *s) { return s->rest_time >= REST_TIME; }

static void clear_block(ahrs_kcf_state *s) {
    memset(s->sum_force, 0, sizeof s->sum_force);
    memset(s->sum_sens, 0, sizeof s->sum_sens);
    memset(s->turn, 0, sizeof s->turn);
    s->sum_rate2 = 0;
    s->block_time = 0;
    s->force_time = 0;
}

/* Low-pass of second order whose time constant grows with the age of the average; without a measurement it coasts. */
typedef struct {
    ahrs_real T, pull, inverse; /* interval, gain on the difference, 1/denominator */
} low_pass;

static low_pass growing_low_pass(ahrs_real tau, ahrs_real age, ahrs_real T, bool measured) {
    const ahrs_real W = SQRT2 / ahrs_min(tau, ahrs_max(age, 2 * T));
    return (low_pass){T, measured ? T * W * W : 0, 1 / (1 + SQRT2 * W * T + W * W * T * T)};
}

/* Turns the level frame so that the low-passed force is its vertical; gives the tilt error before. */
static ahrs_vec3 level(ahrs_kcf_state *s, low_pass f) {
    const bool first = !(s->tilt_age > f.T);
    ahrs_vec3 force = ahrs_vec3_of(s->tilt_force), slope = ahrs_vec3_of(s->tilt_slope);
    if (f.pull > 0) {
        const ahrs_vec3 mean = ahrs_vec3_scale(ahrs_vec3_of(s->sum_force), 1 / s->force_time);
        force = first ? mean : force;
        slope = ahrs_vec3_add_scaled(slope, f.pull, ahrs_vec3_sub(mean, force));
    }
    slope = ahrs_vec3_scale(slope, f.inverse);
    force = ahrs_vec3_add_scaled(force, f.T, slope);
    ahrs_vec3_to(s->tilt_force, force);
    ahrs_vec3_to(s->tilt_slope, slope);

    const ahrs_quat q = ahrs_quat_of(s->q_tilt);
    const ahrs_vec3 turned = ahrs_quat_rotate(q, force);
    const ahrs_real norm = ahrs_vec3_norm(turned);
    if (!(norm > 0)) {
        return (ahrs_vec3){0, 0, 1};
    }
    /* The shortest turn that brings the force upright, not normalised. */
    const ahrs_real along = norm + turned.z;
    const ahrs_quat half_turn = {0, 1, 0, 0};
    const ahrs_quat step =
        along > AHRS_C(2e-12) * norm ? (ahrs_quat){along, turned.y, -turned.x, 0} : half_turn;
    ahrs_quat_to(s->q_tilt, ahrs_quat_unit(ahrs_quat_mul(step, q)));
    return ahrs_vec3_scale(turned, 1 / norm);
}

/* Takes the sensitivities into the level frame: its horizontal rows through the same low-pass as the force. */
static void follow_sensitivities(ahrs_kcf_state *s, low_pass f, ahrs_real inverse_time) {
    const ahrs_mat3 R = ahrs_quat_to_mat3(ahrs_quat_of(s->q_tilt));
    for (int i = 0; i < 2; i++) {
        const ahrs_vec3 mean = ahrs_vec3_scale(R.row[i], inverse_time);
        const ahrs_real *const sum = s->sum_sens;
        ahrs_real *const level = s->sens_level + SENS * i, *const slope = s->sens_slope + SENS * i;
        for (int k = 0; k < SENS; k++) {
            const ahrs_real in = mean.x * sum[k] + mean.y * sum[SENS + k] + mean.z * sum[2 * SENS + k];
            level[k] += f.T * (in - slope[k]);
            slope[k] = (slope[k] + f.pull * level[k]) * f.inverse;
        }
    }
    for (int k = 0; k < G; k++) {
        const ahrs_real *const sum = s->sum_sens + k;
        s->job_vertical[k] = R.row[2].x * sum[0] + R.row[2].y * sum[SENS] + R.row[2].z * sum[2 * SENS];
    }
}

static void face_north(ahrs_kcf_state *s) {
    const ahrs_quat heading = {s->heading[0], 0, 0, s->heading[1]};
    ahrs_quat_to(s->q_north, ahrs_quat_mul(heading, ahrs_quat_of(s->q_level)));
}

/* The averaged force lags behind the vertical by the drift since; what has been learned of the gyroscope meanwhile
 * tells how far (docs/accuracy.md). */
static void make_good_lag(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    ahrs_real lag[2];
    for (int i = 0; i < 2; i++) {
        const ahrs_real *const level = s->sens_level + SENS * i;
        const ahrs_real drift = ahrs_cal_dot(G, level, s->x + GYRO) - level[G];
        lag[i] = p->refine ? AHRS_C(-0.5) * ahrs_clamp(drift, -LAG_MAX, LAG_MAX) : 0;
    }
    const ahrs_quat turn = ahrs_quat_unit((ahrs_quat){1, lag[0], lag[1], 0});
    ahrs_quat_to(s->q_level, ahrs_quat_mul(turn, ahrs_quat_of(s->q_tilt)));
    face_north(s);
}

static ahrs_real drift_row(const ahrs_kcf_state *s, int i, ahrs_real tilt_rate) {
    const ahrs_real *const sens = s->sens_slope + SENS * i;
    return tilt_rate + sens[G] - ahrs_cal_dot(G, sens, s->x + GYRO);
}

/* Correlates the turn of what a sensor sees with the one the gyroscope predicts, axis by axis: a swapped sign turns
 * the correlation around (docs/accuracy.md). */
static void compare_senses(ahrs_real *sense, ahrs_real *power, ahrs_vec3 now, ahrs_vec3 before, ahrs_vec3 turn) {
    const ahrs_vec3 v = ahrs_vec3_scale(ahrs_vec3_add(now, before), AHRS_C(0.5));
    const ahrs_vec3 predicted[3] = {{0, turn.x * v.z, -turn.x * v.y}, {-turn.y * v.z, 0, turn.y * v.x},
                                    {turn.z * v.y, -turn.z * v.x, 0}};
    const ahrs_vec3 all = ahrs_vec3_add(ahrs_vec3_add(predicted[0], predicted[1]), predicted[2]);
    const ahrs_vec3 rest = ahrs_vec3_sub(ahrs_vec3_sub(now, before), all);
    for (int i = 0; i < 3; i++) {
        const ahrs_real norm2 = ahrs_vec3_norm2(predicted[i]);
        sense[i] += norm2 + ahrs_vec3_dot(predicted[i], rest);
        power[i] += norm2;
        /* An exponential window over the rotation itself: rest forgets nothing. */
        const ahrs_real kept = AHRS_C(10.0) / (AHRS_C(10.0) + norm2);
        sense[i] *= kept;
        power[i] *= kept;
    }
}

static void compare_all_senses(ahrs_kcf_state *s, const ahrs_sample *z, ahrs_real gravity) {
    const ahrs_vec3 turn = ahrs_vec3_of(s->turn);
    if (z->force_usable) {
        const ahrs_vec3 force = ahrs_vec3_scale(z->force, 1 / gravity);
        if (s->job & SEEN_FORCE) {
            compare_senses(s->sense, s->sense_power, force, ahrs_vec3_of(s->seen), turn);
        }
        ahrs_vec3_to(s->seen, force);
    }
    s->job = z->force_usable ? s->job | SEEN_FORCE : s->job & ~SEEN_FORCE;
    const bool mag = z->mag_usable && s->mag_scale > 0;
    if (mag) {
        const ahrs_vec3 field = ahrs_vec3_sub(ahrs_vec3_scale(z->mag, s->mag_scale), iron(s));
        if (s->job & SEEN_MAG) {
            compare_senses(s->sense + 3, s->sense_power + 3, field, ahrs_vec3_of(s->seen + 3), turn);
        }
        ahrs_vec3_to(s->seen + 3, field);
    }
    s->job = mag ? s->job | SEEN_MAG : s->job & ~SEEN_MAG;
}

static bool opposes(const ahrs_real *sense, const ahrs_real *power) {
    bool found = false;
    for (int i = 0; i < 3; i++) {
        const ahrs_real enough = power[i] > SENSE_POWER ? SENSE_OPPOSED : SENSE_CLEARLY;
        found = found || (power[i] > SENSE_LEAST_POWER && sense[i] < -enough * power[i]);
    }
    return found;
}

/* Field and gyroscope turn in opposite senses, or force and gyroscope do and the averaged force is no gravity either:
 * accelerations alone can oppose the rotation for a while, but they average out. */
static bool implausible(const ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    const ahrs_real least = SENSE_GRAVITY * p->common.gravity;
    return opposes(s->sense + 3, s->sense_power + 3) ||
           (opposes(s->sense, s->sense_power) && ahrs_vec3_norm2(ahrs_vec3_of(s->tilt_force)) < least * least);
}

static void begin_slow_step(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_sample *z) {
    const ahrs_real T = s->block_time, tau = tau_accel(p);
    const bool force = s->force_time > 0;
    s->tilt_age = force ? ahrs_min(s->tilt_age + T, 100 * tau) : s->tilt_age;
    const low_pass f = growing_low_pass(tau, s->tilt_age, T, force);
    const ahrs_vec3 e = level(s, f);
    follow_sensitivities(s, f, 1 / T);
    make_good_lag(s, p);

    s->job &= MAG_FRESH | SEEN_FORCE | SEEN_MAG | REALIGN;
    s->job_time = T;
    s->job_rate2 = s->sum_rate2 / T;
    if (at_rest(s)) {
        s->job |= JOB_REST;
        ahrs_vec3_to(s->job_drift, ahrs_vec3_sub(ahrs_vec3_of(s->rest_gyro), ahrs_vec3_of(&s->x[GYRO])));
    } else if (force) {
        s->job |= JOB_DRIFT;
        s->job_drift[0] = drift_row(s, 0, -e.y / T);
        s->job_drift[1] = drift_row(s, 1, e.x / T);
    }
    compare_all_senses(s, z, p->common.gravity);
    if ((s->job & MAG_FRESH) && p->use_mag) {
        const ahrs_vec3 m = ahrs_vec3_of(s->mag);
        s->job |= JOB_MAG;
        if (!(s->mag_scale > 0)) {
            s->mag_scale = 1 / ahrs_vec3_norm(m);
            s->job |= JOB_MAG_FIRST;
        }
        ahrs_vec3_to(s->job_mag, ahrs_vec3_scale(m, s->mag_scale));
        ahrs_quat_to(s->job_q, ahrs_quat_mul(ahrs_quat_of(s->q_level), ahrs_quat_of(s->mag_q)));
        memcpy(s->job_rate, s->mag_rate, sizeof s->job_rate);
        s->job_mag_time = ahrs_min(s->mag_time, ahrs_max(MAG_TIME_MAX, T));
        s->mag_time = 0;
    }
    s->job &= ~MAG_FRESH;
    memset(s->dx, 0, sizeof s->dx);
    clear_block(s);
    s->phase = 0;
}

/* Adds the variance of a turn of the level frame about its vertical; `block` are the rows and columns of the field. */
static void turn_field(ahrs_real *block, int width, const ahrs_real *field, ahrs_real variance) {
    const ahrs_real across = -variance * field[0] * field[1];
    block[0] += variance * field[1] * field[1];
    block[1] += across;
    block[width] += across;
    block[width + 1] += variance * field[0] * field[0];
}

/* Adds to three variances; `block` begins with the first. */
static void add_to_diagonal(ahrs_real *block, int width, ahrs_real variance) {
    for (int i = 0; i < 3; i++) {
        block[(width + 1) * i] += variance;
    }
}

/* The errors of the gyroscope turn the level frame, and with it the field in it: P := (I + u v') P (I + u v')' with
 * y = P v and a horizontal u, which v does not see. */
static void couple(ahrs_kcf_state *s, const ahrs_real u[2], const ahrs_real *y, ahrs_real variance) {
    for (int i = 0; i < 2; i++) {
        ahrs_real *const row = s->cov + ROW * (FIELD + i);
        for (int j = 0; j < N; j++) {
            row[j] += u[i] * y[j];
        }
        for (int j = 0; j < 2; j++) {
            row[FIELD + j] += u[j] * (y[FIELD + i] + u[i] * variance);
        }
    }
    for (int j = 0; j < N; j++) {
        ahrs_real *const field = s->cov + ROW * j + FIELD;
        field[0] = s->cov[ROW * FIELD + j];
        field[1] = s->cov[ROW * (FIELD + 1) + j];
    }
}

/* Variance of one slow step of a drift that a bias, which walks, shows to this accuracy. */
static ahrs_real drift_variance(const ahrs_kcf_params *p, ahrs_real accuracy, ahrs_real T) {
    const ahrs_real r = square(accuracy);
    return (r * r / (square(BIAS_GROWTH) / p->bias_forget_time) + r * T) / T;
}

/* Takes rows h of measurements with their products y; h is of `size`, from state `first` on. */
AHRS_INLINE bool take(ahrs_kcf_state *s, int rows, int first, int size, const ahrs_real *h, const ahrs_real *innovation,
                      ahrs_real variance, ahrs_real *y) {
    const bool sound = ahrs_cal_measure(rows, first, size, ROW, h, innovation, variance, y, s->dx);
    if (sound) {
        ahrs_cal_subtract(rows, N, ROW, y, s->cov);
    }
    return sound;
}

/* The same for two or three rows, compiled once for each; a covariance that has lost its meaning begins anew. */
static void learn(ahrs_kcf_state *s, const ahrs_kcf_params *p, int rows, int first, int size, const ahrs_real *h,
                  const ahrs_real *innovation, ahrs_real variance, ahrs_real *y) {
    const bool sound = rows == 2 ? take(s, 2, first, size, h, innovation, variance, y)
                                 : take(s, 3, first, size, h, innovation, variance, y);
    if (!sound) {
        lose_covariance(s, p);
    }
}

/* At rest the low-passed gyroscope shows its bias, all axes of it; in motion the drift of the tilt shows two rows. */
static void learn_gyro(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    static const ahrs_real AXES[3 * 4] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const ahrs_real T = s->job_time, growth = square(BIAS_GROWTH) / p->bias_forget_time * T;
    const bool drifts = s->job & JOB_DRIFT;
    const ahrs_real u[2] = {-s->x[FIELD + 1], s->x[FIELD]};
    ahrs_real innovation[3], h[3 * G], y[3 * ROW];
    for (int i = 0; i < 3; i++) {
        ahrs_real *const variance = variance_of(s->cov, GYRO + i);
        *variance += *variance < square(p->bias_std) ? growth : 0;
        innovation[i] = ahrs_clamp(s->job_drift[i], -p->bias_limit, p->bias_limit);
    }
    memcpy(h, s->job_vertical, G * sizeof *h);
    if (drifts) {
        memcpy(h + G, s->sens_slope, G * sizeof *h);
        memcpy(h + 2 * G, s->sens_slope + SENS, G * sizeof *h);
        ahrs_cal_gyro_products(3, s->cov, h, y);
        for (int r = 1; r < 3; r++) {
            const ahrs_real along = ahrs_cal_dot(G, h + G * r, y);
            y[ROW * r + FIELD] += u[0] * along;
            y[ROW * r + FIELD + 1] += u[1] * along;
        }
    } else {
        ahrs_cal_gyro_products(1, s->cov, h, y);
    }
    couple(s, u, y, ahrs_cal_dot(G, h, y));
    if (s->job & JOB_REST) {
        memcpy(y, s->cov, 3 * ROW * sizeof *y);
        learn(s, p, 3, GYRO, 4, AXES, innovation, drift_variance(p, p->rest_drift_std, T), y);
    } else if (drifts) {
        const ahrs_real young = ahrs_max(1, square(tau_accel(p) / s->tilt_age));
        learn(s, p, 2, GYRO, G, h + G, innovation, drift_variance(p, p->motion_drift_std, T) * young, y + ROW);
    }
}

/* The sample as it would read without hard iron and latency, in the level frame. */
static ahrs_vec3 level_field(const ahrs_kcf_state *s, const ahrs_mat3 *R, ahrs_vec3 hard_iron) {
    const ahrs_real lag = s->x[LATENCY];
    const ahrs_vec3 w = ahrs_vec3_of(s->job_rate), m = ahrs_vec3_sub(ahrs_vec3_of(s->job_mag), hard_iron);
    const ahrs_vec3 first = ahrs_vec3_cross(w, m), second = ahrs_vec3_cross(w, first);
    const ahrs_vec3 then = ahrs_vec3_add_scaled(m, -lag, first);
    return ahrs_mat3_apply(*R, ahrs_vec3_add_scaled(then, AHRS_C(0.5) * lag * lag, second));
}

/* Mean squared misfit over jump_time, and the variance that it has in excess of the expected one. */
static ahrs_real excess_of(const ahrs_kcf_params *p, ahrs_real *misfit, ahrs_real ratio, ahrs_real expected,
                           ahrs_real T) {
    *misfit += ahrs_min(T / p->jump_time, 1) * (ahrs_min(ratio, MISFIT_MAX) - *misfit);
    return ahrs_min(expected * ahrs_max(0, *misfit - p->jump_threshold), 1);
}

/* Changes of the field that no hard iron explains count for both hypotheses. */
static void change_alternative(ahrs_kcf_state *s, const ahrs_kcf_params *p, ahrs_real ratio) {
    const ahrs_real T = s->job_mag_time, excess = excess_of(p, &s->alt_misfit, ratio, s->job_noise[0], T);
    const ahrs_real jump = (square(p->hard_iron_walk) + p->jump_hard_iron * excess) * T;
    add_to_diagonal(s->alt_cov, ALT_ROW, p->jump_field * excess * T);
    add_to_diagonal(s->alt_cov + (ALT_ROW + 1) * AHRS_CAL_IRON, ALT_ROW, jump);
    s->alt_jump += jump;
}

/* Squared difference of two rotation matrices, summed: how differently they show a vector fixed in the body. */
static ahrs_real rotation_difference(const ahrs_real q[4], const ahrs_real r[4]) {
    const ahrs_real c = ahrs_quat_dot(ahrs_quat_of(q), ahrs_quat_of(r));
    return 8 * ahrs_max(1 - c * c, 0);
}

/* Turns the field in the level frame to where it is seen now: the heading had been lost. */
static void align(ahrs_real *field, ahrs_vec3 seen) {
    const ahrs_real have2 = field[0] * field[0] + field[1] * field[1], want2 = seen.x * seen.x + seen.y * seen.y;
    if (want2 > 0) {
        const ahrs_real k = ahrs_sqrt(have2 / want2);
        field[0] = k * seen.x;
        field[1] = k * seen.y;
    }
}

/* Makes three states independent of all others, with a variance of their own. */
static void make_independent(ahrs_kcf_state *s, int first, ahrs_real variance) {
    for (int i = first; i < first + 3; i++) {
        for (int j = 0; j < N; j++) {
            s->cov[ROW * i + j] = 0;
            s->cov[ROW * j + i] = 0;
        }
        *variance_of(s->cov, i) = variance;
    }
}

/* Takes field and hard iron from before a change, or the field that is seen. */
static void renew_field(ahrs_kcf_state *s, const ahrs_kcf_params *p, ahrs_vec3 field, ahrs_real variance,
                        int32_t change) {
    ahrs_vec3_to(s->x + FIELD, field);
    memcpy(s->x + IRON, s->calm_iron, sizeof s->calm_iron);
    make_independent(s, FIELD, variance);
    make_independent(s, IRON, square(p->hard_iron_std));
    s->misfit = 1;
    s->excess = 0;
    s->old_misfit = MISFIT_MAX;
    s->change_views = 0;
    s->fit_views = 0;
    s->change = change;
}

/* Angle, as cosine and sine, from the other field to where the old one would be. */
static void note_north(ahrs_kcf_state *s) {
    const ahrs_real *a = s->x + FIELD, *b = s->calm_field;
    const ahrs_real scale = 1 / ahrs_sqrt((a[0] * a[0] + a[1] * a[1]) * (b[0] * b[0] + b[1] * b[1]));
    s->north_angle[0] = scale * (a[0] * b[0] + a[1] * b[1]);
    s->north_angle[1] = scale * (a[0] * b[1] - a[1] * b[0]);
}

/* The old field, at that angle from the other one as it is known now. */
static void follow_north(ahrs_kcf_state *s) {
    const ahrs_real *a = s->x + FIELD, *turn = s->north_angle;
    const ahrs_vec3 seen = {turn[0] * a[0] - turn[1] * a[1], turn[1] * a[0] + turn[0] * a[1], 0};
    align(s->calm_field, seen);
}

/* Whether the old field is back. */
static bool is_back(ahrs_kcf_state *s, const ahrs_mat3 *R, ahrs_real expected) {
    const ahrs_vec3 off = ahrs_vec3_sub(level_field(s, R, ahrs_vec3_of(s->calm_iron)), ahrs_vec3_of(s->calm_field));
    const ahrs_real ratio = ahrs_min(ahrs_vec3_norm2(off) / (3 * expected), MISFIT_MAX);
    const ahrs_real weight = s->old_misfit < MISFIT_MAX ? ahrs_min(s->job_mag_time / OLD_FIELD_TIME, 1) : 1;
    s->old_misfit += weight * (ratio - s->old_misfit);
    return s->old_misfit < OLD_FIELD_FITS;
}

/* Whether the hard iron is as certain as a calibration would leave it. */
static bool knows_iron(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    bool known = true;
    for (int i = IRON; i < IRON + 3; i++) {
        known = known && *variance_of(s->cov, i) < square(p->hard_iron_std);
    }
    return known;
}

/* Tells a change of the field from one of the hard iron. What has fitted through enough views is trusted: turning
 * makes a hard iron fit, and never a field. Until the old field is back, north is kept by the gyroscope, and by the
 * other field once that is known. */
static void judge_field(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_mat3 *R, ahrs_real expected) {
    const bool misfit = s->misfit > p->jump_threshold, fits = s->misfit < AHRS_C(0.5) * p->jump_threshold;
    const ahrs_real views = s->job_mag_time * ahrs_min(VIEWS_MAX, ahrs_sqrt(s->job_rate2) / VIEW_ANGLE);
    s->change_views += misfit ? views : 0;
    s->fit_views = fits ? s->fit_views + views : 0;
    if (s->change == FIELD_CALM && !misfit) {
        s->iron_known = knows_iron(s, p) && (s->iron_known || s->fit_views > VIEWS_REFUTE);
    }
    if (s->question == QUESTION_OPEN || !p->refine || (s->change == FIELD_CALM && !(misfit && s->iron_known))) {
        memcpy(s->calm_field, s->x + FIELD, sizeof s->calm_field);
        memcpy(s->calm_iron, s->x + IRON, sizeof s->calm_iron);
        s->change_views = 0;
        s->change = FIELD_CALM;
    } else if (s->change <= FIELD_SUSPECT) {
        s->change = s->fit_views > VIEWS_PROVE ? FIELD_CALM : FIELD_SUSPECT;
        if (s->change_views > VIEWS_REFUTE) {
            renew_field(s, p, level_field(s, R, ahrs_vec3_of(s->calm_iron)), 1, FIELD_STRANGE);
        }
    } else if (is_back(s, R, expected)) {
        renew_field(s, p, ahrs_vec3_of(s->calm_field), square(p->mag_noise), FIELD_CALM);
    } else if (misfit) {
        s->change = FIELD_STRANGE;
    } else if (s->change == FIELD_OTHER) {
        follow_north(s);
    } else if (s->fit_views > VIEWS_PROVE) {
        note_north(s);
        s->change = FIELD_OTHER;
    }
}

/* Innovation of the magnetometer, its noise, and how far field and hard iron may have changed with it. */
static void expect_field(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    const ahrs_real T = s->job_mag_time;
    const ahrs_mat3 R = ahrs_quat_to_mat3(ahrs_quat_of(s->job_q));
    const ahrs_vec3 field = level_field(s, &R, iron(s));
    if (s->job & JOB_MAG_FIRST) {
        ahrs_vec3_to(s->x + FIELD, field);
    }
    if (s->job & REALIGN) {
        align(s->x + FIELD, field);
        align(s->alt_x, level_field(s, &R, ahrs_vec3_of(s->alt_x + AHRS_CAL_IRON)));
        s->job &= ~REALIGN;
        s->change = FIELD_CALM;
    }
    const ahrs_real rate2 = ahrs_vec3_norm2(ahrs_vec3_of(s->job_rate)), age = s->tilt_age / tau_accel(p);
    const ahrs_real settling = age < SETTLED ? square(p->mag_tilt_noise) * ahrs_exp_decay(age) : 0;
    const ahrs_real expected = square(p->mag_noise) + square(p->mag_rate_noise) * rate2 + settling;
    judge_field(s, p, &R, expected);
    const ahrs_vec3 nu = ahrs_vec3_sub(level_field(s, &R, iron(s)), ahrs_vec3_of(s->x + FIELD));
    ahrs_vec3_to(s->job_nu, nu);
    const ahrs_real misfit2 = ahrs_vec3_norm2(nu) / 3, ratio = misfit2 / expected;
    const ahrs_real excess = excess_of(p, &s->misfit, ratio, expected, T);
    s->job_noise[0] = expected;
    s->job_noise[1] = square(p->mag_density) / T * expected / square(p->mag_noise) *
                      (1 + p->outlier_weight * ahrs_max(0, ratio - 1));
    for (int i = IRON; i < IRON + 3; i++) {
        ahrs_real *const variance = variance_of(s->cov, i);
        *variance += *variance < IRON_VARIANCE_MAX ? (square(p->hard_iron_walk) + p->jump_hard_iron * excess) * T : 0;
    }
    add_to_diagonal(variance_of(s->cov, FIELD), ROW, p->jump_field * s->excess * T);
    s->excess = excess;
    if (s->question == QUESTION_OPEN) {
        const ahrs_real unexplained = square(p->uncalibrated_std) * rotation_difference(s->job_q, s->alt_q) / 3;
        change_alternative(s, p, misfit2 / (expected + unexplained));
    }
}

static void follow_field(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    const ahrs_real T = s->job_time;
    const ahrs_real heading = (square(p->heading_walk) + square(p->heading_rate_walk) * s->job_rate2) * T;
    const ahrs_real field = square(p->field_walk) * T;
    add_to_diagonal(variance_of(s->cov, FIELD), ROW, field);
    turn_field(variance_of(s->cov, FIELD), ROW, s->x + FIELD, heading);
    if (s->question == QUESTION_OPEN) {
        add_to_diagonal(s->alt_cov, ALT_ROW, field);
        turn_field(s->alt_cov, ALT_ROW, s->alt_x, heading);
    }
    if (s->job & JOB_MAG) {
        expect_field(s, p);
    }
}

static void learn_mag(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    if (!(s->job & JOB_MAG) || (s->job & JOB_MAG_FIRST)) {
        return;
    }
    const ahrs_mat3 R = ahrs_quat_to_mat3(ahrs_quat_of(s->job_q));
    const ahrs_vec3 m = ahrs_vec3_sub(ahrs_vec3_of(s->job_mag), iron(s));
    ahrs_real h[3 * AHRS_CAL_MAG], y[3 * ROW];
    ahrs_cal_mag_rows(&R, ahrs_mat3_apply(R, ahrs_vec3_cross(ahrs_vec3_of(s->job_rate), m)), h);
    ahrs_cal_mag_products(ROW, true, s->cov + ROW * FIELD, h, y);
    learn(s, p, 3, FIELD, AHRS_CAL_MAG, h, s->job_nu, s->job_noise[1], y);
}

static void ask(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    const ahrs_real variance = square(p->uncalibrated_std);
    const ahrs_mat3 R = ahrs_quat_to_mat3(ahrs_quat_of(s->job_q));
    memset(s->alt_x, 0, sizeof s->alt_x);
    memset(s->alt_cov, 0, sizeof s->alt_cov);
    memcpy(s->alt_x, s->x + FIELD, 3 * sizeof(ahrs_real));
    memcpy(s->alt_q, s->job_q, sizeof s->alt_q);
    for (int i = 0; i < 3; i++) {
        ahrs_real *const field = s->alt_cov + ALT_ROW * i;
        field[i] = variance + s->job_noise[0];
        ahrs_vec3_to(field + AHRS_CAL_IRON, ahrs_vec3_scale(R.row[i], -variance));
        for (int j = 0; j < 3; j++) {
            ahrs_real *const iron_row = s->alt_cov + ALT_ROW * (AHRS_CAL_IRON + j);
            iron_row[i] = field[AHRS_CAL_IRON + j];
            iron_row[AHRS_CAL_IRON + j] = variance;
        }
    }
    s->alt_misfit = 1;
    s->alt_jump = 0;
    s->question = QUESTION_OPEN;
}

/* The same magnetometer sample for the hypothesis; slowly varying disturbances count once per view of the field. */
static void learn_alternative(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    if (s->question != QUESTION_OPEN || !(s->job & JOB_MAG)) {
        return;
    }
    const ahrs_mat3 R = ahrs_quat_to_mat3(ahrs_quat_of(s->job_q));
    const ahrs_vec3 field = level_field(s, &R, ahrs_vec3_of(s->alt_x + AHRS_CAL_IRON));
    ahrs_real nu[3], h[3 * AHRS_CAL_MAG], y[3 * ALT_ROW], dx[ALT_ROW] = {0}, trace = 0;
    ahrs_vec3_to(nu, ahrs_vec3_sub(field, ahrs_vec3_of(s->alt_x)));
    ahrs_cal_mag_rows(&R, (ahrs_vec3){0, 0, 0}, h);
    ahrs_cal_mag_products(ALT_ROW, false, s->alt_cov, h, y);
    for (int i = 0; i < 3; i++) {
        trace += ahrs_cal_dot(ALT_ROW, h + AHRS_CAL_MAG * i, y + ALT_ROW * i);
    }
    const ahrs_real expected = s->job_noise[0];
    const ahrs_real ratio = (nu[0] * nu[0] + nu[1] * nu[1] + nu[2] * nu[2]) / (3 * expected + trace);
    const ahrs_real views = ahrs_min(VIEWS_MAX, ahrs_sqrt(s->job_rate2) / VIEW_ANGLE + VIEWS_AT_REST);
    const ahrs_real variance =
        expected / (s->job_mag_time * views) * (1 + p->outlier_weight * ahrs_max(0, ratio - 1));
    if (!ahrs_cal_measure(3, 0, ALT_ROW, ALT_ROW, h, nu, variance, y, dx)) {
        s->question = QUESTION_ANSWERED;
        return;
    }
    ahrs_cal_subtract(3, ALT_N, ALT_ROW, y, s->alt_cov);
    for (int k = 0; k < ALT_N; k++) {
        s->alt_x[k] += dx[k];
    }
}

/* Inverse of a symmetric 3 x 3 matrix and its determinant. */
static ahrs_real invert(ahrs_mat3 a, ahrs_mat3 *inverse) {
    const ahrs_vec3 x = ahrs_vec3_cross(a.row[1], a.row[2]);
    const ahrs_real determinant = ahrs_vec3_dot(a.row[0], x), k = 1 / determinant;
    *inverse = (ahrs_mat3){{ahrs_vec3_scale(x, k), ahrs_vec3_scale(ahrs_vec3_cross(a.row[2], a.row[0]), k),
                            ahrs_vec3_scale(ahrs_vec3_cross(a.row[0], a.row[1]), k)}};
    return determinant;
}

/* Odds of the hypothesis: both give the hard iron a Gaussian prior, of different width, and saw the same samples; the
 * ratio of their marginal likelihoods follows from the posterior of one (docs/accuracy.md). */
static ahrs_real odds_of(const ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    const ahrs_real narrow = square(p->hard_iron_std) + s->alt_jump, wide = square(p->uncalibrated_std) + s->alt_jump;
    ahrs_mat3 posterior;
    for (int i = 0; i < 3; i++) {
        posterior.row[i] = ahrs_vec3_of(s->alt_cov + ALT_ROW * (AHRS_CAL_IRON + i) + AHRS_CAL_IRON);
    }
    const ahrs_vec3 b = ahrs_vec3_of(s->alt_x + AHRS_CAL_IRON);
    const ahrs_real more = 1 / narrow - 1 / wide;
    ahrs_mat3 information, other;
    const ahrs_real posterior_det = invert(posterior, &information);
    const ahrs_vec3 weighted = ahrs_mat3_apply(information, b);
    information.row[0].x += more;
    information.row[1].y += more;
    information.row[2].z += more;
    const ahrs_real information_det = invert(information, &other);
    const ahrs_real shift = ahrs_vec3_dot(weighted, ahrs_vec3_sub(b, ahrs_mat3_apply(other, weighted)));
    const ahrs_real r = narrow / wide;
    const ahrs_real widths = ahrs_sqrt(ahrs_max(information_det * posterior_det * r * r * r, 0));
    return p->uncalibrated_odds * widths / ahrs_exp_decay(ahrs_clamp(AHRS_C(0.5) * shift, 0, 40));
}

static void adopt(ahrs_kcf_state *s) {
    memcpy(s->x + FIELD, s->alt_x, sizeof s->alt_x);
    make_independent(s, FIELD, 1);
    make_independent(s, IRON, 1);
    for (int i = 0; i < ALT_N; i++) {
        memcpy(variance_of(s->cov, FIELD) + ROW * i, s->alt_cov + ALT_ROW * i, ALT_N * sizeof(ahrs_real));
    }
    s->misfit = 1;
}

static void weigh_evidence(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    if (s->question == QUESTION_NEW && (s->job & JOB_MAG_FIRST)) {
        if (p->uncalibrated_odds > 0) {
            ask(s, p);
        } else {
            s->question = QUESTION_ANSWERED;
        }
    }
    if (s->question != QUESTION_OPEN) {
        s->alt_probability = 0;
        return;
    }
    const ahrs_real odds = odds_of(s, p);
    ahrs_real largest = 0;
    for (int i = AHRS_CAL_IRON; i < ALT_N; i++) {
        largest = ahrs_max(largest, s->alt_cov[(ALT_ROW + 1) * i]);
    }
    const bool converged = largest < square(p->hard_iron_std);
    s->alt_probability = odds / (1 + odds);
    if (!ahrs_is_finite(odds) || odds * EVIDENCE_DECIDES < 1 || (converged && odds < 1)) {
        s->question = QUESTION_ANSWERED;
    } else if (odds > EVIDENCE_DECIDES || converged) {
        s->question = QUESTION_ANSWERED;
        adopt(s);
    }
}

static void clamp_all(ahrs_real *x, int n, ahrs_real limit) {
    for (int i = 0; i < n; i++) {
        x[i] = ahrs_clamp(x[i], -limit, limit);
    }
}

/* Half the angle that turns the horizontal field north. */
static void find_north(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    /* Before the body has turned, the hypotheses differ in nothing but the noise of their first samples. */
    const bool same = p->refine && rotation_difference(s->job_q, s->alt_q) < TURNED;
    const ahrs_real other = s->question == QUESTION_OPEN && !same ? s->alt_probability : 0;
    const ahrs_real *const field = s->change >= FIELD_STRANGE ? s->calm_field : s->x + FIELD;
    const ahrs_real x = (1 - other) * field[0] + other * s->alt_x[0];
    const ahrs_real y = (1 - other) * field[1] + other * s->alt_x[1];
    const ahrs_real norm = ahrs_sqrt(x * x + y * y);
    if (!(norm > 0)) {
        return;
    }
    const ahrs_real cosine = x / norm, sine = -y / norm;
    if (cosine > 0) {
        s->heading[0] = ahrs_sqrt(AHRS_C(0.5) * (1 + cosine));
        s->heading[1] = AHRS_C(0.5) * sine / s->heading[0];
    } else {
        const ahrs_real half = ahrs_sqrt(AHRS_C(0.5) * (1 - cosine));
        s->heading[1] = sine < 0 ? -half : half;
        s->heading[0] = AHRS_C(0.5) * sine / s->heading[1];
    }
    face_north(s);
}

static void apply(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    bool sound = true;
    for (int i = 0; i < N; i++) {
        const ahrs_real variance = *variance_of(s->cov, i);
        sound = sound && ahrs_is_finite(s->dx[i]) && variance >= 0 && ahrs_is_finite(variance);
    }
    if (!sound) {
        lose_covariance(s, p);
    }
    for (int i = 0; i < N; i++) {
        s->x[i] += s->dx[i];
    }
    clamp_all(s->x + IRON, 3, IRON_MAX);
    clamp_all(s->x + LATENCY, 1, LATENCY_MAX);
    clamp_all(s->x + GYRO, 3, p->bias_limit);
    clamp_all(s->x + SCALE, 9, SCALE_MAX);
}

static void conclude(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    weigh_evidence(s, p);
    if (s->job & JOB_MAG) {
        find_north(s, p);
    }
}

static void run_phase(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    switch (s->phase++) {
    case PHASE_GYRO: learn_gyro(s, p); break;
    case PHASE_FIELD: follow_field(s, p); break;
    case PHASE_MAG: learn_mag(s, p); break;
    case PHASE_ALTERNATIVE: learn_alternative(s, p); break;
    case PHASE_APPLY: apply(s, p); break;
    default: conclude(s, p); break;
    }
}

static void run_phases(ahrs_kcf_state *s, const ahrs_kcf_params *p, int32_t until) {
    while (s->phase < until) {
        run_phase(s, p);
    }
}

/* The rotation since is not known: the average of the force begins anew, the field is sought where it is now. */
static void restart_tilt(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    run_phases(s, p, PHASES);
    clear_block(s);
    memset(s->tilt_slope, 0, sizeof s->tilt_slope);
    memset(s->sens_level, 0, sizeof s->sens_level);
    memset(s->sens_slope, 0, sizeof s->sens_slope);
    memset(s->rest_one, 0, sizeof s->rest_one);
    memset(s->rest_two, 0, sizeof s->rest_two);
    s->job = REALIGN;
    s->tilt_age = 0;
    s->rest_age = 0;
    s->rest_count = 0;
    s->rest_time = 0;
}

/* Turns the attitude by what a held rate has missed if the rate has gone straight to where it is now. */
static void make_good_hold(ahrs_kcf_state *s, ahrs_vec3 rate) {
    const ahrs_vec3 change = ahrs_vec3_sub(rate, ahrs_vec3_of(s->rate));
    const ahrs_vec3 missed = ahrs_vec3_scale(change, AHRS_C(0.5) * s->blind);
    ahrs_quat_to(s->q_int, ahrs_quat_unit(ahrs_quat_mul(ahrs_quat_of(s->q_int), ahrs_quat_exp(missed))));
    ahrs_vec3_to(s->turn, ahrs_vec3_add(ahrs_vec3_of(s->turn), missed));
}

/* What a time without a rate costs: certainty of the heading, or the attitude. A rate that swings at RATE_BANDWIDTH is
 * off a straight line by its second derivative, which over a time T turns by rate bandwidth^2 T^3 / 12. */
static void account_for_blindness(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_sample *z) {
    const ahrs_vec3 rate = ahrs_vec3_sub(z->rate, gyro_error(s, z->rate));
    const ahrs_real T = s->blind, rate2 = ahrs_max(s->job_rate2, ahrs_vec3_norm2(rate));
    const ahrs_real lost = rate2 * square(square(RATE_BANDWIDTH) * T * T * T / 12);
    const bool all = ahrs_max(T, z->dt) > AHRS_LONGEST_STEP || lost > LOST;
    if (all) {
        restart_tilt(s, p);
    } else {
        make_good_hold(s, rate);
    }
    turn_field(variance_of(s->cov, FIELD), ROW, s->x + FIELD, all ? 1 : lost);
    turn_field(s->alt_cov, ALT_ROW, s->alt_x, all ? 1 : lost);
}

/* The first sample is kept until the second tells the interval it stands for. */
static void start(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_sample *z) {
    const ahrs_estimator_state common = s->common;
    ahrs_kcf_init(s, p);
    s->common = common;
    memcpy(s->q_tilt, common.q, sizeof s->q_tilt);
    memcpy(s->q_level, common.q, sizeof s->q_level);
    face_north(s);
    if (p->common.initialisation == AHRS_INITIALISATION_GIVEN) {
        const ahrs_vec3 down = ahrs_quat_down(ahrs_quat_of(common.q));
        ahrs_vec3_to(s->tilt_force, ahrs_vec3_scale(down, p->common.gravity));
        s->tilt_age = tau_accel(p);
    }
    ahrs_vec3_to(s->rate, z->rate);
    ahrs_vec3_to(s->seen, z->force);
    ahrs_vec3_to(s->mag, z->mag);
    s->job = FIRST_KEPT | (z->force_usable ? SEEN_FORCE : 0) | (z->mag_usable ? MAG_FRESH : 0);
}

static ahrs_sample take_first(ahrs_kcf_state *s, ahrs_real dt) {
    const bool force = s->job & SEEN_FORCE, mag = s->job & MAG_FRESH;
    s->job = 0;
    return (ahrs_sample){.rate = ahrs_vec3_of(s->rate), .force = ahrs_vec3_of(s->seen), .accel = ahrs_vec3_of(s->seen),
                         .mag = ahrs_vec3_of(s->mag), .force_usable = force, .accel_usable = force,
                         .mag_usable = mag, .dt = dt, .gain_dt = dt};
}

/* Takes over a heading that the common state has turned. */
static void turn_heading(ahrs_kcf_state *s) {
    const ahrs_quat level_attitude = ahrs_quat_mul(ahrs_quat_of(s->q_level), ahrs_quat_of(s->q_int));
    const ahrs_quat d = ahrs_quat_mul(ahrs_quat_of(s->common.q), ahrs_quat_conj(level_attitude));
    const ahrs_real norm2 = d.w * d.w + d.z * d.z;
    if (norm2 > 0) {
        const ahrs_real k = 1 / ahrs_sqrt(norm2);
        s->heading[0] = k * d.w;
        s->heading[1] = k * d.z;
        face_north(s);
    }
}

static bool disturbed(const ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    return s->misfit > p->jump_threshold || s->change >= FIELD_STRANGE;
}

static void step(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_sample *z, ahrs_real turn_time) {
    integrate(s, p, z, turn_time);
    detect_rest(s, z);
    /* Half a sample, and not quite, so that both precisions round a slow period alike. */
    const ahrs_real half_step = AHRS_C(0.499) * z->dt;
    if (s->block_time + half_step >= p->slow_period) {
        run_phases(s, p, PHASES);
        begin_slow_step(s, p, z);
    }
    const ahrs_real done = p->spread ? ahrs_min((s->block_time + half_step) / p->slow_period, 1) : 1;
    run_phases(s, p, (int32_t)((ahrs_real)PHASES * done));
    ahrs_set_condition(&s->common, AHRS_MAG_DISTURBED, disturbed(s, p));
    ahrs_set_condition(&s->common, AHRS_IMPLAUSIBLE, implausible(s, p));
}

void ahrs_kcf_init(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    *s = (ahrs_kcf_state){.q_int = {1}, .q_tilt = {1}, .q_level = {1}, .q_north = {1}, .heading = {1}};
    s->phase = PHASES;
    s->misfit = 1;
    reset_covariance(s, p);
    ahrs_estimator_init(&s->common);
}

void ahrs_kcf_update(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_kcf_inputs *u, ahrs_real dt) {
    ahrs_sample z;
    switch (ahrs_estimator_begin(&s->common, &p->common, u, dt, &z)) {
    case AHRS_WAIT:
        return;
    case AHRS_START:
        start(s, p, &z);
        return;
    case AHRS_TURN:
        turn_heading(s);
        break;
    case AHRS_RUN:
        break;
    }
    if (s->job & FIRST_KEPT) {
        const ahrs_sample first = take_first(s, ahrs_min(z.dt, p->slow_period));
        step(s, p, &first, 0);
    }
    const bool held = ahrs_condition(&s->common, AHRS_GYRO_HELD);
    if (z.dt > AHRS_LONGEST_STEP || (s->blind > 0 && !held)) {
        account_for_blindness(s, p, &z);
    }
    s->blind = held ? s->blind + z.dt : 0;
    step(s, p, &z, z.dt);
    ahrs_estimator_end(&s->common, &p->common, &z, ahrs_quat_mul(ahrs_quat_of(s->q_north), ahrs_quat_of(s->q_int)));
}

void ahrs_kcf_outputs(const ahrs_kcf_state *s, const ahrs_kcf_params *p, ahrs_kcf_outputs_t *y) {
    const int32_t frame = p->common.frame;
    const ahrs_vec3 gyro = ahrs_vec3_of(s->common.gyro);
    const ahrs_real unit = s->mag_scale > 0 ? 1 / s->mag_scale : 0;
    const ahrs_real sign[3] = {1, frame == AHRS_FRAME_ENU ? -1 : 1, frame == AHRS_FRAME_ENU ? -1 : 1};
    ahrs_estimator_outputs(&s->common, &p->common, ahrs_vec3_of(&s->x[GYRO]), &y->common);
    ahrs_vec3_to(y->common.rate, ahrs_swap_body(frame, ahrs_vec3_sub(gyro, gyro_error(s, gyro))));
    y->covariance_reset = ahrs_condition(&s->common, AHRS_COVARIANCE_RESET);
    ahrs_vec3_to(y->hard_iron, ahrs_swap_body(frame, ahrs_vec3_scale(iron(s), unit)));
    for (int i = 0; i < 9; i++) {
        y->gyro_scale[i] = sign[i / 3] * sign[i % 3] * s->x[SCALE + i];
    }
    y->mag_latency = s->x[LATENCY];
    const ahrs_real *const field = s->x + FIELD, *const block = s->cov + (ROW + 1) * FIELD;
    const ahrs_real horizontal2 = field[0] * field[0] + field[1] * field[1];
    y->local_field[0] = unit * ahrs_sqrt(horizontal2);
    y->local_field[1] = unit * field[2];
    const ahrs_real across = field[1] * field[1] * block[0] - 2 * field[0] * field[1] * block[1] +
                             field[0] * field[0] * block[ROW + 1];
    y->heading_std = horizontal2 > 0 ? ahrs_min(ahrs_sqrt(ahrs_max(across, 0)) / horizontal2, AHRS_PI) : AHRS_PI;
    y->disturbance = s->misfit;
    y->uncalibrated = s->alt_probability;
    y->at_rest = at_rest(s);
    y->mag_disturbed = disturbed(s, p);
    y->implausible = implausible(s, p);
}
