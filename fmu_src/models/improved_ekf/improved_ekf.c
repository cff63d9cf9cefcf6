/* Extended Kalman filter on the quaternion, measured by accelerometer and magnetometer (docs/algorithms.md section 1). */
#include "ahrs_improved_ekf.h"
#include "attitude_error.h"
#include "quaternion_ekf.h"

static ahrs_quaternion_ekf settings(const ahrs_improved_ekf_params *p) {
    return (ahrs_quaternion_ekf){p->gyro_noise, p->attitude_noise, p->accel_distrust, p->motion_noise,
                                 p->initial_attitude_std};
}

void ahrs_improved_ekf_init(ahrs_improved_ekf_state *s, const ahrs_improved_ekf_params *p) {
    const ahrs_quaternion_ekf k = settings(p);
    ahrs_estimator_init(&s->common);
    ahrs_quaternion_ekf_start(&k, s->covariance);
}

void ahrs_improved_ekf_update(ahrs_improved_ekf_state *s, const ahrs_improved_ekf_params *p,
                              const ahrs_improved_ekf_inputs *u, ahrs_real dt) {
    const ahrs_quaternion_ekf k = settings(p);
    ahrs_sample z;
    const ahrs_action action = ahrs_estimator_begin(&s->common, &p->common, u, dt, &z);
    if (action == AHRS_START) {
        ahrs_quaternion_ekf_start(&k, s->covariance);
    }
    if (action == AHRS_WAIT || action == AHRS_START) {
        return;
    }
    ahrs_quat q = ahrs_quaternion_ekf_predict(&k, &s->common, s->covariance, z.rate, &z);
    if (z.gain_dt > 0 && (z.accel_usable || z.mag_usable)) {
        const ahrs_quat measured = ahrs_measured_attitude(ahrs_quat_unit(q), &z);
        const ahrs_real r = ahrs_quaternion_ekf_variance(&k, &p->common, &z);
        const bool kept = ahrs_quaternion_ekf_correct(&k, s->covariance, &q, measured, r);
        ahrs_set_condition(&s->common, AHRS_COVARIANCE_RESET, !kept);
    }
    ahrs_estimator_end(&s->common, &p->common, &z, ahrs_quat_unit(q));
}

void ahrs_improved_ekf_outputs(const ahrs_improved_ekf_state *s, const ahrs_improved_ekf_params *p,
                               ahrs_improved_ekf_outputs_t *y) {
    ahrs_estimator_outputs(&s->common, &p->common, (ahrs_vec3){0, 0, 0}, &y->common);
    ahrs_vec3_to(y->attitude_std, ahrs_quat_covariance_std(s->covariance, ahrs_quat_of(s->common.q)));
    y->covariance_reset = ahrs_condition(&s->common, AHRS_COVARIANCE_RESET);
}
