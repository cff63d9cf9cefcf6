/* Gyroscope alone, by fourth-order angle increments (docs/algorithms.md section 1). */
#include "ahrs_strapdown.h"
#include "estimator.h"
#include "increment.h"

void ahrs_strapdown_init(ahrs_strapdown_state *s, const ahrs_strapdown_params *p) {
    (void)p;
    ahrs_estimator_init(&s->common);
}

void ahrs_strapdown_update(ahrs_strapdown_state *s, const ahrs_strapdown_params *p, const ahrs_strapdown_inputs *u,
                           ahrs_real dt) {
    ahrs_sample z;
    const ahrs_action action = ahrs_estimator_begin(&s->common, &p->common, u, dt, &z);
    if (action == AHRS_WAIT || action == AHRS_START) {
        return;
    }
    const ahrs_quat q = ahrs_quat_mul(ahrs_quat_of(s->common.q), ahrs_increment(ahrs_vec3_scale(z.rate, z.dt)));
    s->common.conditions &= ~(AHRS_ACCEL_USED | AHRS_MAG_USED);
    ahrs_estimator_end(&s->common, &p->common, &z, ahrs_quat_unit(q));
}

void ahrs_strapdown_outputs(const ahrs_strapdown_state *s, const ahrs_strapdown_params *p, ahrs_strapdown_outputs_t *y) {
    ahrs_estimator_outputs(&s->common, &p->common, (ahrs_vec3){0, 0, 0}, &y->common);
}
