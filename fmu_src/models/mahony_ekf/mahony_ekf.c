/* Mahony's filter, smoothed by an extended Kalman filter (docs/algorithms.md section 2). */
#include "ahrs_mahony_ekf.h"
#include "mahony_step.h"
#include "quaternion_ekf.h"

static ahrs_quaternion_ekf settings(const ahrs_mahony_ekf_params *p) {
    return (ahrs_quaternion_ekf){p->gyro_noise, p->attitude_noise, p->accel_distrust, p->motion_noise,
                                 p->initial_attitude_std};
}

void ahrs_mahony_ekf_init(ahrs_mahony_ekf_state *s, const ahrs_mahony_ekf_params *p) {
    const ahrs_quaternion_ekf k = settings(p);
    *s = (ahrs_mahony_ekf_state){.mahony = {1, 0, 0, 0}};
    ahrs_estimator_init(&s->common);
    ahrs_quaternion_ekf_start(&k, s->covariance);
}

void ahrs_mahony_ekf_update(ahrs_mahony_ekf_state *s, const ahrs_mahony_ekf_params *p, const ahrs_mahony_ekf_inputs *u,
                            ahrs_real dt) {
    const ahrs_quaternion_ekf k = settings(p);
    ahrs_sample z;
    const ahrs_action action = ahrs_estimator_begin(&s->common, &p->common, u, dt, &z);
    if (action == AHRS_START) {
        ahrs_quaternion_ekf_start(&k, s->covariance);
        ahrs_vec3_to(s->bias, (ahrs_vec3){0, 0, 0});
    }
    if (action == AHRS_START || action == AHRS_TURN) {
        ahrs_quat_to(s->mahony, ahrs_quat_of(s->common.q));
    }
    if (action == AHRS_WAIT || action == AHRS_START) {
        return;
    }
    const ahrs_mahony_gains gains = {p->kp, p->ki, p->bias_limit};
    const ahrs_quat measured = ahrs_mahony_step(ahrs_quat_of(s->mahony), s->bias, gains, &z);
    const ahrs_vec3 rate = p->bias_feed ? ahrs_vec3_sub(z.rate, ahrs_vec3_of(s->bias)) : z.rate;
    ahrs_quat q = ahrs_quaternion_ekf_predict(&k, &s->common, s->covariance, rate, &z);
    const ahrs_real r = ahrs_quaternion_ekf_variance(&k, &p->common, &z);
    const bool kept = ahrs_quaternion_ekf_correct(&k, s->covariance, &q, measured, r);
    ahrs_quat_to(s->mahony, measured);
    ahrs_set_condition(&s->common, AHRS_COVARIANCE_RESET, !kept);
    ahrs_estimator_end(&s->common, &p->common, &z, ahrs_quat_unit(q));
}

void ahrs_mahony_ekf_outputs(const ahrs_mahony_ekf_state *s, const ahrs_mahony_ekf_params *p,
                             ahrs_mahony_ekf_outputs_t *y) {
    ahrs_estimator_outputs(&s->common, &p->common, ahrs_vec3_of(s->bias), &y->common);
    ahrs_vec3_to(y->attitude_std, ahrs_quat_covariance_std(s->covariance, ahrs_quat_of(s->common.q)));
    y->covariance_reset = ahrs_condition(&s->common, AHRS_COVARIANCE_RESET);
}
