/* Generated from models/mahony/mahony.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_MAHONY_H
#define AHRS_MAHONY_H

#include "ahrs_estimator.h"

/* Mahony's complementary filter with decoupled heading. Integrates the gyroscope together with a
 * proportional-integral correction from the directions of gravity and of the horizontal field. The
 * magnetometer corrects heading only, and the loop gain is one on all axes.
 */

typedef struct {
    ahrs_estimator_params common;
    ahrs_real kp; /* Proportional gain: about the crossover frequency between accelerometer/magnetometer and gyroscope [rad/s] */
    ahrs_real ki; /* Integral gain: how fast the gyroscope bias is learned; 0 switches that off [rad2/s2] */
    ahrs_real bias_limit; /* Largest gyroscope bias that is learned, per axis [rad/s] */
} ahrs_mahony_params;

typedef ahrs_estimator_inputs ahrs_mahony_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
} ahrs_mahony_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real bias[3]; /* Gyroscope bias [rad/s] */
} ahrs_mahony_state;

/* Parameters and inputs to their defaults. */
void ahrs_mahony_defaults(ahrs_mahony_params *p, ahrs_mahony_inputs *u);

/* State as before the first sample. */
void ahrs_mahony_init(ahrs_mahony_state *s, const ahrs_mahony_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
void ahrs_mahony_update(ahrs_mahony_state *s, const ahrs_mahony_params *p, const ahrs_mahony_inputs *u, ahrs_real dt);

void ahrs_mahony_outputs(const ahrs_mahony_state *s, const ahrs_mahony_params *p, ahrs_mahony_outputs_t *y);

#endif
