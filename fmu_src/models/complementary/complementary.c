/* First-order complementary filter on the quaternion (docs/algorithms.md section 1). */
#include "ahrs_complementary.h"
#include "attitude_error.h"
#include "estimator.h"

void ahrs_complementary_init(ahrs_complementary_state *s, const ahrs_complementary_params *p) {
    (void)p;
    ahrs_estimator_init(&s->common);
}

void ahrs_complementary_update(ahrs_complementary_state *s, const ahrs_complementary_params *p,
                               const ahrs_complementary_inputs *u, ahrs_real dt) {
    ahrs_sample z;
    const ahrs_action action = ahrs_estimator_begin(&s->common, &p->common, u, dt, &z);
    if (action == AHRS_WAIT || action == AHRS_START) {
        return;
    }
    const ahrs_quat predicted = ahrs_quat_turn(ahrs_quat_of(s->common.q), ahrs_vec3_scale(z.rate, z.dt));
    const ahrs_vec3 e = ahrs_attitude_error(predicted, &z);
    const ahrs_quat corrected = ahrs_quat_turn(predicted, ahrs_vec3_scale(e, p->kp * z.gain_dt));
    ahrs_estimator_end(&s->common, &p->common, &z, ahrs_quat_refine(corrected));
}

void ahrs_complementary_outputs(const ahrs_complementary_state *s, const ahrs_complementary_params *p,
                                ahrs_complementary_outputs_t *y) {
    ahrs_estimator_outputs(&s->common, &p->common, (ahrs_vec3){0, 0, 0}, &y->common);
}
