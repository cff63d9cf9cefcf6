#include "test_core.h"

#include "ahrs_gcf.h"
#include "estimator.h"

#include <stdio.h>
#include <stdlib.h>

#define CHECK(condition)                                                                                         \
    do {                                                                                                         \
        if (!(condition)) {                                                                                      \
            (void)fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);                                \
            exit(1);                                                                                             \
        }                                                                                                        \
    } while (0)

#ifdef AHRS_SINGLE
#define CLOSE AHRS_C(4e-6)
#else
#define CLOSE AHRS_C(1e-14)
#endif

static bool close_to(ahrs_real x, ahrs_real y) { return ahrs_abs(x - y) <= CLOSE; }

static void elementary_functions_agree_with_the_library(void) {
    for (int i = -700; i <= 700; i++) {
        const ahrs_real x = AHRS_C(0.01) * (ahrs_real)i;
        ahrs_real sine, cosine;
        ahrs_sincos(x, &sine, &cosine);
        CHECK(close_to(sine, (ahrs_real)sin((double)x)) && close_to(cosine, (ahrs_real)cos((double)x)));
        CHECK(close_to(ahrs_atan2(sine, cosine), (ahrs_real)atan2((double)sine, (double)cosine)));
        CHECK(i < 0 || close_to(ahrs_exp_decay(x), (ahrs_real)exp(-(double)x)));
    }
}

static void elementary_functions_have_an_answer_where_there_is_none(void) {
    ahrs_real sine, cosine;
    ahrs_sincos((ahrs_real)NAN, &sine, &cosine);
    CHECK(!(sine != 0) && !(cosine != 1));
    ahrs_sincos(AHRS_C(1e9), &sine, &cosine);
    CHECK(!(sine != 0) && !(cosine != 1));
    CHECK(!(ahrs_atan2(0, 0) != 0));
    CHECK(!(ahrs_atan2((ahrs_real)INFINITY, 1) != 0));
    CHECK(!(ahrs_exp_decay((ahrs_real)INFINITY) != 0));
    CHECK(!(ahrs_exp_decay((ahrs_real)NAN) != 0));
    CHECK(ahrs_min(1, 2) < 2 && ahrs_max(1, 2) > 1);
    CHECK(!ahrs_is_finite((ahrs_real)NAN) && !ahrs_is_finite((ahrs_real)INFINITY));
}

static void attitudes_survive_the_way_through_matrix_angles_and_vector(void) {
    for (int roll = -170; roll <= 180; roll += 25) {
        for (int pitch = -80; pitch <= 80; pitch += 20) {
            for (int yaw = -170; yaw <= 180; yaw += 25) {
                const ahrs_real degree = AHRS_PI / 180;
                const ahrs_vec3 angles = {(ahrs_real)roll * degree, (ahrs_real)pitch * degree, (ahrs_real)yaw * degree};
                const ahrs_quat q = ahrs_quat_from_euler(angles);
                const ahrs_quat m = ahrs_quat_from_mat3(ahrs_quat_to_mat3(q));
                const ahrs_quat v = ahrs_quat_exp(ahrs_quat_log(q));
                const ahrs_quat e = ahrs_quat_from_euler(ahrs_quat_to_euler(q));
                CHECK(ahrs_abs(ahrs_quat_dot(m, q)) > 1 - CLOSE);
                CHECK(ahrs_abs(ahrs_quat_dot(v, q)) > 1 - CLOSE);
                CHECK(ahrs_abs(ahrs_quat_dot(e, q)) > 1 - CLOSE);
                CHECK(ahrs_quat_dot(ahrs_quat_near(ahrs_quat_negate(q), q), q) > 0);
            }
        }
    }
}

/* What the sensors read at an attitude: the frame's gravity and a field of 50 uT that dips 60 deg. */
static void sense(ahrs_gcf_inputs *u, ahrs_quat q) {
    ahrs_vec3_to(u->accel, ahrs_quat_rotate_back(q, (ahrs_vec3){0, 0, AHRS_C(-9.80665)}));
    ahrs_vec3_to(u->mag, ahrs_quat_rotate_back(q, (ahrs_vec3){AHRS_C(25e-6), 0, AHRS_C(43e-6)}));
}

