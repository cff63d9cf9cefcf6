/* Generated from models/strapdown/strapdown.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_STRAPDOWN_H
#define AHRS_STRAPDOWN_H

#include "ahrs_estimator.h"

/* Gyroscope alone. Integrates the gyroscope by fourth-order angle increments from the first attitude on.
 * Accelerometer and magnetometer give that first attitude and are not used afterwards: the error grows with
 * the gyroscope's bias. A baseline for the others.
 */

typedef struct {
    ahrs_estimator_params common;
} ahrs_strapdown_params;

typedef ahrs_estimator_inputs ahrs_strapdown_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
} ahrs_strapdown_outputs_t;

typedef struct {
    ahrs_estimator_state common;
} ahrs_strapdown_state;

/* Parameters and inputs to their defaults. */
void ahrs_strapdown_defaults(ahrs_strapdown_params *p, ahrs_strapdown_inputs *u);

/* State as before the first sample. */
void ahrs_strapdown_init(ahrs_strapdown_state *s, const ahrs_strapdown_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
void ahrs_strapdown_update(ahrs_strapdown_state *s, const ahrs_strapdown_params *p, const ahrs_strapdown_inputs *u, ahrs_real dt);

void ahrs_strapdown_outputs(const ahrs_strapdown_state *s, const ahrs_strapdown_params *p, ahrs_strapdown_outputs_t *y);

#endif
