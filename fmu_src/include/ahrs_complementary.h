/* Generated from models/complementary/complementary.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_COMPLEMENTARY_H
#define AHRS_COMPLEMENTARY_H

#include "ahrs_estimator.h"

/* First-order complementary filter. Integrates the gyroscope and turns the result by the fraction
 * kp*sample_time of the way to the attitude that accelerometer and magnetometer show. It learns no gyroscope
 * bias: a constant one leaves an error of bias/kp.
 */

typedef struct {
    ahrs_estimator_params common;
    ahrs_real kp; /* Crossover frequency between accelerometer/magnetometer and gyroscope: one over the time constant [rad/s] */
} ahrs_complementary_params;

typedef ahrs_estimator_inputs ahrs_complementary_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
} ahrs_complementary_outputs_t;

typedef struct {
    ahrs_estimator_state common;
} ahrs_complementary_state;

/* Parameters and inputs to their defaults. */
void ahrs_complementary_defaults(ahrs_complementary_params *p, ahrs_complementary_inputs *u);

/* State as before the first sample. */
void ahrs_complementary_init(ahrs_complementary_state *s, const ahrs_complementary_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
void ahrs_complementary_update(ahrs_complementary_state *s, const ahrs_complementary_params *p, const ahrs_complementary_inputs *u, ahrs_real dt);

void ahrs_complementary_outputs(const ahrs_complementary_state *s, const ahrs_complementary_params *p, ahrs_complementary_outputs_t *y);

#endif