typedef struct {
    ahrs_gcf_params p;
    ahrs_gcf_inputs u;
    ahrs_gcf_state s;
    ahrs_gcf_outputs_t y;
} filter;

static filter fresh(void) {
    filter f;
    ahrs_gcf_defaults(&f.p, &f.u);
    ahrs_gcf_init(&f.s, &f.p);
    return f;
}

static void update(filter *f, ahrs_real dt) {
    ahrs_gcf_update(&f->s, &f->p, &f->u, dt);
    ahrs_gcf_outputs(&f->s, &f->p, &f->y);
    for (int i = 0; i < 4; i++) {
        CHECK(ahrs_is_finite(f->y.common.q[i]));
    }
}

static ahrs_real error(const filter *f, ahrs_quat truth) {
    const ahrs_quat q = ahrs_quat_of(f->y.common.q);
    return ahrs_vec3_norm(ahrs_quat_log(ahrs_quat_mul(ahrs_quat_conj(truth), q)));
}

static void a_tumbling_body_is_followed_by_every_realisation(void) {
    for (int32_t realisation = 0; realisation < 4; realisation++) {
        filter f = fresh();
        f.p.realisation = realisation;
        f.p.common.declination = 0;
        ahrs_quat truth = {1, 0, 0, 0};
        sense(&f.u, truth);
        update(&f, 0);
        ahrs_real worst = 0;
        for (int k = 0; k < 2000; k++) {
            /* Fast enough for the long form of the exponential in between, and away from a pitch of 90 deg. */
            const ahrs_vec3 rate = {k % 500 < 250 ? 3 : 30, 0, AHRS_C(0.4)};
            ahrs_vec3_to(f.u.gyro, rate);
            truth = ahrs_quat_unit(ahrs_quat_mul(truth, ahrs_quat_exp(ahrs_vec3_scale(rate, AHRS_C(0.01)))));
            sense(&f.u, truth);
            update(&f, AHRS_C(0.01));
            worst = ahrs_max(worst, realisation == AHRS_GCF_REALISATION_EULER ? 0 : error(&f, truth));
        }
        CHECK(worst < AHRS_C(1e-2));
    }
}

static void heading_comes_with_the_first_magnetometer_sample(void) {
    filter f = fresh();
    const ahrs_quat truth = ahrs_quat_from_euler((ahrs_vec3){AHRS_C(0.2), AHRS_C(-0.1), 2});
    sense(&f.u, truth);
    f.u.mag_valid = 0;
    update(&f, 0);
    for (int k = 0; k < 100; k++) {
        update(&f, AHRS_C(0.01));
    }
    CHECK(ahrs_abs(f.y.common.yaw) < AHRS_C(1e-3) && f.y.common.status == AHRS_STATUS_MAG_UNUSED);
    f.u.mag_valid = 1;
    update(&f, AHRS_C(0.01));
    CHECK(error(&f, truth) < AHRS_C(1e-3));
    f.p.common.declination = AHRS_C(0.1);
    update(&f, AHRS_C(0.01));
    CHECK(ahrs_abs(f.y.common.yaw - AHRS_C(2.1)) < AHRS_C(1e-3));
}

static void a_long_acceleration_passes_the_gate_for_its_time_only(void) {
    filter f = fresh();
    f.p.common.accel_gating = 1;
    sense(&f.u, (ahrs_quat){1, 0, 0, 0});
    update(&f, 0);
    f.u.accel[0] = 10;
    for (int k = 0; k < 990; k++) {
        update(&f, AHRS_C(0.01));
    }
    CHECK(!f.y.common.accel_used && ahrs_abs(f.y.common.pitch) < AHRS_C(1e-3));
    for (int k = 0; k < 400; k++) {
        update(&f, AHRS_C(0.01));
    }
    CHECK(f.y.common.accel_used && f.y.common.pitch > AHRS_C(0.1));
}

