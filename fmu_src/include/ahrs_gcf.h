/* Generated from models/gcf/gcf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_GCF_H
#define AHRS_GCF_H

#include "ahrs_estimator.h"

/* Generalized complementary filter. Integrates the gyroscope and corrects the attitude by H(s) times the
 * error between measured and expected directions of gravity and magnetic north. H(s) is of first order (kp),
 * second order (kp, ki: the gyroscope bias is learned) or third order (kp, ki, kii: a ramp of the bias is
 * followed too). With the decoupled error the loop gain is one on all axes, so that the crossover frequency
 * is the one designed.
 */

/* What the filter stores as its attitude; all give the same attitude away from their singularities */
enum {
    AHRS_GCF_REALISATION_QUATERNION = 0, /* a unit quaternion */
    AHRS_GCF_REALISATION_VECTOR = 1, /* the directions of gravity and magnetic north in body axes */
    AHRS_GCF_REALISATION_DCM = 2, /* a rotation matrix */
    AHRS_GCF_REALISATION_EULER = 3, /* roll, pitch, yaw: singular at 90 deg of pitch */
};

/* What the error is formed from */
enum {
    AHRS_GCF_FORM_DIRECT = 0, /* the measured vectors themselves */
    AHRS_GCF_FORM_ATTITUDE = 1, /* an attitude computed from accelerometer and magnetometer first */
};

/* How the vector errors are put together */
enum {
    AHRS_GCF_ERROR_DECOUPLED = 0, /* tilt from gravity, heading from the horizontal field: loop gain one on all axes */
    AHRS_GCF_ERROR_COUPLED = 1, /* the sum of both cross products, weighted kg and kh: loop gain depends on the dip */
};

typedef struct {
    ahrs_estimator_params common;
    ahrs_real kp; /* Proportional gain: about the crossover frequency between accelerometer/magnetometer and gyroscope [rad/s] */
    ahrs_real ki; /* Integral gain: how fast the gyroscope bias is learned; 0 makes the filter first order [rad2/s2] */
    ahrs_real kii; /* Double integral gain: follows a ramp of the gyroscope bias; 0 leaves the filter second order [rad3/s3] */
    ahrs_real bias_limit; /* Largest gyroscope bias that is learned, per axis [rad/s] */
    ahrs_real kg; /* Weight of the gravity error, used when error is coupled [1] */
    ahrs_real kh; /* Weight of the magnetic field error, used when error is coupled [1] */
    int32_t realisation; /* What the filter stores as its attitude (enumeration realisation) */
    int32_t form; /* What the error is formed from (enumeration form) */
    int32_t error; /* How the vector errors are put together (enumeration error) */
} ahrs_gcf_params;

typedef ahrs_estimator_inputs ahrs_gcf_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
} ahrs_gcf_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real bias[3]; /* Gyroscope bias: the integrator of H(s) [rad/s] */
    ahrs_real drift[3]; /* Rate of change of the bias: the double integrator of H(s) [rad/s2] */
    ahrs_real store[9]; /* The attitude as the realisation stores it (unused by quaternion) [1] */
} ahrs_gcf_state;

/* Parameters and inputs to their defaults. */
void ahrs_gcf_defaults(ahrs_gcf_params *p, ahrs_gcf_inputs *u);

/* State as before the first sample. */
void ahrs_gcf_init(ahrs_gcf_state *s, const ahrs_gcf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
void ahrs_gcf_update(ahrs_gcf_state *s, const ahrs_gcf_params *p, const ahrs_gcf_inputs *u, ahrs_real dt);

void ahrs_gcf_outputs(const ahrs_gcf_state *s, const ahrs_gcf_params *p, ahrs_gcf_outputs_t *y);

#endif
