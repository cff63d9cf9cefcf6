/* Mahony's complementary filter with decoupled heading (docs/algorithms.md section 2). */
#include "ahrs_mahony.h"
#include "estimator.h"
#include "mahony_step.h"

void ahrs_mahony_init(ahrs_mahony_state *s, const ahrs_mahony_params *p) {
    (void)p;
    *s = (ahrs_mahony_state){.bias = {0}};
    ahrs_estimator_init(&s->common);
}

void ahrs_mahony_update(ahrs_mahony_state *s, const ahrs_mahony_params *p, const ahrs_mahony_inputs *u, ahrs_real dt) {
    ahrs_sample z;
    const ahrs_action action = ahrs_estimator_begin(&s->common, &p->common, u, dt, &z);
    if (action == AHRS_START) {
        ahrs_vec3_to(s->bias, (ahrs_vec3){0, 0, 0});
    }
    if (action == AHRS_WAIT || action == AHRS_START) {
        return;
    }
    const ahrs_mahony_gains gains = {p->kp, p->ki, p->bias_limit};
    const ahrs_quat q = ahrs_mahony_step(ahrs_quat_of(s->common.q), s->bias, gains, &z);
    ahrs_estimator_end(&s->common, &p->common, &z, q);
}

void ahrs_mahony_outputs(const ahrs_mahony_state *s, const ahrs_mahony_params *p, ahrs_mahony_outputs_t *y) {
    ahrs_estimator_outputs(&s->common, &p->common, ahrs_vec3_of(s->bias), &y->common);
}