static void a_step_that_is_none_is_flagged_and_skipped(void) {
    filter f = fresh();
    sense(&f.u, (ahrs_quat){1, 0, 0, 0});
    update(&f, 0);
    const ahrs_quat before = ahrs_quat_of(f.y.common.q);
    const ahrs_real wrong[] = {(ahrs_real)NAN, -1, (ahrs_real)INFINITY};
    for (int i = 0; i < 3; i++) {
        update(&f, wrong[i]);
        CHECK(f.y.common.status == AHRS_STATUS_STEP_REJECTED);
        CHECK(ahrs_quat_dot(before, ahrs_quat_of(f.y.common.q)) > 1 - CLOSE);
    }
    update(&f, AHRS_C(0.01));
    CHECK(f.y.common.status == AHRS_STATUS_NOMINAL);
    update(&f, 0);
    update(&f, AHRS_C(0.7));
    CHECK(f.y.common.status == AHRS_STATUS_MAG_UNUSED || f.y.common.status == AHRS_STATUS_ACCEL_UNUSED);
}

static void an_attitude_without_meaning_is_taken_anew(void) {
    filter f = fresh();
    const ahrs_quat truth = ahrs_quat_from_euler((ahrs_vec3){AHRS_C(0.3), 0, 1});
    sense(&f.u, truth);
    update(&f, 0);
    f.s.common.q[1] = (ahrs_real)NAN;
    update(&f, AHRS_C(0.01));
    update(&f, AHRS_C(0.01));
    CHECK(error(&f, truth) < AHRS_C(1e-5));
}

static void a_gyroscope_zero_is_learned_at_rest_and_not_in_motion(void) {
    for (int moving = 0; moving < 2; moving++) {
        filter f = fresh();
        f.p.common.gyro_zero_samples = 50;
        f.p.ki = 0;
        sense(&f.u, (ahrs_quat){1, 0, 0, 0});
        f.u.gyro[0] = AHRS_C(0.01);
        update(&f, 0);
        for (int k = 0; k < 300; k++) {
            f.u.gyro[0] = AHRS_C(0.01) + (moving ? AHRS_C(0.3) * (ahrs_real)(k % 7 - 3) : 0);
            update(&f, AHRS_C(0.01));
        }
        f.u.gyro[0] = AHRS_C(0.01);
        update(&f, AHRS_C(0.01));
        CHECK((ahrs_abs(f.y.common.rate[0]) < AHRS_C(1e-4)) == !moving);
    }
}

static void a_smoothed_accelerometer_lets_slow_changes_through_and_holds_back_fast_ones(void) {
    ahrs_real swing[2];
    for (int smooth = 0; smooth < 2; smooth++) {
        filter f = fresh();
        f.p.common.accel_cutoff = smooth ? 2 : 0;
        f.p.kp = 50;
        f.p.ki = 0;
        sense(&f.u, (ahrs_quat){1, 0, 0, 0});
        update(&f, 0);
        ahrs_real high = -1, low = 1;
        for (int k = 0; k < 400; k++) {
            f.u.accel[0] = AHRS_C(1.0) + (k % 2 ? AHRS_C(0.5) : AHRS_C(-0.5));
            f.u.accel_valid = k != 100;
            update(&f, AHRS_C(0.01));
            high = k > 300 ? ahrs_max(high, f.y.common.pitch) : high;
            low = k > 300 ? ahrs_min(low, f.y.common.pitch) : low;
        }
        CHECK(ahrs_abs(AHRS_C(0.5) * (high + low) - ahrs_atan2(1, AHRS_C(9.80665))) < AHRS_C(2e-3));
        swing[smooth] = high - low;
    }
    CHECK(swing[1] < AHRS_C(0.05) * swing[0]);
}

void test_core(void) {
    elementary_functions_agree_with_the_library();
    elementary_functions_have_an_answer_where_there_is_none();
    attitudes_survive_the_way_through_matrix_angles_and_vector();
    a_tumbling_body_is_followed_by_every_realisation();
    heading_comes_with_the_first_magnetometer_sample();
    a_long_acceleration_passes_the_gate_for_its_time_only();
    a_step_that_is_none_is_flagged_and_skipped();
    an_attitude_without_meaning_is_taken_anew();
    a_gyroscope_zero_is_learned_at_rest_and_not_in_motion();
    a_smoothed_accelerometer_lets_slow_changes_through_and_holds_back_fast_ones();
}
