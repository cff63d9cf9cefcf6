/* Bits of ahrs_estimator_state.conditions. */
#ifndef AHRS_CONDITIONS_H
#define AHRS_CONDITIONS_H

#include "ahrs_estimator.h"

enum {
    AHRS_HAS_ATTITUDE = 1,
    AHRS_HAS_HEADING = 2,
    AHRS_HAS_FIELD = 4,
    AHRS_GYRO_HELD = 8,
    AHRS_ACCEL_USED = 16,
    AHRS_MAG_USED = 32,
    AHRS_STEP_REJECTED = 64,
    AHRS_MOVED = 128,
    AHRS_COVARIANCE_RESET = 256,
    AHRS_ACCEL_SUMMED = 512,
    AHRS_MAG_SUMMED = 1024,
    AHRS_IMPLAUSIBLE = 2048,
    AHRS_MAG_DISTURBED = 4096,
    AHRS_HAS_GYRO_ZERO = 8192,
    AHRS_SMOOTHS_FORCE = 16384
};

/* Those that tell of one sample only. */
#define AHRS_MOMENTARY                                                                                           \
    (AHRS_GYRO_HELD | AHRS_ACCEL_USED | AHRS_MAG_USED | AHRS_STEP_REJECTED | AHRS_COVARIANCE_RESET |           \
     AHRS_IMPLAUSIBLE | AHRS_MAG_DISTURBED)

static inline bool ahrs_condition(const ahrs_estimator_state *s, int32_t bit) { return (s->conditions & bit) != 0; }

static inline void ahrs_set_condition(ahrs_estimator_state *s, int32_t bit, bool on) {
    s->conditions = on ? s->conditions | bit : s->conditions & ~bit;
}

#endif
