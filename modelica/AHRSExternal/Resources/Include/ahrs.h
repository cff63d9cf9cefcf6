/* The attitude estimators in C, generated from fmu_src by `python -m ahrs_fmu.export.modelica`. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
#endif

/* Generated from models/adaptive_ckf/adaptive_ckf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_ADAPTIVE_CKF_H
#define AHRS_ADAPTIVE_CKF_H

/* Generated from estimator/estimator.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_ESTIMATOR_H
#define AHRS_ESTIMATOR_H

/* The one floating-point type of the state path: double, or float when AHRS_SINGLE is defined.
 *
 * Only + - * / and the square root are used below the outputs and above them too: they are rounded the same
 * way on every machine, so a host, an FMU and a microcontroller agree to the bit in the same precision. */
#ifndef AHRS_REAL_H
#define AHRS_REAL_H

#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#ifdef AHRS_SINGLE
typedef float ahrs_real;
#define AHRS_C(literal) literal##f
#define AHRS_REAL_MAX FLT_MAX
#define AHRS_REAL_EPSILON FLT_EPSILON
#define ahrs_sqrt sqrtf
#else
typedef double ahrs_real;
#define AHRS_C(literal) literal
#define AHRS_REAL_MAX DBL_MAX
#define AHRS_REAL_EPSILON DBL_EPSILON
#define ahrs_sqrt sqrt
#endif

/* For functions of the sample path that are worth compiling anew where an argument is a constant, and for branches
 * that a compiler should not turn into a wait for both sides. */
#if defined(__GNUC__)
#define AHRS_INLINE static inline __attribute__((always_inline))
#define AHRS_UNLIKELY(condition) __builtin_expect((condition), 0)
#elif defined(_MSC_VER)
#define AHRS_INLINE static __forceinline
#define AHRS_UNLIKELY(condition) (condition)
#else
#define AHRS_INLINE static inline
#define AHRS_UNLIKELY(condition) (condition)
#endif

#define AHRS_PI AHRS_C(3.14159265358979323846)
#define AHRS_INFINITY ((ahrs_real)INFINITY)

static inline ahrs_real ahrs_abs(ahrs_real x) { return x < 0 ? -x : x; }
static inline ahrs_real ahrs_min(ahrs_real x, ahrs_real y) { return x < y ? x : y; }
static inline ahrs_real ahrs_max(ahrs_real x, ahrs_real y) { return x > y ? x : y; }

static inline ahrs_real ahrs_clamp(ahrs_real x, ahrs_real low, ahrs_real high) {
    return ahrs_max(low, ahrs_min(high, x));
}

/* False for NaN as well: every comparison with it fails. */
static inline bool ahrs_is_finite(ahrs_real x) { return x >= -AHRS_REAL_MAX && x <= AHRS_REAL_MAX; }

#endif

/* Navigation frame with its body frame */
enum {
    AHRS_FRAME_NED = 0, /* north-east-down, body forward-right-down; level rest reads (0, 0, -g) */
    AHRS_FRAME_ENU = 1, /* east-north-up, body forward-left-up; level rest reads (0, 0, +g) */
};

/* Where the local magnetic field is known from */
enum {
    AHRS_FIELD_REFERENCE_LEARNED = 0, /* from the samples that initialise the attitude */
    AHRS_FIELD_REFERENCE_GIVEN = 1, /* from field_magnitude and field_dip */
};

/* Where the first attitude comes from */
enum {
    AHRS_INITIALISATION_SENSORS = 0, /* from accelerometer and magnetometer */
    AHRS_INITIALISATION_GIVEN = 1, /* from q0 */
};

/* The worst condition now; one numbering for all estimators */
enum {
    AHRS_STATUS_NOMINAL = 0, /* every sensor is used */
    AHRS_STATUS_MAG_DISTURBED = 1, /* the magnetic field differs from the reference */
    AHRS_STATUS_MAG_UNUSED = 2, /* heading is integrated from the gyroscope */
    AHRS_STATUS_ACCEL_UNUSED = 3, /* tilt is integrated from the gyroscope */
    AHRS_STATUS_GYRO_HELD = 4, /* the gyroscope sample is unusable: the last usable rate is held */
    AHRS_STATUS_STEP_REJECTED = 5, /* the time step is negative or not a number: nothing was done */
    AHRS_STATUS_COVARIANCE_RESET = 6, /* the covariance had lost its meaning and was reset */
    AHRS_STATUS_IMPLAUSIBLE = 7, /* the sensors contradict each other: check axes and signs */
    AHRS_STATUS_INITIALISING_IN_MOTION = 8, /* no attitude yet, and the vehicle moves while samples are averaged */
    AHRS_STATUS_INITIALISING = 9, /* no attitude yet: waiting for usable samples or averaging them */
};

typedef struct {
    ahrs_real sample_time; /* Sample interval of the estimator [s] */
    ahrs_real declination; /* Magnetic declination, east positive: turns the navigation frame from magnetic to true north [rad] */
    ahrs_real gravity; /* Local gravity [m/s2] */
    ahrs_real field_magnitude; /* Magnitude of the local field, used when field_reference is given [T] */
    ahrs_real field_dip; /* Dip of the local field below the horizon, used when field_reference is given [rad] */
    ahrs_real q0[4]; /* First attitude, in the frame of the output, used when initialisation is given; scaled to unit length [1] */
    ahrs_real init_time; /* Time over which samples are averaged for the first attitude; 0 takes the first usable sample [s] */
    ahrs_real motion_time_constant; /* How long an acceleration is taken for motion before it is taken for tilt; infinity never takes it back [s] */
    ahrs_real accel_gate; /* Deviation of the specific force from gravity beyond which the accelerometer is ignored [m/s2] */
    ahrs_real accel_gate_time; /* Longest time without the accelerometer; then it is used until it has been inside the gate once [s] */
    ahrs_real gyro_zero_std; /* Standard deviation per sample and axis above which the vehicle is not at rest: about three times the sensor's [rad/s] */
    ahrs_real gyro_zero_limit; /* Largest zero of the gyroscope that is believed; more is a rotation [rad/s] */
    ahrs_real accel_cutoff; /* Cut-off of a second-order Butterworth low-pass behind the accelerometer; 0 switches it off [Hz] */
    ahrs_real mag_offset[3]; /* Hard iron, subtracted from the magnetometer, body axes [T] */
    ahrs_real mag_gain[3]; /* What the magnetometer without its offset is multiplied with, body axes [1] */
    int32_t frame; /* Navigation and body frame of inputs and outputs (enumeration frame) */
    int32_t field_reference; /* Where the local magnetic field is known from (enumeration field_reference) */
    int32_t initialisation; /* Where the first attitude comes from (enumeration initialisation) */
    int32_t motion_compensation; /* Subtract the estimated motion acceleration from the accelerometer; tilt is then observed more slowly */
    int32_t accel_gating; /* Ignore the accelerometer while its magnitude is far from gravity */
    int32_t gyro_zero_samples; /* Samples at rest over which the zero of the gyroscope is averaged, then subtracted; 0 switches it off */
} ahrs_estimator_params;

typedef struct {
    ahrs_real gyro[3]; /* Angular rate of the body, body axes: mean over the sample interval that ends now [rad/s] */
    ahrs_real accel[3]; /* Specific force (what an accelerometer reads), body axes; zero counts as no measurement [m/s2] */
    ahrs_real mag[3]; /* Magnetic flux density, body axes; zero counts as no measurement [T] */
    int32_t accel_valid; /* False: do not use the accelerometer now */
    int32_t mag_valid; /* False: do not use the magnetometer now */
} ahrs_estimator_inputs;

typedef struct {
    ahrs_real q[4]; /* Attitude quaternion, body to navigation, Hamilton product, scalar first [1] */
    ahrs_real roll; /* Roll angle (z-y-x order) [rad] */
    ahrs_real pitch; /* Pitch angle (z-y-x order) [rad] */
    ahrs_real yaw; /* Yaw angle (z-y-x order): NED from north, clockwise seen from above; ENU from east, counter-clockwise [rad] */
    ahrs_real rate[3]; /* Angular rate without the estimated bias, body axes [rad/s] */
    ahrs_real gyro_bias[3]; /* Estimated gyroscope bias, body axes [rad/s] */
    ahrs_real motion_accel[3]; /* Estimated motion acceleration (accelerometer without gravity), body axes [m/s2] */
    int32_t status; /* The worst condition now (enumeration status) */
    int32_t gyro_held; /* The last gyroscope sample was unusable and an earlier rate was held */
    int32_t accel_used; /* The last accelerometer sample corrected the attitude */
    int32_t mag_used; /* The last magnetometer sample corrected the attitude */
} ahrs_estimator_outputs_t;

typedef struct {
    ahrs_real q[4]; /* Attitude, body (forward-right-down) to magnetic north-east-down [1] */
    ahrs_real gyro[3]; /* Last usable rate [rad/s] */
    ahrs_real force[3]; /* Last usable specific force; without one, the force that keeps the motion acceleration [m/s2] */
    ahrs_real field[2]; /* Reference field: horizontal and downward part [T] */
    ahrs_real accel_sum[3]; /* Sum of the accelerometer samples that initialise the attitude [m/s2] */
    ahrs_real mag_sum[3]; /* Sum of the magnetometer samples that initialise the attitude [T] */
    ahrs_real elapsed; /* Time since the first sample that initialises the attitude [s] */
    ahrs_real gated; /* Time for which the accelerometer has been ignored because of its magnitude [s] */
    ahrs_real force_low[3]; /* Low-pass of the accelerometer: what it lets through [m/s2] */
    ahrs_real force_band[3]; /* Low-pass of the accelerometer: its second state, zero at rest [m/s2] */
    ahrs_real gyro_zero[3]; /* Zero of the gyroscope, or the mean that becomes it [rad/s] */
    ahrs_real gyro_spread; /* Sum of the squared deviations from that mean [rad2/s2] */
    ahrs_real force_excess; /* Mean of specific force minus gravity meanwhile [m/s2] */
    int32_t zero_count; /* Samples in these means */
    int32_t conditions; /* Bits of conditions.h: what is known, what was used, what went wrong at the last sample */
} ahrs_estimator_state;

#endif

/* Cubature Kalman filter on the quaternion with adaptive noise. The state is the quaternion, predicted by
 * the gyroscope and measured by the specific force and the heading. The covariances of measurement and
 * process noise may be estimated while the filter runs, after Sage and Husa. It learns no gyroscope bias:
 * the process noise has to cover it.
 */

/* Which noise covariances are estimated */
enum {
    AHRS_ADAPTIVE_CKF_ADAPTATION_NONE = 0, /* none: both are as given */
    AHRS_ADAPTIVE_CKF_ADAPTATION_R_ONLY = 1, /* that of the measurement, always positive definite */
    AHRS_ADAPTIVE_CKF_ADAPTATION_QR_SAFE = 2, /* both, by terms that keep them positive definite, within limits */
    AHRS_ADAPTIVE_CKF_ADAPTATION_TEXTBOOK = 3, /* both; that of the process may lose its meaning, and the filter resets */
    AHRS_ADAPTIVE_CKF_ADAPTATION_PRINTED = 4, /* both, with the misprint of the source; the filter resets likewise */
};

/* Form of the process noise */
enum {
    AHRS_ADAPTIVE_CKF_PROCESS_NOISE_GYRO = 0, /* gyro_noise across the quaternion, and quaternion_noise in all directions */
    AHRS_ADAPTIVE_CKF_PROCESS_NOISE_ISOTROPIC = 1, /* quaternion_noise in all directions only */
};

typedef struct {
    ahrs_estimator_params common;
    ahrs_real gyro_noise; /* White noise of the gyroscope, rad/s/sqrt(Hz), large enough to cover its bias; used when process_noise is gyro */
    ahrs_real accel_noise; /* White noise of the accelerometer with the motion, m/s2/sqrt(Hz), before it is estimated */
    ahrs_real heading_noise; /* White noise of the measured heading, rad/sqrt(Hz), before it is estimated */
    ahrs_real quaternion_noise; /* White noise of the change of every quaternion element, 1/s/sqrt(Hz) */
    ahrs_real motion_noise; /* Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation */
    ahrs_real initial_attitude_std; /* Standard deviation of the first attitude [rad] */
    ahrs_real forgetting; /* Weight of the estimated noise covariances from one sample to the next [1] */
    ahrs_real measurement_variance_min; /* Least eigenvalue of the measurement covariance, in m2/s4 and rad2, when adaptation is r_only or qr_safe */
    ahrs_real measurement_variance_max; /* Largest eigenvalue of the measurement covariance, in m2/s4 and rad2, when adaptation is r_only or qr_safe */
    ahrs_real process_variance_min; /* Least eigenvalue of the process covariance per sample, when adaptation is qr_safe [1] */
    ahrs_real process_variance_max; /* Largest eigenvalue of the process covariance per sample, when adaptation is qr_safe [1] */
    int32_t adaptation; /* Which noise covariances are estimated (enumeration adaptation) */
    int32_t process_noise; /* Form of the process noise, before it is estimated (enumeration process_noise) */
    int32_t warm_up; /* Samples that the given noise covariances count for when the estimation begins */
} ahrs_adaptive_ckf_params;

typedef ahrs_estimator_inputs ahrs_adaptive_ckf_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
    ahrs_real attitude_std[3]; /* Standard deviation of the attitude error about the body axes, as the filter believes it [rad] */
    int32_t covariance_reset; /* The covariance was reset at the last sample */
} ahrs_adaptive_ckf_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real covariance[10]; /* Covariance of the quaternion: lower triangle, row by row [1] */
    ahrs_real process[10]; /* Covariance of the process noise per sample, likewise [1] */
    ahrs_real measurement[10]; /* Covariance of the measurement noise (specific force, heading), likewise [1] */
    ahrs_real fading; /* Power of the forgetting factor: how much of the given covariances is left [1] */
} ahrs_adaptive_ckf_state;

/* Parameters and inputs to their defaults. */
static inline void ahrs_adaptive_ckf_defaults(ahrs_adaptive_ckf_params *p, ahrs_adaptive_ckf_inputs *u);

/* State as before the first sample. */
static inline void ahrs_adaptive_ckf_init(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
static inline void ahrs_adaptive_ckf_update(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p, const ahrs_adaptive_ckf_inputs *u, ahrs_real dt);

static inline void ahrs_adaptive_ckf_outputs(const ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p, ahrs_adaptive_ckf_outputs_t *y);

#endif
/* What accelerometer and magnetometer say about an attitude (docs/algorithms.md section 5). */
#ifndef AHRS_ATTITUDE_ERROR_H
#define AHRS_ATTITUDE_ERROR_H

/* What all estimators share: which samples are usable, the first attitude, motion compensation, gating, frames and
 * the common outputs. An estimator's update is
 *
 *     switch (ahrs_estimator_begin(&s->common, &p->common, u, dt, &z)) { ... }   what to do with this sample
 *     predict with z.rate, correct with z.accel and z.mag where they are usable
 *     ahrs_estimator_end(&s->common, &p->common, &z, q);                         the new attitude
 *
 * Inside, the axes are forward-right-down and north-east-down with magnetic north (docs/algorithms.md section 0). */
#ifndef ESTIMATOR_H
#define ESTIMATOR_H

/* Bits of ahrs_estimator_state.conditions. */
#ifndef AHRS_CONDITIONS_H
#define AHRS_CONDITIONS_H


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
/* What may happen to the samples before an estimator sees them, each part switched on by parameters: the gyroscope's
 * zero, the magnetometer's calibration, the accelerometer's low-pass (docs/algorithms.md section 0). */
#ifndef AHRS_PREPROCESSING_H
#define AHRS_PREPROCESSING_H

/* Sine, cosine, arc tangent and exponential from + - * / and the square root, so that their bits do not depend
 * on a C library. Accurate to about one unit in the last place for the arguments an estimator meets. */
#ifndef AHRS_TRIG_H
#define AHRS_TRIG_H


/* Beyond this angle the position within a turn is no longer known well enough to mean anything. */
#define AHRS_ANGLE_MAX AHRS_C(1e6)

/* The half turn split into parts of few bits, so that k times the leading parts is exact. */
#ifdef AHRS_SINGLE
#define AHRS_HALF_PI_1 1.5703125f
#define AHRS_HALF_PI_2 0.0004837512969970703f
#define AHRS_HALF_PI_3 7.54979e-08f
#define AHRS_LN2_1 0.693115234375f
#define AHRS_LN2_2 3.1946183e-05f
#else
#define AHRS_HALF_PI_1 1.5707963267341256
#define AHRS_HALF_PI_2 6.077100506303966e-11
#define AHRS_HALF_PI_3 2.0222662487959506e-21
#define AHRS_LN2_1 0.6931471804855391
#define AHRS_LN2_2 7.440617110012397e-11
#endif

/* cos(x) and sin(x)/x as series in x^2 for |x| <= pi/4, in pairs of terms that do not wait for each other. */
static inline ahrs_real ahrs_cos_series(ahrs_real x2) {
    const ahrs_real x4 = x2 * x2;
    const ahrs_real low = (1 - AHRS_C(0.5) * x2) + x4 * (AHRS_C(0.041666666666666664) - AHRS_C(0.001388888888888889) * x2);
    const ahrs_real high = (AHRS_C(2.48015873015873e-05) - AHRS_C(2.7557319223985893e-07) * x2) +
                           x4 * (AHRS_C(2.08767569878681e-09) - AHRS_C(1.1470745597729725e-11) * x2 +
                                 AHRS_C(4.779477332387385e-14) * x4);
    return low + (x4 * x4) * high;
}

static inline ahrs_real ahrs_sinc_series(ahrs_real x2) {
    const ahrs_real x4 = x2 * x2;
    const ahrs_real low = (1 - AHRS_C(0.16666666666666666) * x2) +
                          x4 * (AHRS_C(0.008333333333333333) - AHRS_C(0.0001984126984126984) * x2);
    const ahrs_real high = (AHRS_C(2.7557319223985893e-06) - AHRS_C(2.505210838544172e-08) * x2) +
                           x4 * (AHRS_C(1.6059043836821613e-10) - AHRS_C(7.647163731819816e-13) * x2);
    return low + (x4 * x4) * high;
}

static inline void ahrs_sincos(ahrs_real x, ahrs_real *sine, ahrs_real *cosine) {
    if (!(ahrs_abs(x) <= AHRS_ANGLE_MAX)) {
        *sine = 0;
        *cosine = 1;
        return;
    }
    const ahrs_real turns = x * (2 / AHRS_PI);
    const int32_t k = (int32_t)(turns + (turns < 0 ? AHRS_C(-0.5) : AHRS_C(0.5)));
    const ahrs_real n = (ahrs_real)k;
    const ahrs_real r = ((x - n * AHRS_HALF_PI_1) - n * AHRS_HALF_PI_2) - n * AHRS_HALF_PI_3;
    const ahrs_real c = ahrs_cos_series(r * r);
    const ahrs_real s = r * ahrs_sinc_series(r * r);
    switch (k & 3) {
    case 0: *sine = s; *cosine = c; break;
    case 1: *sine = c; *cosine = -s; break;
    case 2: *sine = -s; *cosine = -c; break;
    default: *sine = -c; *cosine = s; break;
    }
}

/* The angle of the point (x, y); 0 for the origin. */
static inline ahrs_real ahrs_atan2(ahrs_real y, ahrs_real x) {
    static const ahrs_real ATAN_EIGHTHS[9] = {
        AHRS_C(0.0), AHRS_C(0.12435499454676144), AHRS_C(0.24497866312686414),
        AHRS_C(0.35877067027057225), AHRS_C(0.4636476090008061), AHRS_C(0.5585993153435624),
        AHRS_C(0.6435011087932844), AHRS_C(0.7188299996216245), AHRS_C(0.7853981633974483)};
    const ahrs_real ax = ahrs_abs(x), ay = ahrs_abs(y);
    const bool steep = ay > ax;
    const ahrs_real large = steep ? ay : ax, small = steep ? ax : ay;
    if (!(large > 0) || !ahrs_is_finite(large)) {
        return 0;
    }
    /* atan(t) = atan(c) + atan((t - c)/(1 + t c)) with c the nearest eighth leaves |argument| <= 1/16. */
    const ahrs_real t = small / large;
    const int32_t k = (int32_t)(8 * t + AHRS_C(0.5));
    const ahrs_real c = (ahrs_real)k / 8;
    const ahrs_real z = (t - c) / (1 + t * c);
    const ahrs_real z2 = z * z;
    ahrs_real series = AHRS_C(0.07692307692307693);
    series = series * z2 - AHRS_C(0.09090909090909091);
    series = series * z2 + AHRS_C(0.1111111111111111);
    series = series * z2 - AHRS_C(0.14285714285714285);
    series = series * z2 + AHRS_C(0.2);
    series = series * z2 - AHRS_C(0.3333333333333333);
    ahrs_real angle = ATAN_EIGHTHS[k] + (z + z * z2 * series);
    angle = steep ? AHRS_PI / 2 - angle : angle;
    angle = x < 0 ? AHRS_PI - angle : angle;
    return y < 0 ? -angle : angle;
}

/* exp(-x) for x >= 0, infinity included. */
static inline ahrs_real ahrs_exp_decay(ahrs_real x) {
    static const ahrs_real INVERSE[15] = {
        AHRS_C(1.0) / 15, AHRS_C(1.0) / 14, AHRS_C(1.0) / 13, AHRS_C(1.0) / 12, AHRS_C(1.0) / 11,
        AHRS_C(1.0) / 10, AHRS_C(1.0) / 9,  AHRS_C(1.0) / 8,  AHRS_C(1.0) / 7,  AHRS_C(1.0) / 6,
        AHRS_C(1.0) / 5,  AHRS_C(1.0) / 4,  AHRS_C(1.0) / 3,  AHRS_C(1.0) / 2,  AHRS_C(1.0)};
    if (!(x < 80)) {
        return 0;
    }
    const int32_t k = (int32_t)(x * AHRS_C(1.4426950408889634) + AHRS_C(0.5));
    const ahrs_real n = (ahrs_real)k;
    const ahrs_real r = (x - n * AHRS_LN2_1) - n * AHRS_LN2_2;
    ahrs_real y = 1, half = AHRS_C(0.5);
    for (int32_t i = 0; i < 15; i++) {
        y = 1 - y * (r * INVERSE[i]);
    }
    /* y / 2^k, from powers of one half by squaring. */
    for (int32_t left = k; left > 0; left >>= 1) {
        y = left & 1 ? y * half : y;
        half *= half;
    }
    return y;
}

#endif
/* Three-dimensional vectors, passed by value. */
#ifndef AHRS_VEC3_H
#define AHRS_VEC3_H


typedef struct {
    ahrs_real x, y, z;
} ahrs_vec3;

static inline ahrs_vec3 ahrs_vec3_of(const ahrs_real v[3]) { return (ahrs_vec3){v[0], v[1], v[2]}; }

static inline void ahrs_vec3_to(ahrs_real out[3], ahrs_vec3 v) {
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

static inline ahrs_vec3 ahrs_vec3_add(ahrs_vec3 a, ahrs_vec3 b) { return (ahrs_vec3){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline ahrs_vec3 ahrs_vec3_sub(ahrs_vec3 a, ahrs_vec3 b) { return (ahrs_vec3){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline ahrs_vec3 ahrs_vec3_scale(ahrs_vec3 a, ahrs_real k) { return (ahrs_vec3){a.x * k, a.y * k, a.z * k}; }
static inline ahrs_vec3 ahrs_vec3_negate(ahrs_vec3 a) { return (ahrs_vec3){-a.x, -a.y, -a.z}; }

/* a + k b */
static inline ahrs_vec3 ahrs_vec3_add_scaled(ahrs_vec3 a, ahrs_real k, ahrs_vec3 b) {
    return (ahrs_vec3){a.x + k * b.x, a.y + k * b.y, a.z + k * b.z};
}

static inline ahrs_real ahrs_vec3_dot(ahrs_vec3 a, ahrs_vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

static inline ahrs_vec3 ahrs_vec3_cross(ahrs_vec3 a, ahrs_vec3 b) {
    return (ahrs_vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline ahrs_real ahrs_vec3_norm2(ahrs_vec3 a) { return ahrs_vec3_dot(a, a); }
static inline ahrs_real ahrs_vec3_norm(ahrs_vec3 a) { return ahrs_sqrt(ahrs_vec3_norm2(a)); }

/* The caller makes sure that the vector is not zero. */
static inline ahrs_vec3 ahrs_vec3_unit(ahrs_vec3 a) { return ahrs_vec3_scale(a, 1 / ahrs_vec3_norm(a)); }

/* Every element within [-limit, limit]. */
static inline ahrs_vec3 ahrs_vec3_limited(ahrs_vec3 v, ahrs_real limit) {
    return (ahrs_vec3){ahrs_clamp(v.x, -limit, limit), ahrs_clamp(v.y, -limit, limit), ahrs_clamp(v.z, -limit, limit)};
}

static inline bool ahrs_vec3_is_finite(ahrs_vec3 a) {
    return ahrs_is_finite(a.x) && ahrs_is_finite(a.y) && ahrs_is_finite(a.z);
}

#endif

#define AHRS_ZERO_FORCE AHRS_C(0.3) /* m/s2: mean specific force further from gravity is not rest */
#define AHRS_SQRT2 AHRS_C(1.41421356237309504880)

/* Of the cut-off period: after a longer step the low-pass begins anew. The parameters leave it below 0.4. */
#define AHRS_LOWPASS_STEP AHRS_C(0.45)

/* Hard iron and the unequal sensitivity of the axes taken out, in the axes of the user. No measurement, which is zero or
 * not a number, stays one. */
AHRS_INLINE ahrs_vec3 ahrs_calibrated_mag(const ahrs_estimator_params *p, const ahrs_real mag[3]) {
    const bool measured = mag[0] != 0 || mag[1] != 0 || mag[2] != 0;
    const ahrs_vec3 m = {(mag[0] - p->mag_offset[0]) * p->mag_gain[0], (mag[1] - p->mag_offset[1]) * p->mag_gain[1],
                         (mag[2] - p->mag_offset[2]) * p->mag_gain[2]};
    return measured ? m : (ahrs_vec3){0, 0, 0};
}

/* Takes one rate and the magnitude of the specific force into the means over a rest, until the zero is known; true when
 * it becomes so. A rest whose noise, force or mean rate is not that of a vehicle at rest is dropped for the next one. */
static inline bool ahrs_learn_gyro_zero(ahrs_estimator_state *s, const ahrs_estimator_params *p, ahrs_vec3 rate,
                                        ahrs_real force) {
    if (ahrs_condition(s, AHRS_HAS_GYRO_ZERO)) {
        return false;
    }
    if (s->zero_count == 0) {
        ahrs_vec3_to(s->gyro_zero, rate);
        s->gyro_spread = 0;
        s->force_excess = 0;
    }
    s->zero_count++;
    const ahrs_real n = (ahrs_real)s->zero_count;
    const ahrs_vec3 before = ahrs_vec3_of(s->gyro_zero);
    const ahrs_vec3 mean = ahrs_vec3_add_scaled(before, 1 / n, ahrs_vec3_sub(rate, before));
    ahrs_vec3_to(s->gyro_zero, mean);
    s->gyro_spread += ahrs_vec3_dot(ahrs_vec3_sub(rate, before), ahrs_vec3_sub(rate, mean));
    s->force_excess += (force - p->gravity - s->force_excess) / n;
    if (s->zero_count < p->gyro_zero_samples) {
        return false;
    }
    s->zero_count = 0;
    const bool at_rest = s->gyro_spread <= 3 * (n - 1) * (p->gyro_zero_std * p->gyro_zero_std) &&
                         ahrs_abs(s->force_excess) <= AHRS_ZERO_FORCE &&
                         ahrs_vec3_norm2(mean) <= p->gyro_zero_limit * p->gyro_zero_limit;
    ahrs_set_condition(s, AHRS_HAS_GYRO_ZERO, at_rest);
    return at_rest;
}

static inline ahrs_vec3 ahrs_gyro_zero(const ahrs_estimator_state *s) {
    return ahrs_condition(s, AHRS_HAS_GYRO_ZERO) ? ahrs_vec3_of(s->gyro_zero) : (ahrs_vec3){0, 0, 0};
}

/* Second-order Butterworth low-pass by the trapezoidal rule, warped so that the cut-off is exact. Its two states keep
 * their meaning when the step changes. It begins at rest in the first sample, and anew after one that is not usable;
 * the result is zero then. */
static inline ahrs_vec3 ahrs_smooth_force(ahrs_estimator_state *s, const ahrs_estimator_params *p, ahrs_vec3 force,
                                          bool usable, ahrs_real dt) {
    const ahrs_real turns = p->accel_cutoff * dt;
    const bool begins = !ahrs_condition(s, AHRS_SMOOTHS_FORCE) || turns > AHRS_LOWPASS_STEP;
    ahrs_set_condition(s, AHRS_SMOOTHS_FORCE, usable);
    if (!usable) {
        return (ahrs_vec3){0, 0, 0};
    }
    if (begins) {
        ahrs_vec3_to(s->force_low, force);
        ahrs_vec3_to(s->force_band, (ahrs_vec3){0, 0, 0});
        return force;
    }
    ahrs_real sine, cosine;
    ahrs_sincos(AHRS_PI * turns, &sine, &cosine);
    const ahrs_real g = sine / cosine;
    const ahrs_vec3 low = ahrs_vec3_of(s->force_low), band = ahrs_vec3_of(s->force_band);
    const ahrs_vec3 driven = ahrs_vec3_add_scaled(band, g, ahrs_vec3_sub(force, low));
    const ahrs_vec3 middle = ahrs_vec3_scale(driven, 1 / (1 + g * (g + AHRS_SQRT2)));
    const ahrs_vec3 smooth = ahrs_vec3_add_scaled(low, g, middle);
    ahrs_vec3_to(s->force_band, ahrs_vec3_sub(ahrs_vec3_scale(middle, 2), band));
    ahrs_vec3_to(s->force_low, ahrs_vec3_sub(ahrs_vec3_scale(smooth, 2), low));
    return smooth;
}

#endif
/* Unit quaternions, Hamilton product, scalar first, passed by value.
 * As an attitude q turns body vectors into navigation vectors: v_n = q v_b q* (docs/algorithms.md section 0). */
#ifndef AHRS_QUAT_H
#define AHRS_QUAT_H

/* 3 x 3 matrices, row by row, passed by value. */
#ifndef AHRS_MAT3_H
#define AHRS_MAT3_H


typedef struct {
    ahrs_vec3 row[3];
} ahrs_mat3;

static inline ahrs_vec3 ahrs_mat3_apply(ahrs_mat3 m, ahrs_vec3 v) {
    return (ahrs_vec3){ahrs_vec3_dot(m.row[0], v), ahrs_vec3_dot(m.row[1], v), ahrs_vec3_dot(m.row[2], v)};
}

/* transpose(m) v */
static inline ahrs_vec3 ahrs_mat3_apply_transposed(ahrs_mat3 m, ahrs_vec3 v) {
    const ahrs_vec3 xy = ahrs_vec3_add_scaled(ahrs_vec3_scale(m.row[0], v.x), v.y, m.row[1]);
    return ahrs_vec3_add_scaled(xy, v.z, m.row[2]);
}

static inline ahrs_mat3 ahrs_mat3_mul(ahrs_mat3 a, ahrs_mat3 b) {
    return (ahrs_mat3){{ahrs_mat3_apply_transposed(b, a.row[0]), ahrs_mat3_apply_transposed(b, a.row[1]),
                        ahrs_mat3_apply_transposed(b, a.row[2])}};
}

static inline ahrs_mat3 ahrs_mat3_of(const ahrs_real m[9]) {
    return (ahrs_mat3){{ahrs_vec3_of(m), ahrs_vec3_of(m + 3), ahrs_vec3_of(m + 6)}};
}

static inline void ahrs_mat3_to(ahrs_real out[9], ahrs_mat3 m) {
    ahrs_vec3_to(out, m.row[0]);
    ahrs_vec3_to(out + 3, m.row[1]);
    ahrs_vec3_to(out + 6, m.row[2]);
}

/* transpose(a) b */
static inline ahrs_mat3 ahrs_mat3_transposed_mul(ahrs_mat3 a, ahrs_mat3 b) {
    return (ahrs_mat3){{
        ahrs_mat3_apply_transposed(b, (ahrs_vec3){a.row[0].x, a.row[1].x, a.row[2].x}),
        ahrs_mat3_apply_transposed(b, (ahrs_vec3){a.row[0].y, a.row[1].y, a.row[2].y}),
        ahrs_mat3_apply_transposed(b, (ahrs_vec3){a.row[0].z, a.row[1].z, a.row[2].z}),
    }};
}

/* Symmetric 3 x 3 matrices: the lower triangle, row by row. */
typedef struct {
    ahrs_real xx, yx, yy, zx, zy, zz;
} ahrs_sym3;

static inline ahrs_sym3 ahrs_sym3_of(const ahrs_real a[6]) { return (ahrs_sym3){a[0], a[1], a[2], a[3], a[4], a[5]}; }

static inline void ahrs_sym3_to(ahrs_real out[6], ahrs_sym3 a) {
    out[0] = a.xx;
    out[1] = a.yx;
    out[2] = a.yy;
    out[3] = a.zx;
    out[4] = a.zy;
    out[5] = a.zz;
}

static inline ahrs_mat3 ahrs_sym3_full(ahrs_sym3 a) {
    return (ahrs_mat3){{{a.xx, a.yx, a.zx}, {a.yx, a.yy, a.zy}, {a.zx, a.zy, a.zz}}};
}

static inline ahrs_sym3 ahrs_sym3_scale(ahrs_sym3 a, ahrs_real k) {
    return (ahrs_sym3){k * a.xx, k * a.yx, k * a.yy, k * a.zx, k * a.zy, k * a.zz};
}

static inline ahrs_sym3 ahrs_sym3_add_diagonal(ahrs_sym3 a, ahrs_real k) {
    return (ahrs_sym3){a.xx + k, a.yx, a.yy + k, a.zx, a.zy, a.zz + k};
}

static inline ahrs_vec3 ahrs_sym3_apply(ahrs_sym3 a, ahrs_vec3 v) {
    return (ahrs_vec3){a.xx * v.x + a.yx * v.y + a.zx * v.z, a.yx * v.x + a.yy * v.y + a.zy * v.z,
                       a.zx * v.x + a.zy * v.y + a.zz * v.z};
}

/* Lower triangle of a b, for products that are symmetric. */
static inline ahrs_sym3 ahrs_sym3_product(ahrs_mat3 a, ahrs_mat3 b) {
    const ahrs_vec3 x = {b.row[0].x, b.row[1].x, b.row[2].x}, y = {b.row[0].y, b.row[1].y, b.row[2].y},
                    z = {b.row[0].z, b.row[1].z, b.row[2].z};
    return (ahrs_sym3){ahrs_vec3_dot(a.row[0], x), ahrs_vec3_dot(a.row[1], x), ahrs_vec3_dot(a.row[1], y),
                       ahrs_vec3_dot(a.row[2], x), ahrs_vec3_dot(a.row[2], y), ahrs_vec3_dot(a.row[2], z)};
}

/* The same of transpose(a) b. */
static inline ahrs_sym3 ahrs_sym3_transposed_product(ahrs_mat3 a, ahrs_mat3 b) {
    const ahrs_vec3 *const r = a.row, *const s = b.row;
    return (ahrs_sym3){r[0].x * s[0].x + r[1].x * s[1].x + r[2].x * s[2].x,
                       r[0].y * s[0].x + r[1].y * s[1].x + r[2].y * s[2].x,
                       r[0].y * s[0].y + r[1].y * s[1].y + r[2].y * s[2].y,
                       r[0].z * s[0].x + r[1].z * s[1].x + r[2].z * s[2].x,
                       r[0].z * s[0].y + r[1].z * s[1].y + r[2].z * s[2].y,
                       r[0].z * s[0].z + r[1].z * s[1].z + r[2].z * s[2].z};
}

#endif

typedef struct {
    ahrs_real w, x, y, z;
} ahrs_quat;

#define AHRS_QUAT_IDENTITY ((ahrs_quat){1, 0, 0, 0})

static inline ahrs_quat ahrs_quat_of(const ahrs_real q[4]) { return (ahrs_quat){q[0], q[1], q[2], q[3]}; }

static inline void ahrs_quat_to(ahrs_real out[4], ahrs_quat q) {
    out[0] = q.w;
    out[1] = q.x;
    out[2] = q.y;
    out[3] = q.z;
}

static inline ahrs_quat ahrs_quat_mul(ahrs_quat p, ahrs_quat q) {
    return (ahrs_quat){(p.w * q.w - p.x * q.x) - (p.y * q.y + p.z * q.z),
                       (p.w * q.x + p.x * q.w) + (p.y * q.z - p.z * q.y),
                       (p.w * q.y + p.y * q.w) + (p.z * q.x - p.x * q.z),
                       (p.w * q.z + p.z * q.w) + (p.x * q.y - p.y * q.x)};
}

static inline ahrs_quat ahrs_quat_conj(ahrs_quat q) { return (ahrs_quat){q.w, -q.x, -q.y, -q.z}; }
static inline ahrs_quat ahrs_quat_negate(ahrs_quat q) { return (ahrs_quat){-q.w, -q.x, -q.y, -q.z}; }
static inline ahrs_real ahrs_quat_dot(ahrs_quat p, ahrs_quat q) { return (p.w * q.w + p.x * q.x) + (p.y * q.y + p.z * q.z); }

static inline ahrs_quat ahrs_quat_add(ahrs_quat p, ahrs_quat q) {
    return (ahrs_quat){p.w + q.w, p.x + q.x, p.y + q.y, p.z + q.z};
}

static inline ahrs_quat ahrs_quat_sub(ahrs_quat p, ahrs_quat q) {
    return (ahrs_quat){p.w - q.w, p.x - q.x, p.y - q.y, p.z - q.z};
}

static inline ahrs_quat ahrs_quat_scale(ahrs_quat q, ahrs_real k) {
    return (ahrs_quat){q.w * k, q.x * k, q.y * k, q.z * k};
}

/* q, or -q where that is nearer to the reference: the same attitude without a jump of sign. */
static inline ahrs_quat ahrs_quat_near(ahrs_quat q, ahrs_quat reference) {
    return ahrs_quat_dot(q, reference) < 0 ? ahrs_quat_negate(q) : q;
}

/* The caller makes sure that q is not zero. */
static inline ahrs_quat ahrs_quat_unit(ahrs_quat q) { return ahrs_quat_scale(q, 1 / ahrs_sqrt(ahrs_quat_dot(q, q))); }

/* Takes out the rounding of a product of unit quaternions: one Newton step of 1/sqrt at 1. */
static inline ahrs_quat ahrs_quat_refine(ahrs_quat q) {
    return ahrs_quat_scale(q, AHRS_C(1.5) - AHRS_C(0.5) * ahrs_quat_dot(q, q));
}

/* cos(n/2) and sin(n/2)/n of a rotation vector whose length n has the square n2. */
AHRS_INLINE void ahrs_half_angle(ahrs_real n2, ahrs_real *cosine, ahrs_real *sinc) {
    if (AHRS_UNLIKELY(n2 > AHRS_C(0.01))) {
        const ahrs_real n = ahrs_sqrt(n2);
        ahrs_real s, c;
        ahrs_sincos(AHRS_C(0.5) * n, &s, &c);
        *cosine = c;
        *sinc = s / n;
    } else {
        /* The rotation of one sample seldom exceeds 0.1 rad: the series are short. */
        const ahrs_real n4 = n2 * n2;
        *cosine = (1 - n2 * (AHRS_C(1.0) / 8)) + n4 * (AHRS_C(1.0) / 384 - n2 * (AHRS_C(1.0) / 46080));
        *sinc = (AHRS_C(0.5) - n2 * (AHRS_C(1.0) / 48)) + n4 * (AHRS_C(1.0) / 3840 - n2 * (AHRS_C(1.0) / 645120));
    }
}

/* Rotation vector to quaternion: [cos(|v|/2), sin(|v|/2) v/|v|]. */
AHRS_INLINE ahrs_quat ahrs_quat_exp(ahrs_vec3 v) {
    ahrs_real c, k;
    ahrs_half_angle(ahrs_vec3_norm2(v), &c, &k);
    return (ahrs_quat){c, k * v.x, k * v.y, k * v.z};
}

/* q exp(v), the attitude q after the body has turned by v. The product of q and the vector, [0, v], does not wait for
 * the series. */
AHRS_INLINE ahrs_quat ahrs_quat_turn(ahrs_quat q, ahrs_vec3 v) {
    ahrs_real c, k;
    ahrs_half_angle(ahrs_vec3_norm2(v), &c, &k);
    return (ahrs_quat){c * q.w - k * (q.x * v.x + q.y * v.y + q.z * v.z),
                       c * q.x + k * (q.w * v.x + q.y * v.z - q.z * v.y),
                       c * q.y + k * (q.w * v.y + q.z * v.x - q.x * v.z),
                       c * q.z + k * (q.w * v.z + q.x * v.y - q.y * v.x)};
}

/* Quaternion to the shortest rotation vector. */
static inline ahrs_vec3 ahrs_quat_log(ahrs_quat q) {
    const ahrs_quat p = q.w < 0 ? ahrs_quat_negate(q) : q;
    const ahrs_vec3 v = {p.x, p.y, p.z};
    const ahrs_real sine = ahrs_vec3_norm(v);
    /* Below this the angle and its sine agree to the last bit. */
    const ahrs_real k = sine < AHRS_C(1e-4) * ahrs_sqrt(AHRS_REAL_EPSILON) ? 2 / p.w : 2 * ahrs_atan2(sine, p.w) / sine;
    return ahrs_vec3_scale(v, k);
}

/* The rows of C_nb: the navigation axes seen in body axes. */
enum { AHRS_NORTH, AHRS_EAST, AHRS_DOWN };

static inline ahrs_vec3 ahrs_quat_north(ahrs_quat q) {
    return (ahrs_vec3){(q.w * q.w + q.x * q.x) - (q.y * q.y + q.z * q.z), 2 * (q.x * q.y - q.w * q.z),
                       2 * (q.x * q.z + q.w * q.y)};
}

static inline ahrs_vec3 ahrs_quat_east(ahrs_quat q) {
    return (ahrs_vec3){2 * (q.x * q.y + q.w * q.z), (q.w * q.w - q.x * q.x) + (q.y * q.y - q.z * q.z),
                       2 * (q.y * q.z - q.w * q.x)};
}

static inline ahrs_vec3 ahrs_quat_down(ahrs_quat q) {
    return (ahrs_vec3){2 * (q.x * q.z - q.w * q.y), 2 * (q.y * q.z + q.w * q.x),
                       (q.w * q.w - q.x * q.x) - (q.y * q.y - q.z * q.z)};
}

AHRS_INLINE ahrs_mat3 ahrs_quat_to_mat3(ahrs_quat q) {
    return (ahrs_mat3){{ahrs_quat_north(q), ahrs_quat_east(q), ahrs_quat_down(q)}};
}

/* Body to navigation, and back. */
static inline ahrs_vec3 ahrs_quat_rotate(ahrs_quat q, ahrs_vec3 v) { return ahrs_mat3_apply(ahrs_quat_to_mat3(q), v); }

static inline ahrs_vec3 ahrs_quat_rotate_back(ahrs_quat q, ahrs_vec3 v) {
    return ahrs_mat3_apply_transposed(ahrs_quat_to_mat3(q), v);
}

/* From a rotation matrix, whose entries give four times the products of one component with all of them. That
 * component, half the root of the pivot, is the largest one: no division is by a small number. */
static inline ahrs_quat ahrs_quat_from_mat3(ahrs_mat3 c) {
    const ahrs_vec3 *r = c.row;
    ahrs_quat q;
    ahrs_real pivot;
    if (r[0].x + r[1].y + r[2].z > 0) {
        pivot = 1 + r[0].x + r[1].y + r[2].z;
        q = (ahrs_quat){pivot, r[2].y - r[1].z, r[0].z - r[2].x, r[1].x - r[0].y};
    } else if (r[0].x >= r[1].y && r[0].x >= r[2].z) {
        pivot = 1 + r[0].x - r[1].y - r[2].z;
        q = (ahrs_quat){r[2].y - r[1].z, pivot, r[1].x + r[0].y, r[0].z + r[2].x};
    } else if (r[1].y >= r[2].z) {
        pivot = 1 - r[0].x + r[1].y - r[2].z;
        q = (ahrs_quat){r[0].z - r[2].x, r[1].x + r[0].y, pivot, r[2].y + r[1].z};
    } else {
        pivot = 1 - r[0].x - r[1].y + r[2].z;
        q = (ahrs_quat){r[1].x - r[0].y, r[0].z + r[2].x, r[2].y + r[1].z, pivot};
    }
    return ahrs_quat_scale(q, AHRS_C(0.5) / pivot * ahrs_sqrt(pivot));
}

/* Roll, pitch and yaw, z-y-x order (docs/algorithms.md section 0). */
static inline ahrs_vec3 ahrs_quat_to_euler(ahrs_quat q) {
    const ahrs_vec3 down = ahrs_quat_down(q);
    const ahrs_real north_x = (q.w * q.w + q.x * q.x) - (q.y * q.y + q.z * q.z);
    /* The arc tangent keeps its accuracy at 90 deg of pitch, where the arc sine loses half of the digits. */
    const ahrs_real level = ahrs_sqrt(down.y * down.y + down.z * down.z);
    return (ahrs_vec3){ahrs_atan2(down.y, down.z), ahrs_atan2(-down.x, level),
                       ahrs_atan2(2 * (q.x * q.y + q.w * q.z), north_x)};
}

static inline ahrs_quat ahrs_quat_from_euler(ahrs_vec3 euler) {
    ahrs_real sr, cr, sp, cp, sy, cy;
    ahrs_sincos(AHRS_C(0.5) * euler.x, &sr, &cr);
    ahrs_sincos(AHRS_C(0.5) * euler.y, &sp, &cp);
    ahrs_sincos(AHRS_C(0.5) * euler.z, &sy, &cy);
    return (ahrs_quat){cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
                       cr * cp * sy - sr * sp * cy};
}

#endif

/* Larger samples are not physical and count as no measurement; their squares still fit into a float. */
#define AHRS_GYRO_LIMIT AHRS_C(1e3)
#define AHRS_ACCEL_LIMIT AHRS_C(1e4)
#define AHRS_MAG_LIMIT AHRS_C(1.0)

#define AHRS_ACCEL_LEAST AHRS_C(0.1)  /* of gravity: below is free fall */
#define AHRS_MAG_LEAST AHRS_C(1e-3)   /* of the reference field */
#define AHRS_MAG_SINE AHRS_C(0.05)    /* of the angle between field and gravity: below there is no heading */
#define AHRS_LONGEST_STEP AHRS_C(0.5) /* s: after a longer gap the attitude is carried on, not corrected */
#define AHRS_REST_RATE AHRS_C(0.1)    /* rad/s: faster is motion */
#define AHRS_REST_FORCE AHRS_C(0.5)   /* m/s2: specific force further from gravity is motion */

typedef enum {
    AHRS_WAIT,  /* nothing to do: no attitude yet, or no time has passed */
    AHRS_START, /* an attitude is in the common state, the first or one with a new zero of the gyroscope: begin from it */
    AHRS_TURN,  /* as AHRS_RUN, after taking over the attitude in the common state: its heading was turned */
    AHRS_RUN    /* predict and correct */
} ahrs_action;

/* One sample in inner axes. Vectors that are not usable are zero. */
typedef struct {
    ahrs_vec3 rate;  /* rad/s */
    ahrs_vec3 force; /* m/s2, the accelerometer as read */
    ahrs_vec3 accel; /* m/s2, without the motion acceleration where that is compensated */
    ahrs_vec3 mag;   /* T */
    ahrs_vec3 motion; /* m/s2, expected motion acceleration; only where it is compensated or not measured */
    bool force_usable, accel_usable, mag_usable;
    ahrs_real dt;      /* s, of the prediction */
    ahrs_real gain_dt; /* s, of the correction: 0 after a gap */
} ahrs_sample;

/* Forward-left-up to forward-right-down, and back. */
AHRS_INLINE ahrs_vec3 ahrs_swap_body(int32_t frame, ahrs_vec3 v) {
    return AHRS_UNLIKELY(frame == AHRS_FRAME_ENU) ? (ahrs_vec3){v.x, -v.y, -v.z} : v;
}

/* North-east-down with forward-right-down to east-north-up with forward-left-up, and back: two half turns. */
static inline ahrs_quat ahrs_swap_frames(ahrs_quat q) {
    const ahrs_real r = AHRS_C(0.70710678118654752440);
    return (ahrs_quat){r * (q.w + q.z), r * (q.x + q.y), r * (q.x - q.y), r * (q.w - q.z)};
}

/* Turns the navigation frame of an inner attitude by the declination, in the inner axes. */
static inline ahrs_quat ahrs_decline(ahrs_quat q, ahrs_real declination) {
    ahrs_real sine, cosine;
    ahrs_sincos(AHRS_C(0.5) * declination, &sine, &cosine);
    return ahrs_quat_mul((ahrs_quat){cosine, 0, 0, sine}, q);
}

static inline ahrs_quat ahrs_to_output_frame(const ahrs_estimator_params *p, ahrs_quat q) {
    const ahrs_quat declined = p->declination != 0 ? ahrs_decline(q, p->declination) : q;
    return p->frame == AHRS_FRAME_ENU ? ahrs_swap_frames(declined) : declined;
}

static inline ahrs_quat ahrs_from_output_frame(const ahrs_estimator_params *p, ahrs_quat q) {
    const ahrs_quat inner = p->frame == AHRS_FRAME_ENU ? ahrs_swap_frames(q) : q;
    return p->declination != 0 ? ahrs_decline(inner, -p->declination) : inner;
}

/* Whether the angle between field and vertical leaves a heading; never for a zero field. */
static inline bool ahrs_has_horizontal_part(ahrs_vec3 mag, ahrs_vec3 vertical) {
    const ahrs_real along = ahrs_vec3_dot(vertical, mag);
    return along * along < (1 - AHRS_MAG_SINE * AHRS_MAG_SINE) * (ahrs_vec3_norm2(vertical) * ahrs_vec3_norm2(mag));
}

/* Attitude from specific force and field, accelerometer first, exact for all attitudes (docs/algorithms.md
 * section 2). With a zero field the heading is zero. */
static inline ahrs_quat ahrs_attitude_of(ahrs_vec3 force, ahrs_vec3 mag) {
    const ahrs_vec3 down = ahrs_vec3_unit(ahrs_vec3_negate(force));
    if (ahrs_vec3_norm2(mag) > 0) {
        const ahrs_vec3 east = ahrs_vec3_unit(ahrs_vec3_cross(down, mag));
        return ahrs_quat_from_mat3((ahrs_mat3){{ahrs_vec3_cross(east, down), east, down}});
    }
    const ahrs_real roll = ahrs_atan2(down.y, down.z);
    const ahrs_real pitch = ahrs_atan2(-down.x, ahrs_sqrt(down.y * down.y + down.z * down.z));
    return ahrs_quat_from_euler((ahrs_vec3){roll, pitch, 0});
}

/* Reads one sample: which parts are usable by themselves, and all of it in inner axes. Comparisons of squared norms
 * fail for NaN and infinity. */
AHRS_INLINE ahrs_sample ahrs_read_sample(ahrs_estimator_state *s, const ahrs_estimator_params *p,
                                         const ahrs_estimator_inputs *u, ahrs_real dt) {
    ahrs_sample z = {.dt = dt, .gain_dt = dt > AHRS_LONGEST_STEP ? 0 : dt};
    const ahrs_vec3 gyro = ahrs_swap_body(p->frame, ahrs_vec3_of(u->gyro));
    const ahrs_vec3 accel = ahrs_swap_body(p->frame, ahrs_vec3_of(u->accel));
    const ahrs_vec3 mag = ahrs_swap_body(p->frame, ahrs_calibrated_mag(p, u->mag));
    if (ahrs_vec3_norm2(gyro) <= AHRS_GYRO_LIMIT * AHRS_GYRO_LIMIT) {
        z.rate = gyro;
        ahrs_vec3_to(s->gyro, z.rate);
    } else {
        z.rate = ahrs_vec3_of(s->gyro);
        s->conditions |= AHRS_GYRO_HELD;
    }
    const ahrs_real least = AHRS_ACCEL_LEAST * p->gravity;
    const ahrs_real force2 = ahrs_vec3_norm2(accel), mag2 = ahrs_vec3_norm2(mag);
    if (u->accel_valid && force2 > least * least && force2 <= AHRS_ACCEL_LIMIT * AHRS_ACCEL_LIMIT) {
        z.force = accel;
        z.force_usable = true;
    }
    if (AHRS_UNLIKELY(p->accel_cutoff > 0)) {
        z.force = ahrs_smooth_force(s, p, accel, z.force_usable, dt);
        z.force_usable = ahrs_vec3_norm2(z.force) > least * least;
    }
    const ahrs_real field2 = s->field[0] * s->field[0] + s->field[1] * s->field[1]; /* 0 until it is known */
    if (u->mag_valid && mag2 > AHRS_MAG_LEAST * AHRS_MAG_LEAST * field2 && mag2 <= AHRS_MAG_LIMIT * AHRS_MAG_LIMIT) {
        z.mag = mag;
        z.mag_usable = z.force_usable ? ahrs_has_horizontal_part(mag, z.force)
                                      : ahrs_has_horizontal_part(mag, ahrs_quat_down(ahrs_quat_of(s->q)));
    }
    return z;
}

/* Keeps the reference field: as given, or as this sample shows it at the present attitude. */
static inline void ahrs_learn_field(ahrs_estimator_state *s, const ahrs_estimator_params *p, ahrs_vec3 mag) {
    if (p->field_reference == AHRS_FIELD_REFERENCE_GIVEN) {
        ahrs_real sine, cosine;
        ahrs_sincos(p->field_dip, &sine, &cosine);
        s->field[0] = p->field_magnitude * cosine;
        s->field[1] = p->field_magnitude * sine;
        s->conditions |= AHRS_HAS_FIELD;
    } else if (ahrs_vec3_norm2(mag) > 0) {
        const ahrs_vec3 m = ahrs_quat_rotate(ahrs_quat_of(s->q), mag);
        s->field[0] = ahrs_sqrt(m.x * m.x + m.y * m.y);
        s->field[1] = m.z;
        s->conditions |= AHRS_HAS_FIELD;
    }
}

static inline bool ahrs_moves(const ahrs_estimator_params *p, const ahrs_sample *z) {
    return ahrs_vec3_norm2(z->rate) > AHRS_REST_RATE * AHRS_REST_RATE ||
           (z->force_usable && ahrs_abs(ahrs_vec3_norm(z->force) - p->gravity) > AHRS_REST_FORCE);
}

/* Averages usable samples into the first attitude; true when it is complete. */
static inline bool ahrs_initialise_from_sensors(ahrs_estimator_state *s, const ahrs_estimator_params *p,
                                                const ahrs_sample *z) {
    if (ahrs_condition(s, AHRS_ACCEL_SUMMED)) {
        s->elapsed += z->dt;
    }
    if (z->force_usable) {
        ahrs_vec3_to(s->accel_sum, ahrs_vec3_add(ahrs_vec3_of(s->accel_sum), z->force));
        s->conditions |= AHRS_ACCEL_SUMMED;
    }
    if (z->mag_usable) {
        ahrs_vec3_to(s->mag_sum, ahrs_vec3_add(ahrs_vec3_of(s->mag_sum), z->mag));
        s->conditions |= AHRS_MAG_SUMMED;
    }
    if (ahrs_moves(p, z)) {
        s->conditions |= AHRS_MOVED;
    }
    const ahrs_vec3 force = ahrs_vec3_of(s->accel_sum), mag = ahrs_vec3_of(s->mag_sum);
    if (!ahrs_condition(s, AHRS_ACCEL_SUMMED) || !(ahrs_vec3_norm2(force) > 0)) {
        return false;
    }
    const bool heading = ahrs_condition(s, AHRS_MAG_SUMMED) && ahrs_has_horizontal_part(mag, force);
    ahrs_quat_to(s->q, ahrs_attitude_of(force, heading ? mag : (ahrs_vec3){0, 0, 0}));
    ahrs_set_condition(s, AHRS_HAS_HEADING, heading);
    return s->elapsed >= p->init_time;
}

/* The motion acceleration: what the accelerometer reads beyond gravity. */
AHRS_INLINE ahrs_vec3 ahrs_motion(const ahrs_estimator_state *s, const ahrs_estimator_params *p) {
    return ahrs_vec3_add_scaled(ahrs_vec3_of(s->force), p->gravity, ahrs_quat_down(ahrs_quat_of(s->q)));
}

/* Keeps the force that makes this motion acceleration at the present attitude. */
AHRS_INLINE void ahrs_set_motion(ahrs_estimator_state *s, const ahrs_estimator_params *p, ahrs_vec3 motion) {
    ahrs_vec3_to(s->force, ahrs_vec3_add_scaled(motion, -p->gravity, ahrs_quat_down(ahrs_quat_of(s->q))));
}

static inline void ahrs_start(ahrs_estimator_state *s, const ahrs_estimator_params *p, const ahrs_sample *z) {
    s->conditions |= AHRS_HAS_ATTITUDE;
    ahrs_learn_field(s, p, z->mag_usable ? z->mag : (ahrs_vec3){0, 0, 0});
    if (z->force_usable) {
        ahrs_vec3_to(s->force, z->force);
    } else {
        ahrs_set_motion(s, p, (ahrs_vec3){0, 0, 0});
    }
    ahrs_set_condition(s, AHRS_ACCEL_USED, z->force_usable);
    ahrs_set_condition(s, AHRS_MAG_USED, z->mag_usable);
}

/* Whether the accelerometer is so far from gravity that it is ignored, for a limited time. */
AHRS_INLINE bool ahrs_is_gated(ahrs_estimator_state *s, const ahrs_estimator_params *p, const ahrs_sample *z) {
    if (ahrs_abs(ahrs_vec3_norm(z->force) - p->gravity) <= p->accel_gate) {
        s->gated = 0;
        return false;
    }
    s->gated = ahrs_min(s->gated + z->dt, p->accel_gate_time + 1);
    return s->gated <= p->accel_gate_time;
}

/* Turns the attitude about the vertical so that the field points north. */
static inline void ahrs_align_heading(ahrs_estimator_state *s, ahrs_vec3 mag) {
    const ahrs_quat q = ahrs_quat_of(s->q);
    const ahrs_vec3 m = ahrs_quat_rotate(q, mag);
    ahrs_real sine, cosine;
    ahrs_sincos(AHRS_C(-0.5) * ahrs_atan2(m.y, m.x), &sine, &cosine);
    ahrs_quat_to(s->q, ahrs_quat_near(ahrs_quat_mul((ahrs_quat){cosine, 0, 0, sine}, q), q));
    s->conditions |= AHRS_HAS_HEADING;
}

/* Takes heading and reference field, what of them is missing, from a sample; true if the attitude was turned. */
static inline bool ahrs_take_up_field(ahrs_estimator_state *s, const ahrs_estimator_params *p, ahrs_vec3 mag) {
    const bool turn = !ahrs_condition(s, AHRS_HAS_HEADING);
    if (turn) {
        ahrs_align_heading(s, mag);
    }
    if (!ahrs_condition(s, AHRS_HAS_FIELD)) {
        ahrs_learn_field(s, p, mag);
    }
    return turn;
}

/* The part of a sample that needs an attitude: reference field, gating, motion compensation. */
AHRS_INLINE ahrs_action ahrs_prepare_sample(ahrs_estimator_state *s, const ahrs_estimator_params *p, ahrs_sample *z) {
    bool turn = false;
    const int32_t known = AHRS_HAS_HEADING | AHRS_HAS_FIELD;
    if (AHRS_UNLIKELY(z->mag_usable && (s->conditions & known) != known)) {
        const ahrs_vec3 mag = z->mag; /* a copy, so that the sample may stay in registers */
        turn = ahrs_take_up_field(s, p, mag);
    }
    z->accel_usable = z->force_usable && !(p->accel_gating && ahrs_is_gated(s, p, z));
    z->accel = z->force;
    if (p->motion_compensation || !z->force_usable) {
        z->motion = ahrs_motion(s, p);
    }
    if (p->motion_compensation) {
        z->motion = ahrs_vec3_scale(z->motion, ahrs_exp_decay(z->dt / p->motion_time_constant));
        z->accel = ahrs_vec3_sub(z->force, z->motion);
        z->accel_usable = z->accel_usable && ahrs_vec3_norm2(z->accel) > 0;
    }
    if (z->force_usable) {
        ahrs_vec3_to(s->force, z->force);
    }
    const bool correcting = z->gain_dt > 0;
    s->conditions |= (z->accel_usable && correcting ? AHRS_ACCEL_USED : 0) |
                     (z->mag_usable && correcting ? AHRS_MAG_USED : 0);
    return turn ? AHRS_TURN : AHRS_RUN;
}

static inline void ahrs_estimator_init(ahrs_estimator_state *s) {
    *s = (ahrs_estimator_state){.q = {1, 0, 0, 0}};
}

/* The first attitude, as soon as there is one. */
static inline ahrs_action ahrs_initialise(ahrs_estimator_state *s, const ahrs_estimator_params *p,
                                          const ahrs_sample *z) {
    if (p->initialisation == AHRS_INITIALISATION_GIVEN) {
        ahrs_quat_to(s->q, ahrs_from_output_frame(p, ahrs_quat_unit(ahrs_quat_of(p->q0))));
        s->conditions |= AHRS_HAS_HEADING;
    } else if (!ahrs_initialise_from_sensors(s, p, z)) {
        return AHRS_WAIT;
    }
    ahrs_start(s, p, z);
    return AHRS_START;
}

/* Takes in one sample and tells the estimator what to do with it. */
AHRS_INLINE ahrs_action ahrs_estimator_begin(ahrs_estimator_state *s, const ahrs_estimator_params *p,
                                             const ahrs_estimator_inputs *u, ahrs_real dt, ahrs_sample *z) {
    const bool has_attitude = ahrs_condition(s, AHRS_HAS_ATTITUDE);
    if (AHRS_UNLIKELY(!(dt > 0 && dt <= AHRS_REAL_MAX))) {
        if (dt != 0) {
            s->conditions |= AHRS_STEP_REJECTED;
            return AHRS_WAIT;
        }
        if (has_attitude) {
            return AHRS_WAIT;
        }
    }
    s->conditions &= ~AHRS_MOMENTARY;
    *z = ahrs_read_sample(s, p, u, dt);
    bool zeroed = false;
    if (AHRS_UNLIKELY(p->gyro_zero_samples > 0 && !ahrs_condition(s, AHRS_GYRO_HELD))) {
        zeroed = z->force_usable && ahrs_learn_gyro_zero(s, p, z->rate, ahrs_vec3_norm(z->force));
        z->rate = ahrs_vec3_sub(z->rate, ahrs_gyro_zero(s));
        ahrs_vec3_to(s->gyro, z->rate);
    }
    if (AHRS_UNLIKELY(!has_attitude)) {
        const ahrs_sample first = *z; /* a copy, so that the sample itself may stay in registers */
        return ahrs_initialise(s, p, &first);
    }
    const ahrs_action action = ahrs_prepare_sample(s, p, z);
    return zeroed ? AHRS_START : action;
}

/* Takes over the attitude after a sample, a unit quaternion; one that has lost its meaning is initialised anew. */
AHRS_INLINE void ahrs_estimator_end(ahrs_estimator_state *s, const ahrs_estimator_params *p, const ahrs_sample *z,
                                    ahrs_quat q) {
    ahrs_quat next = q;
    /* The cosine of half the angle turned within the sample: near one, unless q has changed its sign or is lost. */
    const ahrs_real along = ahrs_quat_dot(q, ahrs_quat_of(s->q));
    if (AHRS_UNLIKELY(!(along > AHRS_C(0.75) && along < AHRS_C(1.25)))) {
        const ahrs_real norm2 = ahrs_quat_dot(q, q);
        if (!(norm2 > AHRS_C(0.5) && norm2 < AHRS_C(2.0))) {
            ahrs_estimator_init(s);
            return;
        }
        if (along < 0) {
            next = ahrs_quat_negate(q);
        }
    }
    ahrs_quat_to(s->q, next);
    if (AHRS_UNLIKELY(!z->force_usable)) {
        ahrs_set_motion(s, p, z->motion);
    }
}

static inline int32_t ahrs_status_of(const ahrs_estimator_state *s) {
    if (!ahrs_condition(s, AHRS_HAS_ATTITUDE)) {
        return ahrs_condition(s, AHRS_MOVED) ? AHRS_STATUS_INITIALISING_IN_MOTION : AHRS_STATUS_INITIALISING;
    }
    if (ahrs_condition(s, AHRS_IMPLAUSIBLE)) {
        return AHRS_STATUS_IMPLAUSIBLE;
    }
    if (ahrs_condition(s, AHRS_COVARIANCE_RESET)) {
        return AHRS_STATUS_COVARIANCE_RESET;
    }
    if (ahrs_condition(s, AHRS_STEP_REJECTED)) {
        return AHRS_STATUS_STEP_REJECTED;
    }
    if (ahrs_condition(s, AHRS_GYRO_HELD)) {
        return AHRS_STATUS_GYRO_HELD;
    }
    if (!ahrs_condition(s, AHRS_ACCEL_USED)) {
        return AHRS_STATUS_ACCEL_UNUSED;
    }
    if (!ahrs_condition(s, AHRS_MAG_USED)) {
        return AHRS_STATUS_MAG_UNUSED;
    }
    return ahrs_condition(s, AHRS_MAG_DISTURBED) ? AHRS_STATUS_MAG_DISTURBED : AHRS_STATUS_NOMINAL;
}

/* The common outputs; `bias` is the gyroscope bias that the estimator has learned, in inner axes. */
static inline void ahrs_estimator_outputs(const ahrs_estimator_state *s, const ahrs_estimator_params *p,
                                          ahrs_vec3 bias, ahrs_estimator_outputs_t *y) {
    const ahrs_quat q = ahrs_to_output_frame(p, ahrs_quat_of(s->q));
    const ahrs_vec3 euler = ahrs_quat_to_euler(q);
    ahrs_quat_to(y->q, q);
    y->roll = euler.x;
    y->pitch = euler.y;
    y->yaw = euler.z;
    ahrs_vec3_to(y->rate, ahrs_swap_body(p->frame, ahrs_vec3_sub(ahrs_vec3_of(s->gyro), bias)));
    ahrs_vec3_to(y->gyro_bias, ahrs_swap_body(p->frame, ahrs_vec3_add(bias, ahrs_gyro_zero(s))));
    const ahrs_vec3 motion = ahrs_condition(s, AHRS_HAS_ATTITUDE) ? ahrs_motion(s, p) : (ahrs_vec3){0, 0, 0};
    ahrs_vec3_to(y->motion_accel, ahrs_swap_body(p->frame, motion));
    y->status = ahrs_status_of(s);
    y->gyro_held = ahrs_condition(s, AHRS_GYRO_HELD);
    y->accel_used = ahrs_condition(s, AHRS_ACCEL_USED);
    y->mag_used = ahrs_condition(s, AHRS_MAG_USED);
}

#endif

/* Tilt from gravity, heading from the horizontal field, as a rotation vector in body axes for small errors: loop gain one
 * on all axes. The rows of c are the navigation axes seen from the body. */
AHRS_INLINE ahrs_vec3 ahrs_decoupled_error(ahrs_mat3 c, const ahrs_sample *z) {
    ahrs_vec3 e = {0, 0, 0};
    if (z->accel_usable) {
        e = ahrs_vec3_cross(c.row[AHRS_DOWN], ahrs_vec3_unit(z->accel)); /* a x s with s = -down */
    }
    if (z->mag_usable) {
        const ahrs_real x = ahrs_vec3_dot(c.row[AHRS_NORTH], z->mag);
        const ahrs_real y = ahrs_vec3_dot(c.row[AHRS_EAST], z->mag);
        const ahrs_real norm2 = x * x + y * y;
        if (norm2 > 0) { /* y/norm, where quotient and root do not wait for each other */
            e = ahrs_vec3_sub(e, ahrs_vec3_scale(c.row[AHRS_DOWN], y / norm2 * ahrs_sqrt(norm2)));
        }
    }
    return e;
}

/* The shortest rotation vector that brings down to where the accelerometer shows it. */
static inline ahrs_vec3 ahrs_tilt_error(ahrs_vec3 down, ahrs_vec3 force) {
    const ahrs_vec3 measured = ahrs_vec3_unit(ahrs_vec3_negate(force));
    const ahrs_vec3 cross = ahrs_vec3_cross(measured, down);
    const ahrs_real sine = ahrs_vec3_norm(cross);
    return sine > 0 ? ahrs_vec3_scale(cross, ahrs_atan2(sine, ahrs_vec3_dot(measured, down)) / sine) : cross;
}

/* Whether both vectors together show an attitude. The front end has looked at the accelerometer as read; here it is the
 * one that motion compensation leaves. */
static inline bool ahrs_shows_attitude(const ahrs_sample *z) {
    return z->accel_usable && z->mag_usable && ahrs_has_horizontal_part(z->mag, z->accel);
}

/* The rotation from a predicted attitude to the one that accelerometer and magnetometer show; of what cannot be used,
 * the prediction is kept. */
static inline ahrs_vec3 ahrs_attitude_error(ahrs_quat q, const ahrs_sample *z) {
    if (ahrs_shows_attitude(z)) {
        return ahrs_quat_log(ahrs_quat_mul(ahrs_quat_conj(q), ahrs_attitude_of(z->accel, z->mag)));
    }
    return z->accel_usable ? ahrs_tilt_error(ahrs_quat_down(q), z->accel)
                           : ahrs_decoupled_error(ahrs_quat_to_mat3(q), z);
}

/* The attitude that accelerometer and magnetometer show, with the sign of the predicted one. */
static inline ahrs_quat ahrs_measured_attitude(ahrs_quat q, const ahrs_sample *z) {
    if (ahrs_shows_attitude(z)) {
        return ahrs_quat_near(ahrs_attitude_of(z->accel, z->mag), q);
    }
    return ahrs_quat_turn(q, ahrs_attitude_error(q, z));
}

#endif
/* Rotation of one sample as truncated series in the angle increment d = rate times interval; q (x) increment is the
 * attitude after it, not of unit length (docs/algorithms.md section 1). */
#ifndef AHRS_INCREMENT_H
#define AHRS_INCREMENT_H


/* rad: beyond this the series mean nothing, and the exact rotation takes their place. */
#define AHRS_INCREMENT_MAX AHRS_C(1.0)

AHRS_INLINE bool ahrs_increment_is_large(ahrs_real s) { return AHRS_UNLIKELY(s > AHRS_INCREMENT_MAX * AHRS_INCREMENT_MAX); }

/* First order: 1 + OM(d)/2. */
static inline ahrs_quat ahrs_increment_first(ahrs_vec3 d) {
    if (ahrs_increment_is_large(ahrs_vec3_norm2(d))) {
        return ahrs_quat_exp(d);
    }
    return (ahrs_quat){1, AHRS_C(0.5) * d.x, AHRS_C(0.5) * d.y, AHRS_C(0.5) * d.z};
}

/* Second order. */
static inline ahrs_quat ahrs_increment_second(ahrs_vec3 d) {
    const ahrs_real s = ahrs_vec3_norm2(d);
    if (ahrs_increment_is_large(s)) {
        return ahrs_quat_exp(d);
    }
    return (ahrs_quat){1 - AHRS_C(0.125) * s, AHRS_C(0.5) * d.x, AHRS_C(0.5) * d.y, AHRS_C(0.5) * d.z};
}

/* Fourth order. */
static inline ahrs_quat ahrs_increment(ahrs_vec3 d) {
    const ahrs_real s = ahrs_vec3_norm2(d);
    if (ahrs_increment_is_large(s)) {
        return ahrs_quat_exp(d);
    }
    const ahrs_real k = AHRS_C(0.5) - s / 48;
    return (ahrs_quat){1 - s / 8 + s * s / 384, k * d.x, k * d.y, k * d.z};
}

#endif
/* Noise densities as variances of one sample (docs/algorithms.md section 6). White noise of density N has the variance
 * N^2/T per sample of interval T, and an integrated one grows by N^2 T. */
#ifndef AHRS_NOISE_H
#define AHRS_NOISE_H


/* rad/s/sqrt(Hz): how wrong a rate is that was not measured, because a sample was unusable or the step too long. */
#define AHRS_HELD_NOISE AHRS_C(0.1)

/* Of white noise in one sample; the sensor's interval, whatever the step since the sample before. */
static inline ahrs_real ahrs_sample_variance(const ahrs_estimator_params *p, ahrs_real density) {
    return density * density / p->sample_time;
}

/* Of the rotation in one step, rad2. */
static inline ahrs_real ahrs_turn_variance(const ahrs_estimator_state *s, const ahrs_sample *z, ahrs_real density) {
    const bool held = ahrs_condition(s, AHRS_GYRO_HELD) || !(z->gain_dt > 0);
    return (density * density + (held ? AHRS_HELD_NOISE * AHRS_HELD_NOISE : 0)) * z->dt;
}

/* Of what motion compensation leaves of a changing acceleration, (m/s2)2: it is that of the sample before. */
static inline ahrs_real ahrs_motion_variance(const ahrs_estimator_params *p, const ahrs_sample *z, ahrs_real density) {
    return p->motion_compensation ? density * density * z->dt : 0;
}

#endif
/* Covariance of the four elements of a quaternion, as a triangle of matrix.h. */
#ifndef AHRS_QUATERNION_COVARIANCE_H
#define AHRS_QUATERNION_COVARIANCE_H

/* Small symmetric and triangular matrices. Both are kept as their lower triangle, row by row without gaps; rectangular
 * ones row by row. The sizes are arguments, so that they are constants wherever a function is inlined. */
#ifndef AHRS_MATRIX_H
#define AHRS_MATRIX_H


enum { AHRS_MATRIX_MAX = 12 };

/* Number of elements of a triangle with n rows, and so the place of row n in a larger one. */
#define AHRS_TRIANGLE(n) ((n) * ((n) + 1) / 2)

/* Element (i, j) of a symmetric matrix. */
static inline ahrs_real *ahrs_at(ahrs_real *a, int32_t i, int32_t j) {
    return i >= j ? &a[AHRS_TRIANGLE(i) + j] : &a[AHRS_TRIANGLE(j) + i];
}

static inline ahrs_real ahrs_of(const ahrs_real *a, int32_t i, int32_t j) {
    return i >= j ? a[AHRS_TRIANGLE(i) + j] : a[AHRS_TRIANGLE(j) + i];
}

static inline void ahrs_add_diagonal(int32_t n, ahrs_real *a, ahrs_real k) {
    for (int32_t i = 0; i < n; i++) {
        a[AHRS_TRIANGLE(i) + i] += k;
    }
}

/* a = L L'; false where a is not positive definite. l may be a. */
static inline bool ahrs_cholesky(int32_t n, const ahrs_real *a, ahrs_real *l) {
    for (int32_t i = 0; i < n; i++) {
        ahrs_real *const row = &l[AHRS_TRIANGLE(i)];
        for (int32_t j = 0; j <= i; j++) {
            const ahrs_real *const other = &l[AHRS_TRIANGLE(j)];
            ahrs_real sum = a[AHRS_TRIANGLE(i) + j];
            for (int32_t k = 0; k < j; k++) {
                sum -= row[k] * other[k];
            }
            if (j < i) {
                row[j] = sum / other[j];
            } else if (sum > 0 && ahrs_is_finite(sum)) {
                row[j] = ahrs_sqrt(sum);
            } else {
                return false;
            }
        }
    }
    return true;
}

/* Whether every eigenvalue of a is above the floor. */
static inline bool ahrs_is_above(int32_t n, const ahrs_real *a, ahrs_real floor) {
    ahrs_real l[AHRS_TRIANGLE(AHRS_MATRIX_MAX)];
    for (int32_t i = 0; i < AHRS_TRIANGLE(n); i++) {
        l[i] = a[i];
    }
    ahrs_add_diagonal(n, l, -floor);
    return ahrs_cholesky(n, l, l);
}

/* x := L^-1 x */
static inline void ahrs_solve_lower(int32_t n, const ahrs_real *l, ahrs_real *x) {
    for (int32_t i = 0; i < n; i++) {
        const ahrs_real *const row = &l[AHRS_TRIANGLE(i)];
        for (int32_t k = 0; k < i; k++) {
            x[i] -= row[k] * x[k];
        }
        x[i] /= row[i];
    }
}

/* x := L'^-1 x */
static inline void ahrs_solve_upper(int32_t n, const ahrs_real *l, ahrs_real *x) {
    for (int32_t i = n - 1; i >= 0; i--) {
        for (int32_t k = i + 1; k < n; k++) {
            x[i] -= l[AHRS_TRIANGLE(k) + i] * x[k];
        }
        x[i] /= l[AHRS_TRIANGLE(i) + i];
    }
}

/* The triangle l with l l' = a a' for a of n rows and m >= n columns, by reflections; a is destroyed. False where a row
 * depends on those above it. */
static inline bool ahrs_triangle_of(int32_t n, int32_t m, ahrs_real *a, ahrs_real *l) {
    for (int32_t i = 0; i < n; i++) {
        ahrs_real *const pivot = &a[i * m];
        ahrs_real norm2 = 0;
        for (int32_t k = i; k < m; k++) {
            norm2 += pivot[k] * pivot[k];
        }
        if (!(norm2 > 0 && ahrs_is_finite(norm2))) {
            return false;
        }
        /* The reflection brings the rest of the row onto the axis that leaves the larger mirror vector. */
        const ahrs_real norm = ahrs_sqrt(norm2);
        const ahrs_real side = pivot[i] < 0 ? -1 : 1;
        pivot[i] += side * norm;
        const ahrs_real scale = 1 / (norm * ahrs_abs(pivot[i]));
        for (int32_t r = i + 1; r < n; r++) {
            ahrs_real *const row = &a[r * m];
            ahrs_real dot = 0;
            for (int32_t k = i; k < m; k++) {
                dot += pivot[k] * row[k];
            }
            for (int32_t k = i; k < m; k++) {
                row[k] -= scale * dot * pivot[k];
            }
            l[AHRS_TRIANGLE(r) + i] = -side * row[i]; /* the diagonal is positive */
        }
        l[AHRS_TRIANGLE(i) + i] = norm;
    }
    return true;
}

/* l l' + sign x x' as a triangle again; x is destroyed. False, and l destroyed, where that is not positive definite. */
static inline bool ahrs_add_square(int32_t n, ahrs_real *l, ahrs_real *x, ahrs_real sign) {
    for (int32_t i = 0; i < n; i++) {
        ahrs_real *const diagonal = &l[AHRS_TRIANGLE(i) + i];
        const ahrs_real norm2 = *diagonal * *diagonal + sign * x[i] * x[i];
        if (!(norm2 > 0 && ahrs_is_finite(norm2))) {
            return false;
        }
        const ahrs_real norm = ahrs_sqrt(norm2);
        const ahrs_real c = *diagonal / norm, s = x[i] / norm;
        *diagonal = norm;
        for (int32_t k = i + 1; k < n; k++) {
            ahrs_real *const below = &l[AHRS_TRIANGLE(k) + i];
            const ahrs_real old = *below;
            *below = c * old + sign * s * x[k];
            x[k] = c * x[k] - s * old;
        }
    }
    return true;
}

/* One rotation of Jacobi's method: brings element (i, j) of a to zero, unless it is negligible already, and turns the
 * rows of v along. */
static inline void ahrs_jacobi_rotation(int32_t n, ahrs_real *a, ahrs_real *v, int32_t i, int32_t j) {
    const ahrs_real off = ahrs_of(a, i, j), both = ahrs_of(a, i, i) * ahrs_of(a, j, j);
    if (!(off * off > AHRS_REAL_EPSILON * AHRS_REAL_EPSILON * ahrs_abs(both))) {
        return;
    }
    const ahrs_real theta = (ahrs_of(a, j, j) - ahrs_of(a, i, i)) / (2 * off);
    const ahrs_real size = 1 / (ahrs_abs(theta) + ahrs_sqrt(theta * theta + 1));
    const ahrs_real tangent = theta < 0 ? -size : size;
    const ahrs_real c = 1 / ahrs_sqrt(tangent * tangent + 1), s = tangent * c;
    *ahrs_at(a, i, i) -= tangent * off;
    *ahrs_at(a, j, j) += tangent * off;
    *ahrs_at(a, i, j) = 0;
    for (int32_t k = 0; k < n; k++) {
        if (k != i && k != j) {
            const ahrs_real aik = ahrs_of(a, i, k), ajk = ahrs_of(a, j, k);
            *ahrs_at(a, i, k) = c * aik - s * ajk;
            *ahrs_at(a, j, k) = s * aik + c * ajk;
        }
        const ahrs_real vik = v[i * n + k], vjk = v[j * n + k];
        v[i * n + k] = c * vik - s * vjk;
        v[j * n + k] = s * vik + c * vjk;
    }
}

/* Brings the eigenvalues of a (at most 4 rows, finite) into [low, high]. */
static inline void ahrs_clamp_eigenvalues(int32_t n, ahrs_real *a, ahrs_real low, ahrs_real high) {
    enum { MOST = 4, SWEEPS = 10 };
    ahrs_real v[MOST * MOST] = {0}, d[MOST];
    for (int32_t i = 0; i < n; i++) {
        v[i * n + i] = 1;
    }
    for (int32_t sweep = 0; sweep < SWEEPS; sweep++) {
        for (int32_t i = 1; i < n; i++) {
            for (int32_t j = 0; j < i; j++) {
                ahrs_jacobi_rotation(n, a, v, i, j);
            }
        }
    }
    for (int32_t i = 0; i < n; i++) {
        d[i] = ahrs_clamp(ahrs_of(a, i, i), low, high);
    }
    for (int32_t i = 0; i < n; i++) {
        for (int32_t j = 0; j <= i; j++) {
            ahrs_real sum = 0;
            for (int32_t k = 0; k < n; k++) {
                sum += d[k] * v[k * n + i] * v[k * n + j];
            }
            *ahrs_at(a, i, j) = sum;
        }
    }
}

#endif

/* No eigenvalue is let below this. */
#define AHRS_COVARIANCE_LEAST AHRS_C(1e-12)


static inline void ahrs_quat_rows(const ahrs_real *p, ahrs_quat row[4]) {
    for (int32_t i = 0; i < 4; i++) {
        row[i] = (ahrs_quat){ahrs_of(p, i, 0), ahrs_of(p, i, 1), ahrs_of(p, i, 2), ahrs_of(p, i, 3)};
    }
}

/* variance times the unit matrix */
static inline void ahrs_quat_covariance_set(ahrs_real *p, ahrs_real variance) {
    for (int32_t i = 0; i < AHRS_TRIANGLE(4); i++) {
        p[i] = 0;
    }
    ahrs_add_diagonal(4, p, variance);
}

/* After every quaternion has been multiplied with r from the right: F P F' with F x = x (x) r. */
static inline void ahrs_quat_covariance_turn(ahrs_real *p, ahrs_quat r) {
    ahrs_quat row[4];
    ahrs_real half[4][4];
    ahrs_quat_rows(p, row);
    for (int32_t i = 0; i < 4; i++) {
        ahrs_quat_to(half[i], ahrs_quat_mul(row[i], r));
    }
    for (int32_t j = 0; j < 4; j++) {
        ahrs_real column[4];
        ahrs_quat_to(column, ahrs_quat_mul((ahrs_quat){half[0][j], half[1][j], half[2][j], half[3][j]}, r));
        for (int32_t i = j; i < 4; i++) {
            *ahrs_at(p, i, j) = column[i];
        }
    }
}

/* Adds k (I - q q'): noise across a unit quaternion, none along it. A rotation of variance v gives k = v/4. */
static inline void ahrs_quat_covariance_spread(ahrs_real *p, ahrs_quat q, ahrs_real k) {
    ahrs_real e[4];
    ahrs_quat_to(e, q);
    for (int32_t i = 0; i < 4; i++) {
        for (int32_t j = 0; j <= i; j++) {
            *ahrs_at(p, i, j) += k * ((i == j ? 1 : 0) - e[i] * e[j]);
        }
    }
}

/* Keeps the matrix positive definite; false where it has no meaning left. */
static inline bool ahrs_quat_covariance_keep(ahrs_real *p) {
    for (int32_t i = 0; i < AHRS_TRIANGLE(4); i++) {
        if (!ahrs_is_finite(p[i])) {
            return false;
        }
    }
    if (AHRS_UNLIKELY(!ahrs_is_above(4, p, AHRS_COVARIANCE_LEAST))) {
        ahrs_clamp_eigenvalues(4, p, AHRS_COVARIANCE_LEAST, AHRS_REAL_MAX);
    }
    return true;
}

/* Standard deviation of the rotation about each body axis: turning by v moves q by q (x) v/2. */
static inline ahrs_vec3 ahrs_quat_covariance_std(const ahrs_real *p, ahrs_quat q) {
    const ahrs_quat axis[3] = {
        ahrs_quat_mul(q, (ahrs_quat){0, 1, 0, 0}),
        ahrs_quat_mul(q, (ahrs_quat){0, 0, 1, 0}),
        ahrs_quat_mul(q, (ahrs_quat){0, 0, 0, 1}),
    };
    ahrs_quat row[4];
    ahrs_real variance[3];
    ahrs_quat_rows(p, row);
    for (int32_t i = 0; i < 3; i++) {
        const ahrs_quat image = {ahrs_quat_dot(row[0], axis[i]), ahrs_quat_dot(row[1], axis[i]),
                                 ahrs_quat_dot(row[2], axis[i]), ahrs_quat_dot(row[3], axis[i])};
        variance[i] = ahrs_max(ahrs_quat_dot(axis[i], image), 0);
    }
    return (ahrs_vec3){2 * ahrs_sqrt(variance[0]), 2 * ahrs_sqrt(variance[1]), 2 * ahrs_sqrt(variance[2])};
}

#endif
/* Cubature Kalman filter on the quaternion with Sage-Husa noise estimation (docs/algorithms.md section 3). */

/* The measurement: specific force, and heading where there is one. */
enum { adaptive_ckf_N = 4, adaptive_ckf_HEADING = 3, adaptive_ckf_TRIANGLE = AHRS_TRIANGLE(4) };

/* Beyond this pitch (85 deg) the heading is not measured. */
static const ahrs_real adaptive_ckf_SINE_OF_PITCH_MAX = AHRS_C(0.9961946980917455);

/* Sum of the variances of the quaternion's elements, that of a rotation by one radian: as good as unknown. */
static const ahrs_real adaptive_ckf_SPREAD_MAX = AHRS_C(0.25);

/* A correction on its way: innovation v, its covariance S, gain K, and K v. */
typedef struct {
    int32_t rows; /* of the measurement */
    ahrs_real innovation[adaptive_ckf_N], spread[adaptive_ckf_TRIANGLE], gain[adaptive_ckf_N][adaptive_ckf_N], change[adaptive_ckf_N];
} adaptive_ckf_correction;

static void adaptive_ckf_copy(const ahrs_real *from, ahrs_real *to) {
    for (int32_t i = 0; i < adaptive_ckf_TRIANGLE; i++) {
        to[i] = from[i];
    }
}

/* Angle in [-pi, pi] of one in [-3 pi, 3 pi]. */
static ahrs_real adaptive_ckf_wrapped(ahrs_real angle) {
    return angle > AHRS_PI ? angle - 2 * AHRS_PI : (angle < -AHRS_PI ? angle + 2 * AHRS_PI : angle);
}

static ahrs_real adaptive_ckf_heading_of(ahrs_quat q) { return ahrs_atan2(ahrs_quat_east(q).x, ahrs_quat_north(q).x); }

/* Specific force and heading of an attitude that need not be of unit length; the heading near a reference. */
static void adaptive_ckf_expected(const ahrs_adaptive_ckf_params *p, ahrs_quat q, ahrs_real near, ahrs_real z[adaptive_ckf_N]) {
    ahrs_vec3_to(z, ahrs_vec3_scale(ahrs_quat_down(q), -p->common.gravity));
    z[adaptive_ckf_HEADING] = near + adaptive_ckf_wrapped(adaptive_ckf_heading_of(q) - near);
}

/* Derivative of `expected` by the elements of q, row by row. */
static void adaptive_ckf_jacobian(const ahrs_adaptive_ckf_params *p, ahrs_quat q, ahrs_real h[adaptive_ckf_N][adaptive_ckf_N]) {
    const ahrs_real g2 = -2 * p->common.gravity;
    const ahrs_real y = ahrs_quat_east(q).x, x = ahrs_quat_north(q).x;
    const ahrs_real k = 2 / (x * x + y * y);
    ahrs_quat_to(h[0], ahrs_quat_scale((ahrs_quat){-q.y, q.z, -q.w, q.x}, g2));
    ahrs_quat_to(h[1], ahrs_quat_scale((ahrs_quat){q.x, q.w, q.z, q.y}, g2));
    ahrs_quat_to(h[2], ahrs_quat_scale((ahrs_quat){q.w, -q.x, -q.y, q.z}, g2));
    const ahrs_quat dy = {q.z, q.y, q.x, q.w}, dx = {q.w, q.x, -q.y, -q.z};
    ahrs_quat_to(h[adaptive_ckf_HEADING], ahrs_quat_scale(ahrs_quat_sub(ahrs_quat_scale(dy, x), ahrs_quat_scale(dx, y)), k));
}

/* Process noise per sample as the parameters give it. */
static void adaptive_ckf_given_process_noise(const ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p, ahrs_quat q,
                                const ahrs_sample *z, ahrs_real out[adaptive_ckf_TRIANGLE]) {
    ahrs_quat_covariance_set(out, p->quaternion_noise * p->quaternion_noise * z->dt);
    if (p->process_noise == AHRS_ADAPTIVE_CKF_PROCESS_NOISE_GYRO) {
        ahrs_quat_covariance_spread(out, q, AHRS_C(0.25) * ahrs_turn_variance(&s->common, z, p->gyro_noise));
    }
}

/* Keeps the points of a quaternion that nothing measures near unit length. */
static void adaptive_ckf_limit_spread(ahrs_real covariance[adaptive_ckf_TRIANGLE]) {
    ahrs_real sum = 0;
    for (int32_t i = 0; i < adaptive_ckf_N; i++) {
        sum += ahrs_of(covariance, i, i);
    }
    const ahrs_real scale = sum > adaptive_ckf_SPREAD_MAX ? adaptive_ckf_SPREAD_MAX / sum : 1;
    for (int32_t i = 0; i < adaptive_ckf_TRIANGLE; i++) {
        covariance[i] *= scale;
    }
}

static void adaptive_ckf_start(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p) {
    const ahrs_sample nominal = {.dt = p->common.sample_time, .gain_dt = p->common.sample_time};
    const ahrs_real accel = ahrs_sample_variance(&p->common, p->accel_noise) +
                            ahrs_motion_variance(&p->common, &nominal, p->motion_noise);
    ahrs_quat_covariance_set(s->covariance, AHRS_C(0.25) * p->initial_attitude_std * p->initial_attitude_std);
    adaptive_ckf_given_process_noise(s, p, ahrs_quat_of(s->common.q), &nominal, s->process);
    ahrs_quat_covariance_set(s->measurement, accel);
    *ahrs_at(s->measurement, adaptive_ckf_HEADING, adaptive_ckf_HEADING) = ahrs_sample_variance(&p->common, p->heading_noise);
    s->fading = p->forgetting;
    for (int32_t i = 0; i < p->warm_up; i++) {
        s->fading *= p->forgetting;
    }
}

/* Mean and covariances of the measurement over the cubature points, gain and change of the state. False where the
 * covariance is not positive definite. */
static bool adaptive_ckf_measure(const ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p, const ahrs_sample *z,
                    ahrs_quat q, adaptive_ckf_correction *c) {
    enum { POINTS = 2 * adaptive_ckf_N };
    const ahrs_real weight = 1 / (ahrs_real)POINTS;
    ahrs_real root[adaptive_ckf_TRIANGLE], side[adaptive_ckf_N][adaptive_ckf_N], y[POINTS][adaptive_ckf_N], mean[adaptive_ckf_N] = {0};
    if (!ahrs_cholesky(adaptive_ckf_N, s->covariance, root)) {
        return false;
    }
    const ahrs_real heading = adaptive_ckf_heading_of(q);
    for (int32_t i = 0; i < adaptive_ckf_N; i++) {
        for (int32_t j = 0; j < adaptive_ckf_N; j++) {
            side[i][j] = j < i ? 0 : 2 * root[AHRS_TRIANGLE(j) + i]; /* 2 = sqrt(N) */
        }
        adaptive_ckf_expected(p, ahrs_quat_add(q, ahrs_quat_of(side[i])), heading, y[i]);
        adaptive_ckf_expected(p, ahrs_quat_sub(q, ahrs_quat_of(side[i])), heading, y[i + adaptive_ckf_N]);
    }
    for (int32_t a = 0; a < c->rows; a++) {
        for (int32_t i = 0; i < POINTS; i++) {
            mean[a] += weight * y[i][a];
        }
    }
    for (int32_t a = 0; a < c->rows; a++) {
        for (int32_t b = 0; b <= a; b++) {
            ahrs_real sum = ahrs_of(s->measurement, a, b);
            for (int32_t i = 0; i < POINTS; i++) {
                sum += weight * (y[i][a] - mean[a]) * (y[i][b] - mean[b]);
            }
            *ahrs_at(c->spread, a, b) = sum;
        }
        for (int32_t j = 0; j < adaptive_ckf_N; j++) {
            c->gain[j][a] = 0;
            for (int32_t i = 0; i < adaptive_ckf_N; i++) {
                c->gain[j][a] += weight * side[i][j] * (y[i][a] - y[i + adaptive_ckf_N][a]);
            }
        }
    }
    ahrs_vec3_to(c->innovation, ahrs_vec3_sub(z->accel, ahrs_vec3_of(mean)));
    if (c->rows > adaptive_ckf_HEADING) {
        const ahrs_real measured = adaptive_ckf_heading_of(ahrs_attitude_of(z->accel, z->mag));
        c->innovation[adaptive_ckf_HEADING] = adaptive_ckf_wrapped(adaptive_ckf_wrapped(measured - mean[adaptive_ckf_HEADING]));
    }
    if (!ahrs_cholesky(c->rows, c->spread, root)) {
        return false;
    }
    for (int32_t j = 0; j < adaptive_ckf_N; j++) {
        ahrs_solve_lower(c->rows, root, c->gain[j]);
        ahrs_solve_upper(c->rows, root, c->gain[j]);
        c->change[j] = 0;
        for (int32_t a = 0; a < c->rows; a++) {
            c->change[j] += c->gain[j][a] * c->innovation[a];
        }
    }
    return true;
}

/* P := P - K S K' */
static void adaptive_ckf_subtract_gain(const adaptive_ckf_correction *c, ahrs_real covariance[adaptive_ckf_TRIANGLE]) {
    for (int32_t i = 0; i < adaptive_ckf_N; i++) {
        for (int32_t j = 0; j <= i; j++) {
            ahrs_real sum = 0;
            for (int32_t a = 0; a < c->rows; a++) {
                for (int32_t b = 0; b < c->rows; b++) {
                    sum += c->gain[i][a] * ahrs_of(c->spread, a, b) * c->gain[j][b];
                }
            }
            *ahrs_at(covariance, i, j) -= sum;
        }
    }
}

/* Brings the eigenvalues of a covariance into their range, where they are not. */
static void adaptive_ckf_keep_within(ahrs_real a[adaptive_ckf_TRIANGLE], ahrs_real low, ahrs_real high) {
    ahrs_real upside[adaptive_ckf_TRIANGLE];
    for (int32_t i = 0; i < adaptive_ckf_TRIANGLE; i++) {
        upside[i] = -a[i];
    }
    if (!ahrs_is_above(adaptive_ckf_N, a, low) || !ahrs_is_above(adaptive_ckf_N, upside, -high)) {
        ahrs_clamp_eigenvalues(adaptive_ckf_N, a, low, high);
    }
}

/* R := (1 - d) R + d (e e' + H P H') with e = (I - H K) v: what the correction leaves of the innovation. The published
 * forms know no limits. */
static void adaptive_ckf_adapt_measurement(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p, const adaptive_ckf_correction *c,
                              ahrs_quat q, ahrs_real d) {
    ahrs_real h[adaptive_ckf_N][adaptive_ckf_N], left[adaptive_ckf_N];
    adaptive_ckf_jacobian(p, q, h);
    for (int32_t a = 0; a < c->rows; a++) {
        left[a] = c->innovation[a] - ahrs_quat_dot(ahrs_quat_of(h[a]), ahrs_quat_of(c->change));
    }
    for (int32_t a = 0; a < c->rows; a++) {
        for (int32_t b = 0; b <= a; b++) {
            ahrs_real sum = left[a] * left[b];
            for (int32_t i = 0; i < adaptive_ckf_N; i++) {
                for (int32_t j = 0; j < adaptive_ckf_N; j++) {
                    sum += h[a][i] * ahrs_of(s->covariance, i, j) * h[b][j];
                }
            }
            ahrs_real *const r = ahrs_at(s->measurement, a, b);
            *r = (1 - d) * *r + d * sum;
        }
    }
    if (p->adaptation <= AHRS_ADAPTIVE_CKF_ADAPTATION_QR_SAFE) {
        adaptive_ckf_keep_within(s->measurement, p->measurement_variance_min, p->measurement_variance_max);
    }
}

/* Q := (1 - d) Q + d (K v v' K' + P - F P F'): without the last two terms for qr_safe, with the P of the sample before
 * for textbook, with the new one for printed. */
static void adaptive_ckf_adapt_process(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p, const adaptive_ckf_correction *c,
                          ahrs_quat turn, const ahrs_real turned[adaptive_ckf_TRIANGLE], ahrs_real d) {
    ahrs_real again[adaptive_ckf_TRIANGLE];
    const bool safe = p->adaptation == AHRS_ADAPTIVE_CKF_ADAPTATION_QR_SAFE;
    adaptive_ckf_copy(p->adaptation == AHRS_ADAPTIVE_CKF_ADAPTATION_PRINTED ? s->covariance : turned, again);
    if (p->adaptation == AHRS_ADAPTIVE_CKF_ADAPTATION_PRINTED) {
        ahrs_quat_covariance_turn(again, turn);
    }
    for (int32_t i = 0; i < adaptive_ckf_N; i++) {
        for (int32_t j = 0; j <= i; j++) {
            const ahrs_real growth = safe ? 0 : ahrs_of(s->covariance, i, j) - ahrs_of(again, i, j);
            ahrs_real *const noise = ahrs_at(s->process, i, j);
            *noise = (1 - d) * *noise + d * (c->change[i] * c->change[j] + growth);
        }
    }
    if (safe) {
        adaptive_ckf_keep_within(s->process, p->process_variance_min, p->process_variance_max);
    }
}

/* One correction; false where a covariance has lost its meaning. */
static bool adaptive_ckf_correct(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p, const ahrs_sample *z,
                    ahrs_quat turn, const ahrs_real turned[adaptive_ckf_TRIANGLE], ahrs_quat *q) {
    const bool level = ahrs_abs(ahrs_quat_down(*q).x) < adaptive_ckf_SINE_OF_PITCH_MAX;
    adaptive_ckf_correction c = {.rows = level && ahrs_shows_attitude(z) ? adaptive_ckf_N : adaptive_ckf_HEADING};
    if (!adaptive_ckf_measure(s, p, z, *q, &c)) {
        return false;
    }
    *q = ahrs_quat_add(*q, ahrs_quat_of(c.change));
    adaptive_ckf_subtract_gain(&c, s->covariance);
    if (!ahrs_quat_covariance_keep(s->covariance)) {
        return false;
    }
    s->fading *= p->forgetting;
    const ahrs_real d = (1 - p->forgetting) / (1 - s->fading);
    if (p->adaptation != AHRS_ADAPTIVE_CKF_ADAPTATION_NONE) {
        adaptive_ckf_adapt_measurement(s, p, &c, *q, d);
    }
    if (p->adaptation > AHRS_ADAPTIVE_CKF_ADAPTATION_R_ONLY) {
        adaptive_ckf_adapt_process(s, p, &c, turn, turned, d);
    }
    return true;
}

static inline void ahrs_adaptive_ckf_init(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p) {
    ahrs_estimator_init(&s->common);
    adaptive_ckf_start(s, p);
}

static inline void ahrs_adaptive_ckf_update(ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p,
                              const ahrs_adaptive_ckf_inputs *u, ahrs_real dt) {
    ahrs_sample z;
    const ahrs_action action = ahrs_estimator_begin(&s->common, &p->common, u, dt, &z);
    if (action == AHRS_START) {
        adaptive_ckf_start(s, p);
    }
    if (action == AHRS_WAIT || action == AHRS_START) {
        return;
    }
    ahrs_real turned[adaptive_ckf_TRIANGLE];
    const ahrs_quat before = ahrs_quat_of(s->common.q);
    const ahrs_quat turn = ahrs_increment(ahrs_vec3_scale(z.rate, z.dt));
    ahrs_quat q = ahrs_quat_mul(before, turn);
    if (p->adaptation <= AHRS_ADAPTIVE_CKF_ADAPTATION_R_ONLY) {
        adaptive_ckf_given_process_noise(s, p, before, &z, s->process);
    }
    ahrs_quat_covariance_turn(s->covariance, turn);
    adaptive_ckf_copy(s->covariance, turned);
    for (int32_t i = 0; i < adaptive_ckf_TRIANGLE; i++) {
        s->covariance[i] += s->process[i];
    }
    adaptive_ckf_limit_spread(s->covariance);
    if (z.gain_dt > 0 && z.accel_usable && !adaptive_ckf_correct(s, p, &z, turn, turned, &q)) {
        adaptive_ckf_start(s, p);
        s->common.conditions |= AHRS_COVARIANCE_RESET;
        q = ahrs_quat_mul(before, turn);
    }
    ahrs_estimator_end(&s->common, &p->common, &z, ahrs_quat_unit(q));
}

static inline void ahrs_adaptive_ckf_outputs(const ahrs_adaptive_ckf_state *s, const ahrs_adaptive_ckf_params *p,
                               ahrs_adaptive_ckf_outputs_t *y) {
    ahrs_estimator_outputs(&s->common, &p->common, (ahrs_vec3){0, 0, 0}, &y->common);
    ahrs_vec3_to(y->attitude_std, ahrs_quat_covariance_std(s->covariance, ahrs_quat_of(s->common.q)));
    y->covariance_reset = ahrs_condition(&s->common, AHRS_COVARIANCE_RESET);
}

/* The one interface between a model and everything that runs it: FMI 2, FMI 3, the host library.
 * A model's table of this shape is generated from its descriptor (models/NAME/NAME_table.c). */
#ifndef FMU_MODEL_H
#define FMU_MODEL_H


#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Reals are stored as ahrs_real, everything else as int32_t. */
typedef enum { FMU_REAL, FMU_INTEGER, FMU_BOOLEAN, FMU_ENUMERATION } fmu_type;

/* Fixed parameters are set before initialisation ends, tunable ones at any time. */
typedef enum { FMU_FIXED, FMU_TUNABLE, FMU_INPUT, FMU_OUTPUT } fmu_role;

/* Which ends of [min, max] are themselves refused, and whether +infinity is a value. */
enum { FMU_MIN_OPEN = 1, FMU_MAX_OPEN = 2, FMU_INFINITY_ALLOWED = 4 };

typedef struct {
    const char *name;
    uint32_t vr;     /* of the first element; element i answers to vr + i */
    uint32_t size;   /* number of elements */
    uint32_t offset; /* of the first element, bytes from the start of the instance */
    fmu_type type;
    fmu_role role;
    unsigned flags;
    double min, max;
} fmu_variable;

/* A rule between parameters, checked when initialisation ends and before a step that follows a change. */
typedef struct {
    const char *rule; /* as written in the descriptor */
    const char *says; /* why, and what to do */
    bool is_warning;  /* the run goes on */
    const uint32_t *vrs; /* the parameters it names */
    uint32_t n_vrs;
    bool (*holds)(const void *instance);
} fmu_limit;

/* A contiguous part of the instance. */
typedef struct {
    size_t offset, size;
} fmu_part;

typedef struct {
    const char *name;  /* gcf */
    const char *title; /* GCF: the name an importer sees */
    size_t instance_size;
    fmu_part params, inputs, outputs, state;
    uint32_t sample_time_offset;
    double sample_time; /* s, the default as written: rounded to a float it would leave the importer's grid */
    const fmu_variable *variables; /* ascending vr */
    size_t n_variables;
    const fmu_limit *limits;
    size_t n_limits;
    void (*defaults)(void *instance); /* parameters and inputs to their start values */
    void (*init)(void *instance);     /* state and outputs as before the first sample */
    void (*update)(void *instance, ahrs_real dt);
    void (*compute_outputs)(void *instance);
} fmu_model;

#endif
/* Generated from models/adaptive_ckf/adaptive_ckf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */

#include <string.h>

typedef struct {
    ahrs_adaptive_ckf_params params;
    ahrs_adaptive_ckf_inputs inputs;
    ahrs_adaptive_ckf_outputs_t outputs;
    ahrs_adaptive_ckf_state state;
} adaptive_ckf_instance;

static const fmu_variable adaptive_ckf_variables[] = {
    {"gyro", 1, 3, offsetof(adaptive_ckf_instance, inputs.gyro), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel", 4, 3, offsetof(adaptive_ckf_instance, inputs.accel), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"mag", 7, 3, offsetof(adaptive_ckf_instance, inputs.mag), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel_valid", 10, 1, offsetof(adaptive_ckf_instance, inputs.accel_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"mag_valid", 11, 1, offsetof(adaptive_ckf_instance, inputs.mag_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"q", 100, 4, offsetof(adaptive_ckf_instance, outputs.common.q), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"roll", 104, 1, offsetof(adaptive_ckf_instance, outputs.common.roll), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"pitch", 105, 1, offsetof(adaptive_ckf_instance, outputs.common.pitch), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"yaw", 106, 1, offsetof(adaptive_ckf_instance, outputs.common.yaw), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate", 107, 3, offsetof(adaptive_ckf_instance, outputs.common.rate), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"gyro_bias", 110, 3, offsetof(adaptive_ckf_instance, outputs.common.gyro_bias), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"motion_accel", 113, 3, offsetof(adaptive_ckf_instance, outputs.common.motion_accel), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"attitude_std", 116, 3, offsetof(adaptive_ckf_instance, outputs.attitude_std), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"status", 119, 1, offsetof(adaptive_ckf_instance, outputs.common.status), FMU_ENUMERATION, FMU_OUTPUT, 0, 0.0, 9.0},
    {"gyro_held", 120, 1, offsetof(adaptive_ckf_instance, outputs.common.gyro_held), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"accel_used", 121, 1, offsetof(adaptive_ckf_instance, outputs.common.accel_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"mag_used", 122, 1, offsetof(adaptive_ckf_instance, outputs.common.mag_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"covariance_reset", 123, 1, offsetof(adaptive_ckf_instance, outputs.covariance_reset), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"sample_time", 200, 1, offsetof(adaptive_ckf_instance, params.common.sample_time), FMU_REAL, FMU_FIXED, 0, 1e-05, 0.5},
    {"frame", 201, 1, offsetof(adaptive_ckf_instance, params.common.frame), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"declination", 202, 1, offsetof(adaptive_ckf_instance, params.common.declination), FMU_REAL, FMU_TUNABLE, 0, -3.141592653589793, 3.141592653589793},
    {"gravity", 203, 1, offsetof(adaptive_ckf_instance, params.common.gravity), FMU_REAL, FMU_FIXED, 0, 0.1, 100.0},
    {"field_reference", 204, 1, offsetof(adaptive_ckf_instance, params.common.field_reference), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"field_magnitude", 205, 1, offsetof(adaptive_ckf_instance, params.common.field_magnitude), FMU_REAL, FMU_FIXED, 0, 1e-07, 0.01},
    {"field_dip", 206, 1, offsetof(adaptive_ckf_instance, params.common.field_dip), FMU_REAL, FMU_FIXED, 0, -1.5707963267948966, 1.5707963267948966},
    {"initialisation", 207, 1, offsetof(adaptive_ckf_instance, params.common.initialisation), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"q0", 208, 4, offsetof(adaptive_ckf_instance, params.common.q0), FMU_REAL, FMU_FIXED, 0, -1.1, 1.1},
    {"init_time", 212, 1, offsetof(adaptive_ckf_instance, params.common.init_time), FMU_REAL, FMU_FIXED, 0, 0.0, 600.0},
    {"motion_compensation", 213, 1, offsetof(adaptive_ckf_instance, params.common.motion_compensation), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"motion_time_constant", 214, 1, offsetof(adaptive_ckf_instance, params.common.motion_time_constant), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN | FMU_INFINITY_ALLOWED, 0.0, DBL_MAX},
    {"accel_gating", 215, 1, offsetof(adaptive_ckf_instance, params.common.accel_gating), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"accel_gate", 216, 1, offsetof(adaptive_ckf_instance, params.common.accel_gate), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"accel_gate_time", 217, 1, offsetof(adaptive_ckf_instance, params.common.accel_gate_time), FMU_REAL, FMU_TUNABLE, 0, 0.0, 600.0},
    {"gyro_zero_samples", 220, 1, offsetof(adaptive_ckf_instance, params.common.gyro_zero_samples), FMU_INTEGER, FMU_FIXED, 0, 0.0, 1000000.0},
    {"gyro_zero_std", 221, 1, offsetof(adaptive_ckf_instance, params.common.gyro_zero_std), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"gyro_zero_limit", 222, 1, offsetof(adaptive_ckf_instance, params.common.gyro_zero_limit), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"accel_cutoff", 223, 1, offsetof(adaptive_ckf_instance, params.common.accel_cutoff), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"mag_offset", 224, 3, offsetof(adaptive_ckf_instance, params.common.mag_offset), FMU_REAL, FMU_FIXED, 0, -0.01, 0.01},
    {"mag_gain", 227, 3, offsetof(adaptive_ckf_instance, params.common.mag_gain), FMU_REAL, FMU_FIXED, 0, 0.01, 100.0},
    {"gyro_noise", 1040, 1, offsetof(adaptive_ckf_instance, params.gyro_noise), FMU_REAL, FMU_FIXED, 0, 0.0, 100.0},
    {"accel_noise", 1042, 1, offsetof(adaptive_ckf_instance, params.accel_noise), FMU_REAL, FMU_FIXED, FMU_MIN_OPEN, 0.0, 1000.0},
    {"heading_noise", 1044, 1, offsetof(adaptive_ckf_instance, params.heading_noise), FMU_REAL, FMU_FIXED, FMU_MIN_OPEN, 0.0, 100.0},
    {"quaternion_noise", 1046, 1, offsetof(adaptive_ckf_instance, params.quaternion_noise), FMU_REAL, FMU_FIXED, FMU_MIN_OPEN, 0.0, 100.0},
    {"motion_noise", 1047, 1, offsetof(adaptive_ckf_instance, params.motion_noise), FMU_REAL, FMU_FIXED, 0, 0.0, 1000.0},
    {"initial_attitude_std", 1048, 1, offsetof(adaptive_ckf_instance, params.initial_attitude_std), FMU_REAL, FMU_FIXED, 0, 0.0001, 0.5},
    {"adaptation", 1070, 1, offsetof(adaptive_ckf_instance, params.adaptation), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 4.0},
    {"process_noise", 1071, 1, offsetof(adaptive_ckf_instance, params.process_noise), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"forgetting", 1072, 1, offsetof(adaptive_ckf_instance, params.forgetting), FMU_REAL, FMU_FIXED, FMU_MAX_OPEN, 0.5, 1.0},
    {"warm_up", 1073, 1, offsetof(adaptive_ckf_instance, params.warm_up), FMU_INTEGER, FMU_FIXED, 0, 0.0, 10000.0},
    {"measurement_variance_min", 1074, 1, offsetof(adaptive_ckf_instance, params.measurement_variance_min), FMU_REAL, FMU_FIXED, 0, 1e-12, 1000000.0},
    {"measurement_variance_max", 1075, 1, offsetof(adaptive_ckf_instance, params.measurement_variance_max), FMU_REAL, FMU_FIXED, 0, 1e-12, 1000000.0},
    {"process_variance_min", 1076, 1, offsetof(adaptive_ckf_instance, params.process_variance_min), FMU_REAL, FMU_FIXED, 0, 1e-12, 1.0},
    {"process_variance_max", 1077, 1, offsetof(adaptive_ckf_instance, params.process_variance_max), FMU_REAL, FMU_FIXED, 0, 1e-12, 1.0},
};

static bool adaptive_ckf_limit_0(const void *data) {
    const ahrs_adaptive_ckf_params *p = &((const adaptive_ckf_instance *)data)->params;
    return (p->common.initialisation == AHRS_INITIALISATION_SENSORS) || (((((p->common.q0[0] * p->common.q0[0]) + (p->common.q0[1] * p->common.q0[1])) + (p->common.q0[2] * p->common.q0[2])) + (p->common.q0[3] * p->common.q0[3])) > AHRS_C(1e-06));
}

static const uint32_t adaptive_ckf_limit_0_vrs[] = {207, 208};

static bool adaptive_ckf_limit_1(const void *data) {
    const ahrs_adaptive_ckf_params *p = &((const adaptive_ckf_instance *)data)->params;
    return (!(p->common.motion_compensation)) || (p->common.motion_time_constant < AHRS_INFINITY);
}

static const uint32_t adaptive_ckf_limit_1_vrs[] = {213, 214};

static bool adaptive_ckf_limit_2(const void *data) {
    const ahrs_adaptive_ckf_params *p = &((const adaptive_ckf_instance *)data)->params;
    return (p->common.accel_cutoff * p->common.sample_time) < AHRS_C(0.4);
}

static const uint32_t adaptive_ckf_limit_2_vrs[] = {223, 200};

static bool adaptive_ckf_limit_3(const void *data) {
    const ahrs_adaptive_ckf_params *p = &((const adaptive_ckf_instance *)data)->params;
    return p->measurement_variance_min <= p->measurement_variance_max;
}

static const uint32_t adaptive_ckf_limit_3_vrs[] = {1074, 1075};

static bool adaptive_ckf_limit_4(const void *data) {
    const ahrs_adaptive_ckf_params *p = &((const adaptive_ckf_instance *)data)->params;
    return p->process_variance_min <= p->process_variance_max;
}

static const uint32_t adaptive_ckf_limit_4_vrs[] = {1076, 1077};

static bool adaptive_ckf_limit_5(const void *data) {
    const ahrs_adaptive_ckf_params *p = &((const adaptive_ckf_instance *)data)->params;
    return (p->adaptation == AHRS_ADAPTIVE_CKF_ADAPTATION_NONE) || (p->adaptation == AHRS_ADAPTIVE_CKF_ADAPTATION_R_ONLY) || (p->adaptation == AHRS_ADAPTIVE_CKF_ADAPTATION_QR_SAFE);
}

static const uint32_t adaptive_ckf_limit_5_vrs[] = {1070};

static const fmu_limit adaptive_ckf_limits[] = {
    {"initialisation == sensors or q0[0]*q0[0] + q0[1]*q0[1] + q0[2]*q0[2] + q0[3]*q0[3] > 1e-6", "q0 has no direction: give a quaternion of about unit length", false, adaptive_ckf_limit_0_vrs, 2, adaptive_ckf_limit_0},
    {"not motion_compensation or motion_time_constant < inf", "tilt is not observed at all with an infinite motion_time_constant: use it for bursts of less than half a minute only", true, adaptive_ckf_limit_1_vrs, 2, adaptive_ckf_limit_1},
    {"accel_cutoff*sample_time < 0.4", "the low-pass needs more than two samples per period: lower accel_cutoff or sample_time", false, adaptive_ckf_limit_2_vrs, 2, adaptive_ckf_limit_2},
    {"measurement_variance_min <= measurement_variance_max", "the least eigenvalue cannot be above the largest", false, adaptive_ckf_limit_3_vrs, 2, adaptive_ckf_limit_3},
    {"process_variance_min <= process_variance_max", "the least eigenvalue cannot be above the largest", false, adaptive_ckf_limit_4_vrs, 2, adaptive_ckf_limit_4},
    {"adaptation == none or adaptation == r_only or adaptation == qr_safe", "this estimate of the process noise may lose positive definiteness, and the filter then resets: use r_only", true, adaptive_ckf_limit_5_vrs, 1, adaptive_ckf_limit_5},
};

static inline void ahrs_adaptive_ckf_defaults(ahrs_adaptive_ckf_params *p, ahrs_adaptive_ckf_inputs *u) {
    memset(p, 0, sizeof *p);
    memset(u, 0, sizeof *u);
    p->common.sample_time = AHRS_C(0.01);
    p->common.frame = 0;
    p->common.declination = AHRS_C(0.0);
    p->common.gravity = AHRS_C(9.80665);
    p->common.field_reference = 0;
    p->common.field_magnitude = AHRS_C(5e-05);
    p->common.field_dip = AHRS_C(1.1);
    p->common.initialisation = 0;
    p->common.q0[0] = AHRS_C(1.0);
    p->common.q0[1] = AHRS_C(0.0);
    p->common.q0[2] = AHRS_C(0.0);
    p->common.q0[3] = AHRS_C(0.0);
    p->common.init_time = AHRS_C(0.0);
    p->common.motion_compensation = 0;
    p->common.motion_time_constant = AHRS_C(1.0);
    p->common.accel_gating = 0;
    p->common.accel_gate = AHRS_C(1.0);
    p->common.accel_gate_time = AHRS_C(10.0);
    p->common.gyro_zero_samples = 0;
    p->common.gyro_zero_std = AHRS_C(0.02);
    p->common.gyro_zero_limit = AHRS_C(0.1);
    p->common.accel_cutoff = AHRS_C(0.0);
    p->common.mag_offset[0] = AHRS_C(0.0);
    p->common.mag_offset[1] = AHRS_C(0.0);
    p->common.mag_offset[2] = AHRS_C(0.0);
    p->common.mag_gain[0] = AHRS_C(1.0);
    p->common.mag_gain[1] = AHRS_C(1.0);
    p->common.mag_gain[2] = AHRS_C(1.0);
    p->gyro_noise = AHRS_C(0.006);
    p->accel_noise = AHRS_C(0.1);
    p->heading_noise = AHRS_C(0.0316);
    p->quaternion_noise = AHRS_C(0.000316);
    p->motion_noise = AHRS_C(0.5);
    p->initial_attitude_std = AHRS_C(0.063);
    p->adaptation = 1;
    p->process_noise = 0;
    p->forgetting = AHRS_C(0.995);
    p->warm_up = 200;
    p->measurement_variance_min = AHRS_C(0.0001);
    p->measurement_variance_max = AHRS_C(1000.0);
    p->process_variance_min = AHRS_C(1e-08);
    p->process_variance_max = AHRS_C(1e-05);
    u->gyro[0] = AHRS_C(0.0);
    u->gyro[1] = AHRS_C(0.0);
    u->gyro[2] = AHRS_C(0.0);
    u->accel[0] = AHRS_C(0.0);
    u->accel[1] = AHRS_C(0.0);
    u->accel[2] = AHRS_C(0.0);
    u->mag[0] = AHRS_C(0.0);
    u->mag[1] = AHRS_C(0.0);
    u->mag[2] = AHRS_C(0.0);
    u->accel_valid = 1;
    u->mag_valid = 1;
}

static void adaptive_ckf_defaults(void *data) {
    adaptive_ckf_instance *i = data;
    memset(i, 0, sizeof *i);
    ahrs_adaptive_ckf_defaults(&i->params, &i->inputs);
}

static void adaptive_ckf_init(void *data) {
    adaptive_ckf_instance *i = data;
    ahrs_adaptive_ckf_init(&i->state, &i->params);
}

static void adaptive_ckf_update(void *data, ahrs_real dt) {
    adaptive_ckf_instance *i = data;
    ahrs_adaptive_ckf_update(&i->state, &i->params, &i->inputs, dt);
}

static void adaptive_ckf_compute_outputs(void *data) {
    adaptive_ckf_instance *i = data;
    ahrs_adaptive_ckf_outputs(&i->state, &i->params, &i->outputs);
}

static const fmu_model ahrs_adaptive_ckf_model = {
    "adaptive_ckf", "AdaptiveCKF", sizeof(adaptive_ckf_instance), {offsetof(adaptive_ckf_instance, params), sizeof(((adaptive_ckf_instance *)0)->params)}, {offsetof(adaptive_ckf_instance, inputs), sizeof(((adaptive_ckf_instance *)0)->inputs)}, {offsetof(adaptive_ckf_instance, outputs), sizeof(((adaptive_ckf_instance *)0)->outputs)}, {offsetof(adaptive_ckf_instance, state), sizeof(((adaptive_ckf_instance *)0)->state)},
    offsetof(adaptive_ckf_instance, params.common.sample_time), 0.01,
    adaptive_ckf_variables, sizeof adaptive_ckf_variables / sizeof adaptive_ckf_variables[0],
    adaptive_ckf_limits, sizeof adaptive_ckf_limits / sizeof adaptive_ckf_limits[0],
    adaptive_ckf_defaults, adaptive_ckf_init, adaptive_ckf_update, adaptive_ckf_compute_outputs};

/* Generated from models/cg_ekf/cg_ekf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_CG_EKF_H
#define AHRS_CG_EKF_H


/* Attitude by conjugate gradients, smoothed by an extended Kalman filter. Fletcher-Reeves conjugate
 * gradients, begun at the predicted attitude, find the attitude at which the directions of gravity and of
 * the magnetic field fit best, both with equal weight. It measures the quaternion of an extended Kalman
 * filter that the gyroscope predicts. It learns no gyroscope bias. In the steady state it is a first-order
 * complementary filter whose crossover frequency is gyro_noise/attitude_noise.
 */

typedef struct {
    ahrs_estimator_params common;
    ahrs_real gyro_noise; /* White noise of the gyroscope, rad/s/sqrt(Hz) */
    ahrs_real attitude_noise; /* White noise of the attitude that the search finds, rad/sqrt(Hz) */
    ahrs_real motion_noise; /* Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation */
    ahrs_real initial_attitude_std; /* Standard deviation of the first attitude [rad] */
    int32_t iterations; /* Most iterations of the search per sample; it ends before where the gradient vanishes */
} ahrs_cg_ekf_params;

typedef ahrs_estimator_inputs ahrs_cg_ekf_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
    ahrs_real attitude_std[3]; /* Standard deviation of the attitude error about the body axes, as the filter believes it [rad] */
    int32_t covariance_reset; /* The covariance was reset at the last sample */
} ahrs_cg_ekf_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real variance; /* Variance of every element of the quaternion; their covariance stays a multiple of the unit matrix [1] */
} ahrs_cg_ekf_state;

/* Parameters and inputs to their defaults. */
static inline void ahrs_cg_ekf_defaults(ahrs_cg_ekf_params *p, ahrs_cg_ekf_inputs *u);

/* State as before the first sample. */
static inline void ahrs_cg_ekf_init(ahrs_cg_ekf_state *s, const ahrs_cg_ekf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
static inline void ahrs_cg_ekf_update(ahrs_cg_ekf_state *s, const ahrs_cg_ekf_params *p, const ahrs_cg_ekf_inputs *u, ahrs_real dt);

static inline void ahrs_cg_ekf_outputs(const ahrs_cg_ekf_state *s, const ahrs_cg_ekf_params *p, ahrs_cg_ekf_outputs_t *y);

#endif
/* Attitude by conjugate gradients, smoothed by an extended Kalman filter (docs/algorithms.md section 4).
 *
 * The prediction is a rotation of four dimensions times a number, and both noises are multiples of the unit matrix: so
 * the covariance is one as well, and the filter needs only that number. */

enum { cg_ekf_RESTART = 4, cg_ekf_NEWTON_STEPS = 6 };

static const ahrs_real cg_ekf_GRADIENT_LEAST = AHRS_C(1e-10);
static const ahrs_real cg_ekf_CURVATURE_LEAST = AHRS_C(1e-12); /* less belongs to a direction so short that its first guess will do */

/* Directions in navigation axes and where they are measured in the body. One that is not usable is zero in both. */
typedef struct {
    ahrs_vec3 gravity, field;
} cg_ekf_directions;

static ahrs_real cg_ekf_dot(cg_ekf_directions a, cg_ekf_directions b) {
    return ahrs_vec3_dot(a.gravity, b.gravity) + ahrs_vec3_dot(a.field, b.field);
}

/* n (x) q for a vector n */
static ahrs_quat cg_ekf_from_left(ahrs_vec3 n, ahrs_quat q) { return ahrs_quat_mul((ahrs_quat){0, n.x, n.y, n.z}, q); }

/* Vector part of p* (x) n (x) q: for p = q the direction n seen from the body, for a change d of q half of what that
 * changes by. */
static ahrs_vec3 cg_ekf_between(ahrs_quat p, ahrs_vec3 n, ahrs_quat q) {
    const ahrs_quat t = ahrs_quat_mul(ahrs_quat_conj(p), cg_ekf_from_left(n, q));
    return (ahrs_vec3){t.x, t.y, t.z};
}

static cg_ekf_directions cg_ekf_seen(ahrs_quat p, const cg_ekf_directions *nav, ahrs_quat q) {
    return (cg_ekf_directions){cg_ekf_between(p, nav->gravity, q), cg_ekf_between(p, nav->field, q)};
}

static cg_ekf_directions cg_ekf_misfit(ahrs_quat q, const cg_ekf_directions *nav, const cg_ekf_directions *measured) {
    const cg_ekf_directions s = cg_ekf_seen(q, nav, q);
    return (cg_ekf_directions){ahrs_vec3_sub(s.gravity, measured->gravity), ahrs_vec3_sub(s.field, measured->field)};
}

/* v without its part along q, which would change the length of q only. */
static ahrs_quat cg_ekf_across(ahrs_quat q, ahrs_quat v) { return ahrs_quat_sub(v, ahrs_quat_scale(q, ahrs_quat_dot(q, v))); }

/* Gradient of |e|^2/2 among unit quaternions. */
static ahrs_quat cg_ekf_gradient(ahrs_quat q, const cg_ekf_directions *nav, cg_ekf_directions e) {
    const ahrs_quat gravity = ahrs_quat_mul(cg_ekf_from_left(nav->gravity, q), (ahrs_quat){0, e.gravity.x, e.gravity.y, e.gravity.z});
    const ahrs_quat field = ahrs_quat_mul(cg_ekf_from_left(nav->field, q), (ahrs_quat){0, e.field.x, e.field.y, e.field.z});
    return cg_ekf_across(q, ahrs_quat_scale(ahrs_quat_add(gravity, field), -2));
}

/* How far to go from q along d. The misfit along the line is exactly e0 + L e1 + L^2 e2, half its square a quartic. */
static ahrs_real cg_ekf_step_along(ahrs_quat q, ahrs_quat d, const cg_ekf_directions *nav, cg_ekf_directions e0) {
    const cg_ekf_directions half = cg_ekf_seen(q, nav, d), e2 = cg_ekf_seen(d, nav, d);
    const cg_ekf_directions e1 = {ahrs_vec3_scale(half.gravity, 2), ahrs_vec3_scale(half.field, 2)};
    const ahrs_real c0 = cg_ekf_dot(e0, e1), c1 = cg_ekf_dot(e1, e1) + 2 * cg_ekf_dot(e0, e2), c2 = 3 * cg_ekf_dot(e1, e2), c3 = 2 * cg_ekf_dot(e2, e2);
    if (!(cg_ekf_dot(e1, e1) > 0)) {
        return 0;
    }
    ahrs_real length = -c0 / cg_ekf_dot(e1, e1);
    for (int32_t i = 0; i < cg_ekf_NEWTON_STEPS; i++) {
        const ahrs_real slope = c0 + length * (c1 + length * (c2 + length * c3));
        const ahrs_real curvature = c1 + length * (2 * c2 + length * 3 * c3);
        if (!(curvature > cg_ekf_CURVATURE_LEAST)) {
            break;
        }
        length -= slope / curvature;
    }
    return length;
}

/* The attitude of the least misfit, searched from q. */
static ahrs_quat cg_ekf_fit(ahrs_quat q, const cg_ekf_directions *nav, const cg_ekf_directions *measured, int32_t iterations) {
    ahrs_quat direction = {0, 0, 0, 0};
    ahrs_real before = 1;
    for (int32_t i = 0; i < iterations; i++) {
        const cg_ekf_directions e = cg_ekf_misfit(q, nav, measured);
        const ahrs_quat uphill = cg_ekf_gradient(q, nav, e);
        const ahrs_real norm2 = ahrs_quat_dot(uphill, uphill);
        if (!(norm2 > cg_ekf_GRADIENT_LEAST * cg_ekf_GRADIENT_LEAST)) {
            break;
        }
        const ahrs_real beta = i % cg_ekf_RESTART == 0 ? 0 : norm2 / before;
        direction = ahrs_quat_sub(ahrs_quat_scale(cg_ekf_across(q, direction), beta), uphill);
        if (!(ahrs_quat_dot(direction, uphill) < 0)) {
            direction = ahrs_quat_negate(uphill);
        }
        q = ahrs_quat_unit(ahrs_quat_add(q, ahrs_quat_scale(direction, cg_ekf_step_along(q, direction, nav, e))));
        before = norm2;
    }
    return q;
}

static ahrs_quat cg_ekf_measured_attitude(const ahrs_cg_ekf_state *s, const ahrs_cg_ekf_params *p, ahrs_quat predicted,
                                   const ahrs_sample *z) {
    const ahrs_vec3 field = {s->common.field[0], 0, s->common.field[1]};
    cg_ekf_directions nav = {{0, 0, 0}, {0, 0, 0}}, measured = nav;
    if (z->accel_usable) {
        nav.gravity = (ahrs_vec3){0, 0, -1};
        measured.gravity = ahrs_vec3_unit(z->accel);
    }
    if (z->mag_usable && ahrs_vec3_norm2(field) > 0) {
        nav.field = ahrs_vec3_unit(field);
        measured.field = ahrs_vec3_unit(z->mag);
    }
    return cg_ekf_fit(predicted, &nav, &measured, p->iterations);
}

static ahrs_real cg_ekf_initial_variance(const ahrs_cg_ekf_params *p) {
    return AHRS_C(0.25) * p->initial_attitude_std * p->initial_attitude_std;
}

static inline void ahrs_cg_ekf_init(ahrs_cg_ekf_state *s, const ahrs_cg_ekf_params *p) {
    ahrs_estimator_init(&s->common);
    s->variance = cg_ekf_initial_variance(p);
}

static inline void ahrs_cg_ekf_update(ahrs_cg_ekf_state *s, const ahrs_cg_ekf_params *p, const ahrs_cg_ekf_inputs *u, ahrs_real dt) {
    ahrs_sample z;
    const ahrs_action action = ahrs_estimator_begin(&s->common, &p->common, u, dt, &z);
    if (action == AHRS_START) {
        s->variance = cg_ekf_initial_variance(p);
    }
    if (action == AHRS_WAIT || action == AHRS_START) {
        return;
    }
    const ahrs_quat turn = ahrs_increment_second(ahrs_vec3_scale(z.rate, z.dt));
    ahrs_quat q = ahrs_quat_unit(ahrs_quat_mul(ahrs_quat_of(s->common.q), turn));
    s->variance = ahrs_quat_dot(turn, turn) * s->variance +
                  AHRS_C(0.25) * ahrs_turn_variance(&s->common, &z, p->gyro_noise);
    if (!(s->variance <= AHRS_REAL_MAX)) {
        s->variance = cg_ekf_initial_variance(p);
        s->common.conditions |= AHRS_COVARIANCE_RESET;
    }
    if (z.gain_dt > 0 && (z.accel_usable || z.mag_usable)) {
        const ahrs_real moved = ahrs_motion_variance(&p->common, &z, p->motion_noise);
        const ahrs_real attitude = ahrs_sample_variance(&p->common, p->attitude_noise);
        const ahrs_real r = AHRS_C(0.25) * (attitude + moved / (p->common.gravity * p->common.gravity));
        const ahrs_real gain = s->variance / (s->variance + r);
        const ahrs_quat measured = ahrs_quat_near(cg_ekf_measured_attitude(s, p, q, &z), q);
        q = ahrs_quat_add(q, ahrs_quat_scale(ahrs_quat_sub(measured, q), gain));
        s->variance = gain * r;
    }
    ahrs_estimator_end(&s->common, &p->common, &z, ahrs_quat_unit(q));
}

static inline void ahrs_cg_ekf_outputs(const ahrs_cg_ekf_state *s, const ahrs_cg_ekf_params *p, ahrs_cg_ekf_outputs_t *y) {
    const ahrs_real std = 2 * ahrs_sqrt(s->variance);
    ahrs_estimator_outputs(&s->common, &p->common, (ahrs_vec3){0, 0, 0}, &y->common);
    ahrs_vec3_to(y->attitude_std, (ahrs_vec3){std, std, std});
    y->covariance_reset = ahrs_condition(&s->common, AHRS_COVARIANCE_RESET);
}

/* Generated from models/cg_ekf/cg_ekf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */

#include <string.h>

typedef struct {
    ahrs_cg_ekf_params params;
    ahrs_cg_ekf_inputs inputs;
    ahrs_cg_ekf_outputs_t outputs;
    ahrs_cg_ekf_state state;
} cg_ekf_instance;

static const fmu_variable cg_ekf_variables[] = {
    {"gyro", 1, 3, offsetof(cg_ekf_instance, inputs.gyro), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel", 4, 3, offsetof(cg_ekf_instance, inputs.accel), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"mag", 7, 3, offsetof(cg_ekf_instance, inputs.mag), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel_valid", 10, 1, offsetof(cg_ekf_instance, inputs.accel_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"mag_valid", 11, 1, offsetof(cg_ekf_instance, inputs.mag_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"q", 100, 4, offsetof(cg_ekf_instance, outputs.common.q), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"roll", 104, 1, offsetof(cg_ekf_instance, outputs.common.roll), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"pitch", 105, 1, offsetof(cg_ekf_instance, outputs.common.pitch), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"yaw", 106, 1, offsetof(cg_ekf_instance, outputs.common.yaw), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate", 107, 3, offsetof(cg_ekf_instance, outputs.common.rate), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"gyro_bias", 110, 3, offsetof(cg_ekf_instance, outputs.common.gyro_bias), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"motion_accel", 113, 3, offsetof(cg_ekf_instance, outputs.common.motion_accel), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"attitude_std", 116, 3, offsetof(cg_ekf_instance, outputs.attitude_std), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"status", 119, 1, offsetof(cg_ekf_instance, outputs.common.status), FMU_ENUMERATION, FMU_OUTPUT, 0, 0.0, 9.0},
    {"gyro_held", 120, 1, offsetof(cg_ekf_instance, outputs.common.gyro_held), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"accel_used", 121, 1, offsetof(cg_ekf_instance, outputs.common.accel_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"mag_used", 122, 1, offsetof(cg_ekf_instance, outputs.common.mag_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"covariance_reset", 123, 1, offsetof(cg_ekf_instance, outputs.covariance_reset), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"sample_time", 200, 1, offsetof(cg_ekf_instance, params.common.sample_time), FMU_REAL, FMU_FIXED, 0, 1e-05, 0.5},
    {"frame", 201, 1, offsetof(cg_ekf_instance, params.common.frame), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"declination", 202, 1, offsetof(cg_ekf_instance, params.common.declination), FMU_REAL, FMU_TUNABLE, 0, -3.141592653589793, 3.141592653589793},
    {"gravity", 203, 1, offsetof(cg_ekf_instance, params.common.gravity), FMU_REAL, FMU_FIXED, 0, 0.1, 100.0},
    {"field_reference", 204, 1, offsetof(cg_ekf_instance, params.common.field_reference), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"field_magnitude", 205, 1, offsetof(cg_ekf_instance, params.common.field_magnitude), FMU_REAL, FMU_FIXED, 0, 1e-07, 0.01},
    {"field_dip", 206, 1, offsetof(cg_ekf_instance, params.common.field_dip), FMU_REAL, FMU_FIXED, 0, -1.5707963267948966, 1.5707963267948966},
    {"initialisation", 207, 1, offsetof(cg_ekf_instance, params.common.initialisation), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"q0", 208, 4, offsetof(cg_ekf_instance, params.common.q0), FMU_REAL, FMU_FIXED, 0, -1.1, 1.1},
    {"init_time", 212, 1, offsetof(cg_ekf_instance, params.common.init_time), FMU_REAL, FMU_FIXED, 0, 0.0, 600.0},
    {"motion_compensation", 213, 1, offsetof(cg_ekf_instance, params.common.motion_compensation), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"motion_time_constant", 214, 1, offsetof(cg_ekf_instance, params.common.motion_time_constant), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN | FMU_INFINITY_ALLOWED, 0.0, DBL_MAX},
    {"accel_gating", 215, 1, offsetof(cg_ekf_instance, params.common.accel_gating), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"accel_gate", 216, 1, offsetof(cg_ekf_instance, params.common.accel_gate), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"accel_gate_time", 217, 1, offsetof(cg_ekf_instance, params.common.accel_gate_time), FMU_REAL, FMU_TUNABLE, 0, 0.0, 600.0},
    {"gyro_zero_samples", 220, 1, offsetof(cg_ekf_instance, params.common.gyro_zero_samples), FMU_INTEGER, FMU_FIXED, 0, 0.0, 1000000.0},
    {"gyro_zero_std", 221, 1, offsetof(cg_ekf_instance, params.common.gyro_zero_std), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"gyro_zero_limit", 222, 1, offsetof(cg_ekf_instance, params.common.gyro_zero_limit), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"accel_cutoff", 223, 1, offsetof(cg_ekf_instance, params.common.accel_cutoff), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"mag_offset", 224, 3, offsetof(cg_ekf_instance, params.common.mag_offset), FMU_REAL, FMU_FIXED, 0, -0.01, 0.01},
    {"mag_gain", 227, 3, offsetof(cg_ekf_instance, params.common.mag_gain), FMU_REAL, FMU_FIXED, 0, 0.01, 100.0},
    {"gyro_noise", 1040, 1, offsetof(cg_ekf_instance, params.gyro_noise), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN, 0.0, 100.0},
    {"attitude_noise", 1045, 1, offsetof(cg_ekf_instance, params.attitude_noise), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN, 0.0, 100.0},
    {"motion_noise", 1047, 1, offsetof(cg_ekf_instance, params.motion_noise), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000.0},
    {"initial_attitude_std", 1048, 1, offsetof(cg_ekf_instance, params.initial_attitude_std), FMU_REAL, FMU_FIXED, 0, 0.0001, 10.0},
    {"iterations", 1080, 1, offsetof(cg_ekf_instance, params.iterations), FMU_INTEGER, FMU_FIXED, 0, 1.0, 100.0},
};

static bool cg_ekf_limit_0(const void *data) {
    const ahrs_cg_ekf_params *p = &((const cg_ekf_instance *)data)->params;
    return (p->common.initialisation == AHRS_INITIALISATION_SENSORS) || (((((p->common.q0[0] * p->common.q0[0]) + (p->common.q0[1] * p->common.q0[1])) + (p->common.q0[2] * p->common.q0[2])) + (p->common.q0[3] * p->common.q0[3])) > AHRS_C(1e-06));
}

static const uint32_t cg_ekf_limit_0_vrs[] = {207, 208};

static bool cg_ekf_limit_1(const void *data) {
    const ahrs_cg_ekf_params *p = &((const cg_ekf_instance *)data)->params;
    return (!(p->common.motion_compensation)) || (p->common.motion_time_constant < AHRS_INFINITY);
}

static const uint32_t cg_ekf_limit_1_vrs[] = {213, 214};

static bool cg_ekf_limit_2(const void *data) {
    const ahrs_cg_ekf_params *p = &((const cg_ekf_instance *)data)->params;
    return (p->common.accel_cutoff * p->common.sample_time) < AHRS_C(0.4);
}

static const uint32_t cg_ekf_limit_2_vrs[] = {223, 200};

static const fmu_limit cg_ekf_limits[] = {
    {"initialisation == sensors or q0[0]*q0[0] + q0[1]*q0[1] + q0[2]*q0[2] + q0[3]*q0[3] > 1e-6", "q0 has no direction: give a quaternion of about unit length", false, cg_ekf_limit_0_vrs, 2, cg_ekf_limit_0},
    {"not motion_compensation or motion_time_constant < inf", "tilt is not observed at all with an infinite motion_time_constant: use it for bursts of less than half a minute only", true, cg_ekf_limit_1_vrs, 2, cg_ekf_limit_1},
    {"accel_cutoff*sample_time < 0.4", "the low-pass needs more than two samples per period: lower accel_cutoff or sample_time", false, cg_ekf_limit_2_vrs, 2, cg_ekf_limit_2},
};

static inline void ahrs_cg_ekf_defaults(ahrs_cg_ekf_params *p, ahrs_cg_ekf_inputs *u) {
    memset(p, 0, sizeof *p);
    memset(u, 0, sizeof *u);
    p->common.sample_time = AHRS_C(0.01);
    p->common.frame = 0;
    p->common.declination = AHRS_C(0.0);
    p->common.gravity = AHRS_C(9.80665);
    p->common.field_reference = 0;
    p->common.field_magnitude = AHRS_C(5e-05);
    p->common.field_dip = AHRS_C(1.1);
    p->common.initialisation = 0;
    p->common.q0[0] = AHRS_C(1.0);
    p->common.q0[1] = AHRS_C(0.0);
    p->common.q0[2] = AHRS_C(0.0);
    p->common.q0[3] = AHRS_C(0.0);
    p->common.init_time = AHRS_C(0.0);
    p->common.motion_compensation = 0;
    p->common.motion_time_constant = AHRS_C(1.0);
    p->common.accel_gating = 0;
    p->common.accel_gate = AHRS_C(1.0);
    p->common.accel_gate_time = AHRS_C(10.0);
    p->common.gyro_zero_samples = 0;
    p->common.gyro_zero_std = AHRS_C(0.02);
    p->common.gyro_zero_limit = AHRS_C(0.1);
    p->common.accel_cutoff = AHRS_C(0.0);
    p->common.mag_offset[0] = AHRS_C(0.0);
    p->common.mag_offset[1] = AHRS_C(0.0);
    p->common.mag_offset[2] = AHRS_C(0.0);
    p->common.mag_gain[0] = AHRS_C(1.0);
    p->common.mag_gain[1] = AHRS_C(1.0);
    p->common.mag_gain[2] = AHRS_C(1.0);
    p->gyro_noise = AHRS_C(0.0316);
    p->attitude_noise = AHRS_C(0.004);
    p->motion_noise = AHRS_C(0.5);
    p->initial_attitude_std = AHRS_C(0.2);
    p->iterations = 4;
    u->gyro[0] = AHRS_C(0.0);
    u->gyro[1] = AHRS_C(0.0);
    u->gyro[2] = AHRS_C(0.0);
    u->accel[0] = AHRS_C(0.0);
    u->accel[1] = AHRS_C(0.0);
    u->accel[2] = AHRS_C(0.0);
    u->mag[0] = AHRS_C(0.0);
    u->mag[1] = AHRS_C(0.0);
    u->mag[2] = AHRS_C(0.0);
    u->accel_valid = 1;
    u->mag_valid = 1;
}

static void cg_ekf_defaults(void *data) {
    cg_ekf_instance *i = data;
    memset(i, 0, sizeof *i);
    ahrs_cg_ekf_defaults(&i->params, &i->inputs);
}

static void cg_ekf_init(void *data) {
    cg_ekf_instance *i = data;
    ahrs_cg_ekf_init(&i->state, &i->params);
}

static void cg_ekf_update(void *data, ahrs_real dt) {
    cg_ekf_instance *i = data;
    ahrs_cg_ekf_update(&i->state, &i->params, &i->inputs, dt);
}

static void cg_ekf_compute_outputs(void *data) {
    cg_ekf_instance *i = data;
    ahrs_cg_ekf_outputs(&i->state, &i->params, &i->outputs);
}

static const fmu_model ahrs_cg_ekf_model = {
    "cg_ekf", "CGEKF", sizeof(cg_ekf_instance), {offsetof(cg_ekf_instance, params), sizeof(((cg_ekf_instance *)0)->params)}, {offsetof(cg_ekf_instance, inputs), sizeof(((cg_ekf_instance *)0)->inputs)}, {offsetof(cg_ekf_instance, outputs), sizeof(((cg_ekf_instance *)0)->outputs)}, {offsetof(cg_ekf_instance, state), sizeof(((cg_ekf_instance *)0)->state)},
    offsetof(cg_ekf_instance, params.common.sample_time), 0.01,
    cg_ekf_variables, sizeof cg_ekf_variables / sizeof cg_ekf_variables[0],
    cg_ekf_limits, sizeof cg_ekf_limits / sizeof cg_ekf_limits[0],
    cg_ekf_defaults, cg_ekf_init, cg_ekf_update, cg_ekf_compute_outputs};

/* Generated from models/complementary/complementary.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_COMPLEMENTARY_H
#define AHRS_COMPLEMENTARY_H


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
static inline void ahrs_complementary_defaults(ahrs_complementary_params *p, ahrs_complementary_inputs *u);

/* State as before the first sample. */
static inline void ahrs_complementary_init(ahrs_complementary_state *s, const ahrs_complementary_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
static inline void ahrs_complementary_update(ahrs_complementary_state *s, const ahrs_complementary_params *p, const ahrs_complementary_inputs *u, ahrs_real dt);

static inline void ahrs_complementary_outputs(const ahrs_complementary_state *s, const ahrs_complementary_params *p, ahrs_complementary_outputs_t *y);

#endif
/* First-order complementary filter on the quaternion (docs/algorithms.md section 1). */

static inline void ahrs_complementary_init(ahrs_complementary_state *s, const ahrs_complementary_params *p) {
    (void)p;
    ahrs_estimator_init(&s->common);
}

static inline void ahrs_complementary_update(ahrs_complementary_state *s, const ahrs_complementary_params *p,
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

static inline void ahrs_complementary_outputs(const ahrs_complementary_state *s, const ahrs_complementary_params *p,
                                ahrs_complementary_outputs_t *y) {
    ahrs_estimator_outputs(&s->common, &p->common, (ahrs_vec3){0, 0, 0}, &y->common);
}

/* Generated from models/complementary/complementary.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */

#include <string.h>

typedef struct {
    ahrs_complementary_params params;
    ahrs_complementary_inputs inputs;
    ahrs_complementary_outputs_t outputs;
    ahrs_complementary_state state;
} complementary_instance;

static const fmu_variable complementary_variables[] = {
    {"gyro", 1, 3, offsetof(complementary_instance, inputs.gyro), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel", 4, 3, offsetof(complementary_instance, inputs.accel), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"mag", 7, 3, offsetof(complementary_instance, inputs.mag), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel_valid", 10, 1, offsetof(complementary_instance, inputs.accel_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"mag_valid", 11, 1, offsetof(complementary_instance, inputs.mag_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"q", 100, 4, offsetof(complementary_instance, outputs.common.q), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"roll", 104, 1, offsetof(complementary_instance, outputs.common.roll), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"pitch", 105, 1, offsetof(complementary_instance, outputs.common.pitch), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"yaw", 106, 1, offsetof(complementary_instance, outputs.common.yaw), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate", 107, 3, offsetof(complementary_instance, outputs.common.rate), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"gyro_bias", 110, 3, offsetof(complementary_instance, outputs.common.gyro_bias), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"motion_accel", 113, 3, offsetof(complementary_instance, outputs.common.motion_accel), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"status", 119, 1, offsetof(complementary_instance, outputs.common.status), FMU_ENUMERATION, FMU_OUTPUT, 0, 0.0, 9.0},
    {"gyro_held", 120, 1, offsetof(complementary_instance, outputs.common.gyro_held), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"accel_used", 121, 1, offsetof(complementary_instance, outputs.common.accel_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"mag_used", 122, 1, offsetof(complementary_instance, outputs.common.mag_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"sample_time", 200, 1, offsetof(complementary_instance, params.common.sample_time), FMU_REAL, FMU_FIXED, 0, 1e-05, 0.5},
    {"frame", 201, 1, offsetof(complementary_instance, params.common.frame), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"declination", 202, 1, offsetof(complementary_instance, params.common.declination), FMU_REAL, FMU_TUNABLE, 0, -3.141592653589793, 3.141592653589793},
    {"gravity", 203, 1, offsetof(complementary_instance, params.common.gravity), FMU_REAL, FMU_FIXED, 0, 0.1, 100.0},
    {"field_reference", 204, 1, offsetof(complementary_instance, params.common.field_reference), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"field_magnitude", 205, 1, offsetof(complementary_instance, params.common.field_magnitude), FMU_REAL, FMU_FIXED, 0, 1e-07, 0.01},
    {"field_dip", 206, 1, offsetof(complementary_instance, params.common.field_dip), FMU_REAL, FMU_FIXED, 0, -1.5707963267948966, 1.5707963267948966},
    {"initialisation", 207, 1, offsetof(complementary_instance, params.common.initialisation), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"q0", 208, 4, offsetof(complementary_instance, params.common.q0), FMU_REAL, FMU_FIXED, 0, -1.1, 1.1},
    {"init_time", 212, 1, offsetof(complementary_instance, params.common.init_time), FMU_REAL, FMU_FIXED, 0, 0.0, 600.0},
    {"motion_compensation", 213, 1, offsetof(complementary_instance, params.common.motion_compensation), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"motion_time_constant", 214, 1, offsetof(complementary_instance, params.common.motion_time_constant), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN | FMU_INFINITY_ALLOWED, 0.0, DBL_MAX},
    {"accel_gating", 215, 1, offsetof(complementary_instance, params.common.accel_gating), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"accel_gate", 216, 1, offsetof(complementary_instance, params.common.accel_gate), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"accel_gate_time", 217, 1, offsetof(complementary_instance, params.common.accel_gate_time), FMU_REAL, FMU_TUNABLE, 0, 0.0, 600.0},
    {"gyro_zero_samples", 220, 1, offsetof(complementary_instance, params.common.gyro_zero_samples), FMU_INTEGER, FMU_FIXED, 0, 0.0, 1000000.0},
    {"gyro_zero_std", 221, 1, offsetof(complementary_instance, params.common.gyro_zero_std), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"gyro_zero_limit", 222, 1, offsetof(complementary_instance, params.common.gyro_zero_limit), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"accel_cutoff", 223, 1, offsetof(complementary_instance, params.common.accel_cutoff), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"mag_offset", 224, 3, offsetof(complementary_instance, params.common.mag_offset), FMU_REAL, FMU_FIXED, 0, -0.01, 0.01},
    {"mag_gain", 227, 3, offsetof(complementary_instance, params.common.mag_gain), FMU_REAL, FMU_FIXED, 0, 0.01, 100.0},
    {"kp", 1000, 1, offsetof(complementary_instance, params.kp), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000.0},
};

static bool complementary_limit_0(const void *data) {
    const ahrs_complementary_params *p = &((const complementary_instance *)data)->params;
    return (p->common.initialisation == AHRS_INITIALISATION_SENSORS) || (((((p->common.q0[0] * p->common.q0[0]) + (p->common.q0[1] * p->common.q0[1])) + (p->common.q0[2] * p->common.q0[2])) + (p->common.q0[3] * p->common.q0[3])) > AHRS_C(1e-06));
}

static const uint32_t complementary_limit_0_vrs[] = {207, 208};

static bool complementary_limit_1(const void *data) {
    const ahrs_complementary_params *p = &((const complementary_instance *)data)->params;
    return (!(p->common.motion_compensation)) || (p->common.motion_time_constant < AHRS_INFINITY);
}

static const uint32_t complementary_limit_1_vrs[] = {213, 214};

static bool complementary_limit_2(const void *data) {
    const ahrs_complementary_params *p = &((const complementary_instance *)data)->params;
    return (p->common.accel_cutoff * p->common.sample_time) < AHRS_C(0.4);
}

static const uint32_t complementary_limit_2_vrs[] = {223, 200};

static bool complementary_limit_3(const void *data) {
    const ahrs_complementary_params *p = &((const complementary_instance *)data)->params;
    return (p->kp * p->common.sample_time) < 1;
}

static const uint32_t complementary_limit_3_vrs[] = {1000, 200};

static const fmu_limit complementary_limits[] = {
    {"initialisation == sensors or q0[0]*q0[0] + q0[1]*q0[1] + q0[2]*q0[2] + q0[3]*q0[3] > 1e-6", "q0 has no direction: give a quaternion of about unit length", false, complementary_limit_0_vrs, 2, complementary_limit_0},
    {"not motion_compensation or motion_time_constant < inf", "tilt is not observed at all with an infinite motion_time_constant: use it for bursts of less than half a minute only", true, complementary_limit_1_vrs, 2, complementary_limit_1},
    {"accel_cutoff*sample_time < 0.4", "the low-pass needs more than two samples per period: lower accel_cutoff or sample_time", false, complementary_limit_2_vrs, 2, complementary_limit_2},
    {"kp*sample_time < 1", "the filter would correct more than the whole error in one sample: lower kp or sample_time", false, complementary_limit_3_vrs, 2, complementary_limit_3},
};

static inline void ahrs_complementary_defaults(ahrs_complementary_params *p, ahrs_complementary_inputs *u) {
    memset(p, 0, sizeof *p);
    memset(u, 0, sizeof *u);
    p->common.sample_time = AHRS_C(0.01);
    p->common.frame = 0;
    p->common.declination = AHRS_C(0.0);
    p->common.gravity = AHRS_C(9.80665);
    p->common.field_reference = 0;
    p->common.field_magnitude = AHRS_C(5e-05);
    p->common.field_dip = AHRS_C(1.1);
    p->common.initialisation = 0;
    p->common.q0[0] = AHRS_C(1.0);
    p->common.q0[1] = AHRS_C(0.0);
    p->common.q0[2] = AHRS_C(0.0);
    p->common.q0[3] = AHRS_C(0.0);
    p->common.init_time = AHRS_C(0.0);
    p->common.motion_compensation = 0;
    p->common.motion_time_constant = AHRS_C(1.0);
    p->common.accel_gating = 0;
    p->common.accel_gate = AHRS_C(1.0);
    p->common.accel_gate_time = AHRS_C(10.0);
    p->common.gyro_zero_samples = 0;
    p->common.gyro_zero_std = AHRS_C(0.02);
    p->common.gyro_zero_limit = AHRS_C(0.1);
    p->common.accel_cutoff = AHRS_C(0.0);
    p->common.mag_offset[0] = AHRS_C(0.0);
    p->common.mag_offset[1] = AHRS_C(0.0);
    p->common.mag_offset[2] = AHRS_C(0.0);
    p->common.mag_gain[0] = AHRS_C(1.0);
    p->common.mag_gain[1] = AHRS_C(1.0);
    p->common.mag_gain[2] = AHRS_C(1.0);
    p->kp = AHRS_C(0.58);
    u->gyro[0] = AHRS_C(0.0);
    u->gyro[1] = AHRS_C(0.0);
    u->gyro[2] = AHRS_C(0.0);
    u->accel[0] = AHRS_C(0.0);
    u->accel[1] = AHRS_C(0.0);
    u->accel[2] = AHRS_C(0.0);
    u->mag[0] = AHRS_C(0.0);
    u->mag[1] = AHRS_C(0.0);
    u->mag[2] = AHRS_C(0.0);
    u->accel_valid = 1;
    u->mag_valid = 1;
}

static void complementary_defaults(void *data) {
    complementary_instance *i = data;
    memset(i, 0, sizeof *i);
    ahrs_complementary_defaults(&i->params, &i->inputs);
}

static void complementary_init(void *data) {
    complementary_instance *i = data;
    ahrs_complementary_init(&i->state, &i->params);
}

static void complementary_update(void *data, ahrs_real dt) {
    complementary_instance *i = data;
    ahrs_complementary_update(&i->state, &i->params, &i->inputs, dt);
}

static void complementary_compute_outputs(void *data) {
    complementary_instance *i = data;
    ahrs_complementary_outputs(&i->state, &i->params, &i->outputs);
}

static const fmu_model ahrs_complementary_model = {
    "complementary", "Complementary", sizeof(complementary_instance), {offsetof(complementary_instance, params), sizeof(((complementary_instance *)0)->params)}, {offsetof(complementary_instance, inputs), sizeof(((complementary_instance *)0)->inputs)}, {offsetof(complementary_instance, outputs), sizeof(((complementary_instance *)0)->outputs)}, {offsetof(complementary_instance, state), sizeof(((complementary_instance *)0)->state)},
    offsetof(complementary_instance, params.common.sample_time), 0.01,
    complementary_variables, sizeof complementary_variables / sizeof complementary_variables[0],
    complementary_limits, sizeof complementary_limits / sizeof complementary_limits[0],
    complementary_defaults, complementary_init, complementary_update, complementary_compute_outputs};

/* Generated from models/gcf/gcf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_GCF_H
#define AHRS_GCF_H


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
static inline void ahrs_gcf_defaults(ahrs_gcf_params *p, ahrs_gcf_inputs *u);

/* State as before the first sample. */
static inline void ahrs_gcf_init(ahrs_gcf_state *s, const ahrs_gcf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
static inline void ahrs_gcf_update(ahrs_gcf_state *s, const ahrs_gcf_params *p, const ahrs_gcf_inputs *u, ahrs_real dt);

static inline void ahrs_gcf_outputs(const ahrs_gcf_state *s, const ahrs_gcf_params *p, ahrs_gcf_outputs_t *y);

#endif
/* Generalized complementary filter (docs/algorithms.md section 5). */

/* An attitude in the form of its realisation: a quaternion (quaternion, euler), or the navigation axes seen from the
 * body, which are the rows of the rotation matrix (dcm) or the first and the last of them (vector). */
typedef struct {
    int32_t realisation;
    ahrs_quat q;
    ahrs_mat3 c;
} gcf_attitude;

/* From one stored row to the next: vector leaves out east. */
AHRS_INLINE int32_t gcf_row_step(int32_t realisation) { return realisation == AHRS_GCF_REALISATION_VECTOR ? 2 : 1; }

AHRS_INLINE bool gcf_has_axes(int32_t realisation) {
    return realisation == AHRS_GCF_REALISATION_VECTOR || realisation == AHRS_GCF_REALISATION_DCM;
}

AHRS_INLINE gcf_attitude gcf_attitude_from(int32_t realisation, ahrs_quat q) {
    gcf_attitude a = {.realisation = realisation, .q = q};
    if (gcf_has_axes(realisation)) {
        a.c = ahrs_quat_to_mat3(q);
    }
    return a;
}

AHRS_INLINE gcf_attitude gcf_load(const ahrs_gcf_state *s, int32_t realisation) {
    gcf_attitude a = {.realisation = realisation};
    if (gcf_has_axes(realisation)) {
        for (int32_t i = AHRS_NORTH; i <= AHRS_DOWN; i += gcf_row_step(realisation)) {
            a.c.row[i] = ahrs_vec3_of(&s->store[3 * i]);
        }
    } else if (realisation == AHRS_GCF_REALISATION_EULER) {
        a.q = ahrs_quat_from_euler(ahrs_vec3_of(s->store));
    } else {
        a.q = ahrs_quat_of(s->common.q);
    }
    return a;
}

AHRS_INLINE void gcf_store(ahrs_gcf_state *s, gcf_attitude a) {
    if (gcf_has_axes(a.realisation)) {
        for (int32_t i = AHRS_NORTH; i <= AHRS_DOWN; i += gcf_row_step(a.realisation)) {
            ahrs_vec3_to(&s->store[3 * i], a.c.row[i]);
        }
    } else if (a.realisation == AHRS_GCF_REALISATION_EULER) {
        ahrs_vec3_to(s->store, ahrs_quat_to_euler(a.q));
    }
}

/* The rows of the rotation matrix. */
AHRS_INLINE ahrs_mat3 gcf_axes_of(gcf_attitude a) {
    if (!gcf_has_axes(a.realisation)) {
        return ahrs_quat_to_mat3(a.q);
    }
    if (a.realisation == AHRS_GCF_REALISATION_VECTOR) {
        a.c.row[AHRS_EAST] = ahrs_vec3_cross(a.c.row[AHRS_DOWN], a.c.row[AHRS_NORTH]);
    }
    return a.c;
}

AHRS_INLINE ahrs_quat gcf_quaternion_of(gcf_attitude a) {
    return gcf_has_axes(a.realisation) ? ahrs_quat_from_mat3(gcf_axes_of(a)) : a.q;
}

/* Seen from the body, an axis fixed in space turns backwards as the body turns by v: u exp(-[v x]). */
AHRS_INLINE ahrs_vec3 gcf_turned_back(ahrs_vec3 u, ahrs_vec3 v, ahrs_real sinc, ahrs_real versine) {
    const ahrs_vec3 first = ahrs_vec3_cross(u, v), second = ahrs_vec3_cross(first, v);
    return ahrs_vec3_add_scaled(ahrs_vec3_add_scaled(u, sinc, first), versine, second);
}

/* The attitude after the body has turned by the rotation vector v. */
AHRS_INLINE gcf_attitude gcf_rotated(gcf_attitude a, ahrs_vec3 v) {
    if (!gcf_has_axes(a.realisation)) {
        a.q = ahrs_quat_turn(a.q, v);
        return a;
    }
    ahrs_real c, k;
    ahrs_half_angle(ahrs_vec3_norm2(v), &c, &k);
    const ahrs_real sinc = 2 * k * c, versine = 2 * k * k; /* sin n/n and (1 - cos n)/n^2 */
    a.c.row[AHRS_NORTH] = gcf_turned_back(a.c.row[AHRS_NORTH], v, sinc, versine);
    if (a.realisation == AHRS_GCF_REALISATION_DCM) {
        a.c.row[AHRS_EAST] = gcf_turned_back(a.c.row[AHRS_EAST], v, sinc, versine);
    }
    a.c.row[AHRS_DOWN] = gcf_turned_back(a.c.row[AHRS_DOWN], v, sinc, versine);
    return a;
}

/* One step C := (3 C - C C' C)/2 towards the nearest rotation matrix. */
static ahrs_mat3 gcf_refined_matrix(ahrs_mat3 c) {
    ahrs_mat3 gcf_refined;
    for (int32_t i = AHRS_NORTH; i <= AHRS_DOWN; i++) {
        const ahrs_vec3 back = ahrs_mat3_apply_transposed(c, ahrs_mat3_apply(c, c.row[i]));
        gcf_refined.row[i] = ahrs_vec3_add_scaled(ahrs_vec3_scale(c.row[i], AHRS_C(1.5)), AHRS_C(-0.5), back);
    }
    return gcf_refined;
}

/* Two vectors of unit length at right angles; down leads, because it is the better known. */
AHRS_INLINE ahrs_mat3 gcf_refined_vectors(ahrs_mat3 c) {
    const ahrs_vec3 north = c.row[AHRS_NORTH], down = c.row[AHRS_DOWN];
    c.row[AHRS_NORTH] = ahrs_vec3_add_scaled(ahrs_vec3_scale(north, AHRS_C(1.5) - AHRS_C(0.5) * ahrs_vec3_norm2(north)),
                                        -ahrs_vec3_dot(north, down), down);
    c.row[AHRS_DOWN] = ahrs_vec3_scale(down, AHRS_C(1.5) - AHRS_C(0.5) * ahrs_vec3_norm2(down));
    return c;
}

/* The rounding of rotations taken out, by one Newton step. */
AHRS_INLINE gcf_attitude gcf_refined(gcf_attitude a) {
    if (a.realisation == AHRS_GCF_REALISATION_DCM) {
        a.c = gcf_refined_matrix(a.c);
    } else if (a.realisation == AHRS_GCF_REALISATION_VECTOR) {
        a.c = gcf_refined_vectors(a.c);
    } else {
        a.q = ahrs_quat_refine(a.q);
    }
    return a;
}

/* Both cross products, measured x expected, weighted: loop gain kg (I - gg') + kh (I - hh'). */
AHRS_INLINE ahrs_vec3 gcf_coupled_error(const ahrs_gcf_state *s, const ahrs_gcf_params *p, ahrs_mat3 c,
                                    const ahrs_sample *z) {
    ahrs_vec3 e = {0, 0, 0};
    if (z->accel_usable) {
        e = ahrs_vec3_scale(ahrs_vec3_cross(c.row[AHRS_DOWN], ahrs_vec3_unit(z->accel)), p->kg);
    }
    const ahrs_vec3 field =
        ahrs_vec3_add_scaled(ahrs_vec3_scale(c.row[AHRS_NORTH], s->common.field[0]), s->common.field[1], c.row[AHRS_DOWN]);
    if (z->mag_usable && ahrs_vec3_norm2(field) > 0) {
        const ahrs_vec3 cross = ahrs_vec3_cross(ahrs_vec3_unit(z->mag), ahrs_vec3_unit(field));
        e = ahrs_vec3_add_scaled(e, p->kh, cross);
    }
    return e;
}

AHRS_INLINE ahrs_vec3 gcf_error_of(const ahrs_gcf_state *s, const ahrs_gcf_params *p, gcf_attitude a, const ahrs_sample *z) {
    ahrs_vec3 e;
    if (p->form == AHRS_GCF_FORM_ATTITUDE) {
        const gcf_attitude predicted = a; /* copies, so that the direct form may keep its own in registers */
        const ahrs_sample sample = *z;
        e = ahrs_attitude_error(gcf_quaternion_of(predicted), &sample);
    } else if (p->error == AHRS_GCF_ERROR_COUPLED) {
        e = gcf_coupled_error(s, p, gcf_axes_of(a), z);
    } else {
        e = ahrs_decoupled_error(gcf_axes_of(a), z);
    }
    return e;
}

static inline void ahrs_gcf_init(ahrs_gcf_state *s, const ahrs_gcf_params *p) {
    (void)p;
    *s = (ahrs_gcf_state){.bias = {0}};
    ahrs_estimator_init(&s->common);
}

/* One prediction and one correction; the realisation is a constant wherever this is used. */
AHRS_INLINE void gcf_step(ahrs_gcf_state *s, const ahrs_gcf_params *p, const ahrs_sample *z, int32_t realisation) {
    const ahrs_real T = z->gain_dt;
    const ahrs_vec3 bias = ahrs_vec3_of(s->bias);
    const gcf_attitude predicted = gcf_rotated(gcf_load(s, realisation), ahrs_vec3_scale(ahrs_vec3_sub(z->rate, bias), z->dt));
    const ahrs_vec3 e = gcf_error_of(s, p, predicted, z);
    const gcf_attitude corrected = gcf_rotated(gcf_refined(predicted), ahrs_vec3_scale(e, p->kp * T));
    ahrs_vec3 slope = ahrs_vec3_scale(e, p->ki);
    if (p->kii != 0) { /* of third order */
        const ahrs_vec3 drift = ahrs_vec3_add_scaled(ahrs_vec3_of(s->drift), T * p->kii, e);
        ahrs_vec3_to(s->drift, drift);
        slope = ahrs_vec3_add(slope, drift);
    }
    ahrs_vec3_to(s->bias, ahrs_vec3_limited(ahrs_vec3_add_scaled(bias, -T, slope), p->bias_limit));
    gcf_store(s, corrected);
    ahrs_estimator_end(&s->common, &p->common, z, gcf_quaternion_of(corrected));
}

static inline void ahrs_gcf_update(ahrs_gcf_state *s, const ahrs_gcf_params *p, const ahrs_gcf_inputs *u, ahrs_real dt) {
    ahrs_sample z;
    const ahrs_action action = ahrs_estimator_begin(&s->common, &p->common, u, dt, &z);
    if (action == AHRS_START) {
        ahrs_vec3_to(s->bias, (ahrs_vec3){0, 0, 0});
        ahrs_vec3_to(s->drift, (ahrs_vec3){0, 0, 0});
    }
    if (action == AHRS_START || action == AHRS_TURN) {
        gcf_store(s, gcf_attitude_from(p->realisation, ahrs_quat_of(s->common.q)));
    }
    if (action == AHRS_START || action == AHRS_WAIT) {
        return;
    }
    switch (p->realisation) {
    case AHRS_GCF_REALISATION_VECTOR:
        gcf_step(s, p, &z, AHRS_GCF_REALISATION_VECTOR);
        break;
    case AHRS_GCF_REALISATION_DCM:
        gcf_step(s, p, &z, AHRS_GCF_REALISATION_DCM);
        break;
    case AHRS_GCF_REALISATION_EULER:
        gcf_step(s, p, &z, AHRS_GCF_REALISATION_EULER);
        break;
    default:
        gcf_step(s, p, &z, AHRS_GCF_REALISATION_QUATERNION);
    }
}

static inline void ahrs_gcf_outputs(const ahrs_gcf_state *s, const ahrs_gcf_params *p, ahrs_gcf_outputs_t *y) {
    ahrs_estimator_outputs(&s->common, &p->common, ahrs_vec3_of(s->bias), &y->common);
}

/* Generated from models/gcf/gcf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */

#include <string.h>

typedef struct {
    ahrs_gcf_params params;
    ahrs_gcf_inputs inputs;
    ahrs_gcf_outputs_t outputs;
    ahrs_gcf_state state;
} gcf_instance;

static const fmu_variable gcf_variables[] = {
    {"gyro", 1, 3, offsetof(gcf_instance, inputs.gyro), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel", 4, 3, offsetof(gcf_instance, inputs.accel), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"mag", 7, 3, offsetof(gcf_instance, inputs.mag), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel_valid", 10, 1, offsetof(gcf_instance, inputs.accel_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"mag_valid", 11, 1, offsetof(gcf_instance, inputs.mag_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"q", 100, 4, offsetof(gcf_instance, outputs.common.q), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"roll", 104, 1, offsetof(gcf_instance, outputs.common.roll), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"pitch", 105, 1, offsetof(gcf_instance, outputs.common.pitch), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"yaw", 106, 1, offsetof(gcf_instance, outputs.common.yaw), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate", 107, 3, offsetof(gcf_instance, outputs.common.rate), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"gyro_bias", 110, 3, offsetof(gcf_instance, outputs.common.gyro_bias), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"motion_accel", 113, 3, offsetof(gcf_instance, outputs.common.motion_accel), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"status", 119, 1, offsetof(gcf_instance, outputs.common.status), FMU_ENUMERATION, FMU_OUTPUT, 0, 0.0, 9.0},
    {"gyro_held", 120, 1, offsetof(gcf_instance, outputs.common.gyro_held), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"accel_used", 121, 1, offsetof(gcf_instance, outputs.common.accel_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"mag_used", 122, 1, offsetof(gcf_instance, outputs.common.mag_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"sample_time", 200, 1, offsetof(gcf_instance, params.common.sample_time), FMU_REAL, FMU_FIXED, 0, 1e-05, 0.5},
    {"frame", 201, 1, offsetof(gcf_instance, params.common.frame), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"declination", 202, 1, offsetof(gcf_instance, params.common.declination), FMU_REAL, FMU_TUNABLE, 0, -3.141592653589793, 3.141592653589793},
    {"gravity", 203, 1, offsetof(gcf_instance, params.common.gravity), FMU_REAL, FMU_FIXED, 0, 0.1, 100.0},
    {"field_reference", 204, 1, offsetof(gcf_instance, params.common.field_reference), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"field_magnitude", 205, 1, offsetof(gcf_instance, params.common.field_magnitude), FMU_REAL, FMU_FIXED, 0, 1e-07, 0.01},
    {"field_dip", 206, 1, offsetof(gcf_instance, params.common.field_dip), FMU_REAL, FMU_FIXED, 0, -1.5707963267948966, 1.5707963267948966},
    {"initialisation", 207, 1, offsetof(gcf_instance, params.common.initialisation), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"q0", 208, 4, offsetof(gcf_instance, params.common.q0), FMU_REAL, FMU_FIXED, 0, -1.1, 1.1},
    {"init_time", 212, 1, offsetof(gcf_instance, params.common.init_time), FMU_REAL, FMU_FIXED, 0, 0.0, 600.0},
    {"motion_compensation", 213, 1, offsetof(gcf_instance, params.common.motion_compensation), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"motion_time_constant", 214, 1, offsetof(gcf_instance, params.common.motion_time_constant), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN | FMU_INFINITY_ALLOWED, 0.0, DBL_MAX},
    {"accel_gating", 215, 1, offsetof(gcf_instance, params.common.accel_gating), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"accel_gate", 216, 1, offsetof(gcf_instance, params.common.accel_gate), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"accel_gate_time", 217, 1, offsetof(gcf_instance, params.common.accel_gate_time), FMU_REAL, FMU_TUNABLE, 0, 0.0, 600.0},
    {"gyro_zero_samples", 220, 1, offsetof(gcf_instance, params.common.gyro_zero_samples), FMU_INTEGER, FMU_FIXED, 0, 0.0, 1000000.0},
    {"gyro_zero_std", 221, 1, offsetof(gcf_instance, params.common.gyro_zero_std), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"gyro_zero_limit", 222, 1, offsetof(gcf_instance, params.common.gyro_zero_limit), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"accel_cutoff", 223, 1, offsetof(gcf_instance, params.common.accel_cutoff), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"mag_offset", 224, 3, offsetof(gcf_instance, params.common.mag_offset), FMU_REAL, FMU_FIXED, 0, -0.01, 0.01},
    {"mag_gain", 227, 3, offsetof(gcf_instance, params.common.mag_gain), FMU_REAL, FMU_FIXED, 0, 0.01, 100.0},
    {"kp", 1000, 1, offsetof(gcf_instance, params.kp), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000.0},
    {"ki", 1001, 1, offsetof(gcf_instance, params.ki), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000000.0},
    {"kii", 1002, 1, offsetof(gcf_instance, params.kii), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000000000.0},
    {"bias_limit", 1003, 1, offsetof(gcf_instance, params.bias_limit), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"realisation", 1010, 1, offsetof(gcf_instance, params.realisation), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 3.0},
    {"form", 1011, 1, offsetof(gcf_instance, params.form), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"error", 1012, 1, offsetof(gcf_instance, params.error), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"kg", 1013, 1, offsetof(gcf_instance, params.kg), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"kh", 1014, 1, offsetof(gcf_instance, params.kh), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
};

static bool gcf_limit_0(const void *data) {
    const ahrs_gcf_params *p = &((const gcf_instance *)data)->params;
    return (p->common.initialisation == AHRS_INITIALISATION_SENSORS) || (((((p->common.q0[0] * p->common.q0[0]) + (p->common.q0[1] * p->common.q0[1])) + (p->common.q0[2] * p->common.q0[2])) + (p->common.q0[3] * p->common.q0[3])) > AHRS_C(1e-06));
}

static const uint32_t gcf_limit_0_vrs[] = {207, 208};

static bool gcf_limit_1(const void *data) {
    const ahrs_gcf_params *p = &((const gcf_instance *)data)->params;
    return (!(p->common.motion_compensation)) || (p->common.motion_time_constant < AHRS_INFINITY);
}

static const uint32_t gcf_limit_1_vrs[] = {213, 214};

static bool gcf_limit_2(const void *data) {
    const ahrs_gcf_params *p = &((const gcf_instance *)data)->params;
    return (p->common.accel_cutoff * p->common.sample_time) < AHRS_C(0.4);
}

static const uint32_t gcf_limit_2_vrs[] = {223, 200};

static bool gcf_limit_3(const void *data) {
    const ahrs_gcf_params *p = &((const gcf_instance *)data)->params;
    return (p->kp * p->common.sample_time) < 1;
}

static const uint32_t gcf_limit_3_vrs[] = {1000, 200};

static bool gcf_limit_4(const void *data) {
    const ahrs_gcf_params *p = &((const gcf_instance *)data)->params;
    return (p->error == AHRS_GCF_ERROR_DECOUPLED) || (((p->kp * (p->kg + p->kh)) * p->common.sample_time) < 1);
}

static const uint32_t gcf_limit_4_vrs[] = {1012, 200, 1000, 1013, 1014};

static bool gcf_limit_5(const void *data) {
    const ahrs_gcf_params *p = &((const gcf_instance *)data)->params;
    return ((p->ki * p->common.sample_time) * p->common.sample_time) < (4 - ((2 * p->kp) * p->common.sample_time));
}

static const uint32_t gcf_limit_5_vrs[] = {200, 1001, 1000};

static bool gcf_limit_6(const void *data) {
    const ahrs_gcf_params *p = &((const gcf_instance *)data)->params;
    return (p->kii == 0) || ((p->kp * p->ki) > p->kii);
}

static const uint32_t gcf_limit_6_vrs[] = {1002, 1000, 1001};

static bool gcf_limit_7(const void *data) {
    const ahrs_gcf_params *p = &((const gcf_instance *)data)->params;
    return (p->realisation != AHRS_GCF_REALISATION_VECTOR) || (p->form == AHRS_GCF_FORM_DIRECT);
}

static const uint32_t gcf_limit_7_vrs[] = {1010, 1011};

static bool gcf_limit_8(const void *data) {
    const ahrs_gcf_params *p = &((const gcf_instance *)data)->params;
    return (p->error == AHRS_GCF_ERROR_DECOUPLED) || (p->form == AHRS_GCF_FORM_DIRECT);
}

static const uint32_t gcf_limit_8_vrs[] = {1012, 1011};

static const fmu_limit gcf_limits[] = {
    {"initialisation == sensors or q0[0]*q0[0] + q0[1]*q0[1] + q0[2]*q0[2] + q0[3]*q0[3] > 1e-6", "q0 has no direction: give a quaternion of about unit length", false, gcf_limit_0_vrs, 2, gcf_limit_0},
    {"not motion_compensation or motion_time_constant < inf", "tilt is not observed at all with an infinite motion_time_constant: use it for bursts of less than half a minute only", true, gcf_limit_1_vrs, 2, gcf_limit_1},
    {"accel_cutoff*sample_time < 0.4", "the low-pass needs more than two samples per period: lower accel_cutoff or sample_time", false, gcf_limit_2_vrs, 2, gcf_limit_2},
    {"kp*sample_time < 1", "the filter would correct more than the whole error in one sample: lower kp or sample_time", false, gcf_limit_3_vrs, 2, gcf_limit_3},
    {"error == decoupled or kp*(kg + kh)*sample_time < 1", "the coupled error raises the loop gain to kg + kh: lower kp, kg, kh or sample_time", false, gcf_limit_4_vrs, 5, gcf_limit_4},
    {"ki*sample_time*sample_time < 4 - 2*kp*sample_time", "the sampled loop is unstable: lower ki or sample_time", false, gcf_limit_5_vrs, 3, gcf_limit_5},
    {"kii == 0 or kp*ki > kii", "the third-order loop is unstable: lower kii, or raise kp or ki", false, gcf_limit_6_vrs, 3, gcf_limit_6},
    {"realisation != vector or form == direct", "realisation vector stores the measured directions and knows form direct only", false, gcf_limit_7_vrs, 2, gcf_limit_7},
    {"error == decoupled or form == direct", "form attitude has unit loop gain by construction: error coupled goes with form direct", false, gcf_limit_8_vrs, 2, gcf_limit_8},
};

static inline void ahrs_gcf_defaults(ahrs_gcf_params *p, ahrs_gcf_inputs *u) {
    memset(p, 0, sizeof *p);
    memset(u, 0, sizeof *u);
    p->common.sample_time = AHRS_C(0.01);
    p->common.frame = 0;
    p->common.declination = AHRS_C(0.0);
    p->common.gravity = AHRS_C(9.80665);
    p->common.field_reference = 0;
    p->common.field_magnitude = AHRS_C(5e-05);
    p->common.field_dip = AHRS_C(1.1);
    p->common.initialisation = 0;
    p->common.q0[0] = AHRS_C(1.0);
    p->common.q0[1] = AHRS_C(0.0);
    p->common.q0[2] = AHRS_C(0.0);
    p->common.q0[3] = AHRS_C(0.0);
    p->common.init_time = AHRS_C(0.0);
    p->common.motion_compensation = 0;
    p->common.motion_time_constant = AHRS_C(1.0);
    p->common.accel_gating = 0;
    p->common.accel_gate = AHRS_C(1.0);
    p->common.accel_gate_time = AHRS_C(10.0);
    p->common.gyro_zero_samples = 0;
    p->common.gyro_zero_std = AHRS_C(0.02);
    p->common.gyro_zero_limit = AHRS_C(0.1);
    p->common.accel_cutoff = AHRS_C(0.0);
    p->common.mag_offset[0] = AHRS_C(0.0);
    p->common.mag_offset[1] = AHRS_C(0.0);
    p->common.mag_offset[2] = AHRS_C(0.0);
    p->common.mag_gain[0] = AHRS_C(1.0);
    p->common.mag_gain[1] = AHRS_C(1.0);
    p->common.mag_gain[2] = AHRS_C(1.0);
    p->kp = AHRS_C(0.5);
    p->ki = AHRS_C(0.1);
    p->kii = AHRS_C(0.0);
    p->bias_limit = AHRS_C(1.0);
    p->realisation = 0;
    p->form = 0;
    p->error = 0;
    p->kg = AHRS_C(1.0);
    p->kh = AHRS_C(1.0);
    u->gyro[0] = AHRS_C(0.0);
    u->gyro[1] = AHRS_C(0.0);
    u->gyro[2] = AHRS_C(0.0);
    u->accel[0] = AHRS_C(0.0);
    u->accel[1] = AHRS_C(0.0);
    u->accel[2] = AHRS_C(0.0);
    u->mag[0] = AHRS_C(0.0);
    u->mag[1] = AHRS_C(0.0);
    u->mag[2] = AHRS_C(0.0);
    u->accel_valid = 1;
    u->mag_valid = 1;
}

static void gcf_defaults(void *data) {
    gcf_instance *i = data;
    memset(i, 0, sizeof *i);
    ahrs_gcf_defaults(&i->params, &i->inputs);
}

static void gcf_init(void *data) {
    gcf_instance *i = data;
    ahrs_gcf_init(&i->state, &i->params);
}

static void gcf_update(void *data, ahrs_real dt) {
    gcf_instance *i = data;
    ahrs_gcf_update(&i->state, &i->params, &i->inputs, dt);
}

static void gcf_compute_outputs(void *data) {
    gcf_instance *i = data;
    ahrs_gcf_outputs(&i->state, &i->params, &i->outputs);
}

static const fmu_model ahrs_gcf_model = {
    "gcf", "GCF", sizeof(gcf_instance), {offsetof(gcf_instance, params), sizeof(((gcf_instance *)0)->params)}, {offsetof(gcf_instance, inputs), sizeof(((gcf_instance *)0)->inputs)}, {offsetof(gcf_instance, outputs), sizeof(((gcf_instance *)0)->outputs)}, {offsetof(gcf_instance, state), sizeof(((gcf_instance *)0)->state)},
    offsetof(gcf_instance, params.common.sample_time), 0.01,
    gcf_variables, sizeof gcf_variables / sizeof gcf_variables[0],
    gcf_limits, sizeof gcf_limits / sizeof gcf_limits[0],
    gcf_defaults, gcf_init, gcf_update, gcf_compute_outputs};

/* Generated from models/improved_ekf/improved_ekf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_IMPROVED_EKF_H
#define AHRS_IMPROVED_EKF_H


/* Extended Kalman filter on the quaternion, measured by accelerometer and magnetometer. The state is the
 * quaternion. The gyroscope predicts it, and the attitude that accelerometer and magnetometer show together
 * measures it; that measurement counts less while the specific force is not that of gravity. It learns no
 * gyroscope bias. In the steady state it is a first-order complementary filter whose crossover frequency is
 * gyro_noise/attitude_noise.
 */

typedef struct {
    ahrs_estimator_params common;
    ahrs_real gyro_noise; /* White noise of the gyroscope, rad/s/sqrt(Hz) */
    ahrs_real attitude_noise; /* White noise of the attitude from accelerometer and magnetometer at rest, rad/sqrt(Hz) */
    ahrs_real accel_distrust; /* Relative growth of the variance of that attitude with the deviation of the specific force from gravity [s2/m] */
    ahrs_real motion_noise; /* Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation */
    ahrs_real initial_attitude_std; /* Standard deviation of the first attitude [rad] */
} ahrs_improved_ekf_params;

typedef ahrs_estimator_inputs ahrs_improved_ekf_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
    ahrs_real attitude_std[3]; /* Standard deviation of the attitude error about the body axes, as the filter believes it [rad] */
    int32_t covariance_reset; /* The covariance was reset at the last sample */
} ahrs_improved_ekf_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real covariance[10]; /* Covariance of the quaternion: lower triangle, row by row [1] */
} ahrs_improved_ekf_state;

/* Parameters and inputs to their defaults. */
static inline void ahrs_improved_ekf_defaults(ahrs_improved_ekf_params *p, ahrs_improved_ekf_inputs *u);

/* State as before the first sample. */
static inline void ahrs_improved_ekf_init(ahrs_improved_ekf_state *s, const ahrs_improved_ekf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
static inline void ahrs_improved_ekf_update(ahrs_improved_ekf_state *s, const ahrs_improved_ekf_params *p, const ahrs_improved_ekf_inputs *u, ahrs_real dt);

static inline void ahrs_improved_ekf_outputs(const ahrs_improved_ekf_state *s, const ahrs_improved_ekf_params *p, ahrs_improved_ekf_outputs_t *y);

#endif
/* Extended Kalman filter with the quaternion as state and a measured quaternion (docs/algorithms.md section 2). */
#ifndef AHRS_QUATERNION_EKF_H
#define AHRS_QUATERNION_EKF_H


typedef struct {
    ahrs_real gyro_noise, attitude_noise, accel_distrust, motion_noise, initial_attitude_std;
} ahrs_quaternion_ekf;

static inline void ahrs_quaternion_ekf_start(const ahrs_quaternion_ekf *k, ahrs_real covariance[AHRS_TRIANGLE(4)]) {
    ahrs_quat_covariance_set(covariance, AHRS_C(0.25) * k->initial_attitude_std * k->initial_attitude_std);
}

/* The attitude after the rate, not of unit length. */
static inline ahrs_quat ahrs_quaternion_ekf_predict(const ahrs_quaternion_ekf *k, const ahrs_estimator_state *s,
                                                    ahrs_real covariance[AHRS_TRIANGLE(4)], ahrs_vec3 rate,
                                                    const ahrs_sample *z) {
    const ahrs_quat q = ahrs_quat_of(s->q);
    const ahrs_quat turn = ahrs_increment_first(ahrs_vec3_scale(rate, z->dt));
    ahrs_quat_covariance_turn(covariance, turn);
    ahrs_quat_covariance_spread(covariance, q, AHRS_C(0.25) * ahrs_turn_variance(s, z, k->gyro_noise));
    return ahrs_quat_mul(q, turn);
}

/* Variance of an element of the measured quaternion: more as the specific force is less like gravity. */
static inline ahrs_real ahrs_quaternion_ekf_variance(const ahrs_quaternion_ekf *k, const ahrs_estimator_params *p,
                                                     const ahrs_sample *z) {
    const ahrs_real excess = ahrs_abs(ahrs_vec3_norm(z->force) - p->gravity);
    const ahrs_real moved = ahrs_motion_variance(p, z, k->motion_noise) / (p->gravity * p->gravity);
    return AHRS_C(0.25) * (ahrs_sample_variance(p, k->attitude_noise) * (1 + k->accel_distrust * excess) + moved);
}

/* With the measurement noise r I, K = P (P + r I)^-1 is symmetric and the covariance after the correction is r K.
 * False where the covariance has no meaning left; it is then the one to begin with. */
static inline bool ahrs_quaternion_ekf_correct(const ahrs_quaternion_ekf *k, ahrs_real covariance[AHRS_TRIANGLE(4)],
                                               ahrs_quat *q, ahrs_quat measured, ahrs_real r) {
    ahrs_real sum[AHRS_TRIANGLE(4)], gain[4][4], e[4];
    for (int32_t i = 0; i < AHRS_TRIANGLE(4); i++) {
        sum[i] = covariance[i];
    }
    ahrs_add_diagonal(4, sum, r);
    if (!ahrs_cholesky(4, sum, sum)) {
        ahrs_quaternion_ekf_start(k, covariance);
        return false;
    }
    for (int32_t i = 0; i < 4; i++) {
        for (int32_t j = 0; j < 4; j++) {
            gain[i][j] = ahrs_of(covariance, i, j);
        }
        ahrs_solve_lower(4, sum, gain[i]);
        ahrs_solve_upper(4, sum, gain[i]);
    }
    const ahrs_quat v = ahrs_quat_sub(ahrs_quat_near(measured, *q), *q);
    for (int32_t i = 0; i < 4; i++) {
        e[i] = ahrs_quat_dot(ahrs_quat_of(gain[i]), v);
        for (int32_t j = 0; j <= i; j++) {
            *ahrs_at(covariance, i, j) = AHRS_C(0.5) * r * (gain[i][j] + gain[j][i]);
        }
    }
    *q = ahrs_quat_add(*q, ahrs_quat_of(e));
    if (!ahrs_quat_covariance_keep(covariance)) {
        ahrs_quaternion_ekf_start(k, covariance);
        return false;
    }
    return true;
}

#endif
/* Extended Kalman filter on the quaternion, measured by accelerometer and magnetometer (docs/algorithms.md section 1). */

static ahrs_quaternion_ekf improved_ekf_settings(const ahrs_improved_ekf_params *p) {
    return (ahrs_quaternion_ekf){p->gyro_noise, p->attitude_noise, p->accel_distrust, p->motion_noise,
                                 p->initial_attitude_std};
}

static inline void ahrs_improved_ekf_init(ahrs_improved_ekf_state *s, const ahrs_improved_ekf_params *p) {
    const ahrs_quaternion_ekf k = improved_ekf_settings(p);
    ahrs_estimator_init(&s->common);
    ahrs_quaternion_ekf_start(&k, s->covariance);
}

static inline void ahrs_improved_ekf_update(ahrs_improved_ekf_state *s, const ahrs_improved_ekf_params *p,
                              const ahrs_improved_ekf_inputs *u, ahrs_real dt) {
    const ahrs_quaternion_ekf k = improved_ekf_settings(p);
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

static inline void ahrs_improved_ekf_outputs(const ahrs_improved_ekf_state *s, const ahrs_improved_ekf_params *p,
                               ahrs_improved_ekf_outputs_t *y) {
    ahrs_estimator_outputs(&s->common, &p->common, (ahrs_vec3){0, 0, 0}, &y->common);
    ahrs_vec3_to(y->attitude_std, ahrs_quat_covariance_std(s->covariance, ahrs_quat_of(s->common.q)));
    y->covariance_reset = ahrs_condition(&s->common, AHRS_COVARIANCE_RESET);
}

/* Generated from models/improved_ekf/improved_ekf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */

#include <string.h>

typedef struct {
    ahrs_improved_ekf_params params;
    ahrs_improved_ekf_inputs inputs;
    ahrs_improved_ekf_outputs_t outputs;
    ahrs_improved_ekf_state state;
} improved_ekf_instance;

static const fmu_variable improved_ekf_variables[] = {
    {"gyro", 1, 3, offsetof(improved_ekf_instance, inputs.gyro), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel", 4, 3, offsetof(improved_ekf_instance, inputs.accel), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"mag", 7, 3, offsetof(improved_ekf_instance, inputs.mag), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel_valid", 10, 1, offsetof(improved_ekf_instance, inputs.accel_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"mag_valid", 11, 1, offsetof(improved_ekf_instance, inputs.mag_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"q", 100, 4, offsetof(improved_ekf_instance, outputs.common.q), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"roll", 104, 1, offsetof(improved_ekf_instance, outputs.common.roll), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"pitch", 105, 1, offsetof(improved_ekf_instance, outputs.common.pitch), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"yaw", 106, 1, offsetof(improved_ekf_instance, outputs.common.yaw), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate", 107, 3, offsetof(improved_ekf_instance, outputs.common.rate), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"gyro_bias", 110, 3, offsetof(improved_ekf_instance, outputs.common.gyro_bias), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"motion_accel", 113, 3, offsetof(improved_ekf_instance, outputs.common.motion_accel), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"attitude_std", 116, 3, offsetof(improved_ekf_instance, outputs.attitude_std), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"status", 119, 1, offsetof(improved_ekf_instance, outputs.common.status), FMU_ENUMERATION, FMU_OUTPUT, 0, 0.0, 9.0},
    {"gyro_held", 120, 1, offsetof(improved_ekf_instance, outputs.common.gyro_held), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"accel_used", 121, 1, offsetof(improved_ekf_instance, outputs.common.accel_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"mag_used", 122, 1, offsetof(improved_ekf_instance, outputs.common.mag_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"covariance_reset", 123, 1, offsetof(improved_ekf_instance, outputs.covariance_reset), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"sample_time", 200, 1, offsetof(improved_ekf_instance, params.common.sample_time), FMU_REAL, FMU_FIXED, 0, 1e-05, 0.5},
    {"frame", 201, 1, offsetof(improved_ekf_instance, params.common.frame), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"declination", 202, 1, offsetof(improved_ekf_instance, params.common.declination), FMU_REAL, FMU_TUNABLE, 0, -3.141592653589793, 3.141592653589793},
    {"gravity", 203, 1, offsetof(improved_ekf_instance, params.common.gravity), FMU_REAL, FMU_FIXED, 0, 0.1, 100.0},
    {"field_reference", 204, 1, offsetof(improved_ekf_instance, params.common.field_reference), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"field_magnitude", 205, 1, offsetof(improved_ekf_instance, params.common.field_magnitude), FMU_REAL, FMU_FIXED, 0, 1e-07, 0.01},
    {"field_dip", 206, 1, offsetof(improved_ekf_instance, params.common.field_dip), FMU_REAL, FMU_FIXED, 0, -1.5707963267948966, 1.5707963267948966},
    {"initialisation", 207, 1, offsetof(improved_ekf_instance, params.common.initialisation), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"q0", 208, 4, offsetof(improved_ekf_instance, params.common.q0), FMU_REAL, FMU_FIXED, 0, -1.1, 1.1},
    {"init_time", 212, 1, offsetof(improved_ekf_instance, params.common.init_time), FMU_REAL, FMU_FIXED, 0, 0.0, 600.0},
    {"motion_compensation", 213, 1, offsetof(improved_ekf_instance, params.common.motion_compensation), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"motion_time_constant", 214, 1, offsetof(improved_ekf_instance, params.common.motion_time_constant), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN | FMU_INFINITY_ALLOWED, 0.0, DBL_MAX},
    {"accel_gating", 215, 1, offsetof(improved_ekf_instance, params.common.accel_gating), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"accel_gate", 216, 1, offsetof(improved_ekf_instance, params.common.accel_gate), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"accel_gate_time", 217, 1, offsetof(improved_ekf_instance, params.common.accel_gate_time), FMU_REAL, FMU_TUNABLE, 0, 0.0, 600.0},
    {"gyro_zero_samples", 220, 1, offsetof(improved_ekf_instance, params.common.gyro_zero_samples), FMU_INTEGER, FMU_FIXED, 0, 0.0, 1000000.0},
    {"gyro_zero_std", 221, 1, offsetof(improved_ekf_instance, params.common.gyro_zero_std), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"gyro_zero_limit", 222, 1, offsetof(improved_ekf_instance, params.common.gyro_zero_limit), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"accel_cutoff", 223, 1, offsetof(improved_ekf_instance, params.common.accel_cutoff), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"mag_offset", 224, 3, offsetof(improved_ekf_instance, params.common.mag_offset), FMU_REAL, FMU_FIXED, 0, -0.01, 0.01},
    {"mag_gain", 227, 3, offsetof(improved_ekf_instance, params.common.mag_gain), FMU_REAL, FMU_FIXED, 0, 0.01, 100.0},
    {"gyro_noise", 1040, 1, offsetof(improved_ekf_instance, params.gyro_noise), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN, 0.0, 100.0},
    {"attitude_noise", 1045, 1, offsetof(improved_ekf_instance, params.attitude_noise), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN, 0.0, 100.0},
    {"motion_noise", 1047, 1, offsetof(improved_ekf_instance, params.motion_noise), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000.0},
    {"initial_attitude_std", 1048, 1, offsetof(improved_ekf_instance, params.initial_attitude_std), FMU_REAL, FMU_FIXED, 0, 0.0001, 10.0},
    {"accel_distrust", 1050, 1, offsetof(improved_ekf_instance, params.accel_distrust), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
};

static bool improved_ekf_limit_0(const void *data) {
    const ahrs_improved_ekf_params *p = &((const improved_ekf_instance *)data)->params;
    return (p->common.initialisation == AHRS_INITIALISATION_SENSORS) || (((((p->common.q0[0] * p->common.q0[0]) + (p->common.q0[1] * p->common.q0[1])) + (p->common.q0[2] * p->common.q0[2])) + (p->common.q0[3] * p->common.q0[3])) > AHRS_C(1e-06));
}

static const uint32_t improved_ekf_limit_0_vrs[] = {207, 208};

static bool improved_ekf_limit_1(const void *data) {
    const ahrs_improved_ekf_params *p = &((const improved_ekf_instance *)data)->params;
    return (!(p->common.motion_compensation)) || (p->common.motion_time_constant < AHRS_INFINITY);
}

static const uint32_t improved_ekf_limit_1_vrs[] = {213, 214};

static bool improved_ekf_limit_2(const void *data) {
    const ahrs_improved_ekf_params *p = &((const improved_ekf_instance *)data)->params;
    return (p->common.accel_cutoff * p->common.sample_time) < AHRS_C(0.4);
}

static const uint32_t improved_ekf_limit_2_vrs[] = {223, 200};

static const fmu_limit improved_ekf_limits[] = {
    {"initialisation == sensors or q0[0]*q0[0] + q0[1]*q0[1] + q0[2]*q0[2] + q0[3]*q0[3] > 1e-6", "q0 has no direction: give a quaternion of about unit length", false, improved_ekf_limit_0_vrs, 2, improved_ekf_limit_0},
    {"not motion_compensation or motion_time_constant < inf", "tilt is not observed at all with an infinite motion_time_constant: use it for bursts of less than half a minute only", true, improved_ekf_limit_1_vrs, 2, improved_ekf_limit_1},
    {"accel_cutoff*sample_time < 0.4", "the low-pass needs more than two samples per period: lower accel_cutoff or sample_time", false, improved_ekf_limit_2_vrs, 2, improved_ekf_limit_2},
};

static inline void ahrs_improved_ekf_defaults(ahrs_improved_ekf_params *p, ahrs_improved_ekf_inputs *u) {
    memset(p, 0, sizeof *p);
    memset(u, 0, sizeof *u);
    p->common.sample_time = AHRS_C(0.01);
    p->common.frame = 0;
    p->common.declination = AHRS_C(0.0);
    p->common.gravity = AHRS_C(9.80665);
    p->common.field_reference = 0;
    p->common.field_magnitude = AHRS_C(5e-05);
    p->common.field_dip = AHRS_C(1.1);
    p->common.initialisation = 0;
    p->common.q0[0] = AHRS_C(1.0);
    p->common.q0[1] = AHRS_C(0.0);
    p->common.q0[2] = AHRS_C(0.0);
    p->common.q0[3] = AHRS_C(0.0);
    p->common.init_time = AHRS_C(0.0);
    p->common.motion_compensation = 0;
    p->common.motion_time_constant = AHRS_C(1.0);
    p->common.accel_gating = 0;
    p->common.accel_gate = AHRS_C(1.0);
    p->common.accel_gate_time = AHRS_C(10.0);
    p->common.gyro_zero_samples = 0;
    p->common.gyro_zero_std = AHRS_C(0.02);
    p->common.gyro_zero_limit = AHRS_C(0.1);
    p->common.accel_cutoff = AHRS_C(0.0);
    p->common.mag_offset[0] = AHRS_C(0.0);
    p->common.mag_offset[1] = AHRS_C(0.0);
    p->common.mag_offset[2] = AHRS_C(0.0);
    p->common.mag_gain[0] = AHRS_C(1.0);
    p->common.mag_gain[1] = AHRS_C(1.0);
    p->common.mag_gain[2] = AHRS_C(1.0);
    p->gyro_noise = AHRS_C(0.01);
    p->attitude_noise = AHRS_C(0.002);
    p->accel_distrust = AHRS_C(1.0);
    p->motion_noise = AHRS_C(0.5);
    p->initial_attitude_std = AHRS_C(2.0);
    u->gyro[0] = AHRS_C(0.0);
    u->gyro[1] = AHRS_C(0.0);
    u->gyro[2] = AHRS_C(0.0);
    u->accel[0] = AHRS_C(0.0);
    u->accel[1] = AHRS_C(0.0);
    u->accel[2] = AHRS_C(0.0);
    u->mag[0] = AHRS_C(0.0);
    u->mag[1] = AHRS_C(0.0);
    u->mag[2] = AHRS_C(0.0);
    u->accel_valid = 1;
    u->mag_valid = 1;
}

static void improved_ekf_defaults(void *data) {
    improved_ekf_instance *i = data;
    memset(i, 0, sizeof *i);
    ahrs_improved_ekf_defaults(&i->params, &i->inputs);
}

static void improved_ekf_init(void *data) {
    improved_ekf_instance *i = data;
    ahrs_improved_ekf_init(&i->state, &i->params);
}

static void improved_ekf_update(void *data, ahrs_real dt) {
    improved_ekf_instance *i = data;
    ahrs_improved_ekf_update(&i->state, &i->params, &i->inputs, dt);
}

static void improved_ekf_compute_outputs(void *data) {
    improved_ekf_instance *i = data;
    ahrs_improved_ekf_outputs(&i->state, &i->params, &i->outputs);
}

static const fmu_model ahrs_improved_ekf_model = {
    "improved_ekf", "ImprovedEKF", sizeof(improved_ekf_instance), {offsetof(improved_ekf_instance, params), sizeof(((improved_ekf_instance *)0)->params)}, {offsetof(improved_ekf_instance, inputs), sizeof(((improved_ekf_instance *)0)->inputs)}, {offsetof(improved_ekf_instance, outputs), sizeof(((improved_ekf_instance *)0)->outputs)}, {offsetof(improved_ekf_instance, state), sizeof(((improved_ekf_instance *)0)->state)},
    offsetof(improved_ekf_instance, params.common.sample_time), 0.01,
    improved_ekf_variables, sizeof improved_ekf_variables / sizeof improved_ekf_variables[0],
    improved_ekf_limits, sizeof improved_ekf_limits / sizeof improved_ekf_limits[0],
    improved_ekf_defaults, improved_ekf_init, improved_ekf_update, improved_ekf_compute_outputs};

/* Generated from models/kcf/kcf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_KCF_H
#define AHRS_KCF_H


/* Kalman-calibrated complementary filter. A complementary filter finds the tilt in a slowly moving inertial
 * frame; a slow Kalman filter learns what limits it while it runs: bias, scale and misalignment of the
 * gyroscope, hard iron and latency of the magnetometer, and the local field. A second hypothesis covers a
 * magnetometer that was never calibrated.
 */

/* What carries the sensor; sets the time constant of the tilt */
enum {
    AHRS_KCF_PROFILE_HAND = 0, /* worn or held by a person, robot arms: accelerations change sign within seconds; 3.5 s */
    AHRS_KCF_PROFILE_MULTIROTOR = 1, /* accelerations last for seconds, the gyroscope is good for ten: 10 s */
    AHRS_KCF_PROFILE_CUSTOM = 2, /* accel_time_constant says */
};

/* What a gyroscope sample stands for */
enum {
    AHRS_KCF_GYRO_SAMPLING_MEAN = 0, /* the mean rate over the sample interval, as integrating gyroscopes give it */
    AHRS_KCF_GYRO_SAMPLING_INSTANT = 1, /* the rate at the moment of the sample, as decimated recordings have it; matters below 100 Hz */
};

typedef struct {
    ahrs_estimator_params common;
    ahrs_real accel_time_constant; /* Time constant of the specific force in the inertial frame, used when profile is custom [s] */
    ahrs_real slow_period; /* Time between two slow steps, rounded to whole samples [s] */
    ahrs_real uncalibrated_odds; /* Odds that the magnetometer has an uncalibrated hard iron; 0 says that it is calibrated and ends the question [1] */
    ahrs_real uncalibrated_std; /* Hard iron of an uncalibrated magnetometer, standard deviation per axis, of the local field [1] */
    ahrs_real bias_std; /* Gyroscope bias before anything is learned, standard deviation per axis [rad/s] */
    ahrs_real bias_forget_time; /* Time after which a learned bias has become uncertain by 0.1 deg/s [s] */
    ahrs_real bias_limit; /* Largest gyroscope bias that is learned, per axis [rad/s] */
    ahrs_real motion_drift_std; /* Accuracy to which the drift of the tilt in motion shows an error of the gyroscope [rad/s] */
    ahrs_real rest_drift_std; /* Accuracy to which the low-passed gyroscope shows its bias at rest [rad/s] */
    ahrs_real gyro_scale_std; /* Scale error of the gyroscope, standard deviation per axis [1] */
    ahrs_real gyro_misalignment_std; /* Misalignment and cross coupling of the gyroscope, standard deviation per element [rad] */
    ahrs_real hard_iron_std; /* Hard iron that a calibration leaves, standard deviation per axis, of the local field [1] */
    ahrs_real mag_latency_std; /* Latency of the magnetometer against the gyroscope, standard deviation [s] */
    ahrs_real mag_density; /* Deviation of the mean of the field over one second, with everything that varies slowly in it, of the local field [1] */
    ahrs_real mag_noise; /* Usual deviation of one magnetometer sample from the expected field, of the local field [1] */
    ahrs_real mag_rate_noise; /* Additional deviation per angular rate [s] */
    ahrs_real mag_tilt_noise; /* Additional deviation while the first tilt settles [1] */
    ahrs_real hard_iron_walk; /* Random walk of the hard iron: standard deviation after one second, of the local field [1] */
    ahrs_real field_walk; /* Random walk of the local field: standard deviation after one second, of itself [1] */
    ahrs_real heading_walk; /* Random walk of the integrated heading: standard deviation after one second [rad] */
    ahrs_real heading_rate_walk; /* Random walk of the integrated heading per angular rate: standard deviation after one second at one rad/s [s] */
    ahrs_real jump_time; /* Time over which a misfit of the field is averaged before it counts as a change [s] */
    ahrs_real jump_threshold; /* Mean squared misfit, of the expected one, above which the field or the hard iron has changed [1] */
    ahrs_real jump_hard_iron; /* How fast a change makes the hard iron uncertain [1/s] */
    ahrs_real jump_field; /* How fast a change makes the local field uncertain [1/s] */
    ahrs_real outlier_weight; /* How much a misfit of one sample raises its noise [1] */
    int32_t profile; /* What carries the sensor (enumeration profile) */
    int32_t use_mag; /* False: six axes only, the heading is integrated from the gyroscope */
    int32_t spread; /* Spread the slow step over the samples until the next one, so that no sample costs much more than another; its result comes one slow period later */
    int32_t gyro_sampling; /* What a gyroscope sample stands for, used with refine (enumeration gyro_sampling) */
    int32_t refine; /* Correct the averaged tilt for what has since been learned of the gyroscope, join rate samples to second order, keep north through a change of the field; false: the plain equations, for comparison */
} ahrs_kcf_params;

typedef ahrs_estimator_inputs ahrs_kcf_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
    ahrs_real hard_iron[3]; /* Learned hard iron, body axes: the magnetometer reads the field plus this [T] */
    ahrs_real gyro_scale[9]; /* Learned scale and misalignment of the gyroscope, row by row: it reads the rate plus bias plus this times its reading [1] */
    ahrs_real mag_latency; /* Learned latency of the magnetometer against the gyroscope [s] */
    ahrs_real local_field[2]; /* Learned local field: horizontal and downward part [T] */
    ahrs_real heading_std; /* Standard deviation of the heading, as the filter believes it [rad] */
    ahrs_real disturbance; /* Mean squared misfit of the field, of the expected one: about 1 or below when undisturbed [1] */
    ahrs_real uncalibrated; /* Probability that the magnetometer has an uncalibrated hard iron; 0 when the question is closed [1] */
    int32_t covariance_reset; /* The covariance was reset at the last sample */
    int32_t at_rest; /* Rest is detected: the gyroscope shows its bias */
    int32_t mag_disturbed; /* The field does not fit what has been learned, or is another one than at first */
    int32_t implausible; /* Gyroscope and accelerometer or magnetometer turn in opposite senses: check axes and signs */
} ahrs_kcf_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real x[19]; /* Gyroscope bias (3, rad/s), scale and misalignment (9, row by row); field (3, of its norm), hard iron (3, of the field), latency (s) [1] */
    ahrs_real cov[380]; /* Covariance of x, 19 rows of 20: padded with a zero [1] */
    ahrs_real q_int[4]; /* Integrated gyroscope: body to inertial frame [1] */
    ahrs_real q_tilt[4]; /* Inertial frame to level frame of free heading [1] */
    ahrs_real q_level[4]; /* q_tilt with the lag of the averaged force made good [1] */
    ahrs_real q_north[4]; /* Inertial frame to magnetic north-east-down: heading and q_level [1] */
    ahrs_real heading[2]; /* Cosine and sine of half the angle from the level frame to magnetic north [1] */
    ahrs_real block_time; /* Time since the last slow step [s] */
    ahrs_real force_time; /* Of which with a usable accelerometer [s] */
    ahrs_real sum_force[3]; /* Integral of the specific force in the inertial frame, sign of gravity [m/s] */
    ahrs_real sum_sens[39]; /* Integral of the sensitivity of the rate in the inertial frame to bias and scale, and of the corrections of the gyroscope (rad), three rows of 13 [s] */
    ahrs_real sum_rate2; /* Integral of the squared rate [rad2/s] */
    ahrs_real blind; /* Time for which the gyroscope has been held [s] */
    ahrs_real rate[3]; /* Rate of the sample before [rad/s] */
    ahrs_real mag[3]; /* Last usable magnetometer sample [T] */
    ahrs_real mag_q[4]; /* q_int at that sample [1] */
    ahrs_real mag_rate[3]; /* Rate at that sample [rad/s] */
    ahrs_real mag_time; /* Time since the last magnetometer update [s] */
    ahrs_real rest_one[6]; /* First integrator of the low-pass for rest detection: gyroscope, accelerometer [1] */
    ahrs_real rest_two[6]; /* Second integrator; while the low-pass starts, the sum of the samples [1] */
    ahrs_real rest_gyro[3]; /* Low-passed gyroscope [rad/s] */
    ahrs_real rest_gain[3]; /* Coefficients of the low-pass for rest_step [1] */
    ahrs_real rest_step; /* Sample interval of these coefficients [s] */
    ahrs_real rest_count; /* Samples in the sum while the low-pass starts, else 0 [1] */
    ahrs_real rest_age; /* Time since the low-pass started [s] */
    ahrs_real rest_time; /* Time for which gyroscope and accelerometer have been quiet [s] */
    ahrs_real tilt_age; /* Time over which the tilt has been averaged [s] */
    ahrs_real tilt_slope[3]; /* Rate of change of the low-passed force [m/s3] */
    ahrs_real tilt_force[3]; /* Low-passed specific force in the inertial frame, sign of gravity [m/s2] */
    ahrs_real sens_level[26]; /* Sensitivity of the tilt error to bias and scale and the corrections already in it, two rows of 13 [s] */
    ahrs_real sens_slope[26]; /* Its rate of change, as the low-pass sees it [1] */
    ahrs_real job_time; /* Interval of the slow step under way [s] */
    ahrs_real job_vertical[12]; /* Sensitivity of the heading to bias and scale over this interval [s] */
    ahrs_real job_drift[3]; /* Innovations of the gyroscope [rad/s] */
    ahrs_real job_rate2; /* Mean squared rate [rad2/s2] */
    ahrs_real job_q[4]; /* Level attitude at the magnetometer sample [1] */
    ahrs_real job_mag[3]; /* That sample, of the norm of the first [1] */
    ahrs_real job_rate[3]; /* Rate at that sample [rad/s] */
    ahrs_real job_mag_time; /* Time between this magnetometer update and the one before [s] */
    ahrs_real job_nu[3]; /* Innovation of the magnetometer [1] */
    ahrs_real job_noise[2]; /* Variance expected of one magnetometer sample, and of its update [1] */
    ahrs_real dx[20]; /* Corrections of x collected by the slow step under way, padded [1] */
    ahrs_real mag_scale; /* Inverse norm of the first magnetometer sample, 0 before [1/T] */
    ahrs_real misfit; /* Mean squared misfit of the field, of the expected one [1] */
    ahrs_real excess; /* Variance that the misfit has in excess, at the last update [1] */
    ahrs_real change_views; /* Views of the field with a misfit since it became suspect [1] */
    ahrs_real fit_views; /* Views of the field since it has been fitting [1] */
    ahrs_real old_misfit; /* Mean squared misfit of the old field, of the expected one [1] */
    ahrs_real calm_field[3]; /* Field before it changed, of its norm [1] */
    ahrs_real calm_iron[3]; /* Hard iron before that, of the field [1] */
    ahrs_real north_angle[2]; /* Cosine and sine of the angle from the other field to the old one [1] */
    ahrs_real alt_x[6]; /* Field and hard iron if it is not [1] */
    ahrs_real alt_cov[48]; /* Covariance of alt_x, 6 rows of 8: padded with zeros [1] */
    ahrs_real alt_q[4]; /* Level attitude when the question was asked [1] */
    ahrs_real alt_misfit; /* Mean squared misfit of the field that no hard iron explains [1] */
    ahrs_real alt_jump; /* Variance that changes have added to the hard iron since the question was asked [1] */
    ahrs_real alt_probability; /* Probability that the magnetometer is not calibrated [1] */
    ahrs_real turn[3]; /* Rotation since the last slow step, body axes [rad] */
    ahrs_real seen[6]; /* Specific force and field at the last slow step, body axes [1] */
    ahrs_real sense[6]; /* Correlation of the turn of the specific force, and of the field, with the gyroscope, per axis [1] */
    ahrs_real sense_power[6]; /* Power of the turn that the gyroscope predicts, per axis [1] */
    int32_t phase; /* Next part of the slow step */
    int32_t job; /* Bits: what the slow step under way has to do */
    int32_t change; /* The field: 0 as it was, 1 suspect, 2 another one, not known yet, 3 another one, known */
    int32_t iron_known; /* Whether the hard iron was as certain as a calibration leaves it when the field last fitted */
    int32_t question; /* Is the magnetometer calibrated: 0 not yet asked, 1 open, 2 answered */
} ahrs_kcf_state;

/* Parameters and inputs to their defaults. */
static inline void ahrs_kcf_defaults(ahrs_kcf_params *p, ahrs_kcf_inputs *u);

/* State as before the first sample. */
static inline void ahrs_kcf_init(ahrs_kcf_state *s, const ahrs_kcf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
static inline void ahrs_kcf_update(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_kcf_inputs *u, ahrs_real dt);

static inline void ahrs_kcf_outputs(const ahrs_kcf_state *s, const ahrs_kcf_params *p, ahrs_kcf_outputs_t *y);

#endif
/* Covariance of a filter that calibrates sensors (docs/accuracy.md): twelve states of the gyroscope, then those of the
 * magnetometer: field, hard iron and latency; or field and hard iron alone.
 *
 * Both halves are kept, row by row, and get the same bits, so that all work runs along rows; these are padded with
 * zeros to whole quads. Measurements are taken one after the other; the covariance follows once for all of them. Sizes
 * are arguments, so that they are constants wherever a function is inlined. */
#ifndef CALIBRATION_COVARIANCE_H
#define CALIBRATION_COVARIANCE_H


enum {
    AHRS_CAL_GYRO = 12,
    AHRS_CAL_IRON = 3, AHRS_CAL_LATENCY = 6, AHRS_CAL_MAG = 8, /* among the states of the magnetometer */
    AHRS_CAL_ROW = AHRS_CAL_GYRO + AHRS_CAL_MAG /* width of the covariance */
};

/* Sum of products in four parts that do not wait for each other; n is a multiple of four. */
AHRS_INLINE ahrs_real ahrs_cal_dot(int32_t n, const ahrs_real *a, const ahrs_real *b) {
    ahrs_real sum[4] = {a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]};
    for (int32_t i = 4; i < n; i += 4) {
        sum[0] += a[i] * b[i];
        sum[1] += a[i + 1] * b[i + 1];
        sum[2] += a[i + 2] * b[i + 2];
        sum[3] += a[i + 3] * b[i + 3];
    }
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/* y = P h for n rows h that see the gyroscope only, and n rows y. */
AHRS_INLINE void ahrs_cal_gyro_products(int32_t n, const ahrs_real *restrict cov, const ahrs_real *restrict h,
                                        ahrs_real *restrict y) {
    enum { WIDTH = AHRS_CAL_ROW, SIZE = AHRS_CAL_GYRO };
    for (int32_t k = 0; k < SIZE; k += 3) {
        const ahrs_real *const p = cov + WIDTH * k;
        for (int32_t j = 0; j < WIDTH; j++) {
            for (int32_t r = 0; r < n; r++) {
                const ahrs_real *const w = h + SIZE * r + k;
                const ahrs_real sum = (p[j] * w[0] + p[WIDTH + j] * w[1]) + p[2 * WIDTH + j] * w[2];
                y[WIDTH * r + j] = k > 0 ? y[WIDTH * r + j] + sum : sum;
            }
        }
    }
}

/* The three rows [I, R, c] of a magnetometer, padded. */
AHRS_INLINE void ahrs_cal_mag_rows(const ahrs_mat3 *R, ahrs_vec3 c, ahrs_real h[3 * AHRS_CAL_MAG]) {
    const ahrs_real lag[3] = {c.x, c.y, c.z};
    for (int32_t i = 0; i < 3 * AHRS_CAL_MAG; i++) {
        h[i] = 0;
    }
    for (int32_t r = 0; r < 3; r++) {
        ahrs_real *const own = h + AHRS_CAL_MAG * r;
        own[r] = 1;
        ahrs_vec3_to(own + AHRS_CAL_IRON, R->row[r]);
        own[AHRS_CAL_LATENCY] = lag[r];
    }
}

/* y = P h for these rows; `mag` are the rows of P that belong to the magnetometer, of `width`. */
AHRS_INLINE void ahrs_cal_mag_products(int32_t width, bool latency, const ahrs_real *restrict mag,
                                       const ahrs_real *restrict h, ahrs_real *restrict y) {
    for (int32_t j = 0; j < width; j++) {
        const ahrs_real *const p = mag + j;
        for (int32_t r = 0; r < 3; r++) {
            const ahrs_real *const w = h + AHRS_CAL_MAG * r + AHRS_CAL_IRON;
            const ahrs_real field = (p[width * r] + p[width * 3] * w[0]) + (p[width * 4] * w[1] + p[width * 5] * w[2]);
            y[width * r + j] = latency ? field + p[width * AHRS_CAL_LATENCY] * w[3] : field;
        }
    }
}

/* Measurements of n rows h times the state with one variance, one after the other; h stands at `first` of the state and
 * has rows of `size`. y goes in as P h, in rows of `width`, and comes out so that P less its squares is the new
 * covariance; the corrections are collected in dx. False where the covariance has lost its meaning. */
AHRS_INLINE bool ahrs_cal_measure(int32_t n, int32_t first, int32_t size, int32_t width, const ahrs_real *restrict h,
                                  const ahrs_real *restrict innovation, ahrs_real variance, ahrs_real *restrict y,
                                  ahrs_real *restrict dx) {
    for (int32_t r = 0; r < n; r++) {
        ahrs_real *const own = y + width * r;
        const ahrs_real sum = variance + ahrs_cal_dot(size, h + size * r, own + first);
        const ahrs_real rest = innovation[r] - ahrs_cal_dot(size, h + size * r, dx + first);
        if (!(sum >= variance && ahrs_is_finite(sum) && ahrs_is_finite(rest))) {
            return false;
        }
        const ahrs_real scale = 1 / ahrs_sqrt(sum), step = scale * rest;
        for (int32_t j = 0; j < width; j++) {
            own[j] *= scale;
            dx[j] += own[j] * step;
        }
        for (int32_t later = r + 1; later < n; later++) {
            ahrs_real *const other = y + width * later;
            const ahrs_real along = ahrs_cal_dot(size, h + size * later, own + first);
            for (int32_t j = 0; j < width; j++) {
                other[j] -= along * own[j];
            }
        }
    }
    return true;
}

/* P := P - the squares of n vectors y, for the first `rows` rows: the lower half, to whole quads, and its image. */
AHRS_INLINE void ahrs_cal_subtract(int32_t n, int32_t rows, int32_t width, const ahrs_real *restrict y,
                                   ahrs_real *restrict cov) {
    for (int32_t i = 0; i < rows; i++) {
        ahrs_real *const row = cov + width * i;
        const int32_t quads = i / 4 + 1;
        for (int32_t j = 0; j < 4 * quads; j++) {
            ahrs_real sum = y[i] * y[j];
            for (int32_t r = 1; r < n; r++) {
                sum += y[width * r + i] * y[width * r + j];
            }
            row[j] -= sum;
        }
        for (int32_t j = 0; j < 4 * (quads - 1); j++) {
            cov[width * j + i] = row[j];
        }
    }
}

#endif
/* Kalman-calibrated complementary filter (docs/accuracy.md). The level frame is z down with a free heading; the
 * magnetometer counts in the norm of its first sample. */

#include <string.h>

/* Layout of x: bias, scale and misalignment of the gyroscope; then the magnetometer. */
enum { kcf_GYRO = 0, kcf_SCALE = 3, kcf_G = AHRS_CAL_GYRO, kcf_FIELD = kcf_G, kcf_IRON = kcf_FIELD + AHRS_CAL_IRON,
       kcf_LATENCY = kcf_FIELD + AHRS_CAL_LATENCY, kcf_N = 19 };

/* Width of the rows of cov, and of alt_cov, which has the states of the magnetometer only, without latency. */
enum { kcf_ROW = AHRS_CAL_ROW, kcf_ALT_ROW = AHRS_CAL_MAG, kcf_ALT_N = AHRS_CAL_LATENCY };

/* A row of the sensitivities: the twelve of bias and scale, and what the filter has already corrected. */
enum { kcf_SENS = kcf_G + 1 };

/* What the slow step under way has to do. */
enum { kcf_JOB_REST = 1, kcf_JOB_DRIFT = 2, kcf_JOB_MAG = 4, kcf_JOB_MAG_FIRST = 8 };

/* Flags that outlive a sample. */
enum { kcf_MAG_FRESH = 16, kcf_SEEN_FORCE = 32, kcf_SEEN_MAG = 64, kcf_REALIGN = 128, kcf_FIRST_KEPT = 256 };

enum { kcf_QUESTION_NEW, kcf_QUESTION_OPEN, kcf_QUESTION_ANSWERED };

/* What has become of the field: it is as it was; it does not fit, for a reason that turning will show; it is another
 * one, not known yet; it is another one, and known. */
enum { kcf_FIELD_CALM, kcf_FIELD_SUSPECT, kcf_FIELD_STRANGE, kcf_FIELD_OTHER };

/* The parts of the slow step. */
enum { kcf_PHASE_GYRO, kcf_PHASE_FIELD, kcf_PHASE_MAG, kcf_PHASE_ALTERNATIVE, kcf_PHASE_APPLY, kcf_PHASE_EVIDENCE, kcf_PHASES };

static const ahrs_real kcf_SQRT2 = AHRS_C(1.41421356237309504880);
static const ahrs_real kcf_HAND_TIME = AHRS_C(3.5), MULTIROTOR_TIME = AHRS_C(10.0); /* s */
static const ahrs_real kcf_BIAS_GROWTH = AHRS_C(0.0017453292519943296);             /* rad/s, in bias_forget_time */

/* Just below 1.5 s and 0.5 s, so that a whole number of samples counts alike in both precisions. */
static const ahrs_real kcf_REST_TIME = AHRS_C(1.4999), REST_START_TIME = AHRS_C(0.4999);
static const ahrs_real kcf_REST_FILTER_TIME = AHRS_C(0.5); /* s */
static const ahrs_real kcf_REST_GYRO = AHRS_C(0.03490658503988659);                 /* rad/s */
static const ahrs_real kcf_REST_ACCEL = AHRS_C(0.5);                                /* m/s2 */

static const ahrs_real kcf_IRON_VARIANCE_MAX = AHRS_C(4.0); /* of the field: nothing more is unknown than that */
static const ahrs_real kcf_IRON_MAX = AHRS_C(10.0), SCALE_MAX = AHRS_C(0.2), LATENCY_MAX = AHRS_C(0.1);
/* A swapped sign makes the correlation -1 of the power. Little rotation has to show it more clearly. */
static const ahrs_real kcf_SENSE_POWER = AHRS_C(0.5), SENSE_OPPOSED = AHRS_C(0.3);
static const ahrs_real kcf_SENSE_LEAST_POWER = AHRS_C(0.15), SENSE_CLEARLY = AHRS_C(0.7);
static const ahrs_real kcf_SENSE_GRAVITY = AHRS_C(0.85);
static const ahrs_real kcf_LAG_MAX = AHRS_C(0.3); /* rad */
static const ahrs_real kcf_MISFIT_MAX = AHRS_C(1e4);
/* Views of the field after which a misfit is no hard iron, and after which a field without misfit is known. */
static const ahrs_real kcf_VIEWS_REFUTE = AHRS_C(6.0), VIEWS_PROVE = AHRS_C(2.0);
static const ahrs_real kcf_OLD_FIELD_TIME = AHRS_C(2.0), OLD_FIELD_FITS = AHRS_C(1.5); /* s, mean squared misfit */
static const ahrs_real kcf_MAG_TIME_MAX = AHRS_C(0.2); /* s: rarer samples count as single ones */

/* Independent views of the field: per second at rest, one per angle in motion, at most so many per second. */
static const ahrs_real kcf_VIEWS_AT_REST = AHRS_C(0.02), VIEW_ANGLE = AHRS_C(0.5), VIEWS_MAX = AHRS_C(1.0);
static const ahrs_real kcf_SETTLED = AHRS_C(20.0); /* time constants: what is left of the first tilt error is 2e-9 */
static const ahrs_real kcf_RATE_BANDWIDTH = AHRS_C(10.0); /* rad/s: people and vehicles turn to and fro no faster */
static const ahrs_real kcf_LOST = AHRS_C(0.03); /* rad2: an attitude less certain than 10 deg begins anew */
static const ahrs_real kcf_TURNED = AHRS_C(6e-4); /* squared difference of rotation matrices: 1 deg */
static const ahrs_real kcf_EVIDENCE_DECIDES = AHRS_C(2980.9579870417283); /* odds of e^8 */

static ahrs_real kcf_tau_accel(const ahrs_kcf_params *p) {
    return p->profile == AHRS_KCF_PROFILE_HAND         ? kcf_HAND_TIME
           : p->profile == AHRS_KCF_PROFILE_MULTIROTOR ? MULTIROTOR_TIME
                                                       : p->accel_time_constant;
}

static ahrs_real kcf_square(ahrs_real a) { return a * a; }

/* Variance of state i. */
static ahrs_real *kcf_variance_of(ahrs_real *cov, int i) { return cov + (kcf_ROW + 1) * i; }

static void kcf_reset_covariance(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    memset(s->cov, 0, sizeof s->cov);
    for (int i = 0; i < 3; i++) {
        *kcf_variance_of(s->cov, kcf_FIELD + i) = 1;
        *kcf_variance_of(s->cov, kcf_IRON + i) = kcf_square(p->hard_iron_std);
        *kcf_variance_of(s->cov, kcf_GYRO + i) = kcf_square(p->bias_std);
        for (int j = 0; j < 3; j++) {
            *kcf_variance_of(s->cov, kcf_SCALE + 3 * i + j) = kcf_square(i == j ? p->gyro_scale_std : p->gyro_misalignment_std);
        }
    }
    *kcf_variance_of(s->cov, kcf_LATENCY) = kcf_square(p->mag_latency_std);
}

static void kcf_lose_covariance(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    kcf_reset_covariance(s, p);
    memset(s->dx, 0, sizeof s->dx);
    s->common.conditions |= AHRS_COVARIANCE_RESET;
}

static ahrs_vec3 kcf_iron(const ahrs_kcf_state *s) { return ahrs_vec3_of(&s->x[kcf_IRON]); }

static ahrs_vec3 kcf_gyro_error(const ahrs_kcf_state *s, ahrs_vec3 gyro) {
    const ahrs_real *S = &s->x[kcf_SCALE];
    return (ahrs_vec3){s->x[kcf_GYRO] + (S[0] * gyro.x + S[1] * gyro.y + S[2] * gyro.z),
                       s->x[kcf_GYRO + 1] + (S[3] * gyro.x + S[4] * gyro.y + S[5] * gyro.z),
                       s->x[kcf_GYRO + 2] + (S[6] * gyro.x + S[7] * gyro.y + S[8] * gyro.z)};
}

/* Rotation vector over one sample, to second order in the change of the rate: Bortz' equation between two means, or
 * between two momentary rates on a straight line. */
static ahrs_vec3 kcf_rotation(ahrs_kcf_state *s, const ahrs_kcf_params *p, ahrs_vec3 rate, ahrs_real T) {
    const ahrs_vec3 before = ahrs_vec3_of(s->rate);
    ahrs_vec3_to(s->rate, rate);
    if (!p->refine || !(T > 0)) {
        return ahrs_vec3_scale(rate, T);
    }
    const ahrs_vec3 coning = ahrs_vec3_scale(ahrs_vec3_cross(before, rate), T * T / 12);
    const bool instant = p->gyro_sampling == AHRS_KCF_GYRO_SAMPLING_INSTANT;
    const ahrs_vec3 mean = instant ? ahrs_vec3_scale(ahrs_vec3_add(before, rate), AHRS_C(0.5)) : rate;
    return ahrs_vec3_add_scaled(coning, T, mean);
}

/* Integrates the rate and the sums that the slow step needs. */
static void kcf_integrate(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_sample *z, ahrs_real turn_time) {
    const ahrs_real T = z->dt;
    const ahrs_vec3 g = z->rate, c = kcf_gyro_error(s, g), w = ahrs_vec3_sub(g, c);
    const ahrs_vec3 angle = kcf_rotation(s, p, w, turn_time);
    const ahrs_quat q = ahrs_quat_refine(ahrs_quat_mul(ahrs_quat_of(s->q_int), ahrs_quat_exp(angle)));
    ahrs_quat_to(s->q_int, q);
    ahrs_vec3_to(s->turn, ahrs_vec3_add(ahrs_vec3_of(s->turn), angle));

    const ahrs_mat3 R = ahrs_quat_to_mat3(q);
    for (int i = 0; i < 3; i++) {
        ahrs_real *sum = &s->sum_sens[kcf_SENS * i];
        const ahrs_real r[3] = {T * R.row[i].x, T * R.row[i].y, T * R.row[i].z};
        for (int j = 0; j < 3; j++) {
            sum[j] += r[j];
            sum[3 + 3 * j] += r[j] * g.x;
            sum[4 + 3 * j] += r[j] * g.y;
            sum[5 + 3 * j] += r[j] * g.z;
        }
        sum[kcf_G] += r[0] * c.x + r[1] * c.y + r[2] * c.z;
    }
    s->sum_rate2 += T * ahrs_vec3_norm2(w);
    s->block_time += T;
    if (z->accel_usable) {
        ahrs_vec3_to(s->sum_force, ahrs_vec3_add_scaled(ahrs_vec3_of(s->sum_force), -T, ahrs_mat3_apply(R, z->accel)));
        s->force_time += T;
    }
    s->mag_time += T;
    if (z->mag_usable) {
        ahrs_vec3_to(s->mag, z->mag);
        ahrs_quat_to(s->mag_q, q);
        ahrs_vec3_to(s->mag_rate, w);
        s->job |= kcf_MAG_FRESH;
    }
}

/* Coefficients of the second-order Butterworth low-pass by the bilinear rule, as two integrators, so that they may
 * change from sample to sample. */
static void kcf_set_rest_filter(ahrs_kcf_state *s, ahrs_real T) {
    ahrs_real sine, cosine;
    ahrs_sincos(T / (kcf_SQRT2 * kcf_REST_FILTER_TIME), &sine, &cosine);
    const ahrs_real g = sine / cosine;
    s->rest_gain[0] = 1 / (1 + g * (g + kcf_SQRT2));
    s->rest_gain[1] = g * s->rest_gain[0];
    s->rest_gain[2] = g * s->rest_gain[1];
    s->rest_step = T;
}

static void kcf_detect_rest(ahrs_kcf_state *s, const ahrs_sample *z) {
    if (!z->force_usable || s->blind > 0) {
        s->rest_time = 0;
        return;
    }
    const ahrs_real in[6] = {z->rate.x, z->rate.y, z->rate.z, z->force.x, z->force.y, z->force.z};
    ahrs_real deviation[6];
    const bool starting = s->rest_age < REST_START_TIME;
    if (starting) {
        s->rest_age += z->dt;
        s->rest_count += 1;
        for (int i = 0; i < 6; i++) {
            s->rest_two[i] += in[i];
            const ahrs_real mean = s->rest_two[i] / s->rest_count;
            deviation[i] = in[i] - mean;
            s->rest_one[i] = 0;
            if (!(s->rest_age < REST_START_TIME)) {
                s->rest_two[i] = mean;
            }
        }
    } else {
        if (z->dt != s->rest_step) {
            kcf_set_rest_filter(s, z->dt);
        }
        const ahrs_real a = s->rest_gain[0], b = s->rest_gain[1], c = s->rest_gain[2];
        for (int i = 0; i < 6; i++) {
            const ahrs_real one = s->rest_one[i], two = s->rest_two[i], ahead = in[i] - two;
            const ahrs_real v = a * one + b * ahead, low = two + b * one + c * ahead;
            s->rest_one[i] = 2 * v - one;
            s->rest_two[i] = 2 * low - two;
            deviation[i] = in[i] - low;
        }
    }
    const ahrs_vec3 gyro = ahrs_vec3_of(deviation), accel = ahrs_vec3_of(deviation + 3);
    const ahrs_vec3 low = ahrs_vec3_sub(z->rate, gyro);
    ahrs_vec3_to(s->rest_gyro, low);
    const bool quiet = ahrs_vec3_norm2(gyro) < kcf_REST_GYRO * kcf_REST_GYRO &&
                       ahrs_vec3_norm2(accel) < kcf_REST_ACCEL * kcf_REST_ACCEL && ahrs_abs(low.x) <= kcf_REST_GYRO &&
                       ahrs_abs(low.y) <= kcf_REST_GYRO && ahrs_abs(low.z) <= kcf_REST_GYRO;
    s->rest_time = quiet ? ahrs_min(s->rest_time + z->dt, 2 * kcf_REST_TIME) : 0;
}

static bool kcf_at_rest(const ahrs_kcf_state *s) { return s->rest_time >= kcf_REST_TIME; }

static void kcf_clear_block(ahrs_kcf_state *s) {
    memset(s->sum_force, 0, sizeof s->sum_force);
    memset(s->sum_sens, 0, sizeof s->sum_sens);
    memset(s->turn, 0, sizeof s->turn);
    s->sum_rate2 = 0;
    s->block_time = 0;
    s->force_time = 0;
}

/* Low-pass of second order whose time constant grows with the age of the average; without a measurement it coasts. */
typedef struct {
    ahrs_real T, pull, inverse; /* interval, gain on the difference, 1/denominator */
} kcf_low_pass;

static kcf_low_pass kcf_growing_low_pass(ahrs_real tau, ahrs_real age, ahrs_real T, bool measured) {
    const ahrs_real W = kcf_SQRT2 / ahrs_min(tau, ahrs_max(age, 2 * T));
    return (kcf_low_pass){T, measured ? T * W * W : 0, 1 / (1 + kcf_SQRT2 * W * T + W * W * T * T)};
}

/* Turns the level frame so that the low-passed force is its vertical; gives the tilt error before. */
static ahrs_vec3 kcf_level(ahrs_kcf_state *s, kcf_low_pass f) {
    const bool first = !(s->tilt_age > f.T);
    ahrs_vec3 force = ahrs_vec3_of(s->tilt_force), slope = ahrs_vec3_of(s->tilt_slope);
    if (f.pull > 0) {
        const ahrs_vec3 mean = ahrs_vec3_scale(ahrs_vec3_of(s->sum_force), 1 / s->force_time);
        force = first ? mean : force;
        slope = ahrs_vec3_add_scaled(slope, f.pull, ahrs_vec3_sub(mean, force));
    }
    slope = ahrs_vec3_scale(slope, f.inverse);
    force = ahrs_vec3_add_scaled(force, f.T, slope);
    ahrs_vec3_to(s->tilt_force, force);
    ahrs_vec3_to(s->tilt_slope, slope);

    const ahrs_quat q = ahrs_quat_of(s->q_tilt);
    const ahrs_vec3 turned = ahrs_quat_rotate(q, force);
    const ahrs_real norm = ahrs_vec3_norm(turned);
    if (!(norm > 0)) {
        return (ahrs_vec3){0, 0, 1};
    }
    /* The shortest turn that brings the force upright, not normalised. */
    const ahrs_real along = norm + turned.z;
    const ahrs_quat half_turn = {0, 1, 0, 0};
    const ahrs_quat kcf_step =
        along > AHRS_C(2e-12) * norm ? (ahrs_quat){along, turned.y, -turned.x, 0} : half_turn;
    ahrs_quat_to(s->q_tilt, ahrs_quat_unit(ahrs_quat_mul(kcf_step, q)));
    return ahrs_vec3_scale(turned, 1 / norm);
}

/* Takes the sensitivities into the level frame: its horizontal rows through the same low-pass as the force. */
static void kcf_follow_sensitivities(ahrs_kcf_state *s, kcf_low_pass f, ahrs_real inverse_time) {
    const ahrs_mat3 R = ahrs_quat_to_mat3(ahrs_quat_of(s->q_tilt));
    for (int i = 0; i < 2; i++) {
        const ahrs_vec3 mean = ahrs_vec3_scale(R.row[i], inverse_time);
        const ahrs_real *const sum = s->sum_sens;
        ahrs_real *const kcf_level = s->sens_level + kcf_SENS * i, *const slope = s->sens_slope + kcf_SENS * i;
        for (int k = 0; k < kcf_SENS; k++) {
            const ahrs_real in = mean.x * sum[k] + mean.y * sum[kcf_SENS + k] + mean.z * sum[2 * kcf_SENS + k];
            kcf_level[k] += f.T * (in - slope[k]);
            slope[k] = (slope[k] + f.pull * kcf_level[k]) * f.inverse;
        }
    }
    for (int k = 0; k < kcf_G; k++) {
        const ahrs_real *const sum = s->sum_sens + k;
        s->job_vertical[k] = R.row[2].x * sum[0] + R.row[2].y * sum[kcf_SENS] + R.row[2].z * sum[2 * kcf_SENS];
    }
}

static void kcf_face_north(ahrs_kcf_state *s) {
    const ahrs_quat heading = {s->heading[0], 0, 0, s->heading[1]};
    ahrs_quat_to(s->q_north, ahrs_quat_mul(heading, ahrs_quat_of(s->q_level)));
}

/* The averaged force lags behind the vertical by the drift since; what has been learned of the gyroscope meanwhile
 * tells how far (docs/accuracy.md). */
static void kcf_make_good_lag(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    ahrs_real lag[2];
    for (int i = 0; i < 2; i++) {
        const ahrs_real *const kcf_level = s->sens_level + kcf_SENS * i;
        const ahrs_real drift = ahrs_cal_dot(kcf_G, kcf_level, s->x + kcf_GYRO) - kcf_level[kcf_G];
        lag[i] = p->refine ? AHRS_C(-0.5) * ahrs_clamp(drift, -kcf_LAG_MAX, kcf_LAG_MAX) : 0;
    }
    const ahrs_quat turn = ahrs_quat_unit((ahrs_quat){1, lag[0], lag[1], 0});
    ahrs_quat_to(s->q_level, ahrs_quat_mul(turn, ahrs_quat_of(s->q_tilt)));
    kcf_face_north(s);
}

static ahrs_real kcf_drift_row(const ahrs_kcf_state *s, int i, ahrs_real tilt_rate) {
    const ahrs_real *const sens = s->sens_slope + kcf_SENS * i;
    return tilt_rate + sens[kcf_G] - ahrs_cal_dot(kcf_G, sens, s->x + kcf_GYRO);
}

/* Correlates the turn of what a sensor sees with the one the gyroscope predicts, axis by axis: a swapped sign turns
 * the correlation around (docs/accuracy.md). */
static void kcf_compare_senses(ahrs_real *sense, ahrs_real *power, ahrs_vec3 now, ahrs_vec3 before, ahrs_vec3 turn) {
    const ahrs_vec3 v = ahrs_vec3_scale(ahrs_vec3_add(now, before), AHRS_C(0.5));
    const ahrs_vec3 predicted[3] = {{0, turn.x * v.z, -turn.x * v.y}, {-turn.y * v.z, 0, turn.y * v.x},
                                    {turn.z * v.y, -turn.z * v.x, 0}};
    const ahrs_vec3 all = ahrs_vec3_add(ahrs_vec3_add(predicted[0], predicted[1]), predicted[2]);
    const ahrs_vec3 rest = ahrs_vec3_sub(ahrs_vec3_sub(now, before), all);
    for (int i = 0; i < 3; i++) {
        const ahrs_real norm2 = ahrs_vec3_norm2(predicted[i]);
        sense[i] += norm2 + ahrs_vec3_dot(predicted[i], rest);
        power[i] += norm2;
        /* An exponential window over the rotation itself: rest forgets nothing. */
        const ahrs_real kept = AHRS_C(10.0) / (AHRS_C(10.0) + norm2);
        sense[i] *= kept;
        power[i] *= kept;
    }
}

static void kcf_compare_all_senses(ahrs_kcf_state *s, const ahrs_sample *z, ahrs_real gravity) {
    const ahrs_vec3 turn = ahrs_vec3_of(s->turn);
    if (z->force_usable) {
        const ahrs_vec3 force = ahrs_vec3_scale(z->force, 1 / gravity);
        if (s->job & kcf_SEEN_FORCE) {
            kcf_compare_senses(s->sense, s->sense_power, force, ahrs_vec3_of(s->seen), turn);
        }
        ahrs_vec3_to(s->seen, force);
    }
    s->job = z->force_usable ? s->job | kcf_SEEN_FORCE : s->job & ~kcf_SEEN_FORCE;
    const bool mag = z->mag_usable && s->mag_scale > 0;
    if (mag) {
        const ahrs_vec3 field = ahrs_vec3_sub(ahrs_vec3_scale(z->mag, s->mag_scale), kcf_iron(s));
        if (s->job & kcf_SEEN_MAG) {
            kcf_compare_senses(s->sense + 3, s->sense_power + 3, field, ahrs_vec3_of(s->seen + 3), turn);
        }
        ahrs_vec3_to(s->seen + 3, field);
    }
    s->job = mag ? s->job | kcf_SEEN_MAG : s->job & ~kcf_SEEN_MAG;
}

static bool kcf_opposes(const ahrs_real *sense, const ahrs_real *power) {
    bool found = false;
    for (int i = 0; i < 3; i++) {
        const ahrs_real enough = power[i] > kcf_SENSE_POWER ? SENSE_OPPOSED : SENSE_CLEARLY;
        found = found || (power[i] > kcf_SENSE_LEAST_POWER && sense[i] < -enough * power[i]);
    }
    return found;
}

/* Field and gyroscope turn in opposite senses, or force and gyroscope do and the averaged force is no gravity either:
 * accelerations alone can oppose the rotation for a while, but they average out. */
static bool kcf_implausible(const ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    const ahrs_real least = kcf_SENSE_GRAVITY * p->common.gravity;
    return kcf_opposes(s->sense + 3, s->sense_power + 3) ||
           (kcf_opposes(s->sense, s->sense_power) && ahrs_vec3_norm2(ahrs_vec3_of(s->tilt_force)) < least * least);
}

static void kcf_begin_slow_step(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_sample *z) {
    const ahrs_real T = s->block_time, tau = kcf_tau_accel(p);
    const bool force = s->force_time > 0;
    s->tilt_age = force ? ahrs_min(s->tilt_age + T, 100 * tau) : s->tilt_age;
    const kcf_low_pass f = kcf_growing_low_pass(tau, s->tilt_age, T, force);
    const ahrs_vec3 e = kcf_level(s, f);
    kcf_follow_sensitivities(s, f, 1 / T);
    kcf_make_good_lag(s, p);

    s->job &= kcf_MAG_FRESH | kcf_SEEN_FORCE | kcf_SEEN_MAG | kcf_REALIGN;
    s->job_time = T;
    s->job_rate2 = s->sum_rate2 / T;
    if (kcf_at_rest(s)) {
        s->job |= kcf_JOB_REST;
        ahrs_vec3_to(s->job_drift, ahrs_vec3_sub(ahrs_vec3_of(s->rest_gyro), ahrs_vec3_of(&s->x[kcf_GYRO])));
    } else if (force) {
        s->job |= kcf_JOB_DRIFT;
        s->job_drift[0] = kcf_drift_row(s, 0, -e.y / T);
        s->job_drift[1] = kcf_drift_row(s, 1, e.x / T);
    }
    kcf_compare_all_senses(s, z, p->common.gravity);
    if ((s->job & kcf_MAG_FRESH) && p->use_mag) {
        const ahrs_vec3 m = ahrs_vec3_of(s->mag);
        s->job |= kcf_JOB_MAG;
        if (!(s->mag_scale > 0)) {
            s->mag_scale = 1 / ahrs_vec3_norm(m);
            s->job |= kcf_JOB_MAG_FIRST;
        }
        ahrs_vec3_to(s->job_mag, ahrs_vec3_scale(m, s->mag_scale));
        ahrs_quat_to(s->job_q, ahrs_quat_mul(ahrs_quat_of(s->q_level), ahrs_quat_of(s->mag_q)));
        memcpy(s->job_rate, s->mag_rate, sizeof s->job_rate);
        s->job_mag_time = ahrs_min(s->mag_time, ahrs_max(kcf_MAG_TIME_MAX, T));
        s->mag_time = 0;
    }
    s->job &= ~kcf_MAG_FRESH;
    memset(s->dx, 0, sizeof s->dx);
    kcf_clear_block(s);
    s->phase = 0;
}

/* Adds the variance of a turn of the level frame about its vertical; `block` are the rows and columns of the field. */
static void kcf_turn_field(ahrs_real *block, int width, const ahrs_real *field, ahrs_real variance) {
    const ahrs_real across = -variance * field[0] * field[1];
    block[0] += variance * field[1] * field[1];
    block[1] += across;
    block[width] += across;
    block[width + 1] += variance * field[0] * field[0];
}

/* Adds to three variances; `block` begins with the first. */
static void kcf_add_to_diagonal(ahrs_real *block, int width, ahrs_real variance) {
    for (int i = 0; i < 3; i++) {
        block[(width + 1) * i] += variance;
    }
}

/* The errors of the gyroscope turn the level frame, and with it the field in it: P := (I + u v') P (I + u v')' with
 * y = P v and a horizontal u, which v does not see. */
static void kcf_couple(ahrs_kcf_state *s, const ahrs_real u[2], const ahrs_real *y, ahrs_real variance) {
    for (int i = 0; i < 2; i++) {
        ahrs_real *const row = s->cov + kcf_ROW * (kcf_FIELD + i);
        for (int j = 0; j < kcf_N; j++) {
            row[j] += u[i] * y[j];
        }
        for (int j = 0; j < 2; j++) {
            row[kcf_FIELD + j] += u[j] * (y[kcf_FIELD + i] + u[i] * variance);
        }
    }
    for (int j = 0; j < kcf_N; j++) {
        ahrs_real *const field = s->cov + kcf_ROW * j + kcf_FIELD;
        field[0] = s->cov[kcf_ROW * kcf_FIELD + j];
        field[1] = s->cov[kcf_ROW * (kcf_FIELD + 1) + j];
    }
}

/* Variance of one slow step of a drift that a bias, which walks, shows to this accuracy. */
static ahrs_real kcf_drift_variance(const ahrs_kcf_params *p, ahrs_real accuracy, ahrs_real T) {
    const ahrs_real r = kcf_square(accuracy);
    return (r * r / (kcf_square(kcf_BIAS_GROWTH) / p->bias_forget_time) + r * T) / T;
}

/* Takes rows h of measurements with their products y; h is of `size`, from state `first` on. */
AHRS_INLINE bool kcf_take(ahrs_kcf_state *s, int rows, int first, int size, const ahrs_real *h, const ahrs_real *innovation,
                      ahrs_real variance, ahrs_real *y) {
    const bool sound = ahrs_cal_measure(rows, first, size, kcf_ROW, h, innovation, variance, y, s->dx);
    if (sound) {
        ahrs_cal_subtract(rows, kcf_N, kcf_ROW, y, s->cov);
    }
    return sound;
}

/* The same for two or three rows, compiled once for each; a covariance that has lost its meaning begins anew. */
static void kcf_learn(ahrs_kcf_state *s, const ahrs_kcf_params *p, int rows, int first, int size, const ahrs_real *h,
                  const ahrs_real *innovation, ahrs_real variance, ahrs_real *y) {
    const bool sound = rows == 2 ? kcf_take(s, 2, first, size, h, innovation, variance, y)
                                 : kcf_take(s, 3, first, size, h, innovation, variance, y);
    if (!sound) {
        kcf_lose_covariance(s, p);
    }
}

/* At rest the low-passed gyroscope shows its bias, all axes of it; in motion the drift of the tilt shows two rows. */
static void kcf_learn_gyro(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    static const ahrs_real AXES[3 * 4] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const ahrs_real T = s->job_time, growth = kcf_square(kcf_BIAS_GROWTH) / p->bias_forget_time * T;
    const bool drifts = s->job & kcf_JOB_DRIFT;
    const ahrs_real u[2] = {-s->x[kcf_FIELD + 1], s->x[kcf_FIELD]};
    ahrs_real innovation[3], h[3 * kcf_G], y[3 * kcf_ROW];
    for (int i = 0; i < 3; i++) {
        ahrs_real *const variance = kcf_variance_of(s->cov, kcf_GYRO + i);
        *variance += *variance < kcf_square(p->bias_std) ? growth : 0;
        innovation[i] = ahrs_clamp(s->job_drift[i], -p->bias_limit, p->bias_limit);
    }
    memcpy(h, s->job_vertical, kcf_G * sizeof *h);
    if (drifts) {
        memcpy(h + kcf_G, s->sens_slope, kcf_G * sizeof *h);
        memcpy(h + 2 * kcf_G, s->sens_slope + kcf_SENS, kcf_G * sizeof *h);
        ahrs_cal_gyro_products(3, s->cov, h, y);
        for (int r = 1; r < 3; r++) {
            const ahrs_real along = ahrs_cal_dot(kcf_G, h + kcf_G * r, y);
            y[kcf_ROW * r + kcf_FIELD] += u[0] * along;
            y[kcf_ROW * r + kcf_FIELD + 1] += u[1] * along;
        }
    } else {
        ahrs_cal_gyro_products(1, s->cov, h, y);
    }
    kcf_couple(s, u, y, ahrs_cal_dot(kcf_G, h, y));
    if (s->job & kcf_JOB_REST) {
        memcpy(y, s->cov, 3 * kcf_ROW * sizeof *y);
        kcf_learn(s, p, 3, kcf_GYRO, 4, AXES, innovation, kcf_drift_variance(p, p->rest_drift_std, T), y);
    } else if (drifts) {
        const ahrs_real young = ahrs_max(1, kcf_square(kcf_tau_accel(p) / s->tilt_age));
        kcf_learn(s, p, 2, kcf_GYRO, kcf_G, h + kcf_G, innovation, kcf_drift_variance(p, p->motion_drift_std, T) * young, y + kcf_ROW);
    }
}

/* The sample as it would read without hard iron and latency, in the level frame. */
static ahrs_vec3 kcf_level_field(const ahrs_kcf_state *s, const ahrs_mat3 *R, ahrs_vec3 hard_iron) {
    const ahrs_real lag = s->x[kcf_LATENCY];
    const ahrs_vec3 w = ahrs_vec3_of(s->job_rate), m = ahrs_vec3_sub(ahrs_vec3_of(s->job_mag), hard_iron);
    const ahrs_vec3 first = ahrs_vec3_cross(w, m), second = ahrs_vec3_cross(w, first);
    const ahrs_vec3 then = ahrs_vec3_add_scaled(m, -lag, first);
    return ahrs_mat3_apply(*R, ahrs_vec3_add_scaled(then, AHRS_C(0.5) * lag * lag, second));
}

/* Mean squared misfit over jump_time, and the variance that it has in excess of the expected one. */
static ahrs_real kcf_excess_of(const ahrs_kcf_params *p, ahrs_real *misfit, ahrs_real ratio, ahrs_real expected,
                           ahrs_real T) {
    *misfit += ahrs_min(T / p->jump_time, 1) * (ahrs_min(ratio, kcf_MISFIT_MAX) - *misfit);
    return ahrs_min(expected * ahrs_max(0, *misfit - p->jump_threshold), 1);
}

/* Changes of the field that no hard iron explains count for both hypotheses. */
static void kcf_change_alternative(ahrs_kcf_state *s, const ahrs_kcf_params *p, ahrs_real ratio) {
    const ahrs_real T = s->job_mag_time, excess = kcf_excess_of(p, &s->alt_misfit, ratio, s->job_noise[0], T);
    const ahrs_real jump = (kcf_square(p->hard_iron_walk) + p->jump_hard_iron * excess) * T;
    kcf_add_to_diagonal(s->alt_cov, kcf_ALT_ROW, p->jump_field * excess * T);
    kcf_add_to_diagonal(s->alt_cov + (kcf_ALT_ROW + 1) * AHRS_CAL_IRON, kcf_ALT_ROW, jump);
    s->alt_jump += jump;
}

/* Squared difference of two rotation matrices, summed: how differently they show a vector fixed in the body. */
static ahrs_real kcf_rotation_difference(const ahrs_real q[4], const ahrs_real r[4]) {
    const ahrs_real c = ahrs_quat_dot(ahrs_quat_of(q), ahrs_quat_of(r));
    return 8 * ahrs_max(1 - c * c, 0);
}

/* Turns the field in the level frame to where it is seen now: the heading had been lost. */
static void kcf_align(ahrs_real *field, ahrs_vec3 seen) {
    const ahrs_real have2 = field[0] * field[0] + field[1] * field[1], want2 = seen.x * seen.x + seen.y * seen.y;
    if (want2 > 0) {
        const ahrs_real k = ahrs_sqrt(have2 / want2);
        field[0] = k * seen.x;
        field[1] = k * seen.y;
    }
}

/* Makes three states independent of all others, with a variance of their own. */
static void kcf_make_independent(ahrs_kcf_state *s, int first, ahrs_real variance) {
    for (int i = first; i < first + 3; i++) {
        for (int j = 0; j < kcf_N; j++) {
            s->cov[kcf_ROW * i + j] = 0;
            s->cov[kcf_ROW * j + i] = 0;
        }
        *kcf_variance_of(s->cov, i) = variance;
    }
}

/* Takes field and hard iron from before a change, or the field that is seen. */
static void kcf_renew_field(ahrs_kcf_state *s, const ahrs_kcf_params *p, ahrs_vec3 field, ahrs_real variance,
                        int32_t change) {
    ahrs_vec3_to(s->x + kcf_FIELD, field);
    memcpy(s->x + kcf_IRON, s->calm_iron, sizeof s->calm_iron);
    kcf_make_independent(s, kcf_FIELD, variance);
    kcf_make_independent(s, kcf_IRON, kcf_square(p->hard_iron_std));
    s->misfit = 1;
    s->excess = 0;
    s->old_misfit = kcf_MISFIT_MAX;
    s->change_views = 0;
    s->fit_views = 0;
    s->change = change;
}

/* Angle, as cosine and sine, from the other field to where the old one would be. */
static void kcf_note_north(ahrs_kcf_state *s) {
    const ahrs_real *a = s->x + kcf_FIELD, *b = s->calm_field;
    const ahrs_real scale = 1 / ahrs_sqrt((a[0] * a[0] + a[1] * a[1]) * (b[0] * b[0] + b[1] * b[1]));
    s->north_angle[0] = scale * (a[0] * b[0] + a[1] * b[1]);
    s->north_angle[1] = scale * (a[0] * b[1] - a[1] * b[0]);
}

/* The old field, at that angle from the other one as it is known now. */
static void kcf_follow_north(ahrs_kcf_state *s) {
    const ahrs_real *a = s->x + kcf_FIELD, *turn = s->north_angle;
    const ahrs_vec3 seen = {turn[0] * a[0] - turn[1] * a[1], turn[1] * a[0] + turn[0] * a[1], 0};
    kcf_align(s->calm_field, seen);
}

/* Whether the old field is back. */
static bool kcf_is_back(ahrs_kcf_state *s, const ahrs_mat3 *R, ahrs_real expected) {
    const ahrs_vec3 off = ahrs_vec3_sub(kcf_level_field(s, R, ahrs_vec3_of(s->calm_iron)), ahrs_vec3_of(s->calm_field));
    const ahrs_real ratio = ahrs_min(ahrs_vec3_norm2(off) / (3 * expected), kcf_MISFIT_MAX);
    const ahrs_real weight = s->old_misfit < kcf_MISFIT_MAX ? ahrs_min(s->job_mag_time / kcf_OLD_FIELD_TIME, 1) : 1;
    s->old_misfit += weight * (ratio - s->old_misfit);
    return s->old_misfit < OLD_FIELD_FITS;
}

/* Whether the hard iron is as certain as a calibration would leave it. */
static bool kcf_knows_iron(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    bool known = true;
    for (int i = kcf_IRON; i < kcf_IRON + 3; i++) {
        known = known && *kcf_variance_of(s->cov, i) < kcf_square(p->hard_iron_std);
    }
    return known;
}

/* Tells a change of the field from one of the hard iron. What has fitted through enough views is trusted: turning
 * makes a hard iron fit, and never a field. Until the old field is back, north is kept by the gyroscope, and by the
 * other field once that is known. */
static void kcf_judge_field(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_mat3 *R, ahrs_real expected) {
    const bool misfit = s->misfit > p->jump_threshold, fits = s->misfit < AHRS_C(0.5) * p->jump_threshold;
    const ahrs_real views = s->job_mag_time * ahrs_min(VIEWS_MAX, ahrs_sqrt(s->job_rate2) / VIEW_ANGLE);
    s->change_views += misfit ? views : 0;
    s->fit_views = fits ? s->fit_views + views : 0;
    if (s->change == kcf_FIELD_CALM && !misfit) {
        s->iron_known = kcf_knows_iron(s, p) && (s->iron_known || s->fit_views > kcf_VIEWS_REFUTE);
    }
    if (s->question == kcf_QUESTION_OPEN || !p->refine || (s->change == kcf_FIELD_CALM && !(misfit && s->iron_known))) {
        memcpy(s->calm_field, s->x + kcf_FIELD, sizeof s->calm_field);
        memcpy(s->calm_iron, s->x + kcf_IRON, sizeof s->calm_iron);
        s->change_views = 0;
        s->change = kcf_FIELD_CALM;
    } else if (s->change <= kcf_FIELD_SUSPECT) {
        s->change = s->fit_views > VIEWS_PROVE ? kcf_FIELD_CALM : kcf_FIELD_SUSPECT;
        if (s->change_views > kcf_VIEWS_REFUTE) {
            kcf_renew_field(s, p, kcf_level_field(s, R, ahrs_vec3_of(s->calm_iron)), 1, kcf_FIELD_STRANGE);
        }
    } else if (kcf_is_back(s, R, expected)) {
        kcf_renew_field(s, p, ahrs_vec3_of(s->calm_field), kcf_square(p->mag_noise), kcf_FIELD_CALM);
    } else if (misfit) {
        s->change = kcf_FIELD_STRANGE;
    } else if (s->change == kcf_FIELD_OTHER) {
        kcf_follow_north(s);
    } else if (s->fit_views > VIEWS_PROVE) {
        kcf_note_north(s);
        s->change = kcf_FIELD_OTHER;
    }
}

/* Innovation of the magnetometer, its noise, and how far field and hard iron may have changed with it. */
static void kcf_expect_field(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    const ahrs_real T = s->job_mag_time;
    const ahrs_mat3 R = ahrs_quat_to_mat3(ahrs_quat_of(s->job_q));
    const ahrs_vec3 field = kcf_level_field(s, &R, kcf_iron(s));
    if (s->job & kcf_JOB_MAG_FIRST) {
        ahrs_vec3_to(s->x + kcf_FIELD, field);
    }
    if (s->job & kcf_REALIGN) {
        kcf_align(s->x + kcf_FIELD, field);
        kcf_align(s->alt_x, kcf_level_field(s, &R, ahrs_vec3_of(s->alt_x + AHRS_CAL_IRON)));
        s->job &= ~kcf_REALIGN;
        s->change = kcf_FIELD_CALM;
    }
    const ahrs_real rate2 = ahrs_vec3_norm2(ahrs_vec3_of(s->job_rate)), age = s->tilt_age / kcf_tau_accel(p);
    const ahrs_real settling = age < kcf_SETTLED ? kcf_square(p->mag_tilt_noise) * ahrs_exp_decay(age) : 0;
    const ahrs_real expected = kcf_square(p->mag_noise) + kcf_square(p->mag_rate_noise) * rate2 + settling;
    kcf_judge_field(s, p, &R, expected);
    const ahrs_vec3 nu = ahrs_vec3_sub(kcf_level_field(s, &R, kcf_iron(s)), ahrs_vec3_of(s->x + kcf_FIELD));
    ahrs_vec3_to(s->job_nu, nu);
    const ahrs_real misfit2 = ahrs_vec3_norm2(nu) / 3, ratio = misfit2 / expected;
    const ahrs_real excess = kcf_excess_of(p, &s->misfit, ratio, expected, T);
    s->job_noise[0] = expected;
    s->job_noise[1] = kcf_square(p->mag_density) / T * expected / kcf_square(p->mag_noise) *
                      (1 + p->outlier_weight * ahrs_max(0, ratio - 1));
    for (int i = kcf_IRON; i < kcf_IRON + 3; i++) {
        ahrs_real *const variance = kcf_variance_of(s->cov, i);
        *variance += *variance < kcf_IRON_VARIANCE_MAX ? (kcf_square(p->hard_iron_walk) + p->jump_hard_iron * excess) * T : 0;
    }
    kcf_add_to_diagonal(kcf_variance_of(s->cov, kcf_FIELD), kcf_ROW, p->jump_field * s->excess * T);
    s->excess = excess;
    if (s->question == kcf_QUESTION_OPEN) {
        const ahrs_real unexplained = kcf_square(p->uncalibrated_std) * kcf_rotation_difference(s->job_q, s->alt_q) / 3;
        kcf_change_alternative(s, p, misfit2 / (expected + unexplained));
    }
}

static void kcf_follow_field(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    const ahrs_real T = s->job_time;
    const ahrs_real heading = (kcf_square(p->heading_walk) + kcf_square(p->heading_rate_walk) * s->job_rate2) * T;
    const ahrs_real field = kcf_square(p->field_walk) * T;
    kcf_add_to_diagonal(kcf_variance_of(s->cov, kcf_FIELD), kcf_ROW, field);
    kcf_turn_field(kcf_variance_of(s->cov, kcf_FIELD), kcf_ROW, s->x + kcf_FIELD, heading);
    if (s->question == kcf_QUESTION_OPEN) {
        kcf_add_to_diagonal(s->alt_cov, kcf_ALT_ROW, field);
        kcf_turn_field(s->alt_cov, kcf_ALT_ROW, s->alt_x, heading);
    }
    if (s->job & kcf_JOB_MAG) {
        kcf_expect_field(s, p);
    }
}

static void kcf_learn_mag(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    if (!(s->job & kcf_JOB_MAG) || (s->job & kcf_JOB_MAG_FIRST)) {
        return;
    }
    const ahrs_mat3 R = ahrs_quat_to_mat3(ahrs_quat_of(s->job_q));
    const ahrs_vec3 m = ahrs_vec3_sub(ahrs_vec3_of(s->job_mag), kcf_iron(s));
    ahrs_real h[3 * AHRS_CAL_MAG], y[3 * kcf_ROW];
    ahrs_cal_mag_rows(&R, ahrs_mat3_apply(R, ahrs_vec3_cross(ahrs_vec3_of(s->job_rate), m)), h);
    ahrs_cal_mag_products(kcf_ROW, true, s->cov + kcf_ROW * kcf_FIELD, h, y);
    kcf_learn(s, p, 3, kcf_FIELD, AHRS_CAL_MAG, h, s->job_nu, s->job_noise[1], y);
}

static void kcf_ask(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    const ahrs_real variance = kcf_square(p->uncalibrated_std);
    const ahrs_mat3 R = ahrs_quat_to_mat3(ahrs_quat_of(s->job_q));
    memset(s->alt_x, 0, sizeof s->alt_x);
    memset(s->alt_cov, 0, sizeof s->alt_cov);
    memcpy(s->alt_x, s->x + kcf_FIELD, 3 * sizeof(ahrs_real));
    memcpy(s->alt_q, s->job_q, sizeof s->alt_q);
    for (int i = 0; i < 3; i++) {
        ahrs_real *const field = s->alt_cov + kcf_ALT_ROW * i;
        field[i] = variance + s->job_noise[0];
        ahrs_vec3_to(field + AHRS_CAL_IRON, ahrs_vec3_scale(R.row[i], -variance));
        for (int j = 0; j < 3; j++) {
            ahrs_real *const iron_row = s->alt_cov + kcf_ALT_ROW * (AHRS_CAL_IRON + j);
            iron_row[i] = field[AHRS_CAL_IRON + j];
            iron_row[AHRS_CAL_IRON + j] = variance;
        }
    }
    s->alt_misfit = 1;
    s->alt_jump = 0;
    s->question = kcf_QUESTION_OPEN;
}

/* The same magnetometer sample for the hypothesis; slowly varying disturbances count once per view of the field. */
static void kcf_learn_alternative(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    if (s->question != kcf_QUESTION_OPEN || !(s->job & kcf_JOB_MAG)) {
        return;
    }
    const ahrs_mat3 R = ahrs_quat_to_mat3(ahrs_quat_of(s->job_q));
    const ahrs_vec3 field = kcf_level_field(s, &R, ahrs_vec3_of(s->alt_x + AHRS_CAL_IRON));
    ahrs_real nu[3], h[3 * AHRS_CAL_MAG], y[3 * kcf_ALT_ROW], dx[kcf_ALT_ROW] = {0}, trace = 0;
    ahrs_vec3_to(nu, ahrs_vec3_sub(field, ahrs_vec3_of(s->alt_x)));
    ahrs_cal_mag_rows(&R, (ahrs_vec3){0, 0, 0}, h);
    ahrs_cal_mag_products(kcf_ALT_ROW, false, s->alt_cov, h, y);
    for (int i = 0; i < 3; i++) {
        trace += ahrs_cal_dot(kcf_ALT_ROW, h + AHRS_CAL_MAG * i, y + kcf_ALT_ROW * i);
    }
    const ahrs_real expected = s->job_noise[0];
    const ahrs_real ratio = (nu[0] * nu[0] + nu[1] * nu[1] + nu[2] * nu[2]) / (3 * expected + trace);
    const ahrs_real views = ahrs_min(VIEWS_MAX, ahrs_sqrt(s->job_rate2) / VIEW_ANGLE + kcf_VIEWS_AT_REST);
    const ahrs_real variance =
        expected / (s->job_mag_time * views) * (1 + p->outlier_weight * ahrs_max(0, ratio - 1));
    if (!ahrs_cal_measure(3, 0, kcf_ALT_ROW, kcf_ALT_ROW, h, nu, variance, y, dx)) {
        s->question = kcf_QUESTION_ANSWERED;
        return;
    }
    ahrs_cal_subtract(3, kcf_ALT_N, kcf_ALT_ROW, y, s->alt_cov);
    for (int k = 0; k < kcf_ALT_N; k++) {
        s->alt_x[k] += dx[k];
    }
}

/* Inverse of a symmetric 3 x 3 matrix and its determinant. */
static ahrs_real kcf_invert(ahrs_mat3 a, ahrs_mat3 *inverse) {
    const ahrs_vec3 x = ahrs_vec3_cross(a.row[1], a.row[2]);
    const ahrs_real determinant = ahrs_vec3_dot(a.row[0], x), k = 1 / determinant;
    *inverse = (ahrs_mat3){{ahrs_vec3_scale(x, k), ahrs_vec3_scale(ahrs_vec3_cross(a.row[2], a.row[0]), k),
                            ahrs_vec3_scale(ahrs_vec3_cross(a.row[0], a.row[1]), k)}};
    return determinant;
}

/* Odds of the hypothesis: both give the hard iron a Gaussian prior, of different width, and saw the same samples; the
 * ratio of their marginal likelihoods follows from the posterior of one (docs/accuracy.md). */
static ahrs_real kcf_odds_of(const ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    const ahrs_real narrow = kcf_square(p->hard_iron_std) + s->alt_jump, wide = kcf_square(p->uncalibrated_std) + s->alt_jump;
    ahrs_mat3 posterior;
    for (int i = 0; i < 3; i++) {
        posterior.row[i] = ahrs_vec3_of(s->alt_cov + kcf_ALT_ROW * (AHRS_CAL_IRON + i) + AHRS_CAL_IRON);
    }
    const ahrs_vec3 b = ahrs_vec3_of(s->alt_x + AHRS_CAL_IRON);
    const ahrs_real more = 1 / narrow - 1 / wide;
    ahrs_mat3 information, other;
    const ahrs_real posterior_det = kcf_invert(posterior, &information);
    const ahrs_vec3 weighted = ahrs_mat3_apply(information, b);
    information.row[0].x += more;
    information.row[1].y += more;
    information.row[2].z += more;
    const ahrs_real information_det = kcf_invert(information, &other);
    const ahrs_real shift = ahrs_vec3_dot(weighted, ahrs_vec3_sub(b, ahrs_mat3_apply(other, weighted)));
    const ahrs_real r = narrow / wide;
    const ahrs_real widths = ahrs_sqrt(ahrs_max(information_det * posterior_det * r * r * r, 0));
    return p->uncalibrated_odds * widths / ahrs_exp_decay(ahrs_clamp(AHRS_C(0.5) * shift, 0, 40));
}

static void kcf_adopt(ahrs_kcf_state *s) {
    memcpy(s->x + kcf_FIELD, s->alt_x, sizeof s->alt_x);
    kcf_make_independent(s, kcf_FIELD, 1);
    kcf_make_independent(s, kcf_IRON, 1);
    for (int i = 0; i < kcf_ALT_N; i++) {
        memcpy(kcf_variance_of(s->cov, kcf_FIELD) + kcf_ROW * i, s->alt_cov + kcf_ALT_ROW * i, kcf_ALT_N * sizeof(ahrs_real));
    }
    s->misfit = 1;
}

static void kcf_weigh_evidence(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    if (s->question == kcf_QUESTION_NEW && (s->job & kcf_JOB_MAG_FIRST)) {
        if (p->uncalibrated_odds > 0) {
            kcf_ask(s, p);
        } else {
            s->question = kcf_QUESTION_ANSWERED;
        }
    }
    if (s->question != kcf_QUESTION_OPEN) {
        s->alt_probability = 0;
        return;
    }
    const ahrs_real odds = kcf_odds_of(s, p);
    ahrs_real largest = 0;
    for (int i = AHRS_CAL_IRON; i < kcf_ALT_N; i++) {
        largest = ahrs_max(largest, s->alt_cov[(kcf_ALT_ROW + 1) * i]);
    }
    const bool converged = largest < kcf_square(p->hard_iron_std);
    s->alt_probability = odds / (1 + odds);
    if (!ahrs_is_finite(odds) || odds * kcf_EVIDENCE_DECIDES < 1 || (converged && odds < 1)) {
        s->question = kcf_QUESTION_ANSWERED;
    } else if (odds > kcf_EVIDENCE_DECIDES || converged) {
        s->question = kcf_QUESTION_ANSWERED;
        kcf_adopt(s);
    }
}

static void kcf_clamp_all(ahrs_real *x, int n, ahrs_real limit) {
    for (int i = 0; i < n; i++) {
        x[i] = ahrs_clamp(x[i], -limit, limit);
    }
}

/* Half the angle that turns the horizontal field north. */
static void kcf_find_north(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    /* Before the body has turned, the hypotheses differ in nothing but the noise of their first samples. */
    const bool same = p->refine && kcf_rotation_difference(s->job_q, s->alt_q) < kcf_TURNED;
    const ahrs_real other = s->question == kcf_QUESTION_OPEN && !same ? s->alt_probability : 0;
    const ahrs_real *const field = s->change >= kcf_FIELD_STRANGE ? s->calm_field : s->x + kcf_FIELD;
    const ahrs_real x = (1 - other) * field[0] + other * s->alt_x[0];
    const ahrs_real y = (1 - other) * field[1] + other * s->alt_x[1];
    const ahrs_real norm = ahrs_sqrt(x * x + y * y);
    if (!(norm > 0)) {
        return;
    }
    const ahrs_real cosine = x / norm, sine = -y / norm;
    if (cosine > 0) {
        s->heading[0] = ahrs_sqrt(AHRS_C(0.5) * (1 + cosine));
        s->heading[1] = AHRS_C(0.5) * sine / s->heading[0];
    } else {
        const ahrs_real half = ahrs_sqrt(AHRS_C(0.5) * (1 - cosine));
        s->heading[1] = sine < 0 ? -half : half;
        s->heading[0] = AHRS_C(0.5) * sine / s->heading[1];
    }
    kcf_face_north(s);
}

static void kcf_apply(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    bool sound = true;
    for (int i = 0; i < kcf_N; i++) {
        const ahrs_real variance = *kcf_variance_of(s->cov, i);
        sound = sound && ahrs_is_finite(s->dx[i]) && variance >= 0 && ahrs_is_finite(variance);
    }
    if (!sound) {
        kcf_lose_covariance(s, p);
    }
    for (int i = 0; i < kcf_N; i++) {
        s->x[i] += s->dx[i];
    }
    kcf_clamp_all(s->x + kcf_IRON, 3, kcf_IRON_MAX);
    kcf_clamp_all(s->x + kcf_LATENCY, 1, LATENCY_MAX);
    kcf_clamp_all(s->x + kcf_GYRO, 3, p->bias_limit);
    kcf_clamp_all(s->x + kcf_SCALE, 9, SCALE_MAX);
}

static void kcf_conclude(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    kcf_weigh_evidence(s, p);
    if (s->job & kcf_JOB_MAG) {
        kcf_find_north(s, p);
    }
}

static void kcf_run_phase(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    switch (s->phase++) {
    case kcf_PHASE_GYRO: kcf_learn_gyro(s, p); break;
    case kcf_PHASE_FIELD: kcf_follow_field(s, p); break;
    case kcf_PHASE_MAG: kcf_learn_mag(s, p); break;
    case kcf_PHASE_ALTERNATIVE: kcf_learn_alternative(s, p); break;
    case kcf_PHASE_APPLY: kcf_apply(s, p); break;
    default: kcf_conclude(s, p); break;
    }
}

static void kcf_run_phases(ahrs_kcf_state *s, const ahrs_kcf_params *p, int32_t until) {
    while (s->phase < until) {
        kcf_run_phase(s, p);
    }
}

/* The rotation since is not known: the average of the force begins anew, the field is sought where it is now. */
static void kcf_restart_tilt(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    kcf_run_phases(s, p, kcf_PHASES);
    kcf_clear_block(s);
    memset(s->tilt_slope, 0, sizeof s->tilt_slope);
    memset(s->sens_level, 0, sizeof s->sens_level);
    memset(s->sens_slope, 0, sizeof s->sens_slope);
    memset(s->rest_one, 0, sizeof s->rest_one);
    memset(s->rest_two, 0, sizeof s->rest_two);
    s->job = kcf_REALIGN;
    s->tilt_age = 0;
    s->rest_age = 0;
    s->rest_count = 0;
    s->rest_time = 0;
}

/* Turns the attitude by what a held rate has missed if the rate has gone straight to where it is now. */
static void kcf_make_good_hold(ahrs_kcf_state *s, ahrs_vec3 rate) {
    const ahrs_vec3 change = ahrs_vec3_sub(rate, ahrs_vec3_of(s->rate));
    const ahrs_vec3 missed = ahrs_vec3_scale(change, AHRS_C(0.5) * s->blind);
    ahrs_quat_to(s->q_int, ahrs_quat_unit(ahrs_quat_mul(ahrs_quat_of(s->q_int), ahrs_quat_exp(missed))));
    ahrs_vec3_to(s->turn, ahrs_vec3_add(ahrs_vec3_of(s->turn), missed));
}

/* What a time without a rate costs: certainty of the heading, or the attitude. A rate that swings at RATE_BANDWIDTH is
 * off a straight line by its second derivative, which over a time T turns by rate bandwidth^2 T^3 / 12. */
static void kcf_account_for_blindness(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_sample *z) {
    const ahrs_vec3 rate = ahrs_vec3_sub(z->rate, kcf_gyro_error(s, z->rate));
    const ahrs_real T = s->blind, rate2 = ahrs_max(s->job_rate2, ahrs_vec3_norm2(rate));
    const ahrs_real lost = rate2 * kcf_square(kcf_square(kcf_RATE_BANDWIDTH) * T * T * T / 12);
    const bool all = ahrs_max(T, z->dt) > AHRS_LONGEST_STEP || lost > kcf_LOST;
    if (all) {
        kcf_restart_tilt(s, p);
    } else {
        kcf_make_good_hold(s, rate);
    }
    kcf_turn_field(kcf_variance_of(s->cov, kcf_FIELD), kcf_ROW, s->x + kcf_FIELD, all ? 1 : lost);
    kcf_turn_field(s->alt_cov, kcf_ALT_ROW, s->alt_x, all ? 1 : lost);
}

/* The first sample is kept until the second tells the interval it stands for. */
static void kcf_start(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_sample *z) {
    const ahrs_estimator_state common = s->common;
    ahrs_kcf_init(s, p);
    s->common = common;
    memcpy(s->q_tilt, common.q, sizeof s->q_tilt);
    memcpy(s->q_level, common.q, sizeof s->q_level);
    kcf_face_north(s);
    if (p->common.initialisation == AHRS_INITIALISATION_GIVEN) {
        const ahrs_vec3 down = ahrs_quat_down(ahrs_quat_of(common.q));
        ahrs_vec3_to(s->tilt_force, ahrs_vec3_scale(down, p->common.gravity));
        s->tilt_age = kcf_tau_accel(p);
    }
    ahrs_vec3_to(s->rate, z->rate);
    ahrs_vec3_to(s->seen, z->force);
    ahrs_vec3_to(s->mag, z->mag);
    s->job = kcf_FIRST_KEPT | (z->force_usable ? kcf_SEEN_FORCE : 0) | (z->mag_usable ? kcf_MAG_FRESH : 0);
}

static ahrs_sample kcf_take_first(ahrs_kcf_state *s, ahrs_real dt) {
    const bool force = s->job & kcf_SEEN_FORCE, mag = s->job & kcf_MAG_FRESH;
    s->job = 0;
    return (ahrs_sample){.rate = ahrs_vec3_of(s->rate), .force = ahrs_vec3_of(s->seen), .accel = ahrs_vec3_of(s->seen),
                         .mag = ahrs_vec3_of(s->mag), .force_usable = force, .accel_usable = force,
                         .mag_usable = mag, .dt = dt, .gain_dt = dt};
}

/* Takes over a heading that the common state has turned. */
static void kcf_turn_heading(ahrs_kcf_state *s) {
    const ahrs_quat level_attitude = ahrs_quat_mul(ahrs_quat_of(s->q_level), ahrs_quat_of(s->q_int));
    const ahrs_quat d = ahrs_quat_mul(ahrs_quat_of(s->common.q), ahrs_quat_conj(level_attitude));
    const ahrs_real norm2 = d.w * d.w + d.z * d.z;
    if (norm2 > 0) {
        const ahrs_real k = 1 / ahrs_sqrt(norm2);
        s->heading[0] = k * d.w;
        s->heading[1] = k * d.z;
        kcf_face_north(s);
    }
}

static bool kcf_disturbed(const ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    return s->misfit > p->jump_threshold || s->change >= kcf_FIELD_STRANGE;
}

static void kcf_step(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_sample *z, ahrs_real turn_time) {
    kcf_integrate(s, p, z, turn_time);
    kcf_detect_rest(s, z);
    /* Half a sample, and not quite, so that both precisions round a slow period alike. */
    const ahrs_real half_step = AHRS_C(0.499) * z->dt;
    if (s->block_time + half_step >= p->slow_period) {
        kcf_run_phases(s, p, kcf_PHASES);
        kcf_begin_slow_step(s, p, z);
    }
    const ahrs_real done = p->spread ? ahrs_min((s->block_time + half_step) / p->slow_period, 1) : 1;
    kcf_run_phases(s, p, (int32_t)((ahrs_real)kcf_PHASES * done));
    ahrs_set_condition(&s->common, AHRS_MAG_DISTURBED, kcf_disturbed(s, p));
    ahrs_set_condition(&s->common, AHRS_IMPLAUSIBLE, kcf_implausible(s, p));
}

static inline void ahrs_kcf_init(ahrs_kcf_state *s, const ahrs_kcf_params *p) {
    *s = (ahrs_kcf_state){.q_int = {1}, .q_tilt = {1}, .q_level = {1}, .q_north = {1}, .heading = {1}};
    s->phase = kcf_PHASES;
    s->misfit = 1;
    kcf_reset_covariance(s, p);
    ahrs_estimator_init(&s->common);
}

static inline void ahrs_kcf_update(ahrs_kcf_state *s, const ahrs_kcf_params *p, const ahrs_kcf_inputs *u, ahrs_real dt) {
    ahrs_sample z;
    switch (ahrs_estimator_begin(&s->common, &p->common, u, dt, &z)) {
    case AHRS_WAIT:
        return;
    case AHRS_START:
        kcf_start(s, p, &z);
        return;
    case AHRS_TURN:
        kcf_turn_heading(s);
        break;
    case AHRS_RUN:
        break;
    }
    if (s->job & kcf_FIRST_KEPT) {
        const ahrs_sample first = kcf_take_first(s, ahrs_min(z.dt, p->slow_period));
        kcf_step(s, p, &first, 0);
    }
    const bool held = ahrs_condition(&s->common, AHRS_GYRO_HELD);
    if (z.dt > AHRS_LONGEST_STEP || (s->blind > 0 && !held)) {
        kcf_account_for_blindness(s, p, &z);
    }
    s->blind = held ? s->blind + z.dt : 0;
    kcf_step(s, p, &z, z.dt);
    ahrs_estimator_end(&s->common, &p->common, &z, ahrs_quat_mul(ahrs_quat_of(s->q_north), ahrs_quat_of(s->q_int)));
}

static inline void ahrs_kcf_outputs(const ahrs_kcf_state *s, const ahrs_kcf_params *p, ahrs_kcf_outputs_t *y) {
    const int32_t frame = p->common.frame;
    const ahrs_vec3 gyro = ahrs_vec3_of(s->common.gyro);
    const ahrs_real unit = s->mag_scale > 0 ? 1 / s->mag_scale : 0;
    const ahrs_real sign[3] = {1, frame == AHRS_FRAME_ENU ? -1 : 1, frame == AHRS_FRAME_ENU ? -1 : 1};
    ahrs_estimator_outputs(&s->common, &p->common, ahrs_vec3_of(&s->x[kcf_GYRO]), &y->common);
    ahrs_vec3_to(y->common.rate, ahrs_swap_body(frame, ahrs_vec3_sub(gyro, kcf_gyro_error(s, gyro))));
    y->covariance_reset = ahrs_condition(&s->common, AHRS_COVARIANCE_RESET);
    ahrs_vec3_to(y->hard_iron, ahrs_swap_body(frame, ahrs_vec3_scale(kcf_iron(s), unit)));
    for (int i = 0; i < 9; i++) {
        y->gyro_scale[i] = sign[i / 3] * sign[i % 3] * s->x[kcf_SCALE + i];
    }
    y->mag_latency = s->x[kcf_LATENCY];
    const ahrs_real *const field = s->x + kcf_FIELD, *const block = s->cov + (kcf_ROW + 1) * kcf_FIELD;
    const ahrs_real horizontal2 = field[0] * field[0] + field[1] * field[1];
    y->local_field[0] = unit * ahrs_sqrt(horizontal2);
    y->local_field[1] = unit * field[2];
    const ahrs_real across = field[1] * field[1] * block[0] - 2 * field[0] * field[1] * block[1] +
                             field[0] * field[0] * block[kcf_ROW + 1];
    y->heading_std = horizontal2 > 0 ? ahrs_min(ahrs_sqrt(ahrs_max(across, 0)) / horizontal2, AHRS_PI) : AHRS_PI;
    y->disturbance = s->misfit;
    y->uncalibrated = s->alt_probability;
    y->at_rest = kcf_at_rest(s);
    y->mag_disturbed = kcf_disturbed(s, p);
    y->implausible = kcf_implausible(s, p);
}

/* Generated from models/kcf/kcf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */

#include <string.h>

typedef struct {
    ahrs_kcf_params params;
    ahrs_kcf_inputs inputs;
    ahrs_kcf_outputs_t outputs;
    ahrs_kcf_state state;
} kcf_instance;

static const fmu_variable kcf_variables[] = {
    {"gyro", 1, 3, offsetof(kcf_instance, inputs.gyro), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel", 4, 3, offsetof(kcf_instance, inputs.accel), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"mag", 7, 3, offsetof(kcf_instance, inputs.mag), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel_valid", 10, 1, offsetof(kcf_instance, inputs.accel_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"mag_valid", 11, 1, offsetof(kcf_instance, inputs.mag_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"q", 100, 4, offsetof(kcf_instance, outputs.common.q), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"roll", 104, 1, offsetof(kcf_instance, outputs.common.roll), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"pitch", 105, 1, offsetof(kcf_instance, outputs.common.pitch), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"yaw", 106, 1, offsetof(kcf_instance, outputs.common.yaw), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate", 107, 3, offsetof(kcf_instance, outputs.common.rate), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"gyro_bias", 110, 3, offsetof(kcf_instance, outputs.common.gyro_bias), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"motion_accel", 113, 3, offsetof(kcf_instance, outputs.common.motion_accel), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"status", 119, 1, offsetof(kcf_instance, outputs.common.status), FMU_ENUMERATION, FMU_OUTPUT, 0, 0.0, 9.0},
    {"gyro_held", 120, 1, offsetof(kcf_instance, outputs.common.gyro_held), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"accel_used", 121, 1, offsetof(kcf_instance, outputs.common.accel_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"mag_used", 122, 1, offsetof(kcf_instance, outputs.common.mag_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"covariance_reset", 123, 1, offsetof(kcf_instance, outputs.covariance_reset), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"sample_time", 200, 1, offsetof(kcf_instance, params.common.sample_time), FMU_REAL, FMU_FIXED, 0, 1e-05, 0.5},
    {"frame", 201, 1, offsetof(kcf_instance, params.common.frame), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"declination", 202, 1, offsetof(kcf_instance, params.common.declination), FMU_REAL, FMU_TUNABLE, 0, -3.141592653589793, 3.141592653589793},
    {"gravity", 203, 1, offsetof(kcf_instance, params.common.gravity), FMU_REAL, FMU_FIXED, 0, 0.1, 100.0},
    {"field_reference", 204, 1, offsetof(kcf_instance, params.common.field_reference), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"field_magnitude", 205, 1, offsetof(kcf_instance, params.common.field_magnitude), FMU_REAL, FMU_FIXED, 0, 1e-07, 0.01},
    {"field_dip", 206, 1, offsetof(kcf_instance, params.common.field_dip), FMU_REAL, FMU_FIXED, 0, -1.5707963267948966, 1.5707963267948966},
    {"initialisation", 207, 1, offsetof(kcf_instance, params.common.initialisation), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"q0", 208, 4, offsetof(kcf_instance, params.common.q0), FMU_REAL, FMU_FIXED, 0, -1.1, 1.1},
    {"init_time", 212, 1, offsetof(kcf_instance, params.common.init_time), FMU_REAL, FMU_FIXED, 0, 0.0, 600.0},
    {"motion_compensation", 213, 1, offsetof(kcf_instance, params.common.motion_compensation), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"motion_time_constant", 214, 1, offsetof(kcf_instance, params.common.motion_time_constant), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN | FMU_INFINITY_ALLOWED, 0.0, DBL_MAX},
    {"accel_gating", 215, 1, offsetof(kcf_instance, params.common.accel_gating), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"accel_gate", 216, 1, offsetof(kcf_instance, params.common.accel_gate), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"accel_gate_time", 217, 1, offsetof(kcf_instance, params.common.accel_gate_time), FMU_REAL, FMU_TUNABLE, 0, 0.0, 600.0},
    {"gyro_zero_samples", 220, 1, offsetof(kcf_instance, params.common.gyro_zero_samples), FMU_INTEGER, FMU_FIXED, 0, 0.0, 1000000.0},
    {"gyro_zero_std", 221, 1, offsetof(kcf_instance, params.common.gyro_zero_std), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"gyro_zero_limit", 222, 1, offsetof(kcf_instance, params.common.gyro_zero_limit), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"accel_cutoff", 223, 1, offsetof(kcf_instance, params.common.accel_cutoff), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"mag_offset", 224, 3, offsetof(kcf_instance, params.common.mag_offset), FMU_REAL, FMU_FIXED, 0, -0.01, 0.01},
    {"mag_gain", 227, 3, offsetof(kcf_instance, params.common.mag_gain), FMU_REAL, FMU_FIXED, 0, 0.01, 100.0},
    {"hard_iron", 300, 3, offsetof(kcf_instance, outputs.hard_iron), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"gyro_scale", 303, 9, offsetof(kcf_instance, outputs.gyro_scale), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"mag_latency", 312, 1, offsetof(kcf_instance, outputs.mag_latency), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"local_field", 313, 2, offsetof(kcf_instance, outputs.local_field), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"heading_std", 315, 1, offsetof(kcf_instance, outputs.heading_std), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"disturbance", 316, 1, offsetof(kcf_instance, outputs.disturbance), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"uncalibrated", 317, 1, offsetof(kcf_instance, outputs.uncalibrated), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"at_rest", 318, 1, offsetof(kcf_instance, outputs.at_rest), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"mag_disturbed", 319, 1, offsetof(kcf_instance, outputs.mag_disturbed), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"implausible", 320, 1, offsetof(kcf_instance, outputs.implausible), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"profile", 1000, 1, offsetof(kcf_instance, params.profile), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 2.0},
    {"accel_time_constant", 1001, 1, offsetof(kcf_instance, params.accel_time_constant), FMU_REAL, FMU_FIXED, 0, 0.1, 600.0},
    {"use_mag", 1002, 1, offsetof(kcf_instance, params.use_mag), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"spread", 1003, 1, offsetof(kcf_instance, params.spread), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"slow_period", 1004, 1, offsetof(kcf_instance, params.slow_period), FMU_REAL, FMU_FIXED, 0, 0.005, 0.5},
    {"uncalibrated_odds", 1005, 1, offsetof(kcf_instance, params.uncalibrated_odds), FMU_REAL, FMU_FIXED, 0, 0.0, 1000.0},
    {"uncalibrated_std", 1006, 1, offsetof(kcf_instance, params.uncalibrated_std), FMU_REAL, FMU_FIXED, 0, 0.001, 10.0},
    {"gyro_sampling", 1007, 1, offsetof(kcf_instance, params.gyro_sampling), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"refine", 1008, 1, offsetof(kcf_instance, params.refine), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"bias_std", 1010, 1, offsetof(kcf_instance, params.bias_std), FMU_REAL, FMU_FIXED, 0, 0.0, 1.0},
    {"bias_forget_time", 1011, 1, offsetof(kcf_instance, params.bias_forget_time), FMU_REAL, FMU_FIXED, 0, 1.0, 1000000.0},
    {"bias_limit", 1012, 1, offsetof(kcf_instance, params.bias_limit), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"motion_drift_std", 1013, 1, offsetof(kcf_instance, params.motion_drift_std), FMU_REAL, FMU_FIXED, 0, 1e-06, 1.0},
    {"rest_drift_std", 1014, 1, offsetof(kcf_instance, params.rest_drift_std), FMU_REAL, FMU_FIXED, 0, 1e-06, 1.0},
    {"gyro_scale_std", 1015, 1, offsetof(kcf_instance, params.gyro_scale_std), FMU_REAL, FMU_FIXED, 0, 0.0, 0.1},
    {"gyro_misalignment_std", 1016, 1, offsetof(kcf_instance, params.gyro_misalignment_std), FMU_REAL, FMU_FIXED, 0, 0.0, 0.1},
    {"hard_iron_std", 1020, 1, offsetof(kcf_instance, params.hard_iron_std), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"mag_latency_std", 1021, 1, offsetof(kcf_instance, params.mag_latency_std), FMU_REAL, FMU_FIXED, 0, 0.0, 0.1},
    {"mag_density", 1022, 1, offsetof(kcf_instance, params.mag_density), FMU_REAL, FMU_FIXED, 0, 1e-06, 10.0},
    {"mag_noise", 1023, 1, offsetof(kcf_instance, params.mag_noise), FMU_REAL, FMU_FIXED, 0, 1e-06, 10.0},
    {"mag_rate_noise", 1024, 1, offsetof(kcf_instance, params.mag_rate_noise), FMU_REAL, FMU_FIXED, 0, 0.0, 1.0},
    {"mag_tilt_noise", 1025, 1, offsetof(kcf_instance, params.mag_tilt_noise), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"hard_iron_walk", 1026, 1, offsetof(kcf_instance, params.hard_iron_walk), FMU_REAL, FMU_FIXED, 0, 0.0, 1.0},
    {"field_walk", 1027, 1, offsetof(kcf_instance, params.field_walk), FMU_REAL, FMU_FIXED, 0, 0.0, 1.0},
    {"heading_walk", 1028, 1, offsetof(kcf_instance, params.heading_walk), FMU_REAL, FMU_FIXED, 0, 0.0, 1.0},
    {"heading_rate_walk", 1029, 1, offsetof(kcf_instance, params.heading_rate_walk), FMU_REAL, FMU_FIXED, 0, 0.0, 1.0},
    {"jump_time", 1030, 1, offsetof(kcf_instance, params.jump_time), FMU_REAL, FMU_FIXED, 0, 0.01, 60.0},
    {"jump_threshold", 1031, 1, offsetof(kcf_instance, params.jump_threshold), FMU_REAL, FMU_FIXED, 0, 1.0, 100.0},
    {"jump_hard_iron", 1032, 1, offsetof(kcf_instance, params.jump_hard_iron), FMU_REAL, FMU_FIXED, 0, 0.0, 100.0},
    {"jump_field", 1033, 1, offsetof(kcf_instance, params.jump_field), FMU_REAL, FMU_FIXED, 0, 0.0, 100.0},
    {"outlier_weight", 1034, 1, offsetof(kcf_instance, params.outlier_weight), FMU_REAL, FMU_FIXED, 0, 0.0, 100.0},
};

static bool kcf_limit_0(const void *data) {
    const ahrs_kcf_params *p = &((const kcf_instance *)data)->params;
    return (p->common.initialisation == AHRS_INITIALISATION_SENSORS) || (((((p->common.q0[0] * p->common.q0[0]) + (p->common.q0[1] * p->common.q0[1])) + (p->common.q0[2] * p->common.q0[2])) + (p->common.q0[3] * p->common.q0[3])) > AHRS_C(1e-06));
}

static const uint32_t kcf_limit_0_vrs[] = {207, 208};

static bool kcf_limit_1(const void *data) {
    const ahrs_kcf_params *p = &((const kcf_instance *)data)->params;
    return (!(p->common.motion_compensation)) || (p->common.motion_time_constant < AHRS_INFINITY);
}

static const uint32_t kcf_limit_1_vrs[] = {213, 214};

static bool kcf_limit_2(const void *data) {
    const ahrs_kcf_params *p = &((const kcf_instance *)data)->params;
    return (p->common.accel_cutoff * p->common.sample_time) < AHRS_C(0.4);
}

static const uint32_t kcf_limit_2_vrs[] = {223, 200};

static const fmu_limit kcf_limits[] = {
    {"initialisation == sensors or q0[0]*q0[0] + q0[1]*q0[1] + q0[2]*q0[2] + q0[3]*q0[3] > 1e-6", "q0 has no direction: give a quaternion of about unit length", false, kcf_limit_0_vrs, 2, kcf_limit_0},
    {"not motion_compensation or motion_time_constant < inf", "tilt is not observed at all with an infinite motion_time_constant: use it for bursts of less than half a minute only", true, kcf_limit_1_vrs, 2, kcf_limit_1},
    {"accel_cutoff*sample_time < 0.4", "the low-pass needs more than two samples per period: lower accel_cutoff or sample_time", false, kcf_limit_2_vrs, 2, kcf_limit_2},
};

static inline void ahrs_kcf_defaults(ahrs_kcf_params *p, ahrs_kcf_inputs *u) {
    memset(p, 0, sizeof *p);
    memset(u, 0, sizeof *u);
    p->common.sample_time = AHRS_C(0.01);
    p->common.frame = 0;
    p->common.declination = AHRS_C(0.0);
    p->common.gravity = AHRS_C(9.80665);
    p->common.field_reference = 0;
    p->common.field_magnitude = AHRS_C(5e-05);
    p->common.field_dip = AHRS_C(1.1);
    p->common.initialisation = 0;
    p->common.q0[0] = AHRS_C(1.0);
    p->common.q0[1] = AHRS_C(0.0);
    p->common.q0[2] = AHRS_C(0.0);
    p->common.q0[3] = AHRS_C(0.0);
    p->common.init_time = AHRS_C(0.0);
    p->common.motion_compensation = 0;
    p->common.motion_time_constant = AHRS_C(1.0);
    p->common.accel_gating = 0;
    p->common.accel_gate = AHRS_C(1.0);
    p->common.accel_gate_time = AHRS_C(10.0);
    p->common.gyro_zero_samples = 0;
    p->common.gyro_zero_std = AHRS_C(0.02);
    p->common.gyro_zero_limit = AHRS_C(0.1);
    p->common.accel_cutoff = AHRS_C(0.0);
    p->common.mag_offset[0] = AHRS_C(0.0);
    p->common.mag_offset[1] = AHRS_C(0.0);
    p->common.mag_offset[2] = AHRS_C(0.0);
    p->common.mag_gain[0] = AHRS_C(1.0);
    p->common.mag_gain[1] = AHRS_C(1.0);
    p->common.mag_gain[2] = AHRS_C(1.0);
    p->profile = 0;
    p->accel_time_constant = AHRS_C(3.5);
    p->use_mag = 1;
    p->spread = 0;
    p->slow_period = AHRS_C(0.05);
    p->uncalibrated_odds = AHRS_C(0.3329);
    p->uncalibrated_std = AHRS_C(0.2);
    p->gyro_sampling = 0;
    p->refine = 1;
    p->bias_std = AHRS_C(0.017453292519943295);
    p->bias_forget_time = AHRS_C(100.0);
    p->bias_limit = AHRS_C(0.03490658503988659);
    p->motion_drift_std = AHRS_C(0.0017453292519943296);
    p->rest_drift_std = AHRS_C(0.0005235987755982988);
    p->gyro_scale_std = AHRS_C(0.006);
    p->gyro_misalignment_std = AHRS_C(0.004);
    p->hard_iron_std = AHRS_C(0.02);
    p->mag_latency_std = AHRS_C(0.01);
    p->mag_density = AHRS_C(0.1);
    p->mag_noise = AHRS_C(0.03);
    p->mag_rate_noise = AHRS_C(0.005);
    p->mag_tilt_noise = AHRS_C(0.3);
    p->hard_iron_walk = AHRS_C(0.0003);
    p->field_walk = AHRS_C(0.0002);
    p->heading_walk = AHRS_C(0.001);
    p->heading_rate_walk = AHRS_C(0.0015);
    p->jump_time = AHRS_C(0.5);
    p->jump_threshold = AHRS_C(2.0);
    p->jump_hard_iron = AHRS_C(1.5);
    p->jump_field = AHRS_C(0.01);
    p->outlier_weight = AHRS_C(0.5);
    u->gyro[0] = AHRS_C(0.0);
    u->gyro[1] = AHRS_C(0.0);
    u->gyro[2] = AHRS_C(0.0);
    u->accel[0] = AHRS_C(0.0);
    u->accel[1] = AHRS_C(0.0);
    u->accel[2] = AHRS_C(0.0);
    u->mag[0] = AHRS_C(0.0);
    u->mag[1] = AHRS_C(0.0);
    u->mag[2] = AHRS_C(0.0);
    u->accel_valid = 1;
    u->mag_valid = 1;
}

static void kcf_defaults(void *data) {
    kcf_instance *i = data;
    memset(i, 0, sizeof *i);
    ahrs_kcf_defaults(&i->params, &i->inputs);
}

static void kcf_init(void *data) {
    kcf_instance *i = data;
    ahrs_kcf_init(&i->state, &i->params);
}

static void kcf_update(void *data, ahrs_real dt) {
    kcf_instance *i = data;
    ahrs_kcf_update(&i->state, &i->params, &i->inputs, dt);
}

static void kcf_compute_outputs(void *data) {
    kcf_instance *i = data;
    ahrs_kcf_outputs(&i->state, &i->params, &i->outputs);
}

static const fmu_model ahrs_kcf_model = {
    "kcf", "KCF", sizeof(kcf_instance), {offsetof(kcf_instance, params), sizeof(((kcf_instance *)0)->params)}, {offsetof(kcf_instance, inputs), sizeof(((kcf_instance *)0)->inputs)}, {offsetof(kcf_instance, outputs), sizeof(((kcf_instance *)0)->outputs)}, {offsetof(kcf_instance, state), sizeof(((kcf_instance *)0)->state)},
    offsetof(kcf_instance, params.common.sample_time), 0.01,
    kcf_variables, sizeof kcf_variables / sizeof kcf_variables[0],
    kcf_limits, sizeof kcf_limits / sizeof kcf_limits[0],
    kcf_defaults, kcf_init, kcf_update, kcf_compute_outputs};

/* Generated from models/mahony/mahony.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_MAHONY_H
#define AHRS_MAHONY_H


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
static inline void ahrs_mahony_defaults(ahrs_mahony_params *p, ahrs_mahony_inputs *u);

/* State as before the first sample. */
static inline void ahrs_mahony_init(ahrs_mahony_state *s, const ahrs_mahony_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
static inline void ahrs_mahony_update(ahrs_mahony_state *s, const ahrs_mahony_params *p, const ahrs_mahony_inputs *u, ahrs_real dt);

static inline void ahrs_mahony_outputs(const ahrs_mahony_state *s, const ahrs_mahony_params *p, ahrs_mahony_outputs_t *y);

#endif
/* One sample of Mahony's filter with decoupled heading (docs/algorithms.md section 2). */
#ifndef AHRS_MAHONY_STEP_H
#define AHRS_MAHONY_STEP_H


typedef struct {
    ahrs_real kp, ki, bias_limit;
} ahrs_mahony_gains;

/* The error is that of the predicted attitude; rate, bias and correction then turn the attitude together. */
static inline ahrs_quat ahrs_mahony_step(ahrs_quat q, ahrs_real bias[3], ahrs_mahony_gains k, const ahrs_sample *z) {
    const ahrs_vec3 before = ahrs_vec3_of(bias);
    const ahrs_vec3 turn = ahrs_vec3_scale(ahrs_vec3_sub(z->rate, before), z->dt);
    const ahrs_vec3 e = ahrs_decoupled_error(ahrs_quat_to_mat3(ahrs_quat_turn(q, turn)), z);
    const ahrs_vec3 after = ahrs_vec3_limited(ahrs_vec3_add_scaled(before, -k.ki * z->gain_dt, e), k.bias_limit);
    const ahrs_vec3 rate = ahrs_vec3_scale(ahrs_vec3_sub(z->rate, after), z->dt);
    const ahrs_quat corrected = ahrs_quat_turn(q, ahrs_vec3_add_scaled(rate, k.kp * z->gain_dt, e));
    ahrs_vec3_to(bias, after);
    return ahrs_quat_refine(corrected);
}

#endif
/* Mahony's complementary filter with decoupled heading (docs/algorithms.md section 2). */

static inline void ahrs_mahony_init(ahrs_mahony_state *s, const ahrs_mahony_params *p) {
    (void)p;
    *s = (ahrs_mahony_state){.bias = {0}};
    ahrs_estimator_init(&s->common);
}

static inline void ahrs_mahony_update(ahrs_mahony_state *s, const ahrs_mahony_params *p, const ahrs_mahony_inputs *u, ahrs_real dt) {
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

static inline void ahrs_mahony_outputs(const ahrs_mahony_state *s, const ahrs_mahony_params *p, ahrs_mahony_outputs_t *y) {
    ahrs_estimator_outputs(&s->common, &p->common, ahrs_vec3_of(s->bias), &y->common);
}

/* Generated from models/mahony/mahony.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */

#include <string.h>

typedef struct {
    ahrs_mahony_params params;
    ahrs_mahony_inputs inputs;
    ahrs_mahony_outputs_t outputs;
    ahrs_mahony_state state;
} mahony_instance;

static const fmu_variable mahony_variables[] = {
    {"gyro", 1, 3, offsetof(mahony_instance, inputs.gyro), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel", 4, 3, offsetof(mahony_instance, inputs.accel), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"mag", 7, 3, offsetof(mahony_instance, inputs.mag), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel_valid", 10, 1, offsetof(mahony_instance, inputs.accel_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"mag_valid", 11, 1, offsetof(mahony_instance, inputs.mag_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"q", 100, 4, offsetof(mahony_instance, outputs.common.q), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"roll", 104, 1, offsetof(mahony_instance, outputs.common.roll), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"pitch", 105, 1, offsetof(mahony_instance, outputs.common.pitch), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"yaw", 106, 1, offsetof(mahony_instance, outputs.common.yaw), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate", 107, 3, offsetof(mahony_instance, outputs.common.rate), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"gyro_bias", 110, 3, offsetof(mahony_instance, outputs.common.gyro_bias), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"motion_accel", 113, 3, offsetof(mahony_instance, outputs.common.motion_accel), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"status", 119, 1, offsetof(mahony_instance, outputs.common.status), FMU_ENUMERATION, FMU_OUTPUT, 0, 0.0, 9.0},
    {"gyro_held", 120, 1, offsetof(mahony_instance, outputs.common.gyro_held), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"accel_used", 121, 1, offsetof(mahony_instance, outputs.common.accel_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"mag_used", 122, 1, offsetof(mahony_instance, outputs.common.mag_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"sample_time", 200, 1, offsetof(mahony_instance, params.common.sample_time), FMU_REAL, FMU_FIXED, 0, 1e-05, 0.5},
    {"frame", 201, 1, offsetof(mahony_instance, params.common.frame), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"declination", 202, 1, offsetof(mahony_instance, params.common.declination), FMU_REAL, FMU_TUNABLE, 0, -3.141592653589793, 3.141592653589793},
    {"gravity", 203, 1, offsetof(mahony_instance, params.common.gravity), FMU_REAL, FMU_FIXED, 0, 0.1, 100.0},
    {"field_reference", 204, 1, offsetof(mahony_instance, params.common.field_reference), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"field_magnitude", 205, 1, offsetof(mahony_instance, params.common.field_magnitude), FMU_REAL, FMU_FIXED, 0, 1e-07, 0.01},
    {"field_dip", 206, 1, offsetof(mahony_instance, params.common.field_dip), FMU_REAL, FMU_FIXED, 0, -1.5707963267948966, 1.5707963267948966},
    {"initialisation", 207, 1, offsetof(mahony_instance, params.common.initialisation), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"q0", 208, 4, offsetof(mahony_instance, params.common.q0), FMU_REAL, FMU_FIXED, 0, -1.1, 1.1},
    {"init_time", 212, 1, offsetof(mahony_instance, params.common.init_time), FMU_REAL, FMU_FIXED, 0, 0.0, 600.0},
    {"motion_compensation", 213, 1, offsetof(mahony_instance, params.common.motion_compensation), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"motion_time_constant", 214, 1, offsetof(mahony_instance, params.common.motion_time_constant), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN | FMU_INFINITY_ALLOWED, 0.0, DBL_MAX},
    {"accel_gating", 215, 1, offsetof(mahony_instance, params.common.accel_gating), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"accel_gate", 216, 1, offsetof(mahony_instance, params.common.accel_gate), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"accel_gate_time", 217, 1, offsetof(mahony_instance, params.common.accel_gate_time), FMU_REAL, FMU_TUNABLE, 0, 0.0, 600.0},
    {"gyro_zero_samples", 220, 1, offsetof(mahony_instance, params.common.gyro_zero_samples), FMU_INTEGER, FMU_FIXED, 0, 0.0, 1000000.0},
    {"gyro_zero_std", 221, 1, offsetof(mahony_instance, params.common.gyro_zero_std), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"gyro_zero_limit", 222, 1, offsetof(mahony_instance, params.common.gyro_zero_limit), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"accel_cutoff", 223, 1, offsetof(mahony_instance, params.common.accel_cutoff), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"mag_offset", 224, 3, offsetof(mahony_instance, params.common.mag_offset), FMU_REAL, FMU_FIXED, 0, -0.01, 0.01},
    {"mag_gain", 227, 3, offsetof(mahony_instance, params.common.mag_gain), FMU_REAL, FMU_FIXED, 0, 0.01, 100.0},
    {"kp", 1000, 1, offsetof(mahony_instance, params.kp), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000.0},
    {"ki", 1001, 1, offsetof(mahony_instance, params.ki), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000000.0},
    {"bias_limit", 1003, 1, offsetof(mahony_instance, params.bias_limit), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
};

static bool mahony_limit_0(const void *data) {
    const ahrs_mahony_params *p = &((const mahony_instance *)data)->params;
    return (p->common.initialisation == AHRS_INITIALISATION_SENSORS) || (((((p->common.q0[0] * p->common.q0[0]) + (p->common.q0[1] * p->common.q0[1])) + (p->common.q0[2] * p->common.q0[2])) + (p->common.q0[3] * p->common.q0[3])) > AHRS_C(1e-06));
}

static const uint32_t mahony_limit_0_vrs[] = {207, 208};

static bool mahony_limit_1(const void *data) {
    const ahrs_mahony_params *p = &((const mahony_instance *)data)->params;
    return (!(p->common.motion_compensation)) || (p->common.motion_time_constant < AHRS_INFINITY);
}

static const uint32_t mahony_limit_1_vrs[] = {213, 214};

static bool mahony_limit_2(const void *data) {
    const ahrs_mahony_params *p = &((const mahony_instance *)data)->params;
    return (p->common.accel_cutoff * p->common.sample_time) < AHRS_C(0.4);
}

static const uint32_t mahony_limit_2_vrs[] = {223, 200};

static bool mahony_limit_3(const void *data) {
    const ahrs_mahony_params *p = &((const mahony_instance *)data)->params;
    return (p->kp * p->common.sample_time) < 1;
}

static const uint32_t mahony_limit_3_vrs[] = {1000, 200};

static bool mahony_limit_4(const void *data) {
    const ahrs_mahony_params *p = &((const mahony_instance *)data)->params;
    return ((p->ki * p->common.sample_time) * p->common.sample_time) < (4 - ((2 * p->kp) * p->common.sample_time));
}

static const uint32_t mahony_limit_4_vrs[] = {200, 1001, 1000};

static bool mahony_limit_5(const void *data) {
    const ahrs_mahony_params *p = &((const mahony_instance *)data)->params;
    return (2 * p->ki) <= (p->kp * p->kp);
}

static const uint32_t mahony_limit_5_vrs[] = {1001, 1000};

static const fmu_limit mahony_limits[] = {
    {"initialisation == sensors or q0[0]*q0[0] + q0[1]*q0[1] + q0[2]*q0[2] + q0[3]*q0[3] > 1e-6", "q0 has no direction: give a quaternion of about unit length", false, mahony_limit_0_vrs, 2, mahony_limit_0},
    {"not motion_compensation or motion_time_constant < inf", "tilt is not observed at all with an infinite motion_time_constant: use it for bursts of less than half a minute only", true, mahony_limit_1_vrs, 2, mahony_limit_1},
    {"accel_cutoff*sample_time < 0.4", "the low-pass needs more than two samples per period: lower accel_cutoff or sample_time", false, mahony_limit_2_vrs, 2, mahony_limit_2},
    {"kp*sample_time < 1", "the filter would correct more than the whole error in one sample: lower kp or sample_time", false, mahony_limit_3_vrs, 2, mahony_limit_3},
    {"ki*sample_time*sample_time < 4 - 2*kp*sample_time", "the sampled loop is unstable: lower ki or sample_time", false, mahony_limit_4_vrs, 3, mahony_limit_4},
    {"2*ki <= kp*kp", "the loop overshoots, its damping is below 0.7: lower ki or raise kp", true, mahony_limit_5_vrs, 2, mahony_limit_5},
};

static inline void ahrs_mahony_defaults(ahrs_mahony_params *p, ahrs_mahony_inputs *u) {
    memset(p, 0, sizeof *p);
    memset(u, 0, sizeof *u);
    p->common.sample_time = AHRS_C(0.01);
    p->common.frame = 0;
    p->common.declination = AHRS_C(0.0);
    p->common.gravity = AHRS_C(9.80665);
    p->common.field_reference = 0;
    p->common.field_magnitude = AHRS_C(5e-05);
    p->common.field_dip = AHRS_C(1.1);
    p->common.initialisation = 0;
    p->common.q0[0] = AHRS_C(1.0);
    p->common.q0[1] = AHRS_C(0.0);
    p->common.q0[2] = AHRS_C(0.0);
    p->common.q0[3] = AHRS_C(0.0);
    p->common.init_time = AHRS_C(0.0);
    p->common.motion_compensation = 0;
    p->common.motion_time_constant = AHRS_C(1.0);
    p->common.accel_gating = 0;
    p->common.accel_gate = AHRS_C(1.0);
    p->common.accel_gate_time = AHRS_C(10.0);
    p->common.gyro_zero_samples = 0;
    p->common.gyro_zero_std = AHRS_C(0.02);
    p->common.gyro_zero_limit = AHRS_C(0.1);
    p->common.accel_cutoff = AHRS_C(0.0);
    p->common.mag_offset[0] = AHRS_C(0.0);
    p->common.mag_offset[1] = AHRS_C(0.0);
    p->common.mag_offset[2] = AHRS_C(0.0);
    p->common.mag_gain[0] = AHRS_C(1.0);
    p->common.mag_gain[1] = AHRS_C(1.0);
    p->common.mag_gain[2] = AHRS_C(1.0);
    p->kp = AHRS_C(1.0);
    p->ki = AHRS_C(0.1);
    p->bias_limit = AHRS_C(0.2);
    u->gyro[0] = AHRS_C(0.0);
    u->gyro[1] = AHRS_C(0.0);
    u->gyro[2] = AHRS_C(0.0);
    u->accel[0] = AHRS_C(0.0);
    u->accel[1] = AHRS_C(0.0);
    u->accel[2] = AHRS_C(0.0);
    u->mag[0] = AHRS_C(0.0);
    u->mag[1] = AHRS_C(0.0);
    u->mag[2] = AHRS_C(0.0);
    u->accel_valid = 1;
    u->mag_valid = 1;
}

static void mahony_defaults(void *data) {
    mahony_instance *i = data;
    memset(i, 0, sizeof *i);
    ahrs_mahony_defaults(&i->params, &i->inputs);
}

static void mahony_init(void *data) {
    mahony_instance *i = data;
    ahrs_mahony_init(&i->state, &i->params);
}

static void mahony_update(void *data, ahrs_real dt) {
    mahony_instance *i = data;
    ahrs_mahony_update(&i->state, &i->params, &i->inputs, dt);
}

static void mahony_compute_outputs(void *data) {
    mahony_instance *i = data;
    ahrs_mahony_outputs(&i->state, &i->params, &i->outputs);
}

static const fmu_model ahrs_mahony_model = {
    "mahony", "Mahony", sizeof(mahony_instance), {offsetof(mahony_instance, params), sizeof(((mahony_instance *)0)->params)}, {offsetof(mahony_instance, inputs), sizeof(((mahony_instance *)0)->inputs)}, {offsetof(mahony_instance, outputs), sizeof(((mahony_instance *)0)->outputs)}, {offsetof(mahony_instance, state), sizeof(((mahony_instance *)0)->state)},
    offsetof(mahony_instance, params.common.sample_time), 0.01,
    mahony_variables, sizeof mahony_variables / sizeof mahony_variables[0],
    mahony_limits, sizeof mahony_limits / sizeof mahony_limits[0],
    mahony_defaults, mahony_init, mahony_update, mahony_compute_outputs};

/* Generated from models/mahony_ekf/mahony_ekf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_MAHONY_EKF_H
#define AHRS_MAHONY_EKF_H


/* Mahony's filter, smoothed by an extended Kalman filter. Mahony's filter runs by itself, and its quaternion
 * is the measurement of an extended Kalman filter on the quaternion. That filter adds a fast low-pass, whose
 * corner is gyro_noise/attitude_noise; the accuracy is Mahony's. The covariance is what the filter believes:
 * it does not know that its measurement comes from the same gyroscope.
 */

typedef struct {
    ahrs_estimator_params common;
    ahrs_real kp; /* Proportional gain: about the crossover frequency between accelerometer/magnetometer and gyroscope [rad/s] */
    ahrs_real ki; /* Integral gain: how fast the gyroscope bias is learned; 0 switches that off [rad2/s2] */
    ahrs_real bias_limit; /* Largest gyroscope bias that is learned, per axis [rad/s] */
    ahrs_real gyro_noise; /* White noise of the gyroscope, rad/s/sqrt(Hz) */
    ahrs_real attitude_noise; /* White noise of the attitude from the Mahony filter at rest, rad/sqrt(Hz) */
    ahrs_real accel_distrust; /* Relative growth of the variance of that attitude with the deviation of the specific force from gravity [s2/m] */
    ahrs_real motion_noise; /* Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation */
    ahrs_real initial_attitude_std; /* Standard deviation of the first attitude [rad] */
    int32_t bias_feed; /* Predict with the rate without Mahony's bias; false is the printed form, which lets a bias error back in */
} ahrs_mahony_ekf_params;

typedef ahrs_estimator_inputs ahrs_mahony_ekf_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
    ahrs_real attitude_std[3]; /* Standard deviation of the attitude error about the body axes, as the filter believes it [rad] */
    int32_t covariance_reset; /* The covariance was reset at the last sample */
} ahrs_mahony_ekf_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real covariance[10]; /* Covariance of the quaternion: lower triangle, row by row [1] */
    ahrs_real mahony[4]; /* Attitude of the Mahony filter [1] */
    ahrs_real bias[3]; /* Gyroscope bias of the Mahony filter [rad/s] */
} ahrs_mahony_ekf_state;

/* Parameters and inputs to their defaults. */
static inline void ahrs_mahony_ekf_defaults(ahrs_mahony_ekf_params *p, ahrs_mahony_ekf_inputs *u);

/* State as before the first sample. */
static inline void ahrs_mahony_ekf_init(ahrs_mahony_ekf_state *s, const ahrs_mahony_ekf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
static inline void ahrs_mahony_ekf_update(ahrs_mahony_ekf_state *s, const ahrs_mahony_ekf_params *p, const ahrs_mahony_ekf_inputs *u, ahrs_real dt);

static inline void ahrs_mahony_ekf_outputs(const ahrs_mahony_ekf_state *s, const ahrs_mahony_ekf_params *p, ahrs_mahony_ekf_outputs_t *y);

#endif
/* Mahony's filter, smoothed by an extended Kalman filter (docs/algorithms.md section 2). */

static ahrs_quaternion_ekf mahony_ekf_settings(const ahrs_mahony_ekf_params *p) {
    return (ahrs_quaternion_ekf){p->gyro_noise, p->attitude_noise, p->accel_distrust, p->motion_noise,
                                 p->initial_attitude_std};
}

static inline void ahrs_mahony_ekf_init(ahrs_mahony_ekf_state *s, const ahrs_mahony_ekf_params *p) {
    const ahrs_quaternion_ekf k = mahony_ekf_settings(p);
    *s = (ahrs_mahony_ekf_state){.mahony = {1, 0, 0, 0}};
    ahrs_estimator_init(&s->common);
    ahrs_quaternion_ekf_start(&k, s->covariance);
}

static inline void ahrs_mahony_ekf_update(ahrs_mahony_ekf_state *s, const ahrs_mahony_ekf_params *p, const ahrs_mahony_ekf_inputs *u,
                            ahrs_real dt) {
    const ahrs_quaternion_ekf k = mahony_ekf_settings(p);
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

static inline void ahrs_mahony_ekf_outputs(const ahrs_mahony_ekf_state *s, const ahrs_mahony_ekf_params *p,
                             ahrs_mahony_ekf_outputs_t *y) {
    ahrs_estimator_outputs(&s->common, &p->common, ahrs_vec3_of(s->bias), &y->common);
    ahrs_vec3_to(y->attitude_std, ahrs_quat_covariance_std(s->covariance, ahrs_quat_of(s->common.q)));
    y->covariance_reset = ahrs_condition(&s->common, AHRS_COVARIANCE_RESET);
}

/* Generated from models/mahony_ekf/mahony_ekf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */

#include <string.h>

typedef struct {
    ahrs_mahony_ekf_params params;
    ahrs_mahony_ekf_inputs inputs;
    ahrs_mahony_ekf_outputs_t outputs;
    ahrs_mahony_ekf_state state;
} mahony_ekf_instance;

static const fmu_variable mahony_ekf_variables[] = {
    {"gyro", 1, 3, offsetof(mahony_ekf_instance, inputs.gyro), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel", 4, 3, offsetof(mahony_ekf_instance, inputs.accel), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"mag", 7, 3, offsetof(mahony_ekf_instance, inputs.mag), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel_valid", 10, 1, offsetof(mahony_ekf_instance, inputs.accel_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"mag_valid", 11, 1, offsetof(mahony_ekf_instance, inputs.mag_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"q", 100, 4, offsetof(mahony_ekf_instance, outputs.common.q), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"roll", 104, 1, offsetof(mahony_ekf_instance, outputs.common.roll), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"pitch", 105, 1, offsetof(mahony_ekf_instance, outputs.common.pitch), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"yaw", 106, 1, offsetof(mahony_ekf_instance, outputs.common.yaw), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate", 107, 3, offsetof(mahony_ekf_instance, outputs.common.rate), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"gyro_bias", 110, 3, offsetof(mahony_ekf_instance, outputs.common.gyro_bias), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"motion_accel", 113, 3, offsetof(mahony_ekf_instance, outputs.common.motion_accel), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"attitude_std", 116, 3, offsetof(mahony_ekf_instance, outputs.attitude_std), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"status", 119, 1, offsetof(mahony_ekf_instance, outputs.common.status), FMU_ENUMERATION, FMU_OUTPUT, 0, 0.0, 9.0},
    {"gyro_held", 120, 1, offsetof(mahony_ekf_instance, outputs.common.gyro_held), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"accel_used", 121, 1, offsetof(mahony_ekf_instance, outputs.common.accel_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"mag_used", 122, 1, offsetof(mahony_ekf_instance, outputs.common.mag_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"covariance_reset", 123, 1, offsetof(mahony_ekf_instance, outputs.covariance_reset), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"sample_time", 200, 1, offsetof(mahony_ekf_instance, params.common.sample_time), FMU_REAL, FMU_FIXED, 0, 1e-05, 0.5},
    {"frame", 201, 1, offsetof(mahony_ekf_instance, params.common.frame), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"declination", 202, 1, offsetof(mahony_ekf_instance, params.common.declination), FMU_REAL, FMU_TUNABLE, 0, -3.141592653589793, 3.141592653589793},
    {"gravity", 203, 1, offsetof(mahony_ekf_instance, params.common.gravity), FMU_REAL, FMU_FIXED, 0, 0.1, 100.0},
    {"field_reference", 204, 1, offsetof(mahony_ekf_instance, params.common.field_reference), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"field_magnitude", 205, 1, offsetof(mahony_ekf_instance, params.common.field_magnitude), FMU_REAL, FMU_FIXED, 0, 1e-07, 0.01},
    {"field_dip", 206, 1, offsetof(mahony_ekf_instance, params.common.field_dip), FMU_REAL, FMU_FIXED, 0, -1.5707963267948966, 1.5707963267948966},
    {"initialisation", 207, 1, offsetof(mahony_ekf_instance, params.common.initialisation), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"q0", 208, 4, offsetof(mahony_ekf_instance, params.common.q0), FMU_REAL, FMU_FIXED, 0, -1.1, 1.1},
    {"init_time", 212, 1, offsetof(mahony_ekf_instance, params.common.init_time), FMU_REAL, FMU_FIXED, 0, 0.0, 600.0},
    {"motion_compensation", 213, 1, offsetof(mahony_ekf_instance, params.common.motion_compensation), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"motion_time_constant", 214, 1, offsetof(mahony_ekf_instance, params.common.motion_time_constant), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN | FMU_INFINITY_ALLOWED, 0.0, DBL_MAX},
    {"accel_gating", 215, 1, offsetof(mahony_ekf_instance, params.common.accel_gating), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"accel_gate", 216, 1, offsetof(mahony_ekf_instance, params.common.accel_gate), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"accel_gate_time", 217, 1, offsetof(mahony_ekf_instance, params.common.accel_gate_time), FMU_REAL, FMU_TUNABLE, 0, 0.0, 600.0},
    {"gyro_zero_samples", 220, 1, offsetof(mahony_ekf_instance, params.common.gyro_zero_samples), FMU_INTEGER, FMU_FIXED, 0, 0.0, 1000000.0},
    {"gyro_zero_std", 221, 1, offsetof(mahony_ekf_instance, params.common.gyro_zero_std), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"gyro_zero_limit", 222, 1, offsetof(mahony_ekf_instance, params.common.gyro_zero_limit), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"accel_cutoff", 223, 1, offsetof(mahony_ekf_instance, params.common.accel_cutoff), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"mag_offset", 224, 3, offsetof(mahony_ekf_instance, params.common.mag_offset), FMU_REAL, FMU_FIXED, 0, -0.01, 0.01},
    {"mag_gain", 227, 3, offsetof(mahony_ekf_instance, params.common.mag_gain), FMU_REAL, FMU_FIXED, 0, 0.01, 100.0},
    {"kp", 1000, 1, offsetof(mahony_ekf_instance, params.kp), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000.0},
    {"ki", 1001, 1, offsetof(mahony_ekf_instance, params.ki), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000000.0},
    {"bias_limit", 1003, 1, offsetof(mahony_ekf_instance, params.bias_limit), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"gyro_noise", 1040, 1, offsetof(mahony_ekf_instance, params.gyro_noise), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN, 0.0, 100.0},
    {"attitude_noise", 1045, 1, offsetof(mahony_ekf_instance, params.attitude_noise), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN, 0.0, 100.0},
    {"motion_noise", 1047, 1, offsetof(mahony_ekf_instance, params.motion_noise), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000.0},
    {"initial_attitude_std", 1048, 1, offsetof(mahony_ekf_instance, params.initial_attitude_std), FMU_REAL, FMU_FIXED, 0, 0.0001, 10.0},
    {"accel_distrust", 1050, 1, offsetof(mahony_ekf_instance, params.accel_distrust), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"bias_feed", 1060, 1, offsetof(mahony_ekf_instance, params.bias_feed), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
};

static bool mahony_ekf_limit_0(const void *data) {
    const ahrs_mahony_ekf_params *p = &((const mahony_ekf_instance *)data)->params;
    return (p->common.initialisation == AHRS_INITIALISATION_SENSORS) || (((((p->common.q0[0] * p->common.q0[0]) + (p->common.q0[1] * p->common.q0[1])) + (p->common.q0[2] * p->common.q0[2])) + (p->common.q0[3] * p->common.q0[3])) > AHRS_C(1e-06));
}

static const uint32_t mahony_ekf_limit_0_vrs[] = {207, 208};

static bool mahony_ekf_limit_1(const void *data) {
    const ahrs_mahony_ekf_params *p = &((const mahony_ekf_instance *)data)->params;
    return (!(p->common.motion_compensation)) || (p->common.motion_time_constant < AHRS_INFINITY);
}

static const uint32_t mahony_ekf_limit_1_vrs[] = {213, 214};

static bool mahony_ekf_limit_2(const void *data) {
    const ahrs_mahony_ekf_params *p = &((const mahony_ekf_instance *)data)->params;
    return (p->common.accel_cutoff * p->common.sample_time) < AHRS_C(0.4);
}

static const uint32_t mahony_ekf_limit_2_vrs[] = {223, 200};

static bool mahony_ekf_limit_3(const void *data) {
    const ahrs_mahony_ekf_params *p = &((const mahony_ekf_instance *)data)->params;
    return (p->kp * p->common.sample_time) < 1;
}

static const uint32_t mahony_ekf_limit_3_vrs[] = {1000, 200};

static bool mahony_ekf_limit_4(const void *data) {
    const ahrs_mahony_ekf_params *p = &((const mahony_ekf_instance *)data)->params;
    return ((p->ki * p->common.sample_time) * p->common.sample_time) < (4 - ((2 * p->kp) * p->common.sample_time));
}

static const uint32_t mahony_ekf_limit_4_vrs[] = {200, 1001, 1000};

static bool mahony_ekf_limit_5(const void *data) {
    const ahrs_mahony_ekf_params *p = &((const mahony_ekf_instance *)data)->params;
    return (2 * p->ki) <= (p->kp * p->kp);
}

static const uint32_t mahony_ekf_limit_5_vrs[] = {1001, 1000};

static const fmu_limit mahony_ekf_limits[] = {
    {"initialisation == sensors or q0[0]*q0[0] + q0[1]*q0[1] + q0[2]*q0[2] + q0[3]*q0[3] > 1e-6", "q0 has no direction: give a quaternion of about unit length", false, mahony_ekf_limit_0_vrs, 2, mahony_ekf_limit_0},
    {"not motion_compensation or motion_time_constant < inf", "tilt is not observed at all with an infinite motion_time_constant: use it for bursts of less than half a minute only", true, mahony_ekf_limit_1_vrs, 2, mahony_ekf_limit_1},
    {"accel_cutoff*sample_time < 0.4", "the low-pass needs more than two samples per period: lower accel_cutoff or sample_time", false, mahony_ekf_limit_2_vrs, 2, mahony_ekf_limit_2},
    {"kp*sample_time < 1", "the filter would correct more than the whole error in one sample: lower kp or sample_time", false, mahony_ekf_limit_3_vrs, 2, mahony_ekf_limit_3},
    {"ki*sample_time*sample_time < 4 - 2*kp*sample_time", "the sampled loop is unstable: lower ki or sample_time", false, mahony_ekf_limit_4_vrs, 3, mahony_ekf_limit_4},
    {"2*ki <= kp*kp", "the loop overshoots, its damping is below 0.7: lower ki or raise kp", true, mahony_ekf_limit_5_vrs, 2, mahony_ekf_limit_5},
};

static inline void ahrs_mahony_ekf_defaults(ahrs_mahony_ekf_params *p, ahrs_mahony_ekf_inputs *u) {
    memset(p, 0, sizeof *p);
    memset(u, 0, sizeof *u);
    p->common.sample_time = AHRS_C(0.01);
    p->common.frame = 0;
    p->common.declination = AHRS_C(0.0);
    p->common.gravity = AHRS_C(9.80665);
    p->common.field_reference = 0;
    p->common.field_magnitude = AHRS_C(5e-05);
    p->common.field_dip = AHRS_C(1.1);
    p->common.initialisation = 0;
    p->common.q0[0] = AHRS_C(1.0);
    p->common.q0[1] = AHRS_C(0.0);
    p->common.q0[2] = AHRS_C(0.0);
    p->common.q0[3] = AHRS_C(0.0);
    p->common.init_time = AHRS_C(0.0);
    p->common.motion_compensation = 0;
    p->common.motion_time_constant = AHRS_C(1.0);
    p->common.accel_gating = 0;
    p->common.accel_gate = AHRS_C(1.0);
    p->common.accel_gate_time = AHRS_C(10.0);
    p->common.gyro_zero_samples = 0;
    p->common.gyro_zero_std = AHRS_C(0.02);
    p->common.gyro_zero_limit = AHRS_C(0.1);
    p->common.accel_cutoff = AHRS_C(0.0);
    p->common.mag_offset[0] = AHRS_C(0.0);
    p->common.mag_offset[1] = AHRS_C(0.0);
    p->common.mag_offset[2] = AHRS_C(0.0);
    p->common.mag_gain[0] = AHRS_C(1.0);
    p->common.mag_gain[1] = AHRS_C(1.0);
    p->common.mag_gain[2] = AHRS_C(1.0);
    p->kp = AHRS_C(1.0);
    p->ki = AHRS_C(0.1);
    p->bias_limit = AHRS_C(0.2);
    p->bias_feed = 1;
    p->gyro_noise = AHRS_C(0.01);
    p->attitude_noise = AHRS_C(0.002);
    p->accel_distrust = AHRS_C(1.0);
    p->motion_noise = AHRS_C(0.5);
    p->initial_attitude_std = AHRS_C(2.0);
    u->gyro[0] = AHRS_C(0.0);
    u->gyro[1] = AHRS_C(0.0);
    u->gyro[2] = AHRS_C(0.0);
    u->accel[0] = AHRS_C(0.0);
    u->accel[1] = AHRS_C(0.0);
    u->accel[2] = AHRS_C(0.0);
    u->mag[0] = AHRS_C(0.0);
    u->mag[1] = AHRS_C(0.0);
    u->mag[2] = AHRS_C(0.0);
    u->accel_valid = 1;
    u->mag_valid = 1;
}

static void mahony_ekf_defaults(void *data) {
    mahony_ekf_instance *i = data;
    memset(i, 0, sizeof *i);
    ahrs_mahony_ekf_defaults(&i->params, &i->inputs);
}

static void mahony_ekf_init(void *data) {
    mahony_ekf_instance *i = data;
    ahrs_mahony_ekf_init(&i->state, &i->params);
}

static void mahony_ekf_update(void *data, ahrs_real dt) {
    mahony_ekf_instance *i = data;
    ahrs_mahony_ekf_update(&i->state, &i->params, &i->inputs, dt);
}

static void mahony_ekf_compute_outputs(void *data) {
    mahony_ekf_instance *i = data;
    ahrs_mahony_ekf_outputs(&i->state, &i->params, &i->outputs);
}

static const fmu_model ahrs_mahony_ekf_model = {
    "mahony_ekf", "MahonyEKF", sizeof(mahony_ekf_instance), {offsetof(mahony_ekf_instance, params), sizeof(((mahony_ekf_instance *)0)->params)}, {offsetof(mahony_ekf_instance, inputs), sizeof(((mahony_ekf_instance *)0)->inputs)}, {offsetof(mahony_ekf_instance, outputs), sizeof(((mahony_ekf_instance *)0)->outputs)}, {offsetof(mahony_ekf_instance, state), sizeof(((mahony_ekf_instance *)0)->state)},
    offsetof(mahony_ekf_instance, params.common.sample_time), 0.01,
    mahony_ekf_variables, sizeof mahony_ekf_variables / sizeof mahony_ekf_variables[0],
    mahony_ekf_limits, sizeof mahony_ekf_limits / sizeof mahony_ekf_limits[0],
    mahony_ekf_defaults, mahony_ekf_init, mahony_ekf_update, mahony_ekf_compute_outputs};

/* Generated from models/mekf/mekf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_MEKF_H
#define AHRS_MEKF_H


/* Multiplicative extended Kalman filter with gyroscope bias. The gyroscope without its estimated bias
 * predicts the attitude; specific force and magnetic field correct attitude and bias together. The
 * covariance is that of a small rotation about the body axes and of the bias. What the accelerometer feels
 * beside gravity counts as its noise: accel_noise has to cover the motion of the vehicle.
 */

typedef struct {
    ahrs_estimator_params common;
    ahrs_real bias_limit; /* Largest gyroscope bias that is learned, per axis [rad/s] */
    ahrs_real gyro_noise; /* White noise of the gyroscope, rad/s/sqrt(Hz) */
    ahrs_real gyro_bias_noise; /* Random walk of the gyroscope bias, rad/s/s/sqrt(Hz) */
    ahrs_real accel_noise; /* White noise of the accelerometer with the motion of the vehicle, m/s2/sqrt(Hz) */
    ahrs_real mag_noise; /* White noise of the magnetometer with disturbances of the field, T/sqrt(Hz) */
    ahrs_real motion_noise; /* Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation */
    ahrs_real initial_attitude_std; /* Standard deviation of the first attitude [rad] */
    ahrs_real initial_bias_std; /* Standard deviation of the gyroscope bias at the start [rad/s] */
} ahrs_mekf_params;

typedef ahrs_estimator_inputs ahrs_mekf_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
    ahrs_real attitude_std[3]; /* Standard deviation of the attitude error about the body axes, as the filter believes it [rad] */
    int32_t covariance_reset; /* The covariance was reset at the last sample */
} ahrs_mekf_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real bias[3]; /* Gyroscope bias [rad/s] */
    ahrs_real attitude_covariance[6]; /* Covariance of the rotation error about the body axes: lower triangle, row by row [rad2] */
    ahrs_real cross_covariance[9]; /* Covariance of rotation error (rows) and bias error (columns) [rad2/s] */
    ahrs_real bias_covariance[6]; /* Covariance of the bias error: lower triangle, row by row [rad2/s2] */
} ahrs_mekf_state;

/* Parameters and inputs to their defaults. */
static inline void ahrs_mekf_defaults(ahrs_mekf_params *p, ahrs_mekf_inputs *u);

/* State as before the first sample. */
static inline void ahrs_mekf_init(ahrs_mekf_state *s, const ahrs_mekf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
static inline void ahrs_mekf_update(ahrs_mekf_state *s, const ahrs_mekf_params *p, const ahrs_mekf_inputs *u, ahrs_real dt);

static inline void ahrs_mekf_outputs(const ahrs_mekf_state *s, const ahrs_mekf_params *p, ahrs_mekf_outputs_t *y);

#endif
/* Multiplicative extended Kalman filter with gyroscope bias (docs/algorithms.md section 1).
 *
 * The errors are a rotation about the body axes and the bias, with the covariance P = [A B; B' C] in 3 x 3 blocks. A
 * direction measured with noise of equal size on all axes tells of the rotation only, and both directions together
 * through one matrix W = H' R^-1 H of three rows. With the factors A = L D L' and B = L D Z the part of the bias that the
 * rotation does not explain, S = C - Z' D Z, stays as it is, and with D^-1 + L' W L = U E U' the correction is
 *
 *     L := L U'^-1,   D := E^-1,   Z := U^-1 Z,
 *
 * sums of squares throughout, so that the covariance stays positive definite. With the misfit r = H' R^-1 (y - h) the
 * attitude is corrected by A r and the bias by B' r. */

typedef struct {
    ahrs_sym3 a;
    ahrs_mat3 b;
    ahrs_sym3 c;
} mekf_blocks;

static mekf_blocks mekf_load(const ahrs_mekf_state *s) {
    return (mekf_blocks){ahrs_sym3_of(s->attitude_covariance), ahrs_mat3_of(s->cross_covariance),
                    ahrs_sym3_of(s->bias_covariance)};
}

static void mekf_store(ahrs_mekf_state *s, const mekf_blocks *p) {
    ahrs_sym3_to(s->attitude_covariance, p->a);
    ahrs_mat3_to(s->cross_covariance, p->b);
    ahrs_sym3_to(s->bias_covariance, p->c);
}

static mekf_blocks mekf_initial(const ahrs_mekf_params *p) {
    const ahrs_real attitude = p->initial_attitude_std * p->initial_attitude_std;
    const ahrs_real bias = p->initial_bias_std * p->initial_bias_std;
    return (mekf_blocks){.a = {attitude, 0, attitude, 0, 0, attitude}, .c = {bias, 0, bias, 0, 0, bias}};
}

/* The covariance after the body has turned by r and the bias error has added to the rotation error for T seconds. */
AHRS_INLINE mekf_blocks mekf_predicted(const mekf_blocks *p, ahrs_quat r, ahrs_real T, ahrs_real turn, ahrs_real walk) {
    const ahrs_mat3 back = ahrs_quat_to_mat3(r);
    const ahrs_mat3 b = ahrs_mat3_transposed_mul(back, p->b), c = ahrs_sym3_full(p->c);
    const ahrs_mat3 a = ahrs_mat3_transposed_mul(back, ahrs_sym3_full(p->a));
    const ahrs_sym3 turned = ahrs_sym3_product(a, back);
    const ahrs_real cross = AHRS_C(0.5) * T * T * walk;
    mekf_blocks next;
    for (int32_t i = 0; i < 3; i++) {
        next.b.row[i] = ahrs_vec3_add_scaled(b.row[i], -T, c.row[i]);
    }
    next.a = (ahrs_sym3){turned.xx - T * (b.row[0].x + next.b.row[0].x), turned.yx - T * (b.row[1].x + next.b.row[0].y),
                         turned.yy - T * (b.row[1].y + next.b.row[1].y), turned.zx - T * (b.row[2].x + next.b.row[0].z),
                         turned.zy - T * (b.row[2].y + next.b.row[1].z), turned.zz - T * (b.row[2].z + next.b.row[2].z)};
    next.a = ahrs_sym3_add_diagonal(next.a, turn + T * T * T * walk / 3);
    next.b.row[0].x -= cross;
    next.b.row[1].y -= cross;
    next.b.row[2].z -= cross;
    next.c = ahrs_sym3_add_diagonal(p->c, T * walk);
    return next;
}

/* A rotation error has no meaning beyond half a turn: a heading that nothing measures stays at that. Scaling the cross
 * covariance as much as the attitude's keeps the whole positive definite, and heading and bias apart. */
static void mekf_limit_attitude(mekf_blocks *p) {
    const ahrs_real sum = p->a.xx + p->a.yy + p->a.zz;
    if (AHRS_UNLIKELY(sum > AHRS_PI * AHRS_PI)) {
        const ahrs_real scale = AHRS_PI * AHRS_PI / sum;
        p->a = ahrs_sym3_scale(p->a, scale);
        for (int32_t i = 0; i < 3; i++) {
            p->b.row[i] = ahrs_vec3_scale(p->b.row[i], scale);
        }
    }
}

/* One measured direction, in units of its noise: what is expected, and what it says about the rotation. */
typedef struct {
    ahrs_vec3 expected, misfit;
} mekf_direction;

static mekf_direction mekf_compared(ahrs_vec3 measured, ahrs_vec3 expected, ahrs_real variance) {
    const ahrs_real weight = 1 / variance;
    const ahrs_vec3 cross = ahrs_vec3_cross(measured, expected);
    return (mekf_direction){ahrs_vec3_scale(expected, ahrs_sqrt(weight)), ahrs_vec3_scale(cross, weight)};
}

/* Information about the rotation: of a direction e that is (|e|^2 I - e e'). */
static ahrs_sym3 mekf_information(ahrs_vec3 e, ahrs_vec3 m) {
    return (ahrs_sym3){e.y * e.y + e.z * e.z + (m.y * m.y + m.z * m.z), -(e.x * e.y + m.x * m.y),
                       e.x * e.x + e.z * e.z + (m.x * m.x + m.z * m.z), -(e.x * e.z + m.x * m.z),
                       -(e.y * e.z + m.y * m.z),                        e.x * e.x + e.y * e.y + (m.x * m.x + m.y * m.y)};
}

/* Unit lower triangle. */
typedef struct {
    ahrs_real yx, zx, zy;
} mekf_unit_triangle;

static bool mekf_is_positive(ahrs_vec3 d) {
    return d.x > 0 && d.y > 0 && d.z > 0 && d.x <= AHRS_REAL_MAX && d.y <= AHRS_REAL_MAX && d.z <= AHRS_REAL_MAX;
}

/* a = L D L' */
AHRS_INLINE ahrs_vec3 mekf_factored(ahrs_sym3 a, mekf_unit_triangle *l) {
    const ahrs_real inverse = 1 / a.xx;
    *l = (mekf_unit_triangle){.yx = a.yx * inverse, .zx = a.zx * inverse};
    const ahrs_real y = a.yy - l->yx * a.yx, zy = a.zy - l->zx * a.yx;
    l->zy = zy / y;
    return (ahrs_vec3){a.xx, y, a.zz - l->zx * a.zx - l->zy * zy};
}

/* v = U E U'; U' is given. */
AHRS_INLINE ahrs_vec3 mekf_factored_from_below(ahrs_sym3 v, mekf_unit_triangle *u) {
    const ahrs_real inverse = 1 / v.zz;
    *u = (mekf_unit_triangle){.zx = v.zx * inverse, .zy = v.zy * inverse};
    const ahrs_real y = v.yy - u->zy * v.zy, yx = v.yx - u->zx * v.zy;
    u->yx = yx / y;
    return (ahrs_vec3){v.xx - u->zx * v.zx - u->yx * yx, y, v.zz};
}

/* L' w L */
AHRS_INLINE ahrs_sym3 mekf_enclosed(mekf_unit_triangle l, ahrs_sym3 w) {
    const ahrs_vec3 y = {w.yx + l.zy * w.zx, w.yy + l.zy * w.zy, w.zy + l.zy * w.zz};
    const ahrs_vec3 x = {w.xx + l.yx * w.yx + l.zx * w.zx, w.yx + l.yx * w.yy + l.zx * w.zy,
                         w.zx + l.yx * w.zy + l.zx * w.zz};
    return (ahrs_sym3){x.x + l.yx * x.y + l.zx * x.z, x.y + l.zy * x.z, y.y + l.zy * y.z, x.z, y.z, w.zz};
}

/* a + sign (the sum of the products of corresponding rows) */
AHRS_INLINE ahrs_sym3 mekf_with_products(ahrs_sym3 a, ahrs_real sign, ahrs_mat3 m, ahrs_mat3 n) {
    const ahrs_sym3 sum = ahrs_sym3_transposed_product(m, n);
    return (ahrs_sym3){a.xx + sign * sum.xx, a.yx + sign * sum.yx, a.yy + sign * sum.yy,
                       a.zx + sign * sum.zx, a.zy + sign * sum.zy, a.zz + sign * sum.zz};
}

/* False, and nothing that can be used, where the blocks were no covariance. */
AHRS_INLINE bool mekf_corrected(mekf_blocks *p, ahrs_sym3 w) {
    mekf_unit_triangle l, u, unused;
    const ahrs_vec3 d = mekf_factored(p->a, &l);
    const ahrs_vec3 inverse = {1 / d.x, 1 / d.y, 1 / d.z};
    ahrs_mat3 dz = p->b, z;
    dz.row[1] = ahrs_vec3_add_scaled(dz.row[1], -l.yx, dz.row[0]);
    dz.row[2] = ahrs_vec3_add_scaled(ahrs_vec3_add_scaled(dz.row[2], -l.zx, dz.row[0]), -l.zy, dz.row[1]);
    z.row[0] = ahrs_vec3_scale(dz.row[0], inverse.x);
    z.row[1] = ahrs_vec3_scale(dz.row[1], inverse.y);
    z.row[2] = ahrs_vec3_scale(dz.row[2], inverse.z);
    const ahrs_sym3 unexplained = mekf_with_products(p->c, -1, dz, z);

    ahrs_sym3 v = mekf_enclosed(l, w);
    v.xx += inverse.x;
    v.yy += inverse.y;
    v.zz += inverse.z;
    const ahrs_vec3 e = mekf_factored_from_below(v, &u);
    const bool kept = mekf_is_positive(d) && mekf_is_positive(e) && mekf_is_positive(mekf_factored(unexplained, &unused));

    const ahrs_vec3 left = {1 / e.x, 1 / e.y, 1 / e.z};
    l.yx -= u.yx;
    l.zy -= u.zy;
    l.zx -= u.zx + l.zy * u.yx;
    z.row[1] = ahrs_vec3_add_scaled(z.row[1], -u.zy, z.row[2]);
    z.row[0] = ahrs_vec3_add_scaled(ahrs_vec3_add_scaled(z.row[0], -u.yx, z.row[1]), -u.zx, z.row[2]);
    dz.row[0] = ahrs_vec3_scale(z.row[0], left.x);
    dz.row[1] = ahrs_vec3_scale(z.row[1], left.y);
    dz.row[2] = ahrs_vec3_scale(z.row[2], left.z);

    const ahrs_real yx = l.yx * left.x, zx = l.zx * left.x, zy = l.zy * left.y;
    p->a = (ahrs_sym3){left.x, yx, left.y + l.yx * yx, zx, zy + l.zx * yx, left.z + l.zy * zy + l.zx * zx};
    p->b.row[0] = dz.row[0];
    p->b.row[1] = ahrs_vec3_add_scaled(dz.row[1], l.yx, dz.row[0]);
    p->b.row[2] = ahrs_vec3_add_scaled(ahrs_vec3_add_scaled(dz.row[2], l.zy, dz.row[1]), l.zx, dz.row[0]);
    p->c = mekf_with_products(unexplained, 1, dz, z);
    return kept;
}

static inline void ahrs_mekf_init(ahrs_mekf_state *s, const ahrs_mekf_params *p) {
    const mekf_blocks first = mekf_initial(p);
    ahrs_estimator_init(&s->common);
    ahrs_vec3_to(s->bias, (ahrs_vec3){0, 0, 0});
    mekf_store(s, &first);
}

static inline void ahrs_mekf_update(ahrs_mekf_state *s, const ahrs_mekf_params *p, const ahrs_mekf_inputs *u, ahrs_real dt) {
    ahrs_sample z;
    const ahrs_action action = ahrs_estimator_begin(&s->common, &p->common, u, dt, &z);
    if (action == AHRS_START) {
        const mekf_blocks first = mekf_initial(p);
        ahrs_vec3_to(s->bias, (ahrs_vec3){0, 0, 0});
        mekf_store(s, &first);
    }
    if (action == AHRS_WAIT || action == AHRS_START) {
        return;
    }
    ahrs_vec3 bias = ahrs_vec3_of(s->bias);
    const ahrs_quat turn = ahrs_quat_exp(ahrs_vec3_scale(ahrs_vec3_sub(z.rate, bias), z.dt));
    const mekf_blocks before = mekf_load(s);
    mekf_blocks cov = mekf_predicted(&before, turn, z.dt, ahrs_turn_variance(&s->common, &z, p->gyro_noise),
                           p->gyro_bias_noise * p->gyro_bias_noise);
    mekf_limit_attitude(&cov);
    ahrs_quat q = ahrs_quat_refine(ahrs_quat_mul(ahrs_quat_of(s->common.q), turn));

    if (z.gain_dt > 0) {
        const ahrs_vec3 down = ahrs_quat_down(q), none = {0, 0, 0};
        mekf_direction gravity = {none, none}, field = {none, none};
        if (z.accel_usable) {
            const ahrs_real variance =
                ahrs_sample_variance(&p->common, p->accel_noise) + ahrs_motion_variance(&p->common, &z, p->motion_noise);
            gravity = mekf_compared(z.accel, ahrs_vec3_scale(down, -p->common.gravity), variance);
        }
        if (z.mag_usable) {
            const ahrs_vec3 north = ahrs_vec3_scale(ahrs_quat_north(q), s->common.field[0]);
            field = mekf_compared(z.mag, ahrs_vec3_add_scaled(north, s->common.field[1], down),
                             ahrs_sample_variance(&p->common, p->mag_noise));
        }
        if (mekf_corrected(&cov, mekf_information(gravity.expected, field.expected))) {
            const ahrs_vec3 misfit = ahrs_vec3_add(gravity.misfit, field.misfit);
            q = ahrs_quat_turn(q, ahrs_sym3_apply(cov.a, misfit));
            bias = ahrs_vec3_limited(ahrs_vec3_add(bias, ahrs_mat3_apply_transposed(cov.b, misfit)), p->bias_limit);
        } else {
            cov = mekf_initial(p);
            s->common.conditions |= AHRS_COVARIANCE_RESET;
        }
    }
    ahrs_vec3_to(s->bias, bias);
    mekf_store(s, &cov);
    ahrs_estimator_end(&s->common, &p->common, &z, ahrs_quat_refine(q));
}

static inline void ahrs_mekf_outputs(const ahrs_mekf_state *s, const ahrs_mekf_params *p, ahrs_mekf_outputs_t *y) {
    const ahrs_sym3 a = ahrs_sym3_of(s->attitude_covariance);
    ahrs_estimator_outputs(&s->common, &p->common, ahrs_vec3_of(s->bias), &y->common);
    ahrs_vec3_to(y->attitude_std, (ahrs_vec3){ahrs_sqrt(a.xx), ahrs_sqrt(a.yy), ahrs_sqrt(a.zz)});
    y->covariance_reset = ahrs_condition(&s->common, AHRS_COVARIANCE_RESET);
}

/* Generated from models/mekf/mekf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */

#include <string.h>

typedef struct {
    ahrs_mekf_params params;
    ahrs_mekf_inputs inputs;
    ahrs_mekf_outputs_t outputs;
    ahrs_mekf_state state;
} mekf_instance;

static const fmu_variable mekf_variables[] = {
    {"gyro", 1, 3, offsetof(mekf_instance, inputs.gyro), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel", 4, 3, offsetof(mekf_instance, inputs.accel), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"mag", 7, 3, offsetof(mekf_instance, inputs.mag), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel_valid", 10, 1, offsetof(mekf_instance, inputs.accel_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"mag_valid", 11, 1, offsetof(mekf_instance, inputs.mag_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"q", 100, 4, offsetof(mekf_instance, outputs.common.q), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"roll", 104, 1, offsetof(mekf_instance, outputs.common.roll), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"pitch", 105, 1, offsetof(mekf_instance, outputs.common.pitch), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"yaw", 106, 1, offsetof(mekf_instance, outputs.common.yaw), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate", 107, 3, offsetof(mekf_instance, outputs.common.rate), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"gyro_bias", 110, 3, offsetof(mekf_instance, outputs.common.gyro_bias), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"motion_accel", 113, 3, offsetof(mekf_instance, outputs.common.motion_accel), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"attitude_std", 116, 3, offsetof(mekf_instance, outputs.attitude_std), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"status", 119, 1, offsetof(mekf_instance, outputs.common.status), FMU_ENUMERATION, FMU_OUTPUT, 0, 0.0, 9.0},
    {"gyro_held", 120, 1, offsetof(mekf_instance, outputs.common.gyro_held), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"accel_used", 121, 1, offsetof(mekf_instance, outputs.common.accel_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"mag_used", 122, 1, offsetof(mekf_instance, outputs.common.mag_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"covariance_reset", 123, 1, offsetof(mekf_instance, outputs.covariance_reset), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"sample_time", 200, 1, offsetof(mekf_instance, params.common.sample_time), FMU_REAL, FMU_FIXED, 0, 1e-05, 0.5},
    {"frame", 201, 1, offsetof(mekf_instance, params.common.frame), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"declination", 202, 1, offsetof(mekf_instance, params.common.declination), FMU_REAL, FMU_TUNABLE, 0, -3.141592653589793, 3.141592653589793},
    {"gravity", 203, 1, offsetof(mekf_instance, params.common.gravity), FMU_REAL, FMU_FIXED, 0, 0.1, 100.0},
    {"field_reference", 204, 1, offsetof(mekf_instance, params.common.field_reference), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"field_magnitude", 205, 1, offsetof(mekf_instance, params.common.field_magnitude), FMU_REAL, FMU_FIXED, 0, 1e-07, 0.01},
    {"field_dip", 206, 1, offsetof(mekf_instance, params.common.field_dip), FMU_REAL, FMU_FIXED, 0, -1.5707963267948966, 1.5707963267948966},
    {"initialisation", 207, 1, offsetof(mekf_instance, params.common.initialisation), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"q0", 208, 4, offsetof(mekf_instance, params.common.q0), FMU_REAL, FMU_FIXED, 0, -1.1, 1.1},
    {"init_time", 212, 1, offsetof(mekf_instance, params.common.init_time), FMU_REAL, FMU_FIXED, 0, 0.0, 600.0},
    {"motion_compensation", 213, 1, offsetof(mekf_instance, params.common.motion_compensation), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"motion_time_constant", 214, 1, offsetof(mekf_instance, params.common.motion_time_constant), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN | FMU_INFINITY_ALLOWED, 0.0, DBL_MAX},
    {"accel_gating", 215, 1, offsetof(mekf_instance, params.common.accel_gating), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"accel_gate", 216, 1, offsetof(mekf_instance, params.common.accel_gate), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"accel_gate_time", 217, 1, offsetof(mekf_instance, params.common.accel_gate_time), FMU_REAL, FMU_TUNABLE, 0, 0.0, 600.0},
    {"gyro_zero_samples", 220, 1, offsetof(mekf_instance, params.common.gyro_zero_samples), FMU_INTEGER, FMU_FIXED, 0, 0.0, 1000000.0},
    {"gyro_zero_std", 221, 1, offsetof(mekf_instance, params.common.gyro_zero_std), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"gyro_zero_limit", 222, 1, offsetof(mekf_instance, params.common.gyro_zero_limit), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"accel_cutoff", 223, 1, offsetof(mekf_instance, params.common.accel_cutoff), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"mag_offset", 224, 3, offsetof(mekf_instance, params.common.mag_offset), FMU_REAL, FMU_FIXED, 0, -0.01, 0.01},
    {"mag_gain", 227, 3, offsetof(mekf_instance, params.common.mag_gain), FMU_REAL, FMU_FIXED, 0, 0.01, 100.0},
    {"bias_limit", 1003, 1, offsetof(mekf_instance, params.bias_limit), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"gyro_noise", 1040, 1, offsetof(mekf_instance, params.gyro_noise), FMU_REAL, FMU_TUNABLE, 0, 1e-07, 100.0},
    {"gyro_bias_noise", 1041, 1, offsetof(mekf_instance, params.gyro_bias_noise), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"accel_noise", 1042, 1, offsetof(mekf_instance, params.accel_noise), FMU_REAL, FMU_TUNABLE, 0, 0.0001, 1000.0},
    {"mag_noise", 1043, 1, offsetof(mekf_instance, params.mag_noise), FMU_REAL, FMU_TUNABLE, 0, 1e-09, 1.0},
    {"motion_noise", 1047, 1, offsetof(mekf_instance, params.motion_noise), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000.0},
    {"initial_attitude_std", 1048, 1, offsetof(mekf_instance, params.initial_attitude_std), FMU_REAL, FMU_FIXED, 0, 0.0001, 10.0},
    {"initial_bias_std", 1049, 1, offsetof(mekf_instance, params.initial_bias_std), FMU_REAL, FMU_FIXED, 0, 1e-06, 10.0},
};

static bool mekf_limit_0(const void *data) {
    const ahrs_mekf_params *p = &((const mekf_instance *)data)->params;
    return (p->common.initialisation == AHRS_INITIALISATION_SENSORS) || (((((p->common.q0[0] * p->common.q0[0]) + (p->common.q0[1] * p->common.q0[1])) + (p->common.q0[2] * p->common.q0[2])) + (p->common.q0[3] * p->common.q0[3])) > AHRS_C(1e-06));
}

static const uint32_t mekf_limit_0_vrs[] = {207, 208};

static bool mekf_limit_1(const void *data) {
    const ahrs_mekf_params *p = &((const mekf_instance *)data)->params;
    return (!(p->common.motion_compensation)) || (p->common.motion_time_constant < AHRS_INFINITY);
}

static const uint32_t mekf_limit_1_vrs[] = {213, 214};

static bool mekf_limit_2(const void *data) {
    const ahrs_mekf_params *p = &((const mekf_instance *)data)->params;
    return (p->common.accel_cutoff * p->common.sample_time) < AHRS_C(0.4);
}

static const uint32_t mekf_limit_2_vrs[] = {223, 200};

static const fmu_limit mekf_limits[] = {
    {"initialisation == sensors or q0[0]*q0[0] + q0[1]*q0[1] + q0[2]*q0[2] + q0[3]*q0[3] > 1e-6", "q0 has no direction: give a quaternion of about unit length", false, mekf_limit_0_vrs, 2, mekf_limit_0},
    {"not motion_compensation or motion_time_constant < inf", "tilt is not observed at all with an infinite motion_time_constant: use it for bursts of less than half a minute only", true, mekf_limit_1_vrs, 2, mekf_limit_1},
    {"accel_cutoff*sample_time < 0.4", "the low-pass needs more than two samples per period: lower accel_cutoff or sample_time", false, mekf_limit_2_vrs, 2, mekf_limit_2},
};

static inline void ahrs_mekf_defaults(ahrs_mekf_params *p, ahrs_mekf_inputs *u) {
    memset(p, 0, sizeof *p);
    memset(u, 0, sizeof *u);
    p->common.sample_time = AHRS_C(0.01);
    p->common.frame = 0;
    p->common.declination = AHRS_C(0.0);
    p->common.gravity = AHRS_C(9.80665);
    p->common.field_reference = 0;
    p->common.field_magnitude = AHRS_C(5e-05);
    p->common.field_dip = AHRS_C(1.1);
    p->common.initialisation = 0;
    p->common.q0[0] = AHRS_C(1.0);
    p->common.q0[1] = AHRS_C(0.0);
    p->common.q0[2] = AHRS_C(0.0);
    p->common.q0[3] = AHRS_C(0.0);
    p->common.init_time = AHRS_C(0.0);
    p->common.motion_compensation = 0;
    p->common.motion_time_constant = AHRS_C(1.0);
    p->common.accel_gating = 0;
    p->common.accel_gate = AHRS_C(1.0);
    p->common.accel_gate_time = AHRS_C(10.0);
    p->common.gyro_zero_samples = 0;
    p->common.gyro_zero_std = AHRS_C(0.02);
    p->common.gyro_zero_limit = AHRS_C(0.1);
    p->common.accel_cutoff = AHRS_C(0.0);
    p->common.mag_offset[0] = AHRS_C(0.0);
    p->common.mag_offset[1] = AHRS_C(0.0);
    p->common.mag_offset[2] = AHRS_C(0.0);
    p->common.mag_gain[0] = AHRS_C(1.0);
    p->common.mag_gain[1] = AHRS_C(1.0);
    p->common.mag_gain[2] = AHRS_C(1.0);
    p->bias_limit = AHRS_C(0.2);
    p->gyro_noise = AHRS_C(0.0002);
    p->gyro_bias_noise = AHRS_C(0.000175);
    p->accel_noise = AHRS_C(0.1);
    p->mag_noise = AHRS_C(1e-07);
    p->motion_noise = AHRS_C(0.5);
    p->initial_attitude_std = AHRS_C(0.1);
    p->initial_bias_std = AHRS_C(0.02);
    u->gyro[0] = AHRS_C(0.0);
    u->gyro[1] = AHRS_C(0.0);
    u->gyro[2] = AHRS_C(0.0);
    u->accel[0] = AHRS_C(0.0);
    u->accel[1] = AHRS_C(0.0);
    u->accel[2] = AHRS_C(0.0);
    u->mag[0] = AHRS_C(0.0);
    u->mag[1] = AHRS_C(0.0);
    u->mag[2] = AHRS_C(0.0);
    u->accel_valid = 1;
    u->mag_valid = 1;
}

static void mekf_defaults(void *data) {
    mekf_instance *i = data;
    memset(i, 0, sizeof *i);
    ahrs_mekf_defaults(&i->params, &i->inputs);
}

static void mekf_init(void *data) {
    mekf_instance *i = data;
    ahrs_mekf_init(&i->state, &i->params);
}

static void mekf_update(void *data, ahrs_real dt) {
    mekf_instance *i = data;
    ahrs_mekf_update(&i->state, &i->params, &i->inputs, dt);
}

static void mekf_compute_outputs(void *data) {
    mekf_instance *i = data;
    ahrs_mekf_outputs(&i->state, &i->params, &i->outputs);
}

static const fmu_model ahrs_mekf_model = {
    "mekf", "MEKF", sizeof(mekf_instance), {offsetof(mekf_instance, params), sizeof(((mekf_instance *)0)->params)}, {offsetof(mekf_instance, inputs), sizeof(((mekf_instance *)0)->inputs)}, {offsetof(mekf_instance, outputs), sizeof(((mekf_instance *)0)->outputs)}, {offsetof(mekf_instance, state), sizeof(((mekf_instance *)0)->state)},
    offsetof(mekf_instance, params.common.sample_time), 0.01,
    mekf_variables, sizeof mekf_variables / sizeof mekf_variables[0],
    mekf_limits, sizeof mekf_limits / sizeof mekf_limits[0],
    mekf_defaults, mekf_init, mekf_update, mekf_compute_outputs};

/* Generated from models/strapdown/strapdown.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_STRAPDOWN_H
#define AHRS_STRAPDOWN_H


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
static inline void ahrs_strapdown_defaults(ahrs_strapdown_params *p, ahrs_strapdown_inputs *u);

/* State as before the first sample. */
static inline void ahrs_strapdown_init(ahrs_strapdown_state *s, const ahrs_strapdown_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
static inline void ahrs_strapdown_update(ahrs_strapdown_state *s, const ahrs_strapdown_params *p, const ahrs_strapdown_inputs *u, ahrs_real dt);

static inline void ahrs_strapdown_outputs(const ahrs_strapdown_state *s, const ahrs_strapdown_params *p, ahrs_strapdown_outputs_t *y);

#endif
/* Gyroscope alone, by fourth-order angle increments (docs/algorithms.md section 1). */

static inline void ahrs_strapdown_init(ahrs_strapdown_state *s, const ahrs_strapdown_params *p) {
    (void)p;
    ahrs_estimator_init(&s->common);
}

static inline void ahrs_strapdown_update(ahrs_strapdown_state *s, const ahrs_strapdown_params *p, const ahrs_strapdown_inputs *u,
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

static inline void ahrs_strapdown_outputs(const ahrs_strapdown_state *s, const ahrs_strapdown_params *p, ahrs_strapdown_outputs_t *y) {
    ahrs_estimator_outputs(&s->common, &p->common, (ahrs_vec3){0, 0, 0}, &y->common);
}

/* Generated from models/strapdown/strapdown.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */

#include <string.h>

typedef struct {
    ahrs_strapdown_params params;
    ahrs_strapdown_inputs inputs;
    ahrs_strapdown_outputs_t outputs;
    ahrs_strapdown_state state;
} strapdown_instance;

static const fmu_variable strapdown_variables[] = {
    {"gyro", 1, 3, offsetof(strapdown_instance, inputs.gyro), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel", 4, 3, offsetof(strapdown_instance, inputs.accel), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"mag", 7, 3, offsetof(strapdown_instance, inputs.mag), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel_valid", 10, 1, offsetof(strapdown_instance, inputs.accel_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"mag_valid", 11, 1, offsetof(strapdown_instance, inputs.mag_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"q", 100, 4, offsetof(strapdown_instance, outputs.common.q), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"roll", 104, 1, offsetof(strapdown_instance, outputs.common.roll), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"pitch", 105, 1, offsetof(strapdown_instance, outputs.common.pitch), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"yaw", 106, 1, offsetof(strapdown_instance, outputs.common.yaw), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate", 107, 3, offsetof(strapdown_instance, outputs.common.rate), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"gyro_bias", 110, 3, offsetof(strapdown_instance, outputs.common.gyro_bias), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"motion_accel", 113, 3, offsetof(strapdown_instance, outputs.common.motion_accel), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"status", 119, 1, offsetof(strapdown_instance, outputs.common.status), FMU_ENUMERATION, FMU_OUTPUT, 0, 0.0, 9.0},
    {"gyro_held", 120, 1, offsetof(strapdown_instance, outputs.common.gyro_held), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"accel_used", 121, 1, offsetof(strapdown_instance, outputs.common.accel_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"mag_used", 122, 1, offsetof(strapdown_instance, outputs.common.mag_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"sample_time", 200, 1, offsetof(strapdown_instance, params.common.sample_time), FMU_REAL, FMU_FIXED, 0, 1e-05, 0.5},
    {"frame", 201, 1, offsetof(strapdown_instance, params.common.frame), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"declination", 202, 1, offsetof(strapdown_instance, params.common.declination), FMU_REAL, FMU_TUNABLE, 0, -3.141592653589793, 3.141592653589793},
    {"gravity", 203, 1, offsetof(strapdown_instance, params.common.gravity), FMU_REAL, FMU_FIXED, 0, 0.1, 100.0},
    {"field_reference", 204, 1, offsetof(strapdown_instance, params.common.field_reference), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"field_magnitude", 205, 1, offsetof(strapdown_instance, params.common.field_magnitude), FMU_REAL, FMU_FIXED, 0, 1e-07, 0.01},
    {"field_dip", 206, 1, offsetof(strapdown_instance, params.common.field_dip), FMU_REAL, FMU_FIXED, 0, -1.5707963267948966, 1.5707963267948966},
    {"initialisation", 207, 1, offsetof(strapdown_instance, params.common.initialisation), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"q0", 208, 4, offsetof(strapdown_instance, params.common.q0), FMU_REAL, FMU_FIXED, 0, -1.1, 1.1},
    {"init_time", 212, 1, offsetof(strapdown_instance, params.common.init_time), FMU_REAL, FMU_FIXED, 0, 0.0, 600.0},
    {"motion_compensation", 213, 1, offsetof(strapdown_instance, params.common.motion_compensation), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"motion_time_constant", 214, 1, offsetof(strapdown_instance, params.common.motion_time_constant), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN | FMU_INFINITY_ALLOWED, 0.0, DBL_MAX},
    {"accel_gating", 215, 1, offsetof(strapdown_instance, params.common.accel_gating), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"accel_gate", 216, 1, offsetof(strapdown_instance, params.common.accel_gate), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"accel_gate_time", 217, 1, offsetof(strapdown_instance, params.common.accel_gate_time), FMU_REAL, FMU_TUNABLE, 0, 0.0, 600.0},
    {"gyro_zero_samples", 220, 1, offsetof(strapdown_instance, params.common.gyro_zero_samples), FMU_INTEGER, FMU_FIXED, 0, 0.0, 1000000.0},
    {"gyro_zero_std", 221, 1, offsetof(strapdown_instance, params.common.gyro_zero_std), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"gyro_zero_limit", 222, 1, offsetof(strapdown_instance, params.common.gyro_zero_limit), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"accel_cutoff", 223, 1, offsetof(strapdown_instance, params.common.accel_cutoff), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"mag_offset", 224, 3, offsetof(strapdown_instance, params.common.mag_offset), FMU_REAL, FMU_FIXED, 0, -0.01, 0.01},
    {"mag_gain", 227, 3, offsetof(strapdown_instance, params.common.mag_gain), FMU_REAL, FMU_FIXED, 0, 0.01, 100.0},
};

static bool strapdown_limit_0(const void *data) {
    const ahrs_strapdown_params *p = &((const strapdown_instance *)data)->params;
    return (p->common.initialisation == AHRS_INITIALISATION_SENSORS) || (((((p->common.q0[0] * p->common.q0[0]) + (p->common.q0[1] * p->common.q0[1])) + (p->common.q0[2] * p->common.q0[2])) + (p->common.q0[3] * p->common.q0[3])) > AHRS_C(1e-06));
}

static const uint32_t strapdown_limit_0_vrs[] = {207, 208};

static bool strapdown_limit_1(const void *data) {
    const ahrs_strapdown_params *p = &((const strapdown_instance *)data)->params;
    return (!(p->common.motion_compensation)) || (p->common.motion_time_constant < AHRS_INFINITY);
}

static const uint32_t strapdown_limit_1_vrs[] = {213, 214};

static bool strapdown_limit_2(const void *data) {
    const ahrs_strapdown_params *p = &((const strapdown_instance *)data)->params;
    return (p->common.accel_cutoff * p->common.sample_time) < AHRS_C(0.4);
}

static const uint32_t strapdown_limit_2_vrs[] = {223, 200};

static const fmu_limit strapdown_limits[] = {
    {"initialisation == sensors or q0[0]*q0[0] + q0[1]*q0[1] + q0[2]*q0[2] + q0[3]*q0[3] > 1e-6", "q0 has no direction: give a quaternion of about unit length", false, strapdown_limit_0_vrs, 2, strapdown_limit_0},
    {"not motion_compensation or motion_time_constant < inf", "tilt is not observed at all with an infinite motion_time_constant: use it for bursts of less than half a minute only", true, strapdown_limit_1_vrs, 2, strapdown_limit_1},
    {"accel_cutoff*sample_time < 0.4", "the low-pass needs more than two samples per period: lower accel_cutoff or sample_time", false, strapdown_limit_2_vrs, 2, strapdown_limit_2},
};

static inline void ahrs_strapdown_defaults(ahrs_strapdown_params *p, ahrs_strapdown_inputs *u) {
    memset(p, 0, sizeof *p);
    memset(u, 0, sizeof *u);
    p->common.sample_time = AHRS_C(0.01);
    p->common.frame = 0;
    p->common.declination = AHRS_C(0.0);
    p->common.gravity = AHRS_C(9.80665);
    p->common.field_reference = 0;
    p->common.field_magnitude = AHRS_C(5e-05);
    p->common.field_dip = AHRS_C(1.1);
    p->common.initialisation = 0;
    p->common.q0[0] = AHRS_C(1.0);
    p->common.q0[1] = AHRS_C(0.0);
    p->common.q0[2] = AHRS_C(0.0);
    p->common.q0[3] = AHRS_C(0.0);
    p->common.init_time = AHRS_C(0.0);
    p->common.motion_compensation = 0;
    p->common.motion_time_constant = AHRS_C(1.0);
    p->common.accel_gating = 0;
    p->common.accel_gate = AHRS_C(1.0);
    p->common.accel_gate_time = AHRS_C(10.0);
    p->common.gyro_zero_samples = 0;
    p->common.gyro_zero_std = AHRS_C(0.02);
    p->common.gyro_zero_limit = AHRS_C(0.1);
    p->common.accel_cutoff = AHRS_C(0.0);
    p->common.mag_offset[0] = AHRS_C(0.0);
    p->common.mag_offset[1] = AHRS_C(0.0);
    p->common.mag_offset[2] = AHRS_C(0.0);
    p->common.mag_gain[0] = AHRS_C(1.0);
    p->common.mag_gain[1] = AHRS_C(1.0);
    p->common.mag_gain[2] = AHRS_C(1.0);
    u->gyro[0] = AHRS_C(0.0);
    u->gyro[1] = AHRS_C(0.0);
    u->gyro[2] = AHRS_C(0.0);
    u->accel[0] = AHRS_C(0.0);
    u->accel[1] = AHRS_C(0.0);
    u->accel[2] = AHRS_C(0.0);
    u->mag[0] = AHRS_C(0.0);
    u->mag[1] = AHRS_C(0.0);
    u->mag[2] = AHRS_C(0.0);
    u->accel_valid = 1;
    u->mag_valid = 1;
}

static void strapdown_defaults(void *data) {
    strapdown_instance *i = data;
    memset(i, 0, sizeof *i);
    ahrs_strapdown_defaults(&i->params, &i->inputs);
}

static void strapdown_init(void *data) {
    strapdown_instance *i = data;
    ahrs_strapdown_init(&i->state, &i->params);
}

static void strapdown_update(void *data, ahrs_real dt) {
    strapdown_instance *i = data;
    ahrs_strapdown_update(&i->state, &i->params, &i->inputs, dt);
}

static void strapdown_compute_outputs(void *data) {
    strapdown_instance *i = data;
    ahrs_strapdown_outputs(&i->state, &i->params, &i->outputs);
}

static const fmu_model ahrs_strapdown_model = {
    "strapdown", "Strapdown", sizeof(strapdown_instance), {offsetof(strapdown_instance, params), sizeof(((strapdown_instance *)0)->params)}, {offsetof(strapdown_instance, inputs), sizeof(((strapdown_instance *)0)->inputs)}, {offsetof(strapdown_instance, outputs), sizeof(((strapdown_instance *)0)->outputs)}, {offsetof(strapdown_instance, state), sizeof(((strapdown_instance *)0)->state)},
    offsetof(strapdown_instance, params.common.sample_time), 0.01,
    strapdown_variables, sizeof strapdown_variables / sizeof strapdown_variables[0],
    strapdown_limits, sizeof strapdown_limits / sizeof strapdown_limits[0],
    strapdown_defaults, strapdown_init, strapdown_update, strapdown_compute_outputs};

/* Generated from models/ukf/ukf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_UKF_H
#define AHRS_UKF_H


/* Unscented Kalman filter with gyroscope bias, in square-root form. States and noise are those of the
 * multiplicative extended Kalman filter; means and covariances are taken over twelve points around the
 * estimate and the estimate itself. The defaults weight the points equally and the estimate not at all,
 * which are the cubature rules. A small alpha draws the points together, until in single precision little
 * more than rounding is left of their differences.
 */

typedef struct {
    ahrs_estimator_params common;
    ahrs_real bias_limit; /* Largest gyroscope bias that is learned, per axis [rad/s] */
    ahrs_real gyro_noise; /* White noise of the gyroscope, rad/s/sqrt(Hz) */
    ahrs_real gyro_bias_noise; /* Random walk of the gyroscope bias, rad/s/s/sqrt(Hz) */
    ahrs_real accel_noise; /* White noise of the accelerometer with the motion of the vehicle, m/s2/sqrt(Hz) */
    ahrs_real mag_noise; /* White noise of the magnetometer with disturbances of the field, T/sqrt(Hz) */
    ahrs_real motion_noise; /* Random walk of the motion acceleration, m/s2/s/sqrt(Hz), used with motion_compensation */
    ahrs_real initial_attitude_std; /* Standard deviation of the first attitude [rad] */
    ahrs_real initial_bias_std; /* Standard deviation of the gyroscope bias at the start [rad/s] */
    ahrs_real alpha; /* Spread of the points, in standard deviations over the square root of 6 + kappa [1] */
    ahrs_real beta; /* Additional weight of the estimate in the covariances [1] */
    ahrs_real kappa; /* Further spread of the points: with alpha = 1 the weight of the estimate is kappa/(6 + kappa) [1] */
} ahrs_ukf_params;

typedef ahrs_estimator_inputs ahrs_ukf_inputs;

typedef struct {
    ahrs_estimator_outputs_t common;
    ahrs_real attitude_std[3]; /* Standard deviation of the attitude error about the body axes, as the filter believes it [rad] */
    int32_t covariance_reset; /* The covariance was reset at the last sample */
} ahrs_ukf_outputs_t;

typedef struct {
    ahrs_estimator_state common;
    ahrs_real bias[3]; /* Gyroscope bias [rad/s] */
    ahrs_real root[21]; /* Root of the covariance of rotation error (rad, body axes) and bias error (rad/s): lower triangle, row by row [1] */
} ahrs_ukf_state;

/* Parameters and inputs to their defaults. */
static inline void ahrs_ukf_defaults(ahrs_ukf_params *p, ahrs_ukf_inputs *u);

/* State as before the first sample. */
static inline void ahrs_ukf_init(ahrs_ukf_state *s, const ahrs_ukf_params *p);

/* One sample, dt seconds after the one before; dt = 0 only initialises, if that is to be done. */
static inline void ahrs_ukf_update(ahrs_ukf_state *s, const ahrs_ukf_params *p, const ahrs_ukf_inputs *u, ahrs_real dt);

static inline void ahrs_ukf_outputs(const ahrs_ukf_state *s, const ahrs_ukf_params *p, ahrs_ukf_outputs_t *y);

#endif
/* Unscented Kalman filter with gyroscope bias, in square-root form (docs/algorithms.md section 1).
 *
 * The covariance is kept as its triangular root. The points lie in pairs around the estimate; a pair's difference and its
 * sum, instead of the points themselves, make columns in which most elements are zero. Root and noise are put side by side
 * and made triangular by reflections, which squares nothing and cannot lose positive definiteness. What is left of the
 * estimate's own weight, which may be negative, is added to the result. */

enum { ukf_N = 6, ukf_ROTATION = 3, ukf_Z = 6, ukf_PAIRS = ukf_N, ukf_COLUMNS = ukf_N + ukf_N + ukf_Z, ukf_ROOT = AHRS_TRIANGLE(ukf_N) };

/* rad2: the points of a rotation spread further than this would meet behind the back. */
static const ahrs_real ukf_ROTATION_VARIANCE_MAX = AHRS_C(1.0);

/* Distance of the points in standard deviations, the weight of each, and how a covariance is summed up: over deviations
 * from the mean or from the estimate, and `own` times the square of what lies between the two. Both sums are the same, but
 * about the mean `own` is the estimate's weight, -10^6 for alpha 0.001: then the other one is free of cancellation. */
typedef struct {
    ahrs_real distance, point, own;
    bool about_mean;
} ukf_weights;

/* One measured direction or two, in units of their noise. */
typedef struct {
    int32_t rows;
    bool accel, mag;
    ahrs_real gravity, north, down; /* what is expected */
    ahrs_real measured[ukf_Z];
} ukf_measurement;

static ukf_weights ukf_weights_of(const ahrs_ukf_params *p) {
    const ahrs_real spread = p->alpha * p->alpha * ((ahrs_real)ukf_N + p->kappa);
    const ahrs_real about_estimate = p->beta - p->alpha * p->alpha;
    const ahrs_real about_mean = 2 - (ahrs_real)ukf_N / spread + about_estimate;
    const bool mean = ahrs_abs(about_mean) <= ahrs_abs(about_estimate);
    return (ukf_weights){ahrs_sqrt(spread), AHRS_C(0.5) / spread, mean ? about_mean : about_estimate, mean};
}

static void ukf_start(ahrs_ukf_state *s, const ahrs_ukf_params *p) {
    for (int32_t i = 0; i < ukf_ROOT; i++) {
        s->root[i] = 0;
    }
    for (int32_t i = 0; i < ukf_N; i++) {
        *ahrs_at(s->root, i, i) = i < ukf_ROTATION ? p->initial_attitude_std : p->initial_bias_std;
    }
}

/* Column j of the root, rotation or bias, times a number. */
static ahrs_vec3 ukf_column(const ahrs_real root[ukf_ROOT], int32_t first, int32_t j, ahrs_real k) {
    ahrs_vec3 v = {0, 0, 0};
    if (j <= first) {
        v.x = root[AHRS_TRIANGLE(first) + j];
    }
    if (j <= first + 1) {
        v.y = root[AHRS_TRIANGLE(first + 1) + j];
    }
    if (j <= first + 2) {
        v.z = root[AHRS_TRIANGLE(first + 2) + j];
    }
    return ahrs_vec3_scale(v, k);
}

static void ukf_set_column(ahrs_real *rows, int32_t columns, int32_t j, ahrs_vec3 v) {
    rows[j] = v.x;
    rows[columns + j] = v.y;
    rows[2 * columns + j] = v.z;
}

/* Turning errors are kept where a rotation has a meaning; scaling rows of the root leaves it a root. */
static void ukf_limit_rotation(ahrs_real root[ukf_ROOT]) {
    ahrs_real sum = 0;
    for (int32_t i = 0; i < AHRS_TRIANGLE(ukf_ROTATION); i++) {
        sum += root[i] * root[i];
    }
    if (sum > ukf_ROTATION_VARIANCE_MAX) {
        const ahrs_real scale = ahrs_sqrt(ukf_ROTATION_VARIANCE_MAX / sum);
        for (int32_t i = 0; i < AHRS_TRIANGLE(ukf_ROTATION); i++) {
            root[i] *= scale;
        }
    }
}

/* Root of the covariance after the step; the rotation itself goes into q. False where it is lost. */
static bool ukf_predict(ahrs_ukf_state *s, const ahrs_ukf_params *p, const ahrs_sample *z, const ukf_weights *w, ahrs_quat *q) {
    const ahrs_real T = z->dt, half = ahrs_sqrt(AHRS_C(0.5) * w->point);
    const ahrs_vec3 rate = ahrs_vec3_sub(z->rate, ahrs_vec3_of(s->bias));
    const ahrs_quat turn = ahrs_quat_exp(ahrs_vec3_scale(rate, T)), back = ahrs_quat_conj(turn);
    ahrs_vec3 side[ukf_PAIRS][2], mean = {0, 0, 0};
    ahrs_real a[ukf_N * ukf_COLUMNS] = {0}, *const bias_rows = &a[ukf_ROTATION * ukf_COLUMNS];
    for (int32_t j = 0; j < ukf_PAIRS; j++) {
        for (int32_t k = 0; k < 2; k++) {
            const ahrs_real c = k == 0 ? w->distance : -w->distance;
            const ahrs_vec3 rotation = ukf_column(s->root, 0, j, c), bias = ukf_column(s->root, ukf_ROTATION, j, c);
            const ahrs_quat turned = ahrs_quat_exp(ahrs_vec3_scale(ahrs_vec3_sub(rate, bias), T));
            side[j][k] = ahrs_quat_log(ahrs_quat_mul(back, ahrs_quat_mul(ahrs_quat_exp(rotation), turned)));
            mean = ahrs_vec3_add_scaled(mean, w->point, side[j][k]);
        }
    }
    for (int32_t j = 0; j < ukf_PAIRS; j++) {
        const ahrs_vec3 sum = ahrs_vec3_add_scaled(ahrs_vec3_add(side[j][0], side[j][1]), w->about_mean ? -2 : 0, mean);
        ukf_set_column(a, ukf_COLUMNS, j, ahrs_vec3_scale(ahrs_vec3_sub(side[j][0], side[j][1]), half));
        ukf_set_column(a, ukf_COLUMNS, j + ukf_PAIRS, ahrs_vec3_scale(sum, half));
        ukf_set_column(bias_rows, ukf_COLUMNS, j, ukf_column(s->root, ukf_ROTATION, j, 1));
    }
    const ahrs_real walk = p->gyro_bias_noise * p->gyro_bias_noise;
    const ahrs_real turning = ahrs_sqrt(ahrs_turn_variance(&s->common, z, p->gyro_noise) + T * T * T * walk / 3);
    const ahrs_real cross = AHRS_C(-0.5) * T * T * walk / turning;
    const ahrs_real alone = ahrs_sqrt(ahrs_max(T * walk - cross * cross, 0));
    for (int32_t i = 0; i < ukf_ROTATION; i++) {
        a[i * ukf_COLUMNS + 2 * ukf_PAIRS + i] = turning;
        bias_rows[i * ukf_COLUMNS + 2 * ukf_PAIRS + i] = cross;
        bias_rows[i * ukf_COLUMNS + 2 * ukf_PAIRS + ukf_ROTATION + i] = alone;
    }
    *q = ahrs_quat_mul(*q, ahrs_quat_mul(turn, ahrs_quat_exp(mean)));
    if (!ahrs_triangle_of(ukf_N, ukf_COLUMNS, a, s->root)) {
        return false;
    }
    const ahrs_real own = ahrs_sqrt(ahrs_abs(w->own));
    ahrs_real x[ukf_N] = {own * mean.x, own * mean.y, own * mean.z};
    if (own > 0 && !ahrs_add_square(ukf_N, s->root, x, w->own < 0 ? -1 : 1)) {
        return false;
    }
    ukf_limit_rotation(s->root);
    return true;
}

static ukf_measurement ukf_measurement_of(const ahrs_ukf_state *s, const ahrs_ukf_params *p, const ahrs_sample *z) {
    ukf_measurement m = {.accel = z->accel_usable, .mag = z->mag_usable};
    if (m.accel) {
        const ahrs_real variance =
            ahrs_sample_variance(&p->common, p->accel_noise) + ahrs_motion_variance(&p->common, z, p->motion_noise);
        const ahrs_real unit = 1 / ahrs_sqrt(variance);
        m.gravity = unit * p->common.gravity;
        ahrs_vec3_to(m.measured, ahrs_vec3_scale(z->accel, unit));
        m.rows = 3;
    }
    if (m.mag) {
        const ahrs_real unit = 1 / ahrs_sqrt(ahrs_sample_variance(&p->common, p->mag_noise));
        m.north = unit * s->common.field[0];
        m.down = unit * s->common.field[1];
        ahrs_vec3_to(&m.measured[m.rows], ahrs_vec3_scale(z->mag, unit));
        m.rows += 3;
    }
    return m;
}

static void ukf_expected(const ukf_measurement *m, ahrs_quat q, ahrs_real out[ukf_Z]) {
    const ahrs_vec3 down = ahrs_quat_down(q);
    int32_t row = 0;
    if (m->accel) {
        ahrs_vec3_to(out, ahrs_vec3_scale(down, -m->gravity));
        row = 3;
    }
    if (m->mag) {
        ahrs_vec3_to(&out[row], ahrs_vec3_add_scaled(ahrs_vec3_scale(ahrs_quat_north(q), m->north), m->down, down));
    }
}

/* Correction of attitude, bias and root; false where the root is lost. Measurement and state are made triangular
 * together: what stands below the measurement's own root is the gain, and beside it is the root that is left. */
static bool ukf_correct(ahrs_ukf_state *s, const ukf_measurement *m, const ukf_weights *w, ahrs_quat *q, ahrs_vec3 *bias) {
    const int32_t rows = m->rows, columns = rows + 2 * ukf_PAIRS, all = rows + ukf_N;
    const ahrs_real half = ahrs_sqrt(AHRS_C(0.5) * w->point), own = ahrs_sqrt(ahrs_abs(w->own));
    ahrs_real a[(ukf_Z + ukf_N) * ukf_COLUMNS] = {0}, root[AHRS_TRIANGLE(ukf_Z + ukf_N)], x[ukf_Z + ukf_N] = {0};
    ahrs_real centre[ukf_Z], mean[ukf_Z] = {0}, side[ukf_PAIRS][2][ukf_Z], e[ukf_Z], change[ukf_N] = {0};
    ukf_expected(m, *q, centre);
    for (int32_t j = 0; j < ukf_PAIRS; j++) {
        for (int32_t k = 0; k < 2; k++) {
            ukf_expected(m, ahrs_quat_turn(*q, ukf_column(s->root, 0, j, k == 0 ? w->distance : -w->distance)), side[j][k]);
            for (int32_t i = 0; i < rows; i++) {
                side[j][k][i] -= centre[i];
                mean[i] += w->point * side[j][k][i];
            }
        }
    }
    for (int32_t i = 0; i < rows; i++) {
        ahrs_real *const row = &a[i * columns];
        row[i] = 1;
        for (int32_t j = 0; j < ukf_PAIRS; j++) {
            row[rows + j] = half * (side[j][0][i] + side[j][1][i] - (w->about_mean ? 2 * mean[i] : 0));
            row[rows + ukf_PAIRS + j] = half * (side[j][0][i] - side[j][1][i]);
        }
        x[i] = own * mean[i];
        e[i] = m->measured[i] - centre[i] - mean[i];
    }
    for (int32_t i = 0; i < ukf_N; i++) {
        for (int32_t j = 0; j <= i; j++) {
            a[(rows + i) * columns + rows + ukf_PAIRS + j] = ahrs_of(s->root, i, j);
        }
    }
    if (!ahrs_triangle_of(all, columns, a, root) ||
        (own > 0 && !ahrs_add_square(all, root, x, w->own < 0 ? -1 : 1))) {
        return false;
    }
    ahrs_solve_lower(rows, root, e);
    for (int32_t i = 0; i < ukf_N; i++) {
        const ahrs_real *const row = &root[AHRS_TRIANGLE(rows + i)];
        for (int32_t k = 0; k < rows; k++) {
            change[i] += row[k] * e[k];
        }
        for (int32_t j = 0; j <= i; j++) {
            *ahrs_at(s->root, i, j) = row[rows + j];
        }
    }
    *q = ahrs_quat_turn(*q, ahrs_vec3_of(change));
    *bias = ahrs_vec3_add(*bias, ahrs_vec3_of(&change[ukf_ROTATION]));
    return true;
}

static inline void ahrs_ukf_init(ahrs_ukf_state *s, const ahrs_ukf_params *p) {
    ahrs_estimator_init(&s->common);
    ahrs_vec3_to(s->bias, (ahrs_vec3){0, 0, 0});
    ukf_start(s, p);
}

static inline void ahrs_ukf_update(ahrs_ukf_state *s, const ahrs_ukf_params *p, const ahrs_ukf_inputs *u, ahrs_real dt) {
    ahrs_sample z;
    const ahrs_action action = ahrs_estimator_begin(&s->common, &p->common, u, dt, &z);
    if (action == AHRS_START) {
        ahrs_vec3_to(s->bias, (ahrs_vec3){0, 0, 0});
        ukf_start(s, p);
    }
    if (action == AHRS_WAIT || action == AHRS_START) {
        return;
    }
    const ukf_weights w = ukf_weights_of(p);
    ahrs_quat q = ahrs_quat_of(s->common.q);
    ahrs_vec3 bias = ahrs_vec3_of(s->bias);
    bool kept = ukf_predict(s, p, &z, &w, &q);
    const ukf_measurement m = ukf_measurement_of(s, p, &z);
    if (kept && z.gain_dt > 0 && m.rows > 0) {
        kept = ukf_correct(s, &m, &w, &q, &bias);
    }
    if (!kept) {
        ukf_start(s, p);
        s->common.conditions |= AHRS_COVARIANCE_RESET;
    }
    ahrs_vec3_to(s->bias, ahrs_vec3_limited(bias, p->bias_limit));
    ahrs_estimator_end(&s->common, &p->common, &z, ahrs_quat_refine(q));
}

static inline void ahrs_ukf_outputs(const ahrs_ukf_state *s, const ahrs_ukf_params *p, ahrs_ukf_outputs_t *y) {
    const ahrs_real *const r = s->root;
    ahrs_estimator_outputs(&s->common, &p->common, ahrs_vec3_of(s->bias), &y->common);
    ahrs_vec3_to(y->attitude_std, (ahrs_vec3){r[0], ahrs_sqrt(r[1] * r[1] + r[2] * r[2]),
                                              ahrs_sqrt(r[3] * r[3] + r[4] * r[4] + r[5] * r[5])});
    y->covariance_reset = ahrs_condition(&s->common, AHRS_COVARIANCE_RESET);
}

/* Generated from models/ukf/ukf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */

#include <string.h>

typedef struct {
    ahrs_ukf_params params;
    ahrs_ukf_inputs inputs;
    ahrs_ukf_outputs_t outputs;
    ahrs_ukf_state state;
} ukf_instance;

static const fmu_variable ukf_variables[] = {
    {"gyro", 1, 3, offsetof(ukf_instance, inputs.gyro), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel", 4, 3, offsetof(ukf_instance, inputs.accel), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"mag", 7, 3, offsetof(ukf_instance, inputs.mag), FMU_REAL, FMU_INPUT, 0, -DBL_MAX, DBL_MAX},
    {"accel_valid", 10, 1, offsetof(ukf_instance, inputs.accel_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"mag_valid", 11, 1, offsetof(ukf_instance, inputs.mag_valid), FMU_BOOLEAN, FMU_INPUT, 0, 0.0, 1.0},
    {"q", 100, 4, offsetof(ukf_instance, outputs.common.q), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"roll", 104, 1, offsetof(ukf_instance, outputs.common.roll), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"pitch", 105, 1, offsetof(ukf_instance, outputs.common.pitch), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"yaw", 106, 1, offsetof(ukf_instance, outputs.common.yaw), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"rate", 107, 3, offsetof(ukf_instance, outputs.common.rate), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"gyro_bias", 110, 3, offsetof(ukf_instance, outputs.common.gyro_bias), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"motion_accel", 113, 3, offsetof(ukf_instance, outputs.common.motion_accel), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"attitude_std", 116, 3, offsetof(ukf_instance, outputs.attitude_std), FMU_REAL, FMU_OUTPUT, 0, -DBL_MAX, DBL_MAX},
    {"status", 119, 1, offsetof(ukf_instance, outputs.common.status), FMU_ENUMERATION, FMU_OUTPUT, 0, 0.0, 9.0},
    {"gyro_held", 120, 1, offsetof(ukf_instance, outputs.common.gyro_held), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"accel_used", 121, 1, offsetof(ukf_instance, outputs.common.accel_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"mag_used", 122, 1, offsetof(ukf_instance, outputs.common.mag_used), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"covariance_reset", 123, 1, offsetof(ukf_instance, outputs.covariance_reset), FMU_BOOLEAN, FMU_OUTPUT, 0, 0.0, 1.0},
    {"sample_time", 200, 1, offsetof(ukf_instance, params.common.sample_time), FMU_REAL, FMU_FIXED, 0, 1e-05, 0.5},
    {"frame", 201, 1, offsetof(ukf_instance, params.common.frame), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"declination", 202, 1, offsetof(ukf_instance, params.common.declination), FMU_REAL, FMU_TUNABLE, 0, -3.141592653589793, 3.141592653589793},
    {"gravity", 203, 1, offsetof(ukf_instance, params.common.gravity), FMU_REAL, FMU_FIXED, 0, 0.1, 100.0},
    {"field_reference", 204, 1, offsetof(ukf_instance, params.common.field_reference), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"field_magnitude", 205, 1, offsetof(ukf_instance, params.common.field_magnitude), FMU_REAL, FMU_FIXED, 0, 1e-07, 0.01},
    {"field_dip", 206, 1, offsetof(ukf_instance, params.common.field_dip), FMU_REAL, FMU_FIXED, 0, -1.5707963267948966, 1.5707963267948966},
    {"initialisation", 207, 1, offsetof(ukf_instance, params.common.initialisation), FMU_ENUMERATION, FMU_FIXED, 0, 0.0, 1.0},
    {"q0", 208, 4, offsetof(ukf_instance, params.common.q0), FMU_REAL, FMU_FIXED, 0, -1.1, 1.1},
    {"init_time", 212, 1, offsetof(ukf_instance, params.common.init_time), FMU_REAL, FMU_FIXED, 0, 0.0, 600.0},
    {"motion_compensation", 213, 1, offsetof(ukf_instance, params.common.motion_compensation), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"motion_time_constant", 214, 1, offsetof(ukf_instance, params.common.motion_time_constant), FMU_REAL, FMU_TUNABLE, FMU_MIN_OPEN | FMU_INFINITY_ALLOWED, 0.0, DBL_MAX},
    {"accel_gating", 215, 1, offsetof(ukf_instance, params.common.accel_gating), FMU_BOOLEAN, FMU_FIXED, 0, 0.0, 1.0},
    {"accel_gate", 216, 1, offsetof(ukf_instance, params.common.accel_gate), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"accel_gate_time", 217, 1, offsetof(ukf_instance, params.common.accel_gate_time), FMU_REAL, FMU_TUNABLE, 0, 0.0, 600.0},
    {"gyro_zero_samples", 220, 1, offsetof(ukf_instance, params.common.gyro_zero_samples), FMU_INTEGER, FMU_FIXED, 0, 0.0, 1000000.0},
    {"gyro_zero_std", 221, 1, offsetof(ukf_instance, params.common.gyro_zero_std), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"gyro_zero_limit", 222, 1, offsetof(ukf_instance, params.common.gyro_zero_limit), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"accel_cutoff", 223, 1, offsetof(ukf_instance, params.common.accel_cutoff), FMU_REAL, FMU_FIXED, 0, 0.0, 10000.0},
    {"mag_offset", 224, 3, offsetof(ukf_instance, params.common.mag_offset), FMU_REAL, FMU_FIXED, 0, -0.01, 0.01},
    {"mag_gain", 227, 3, offsetof(ukf_instance, params.common.mag_gain), FMU_REAL, FMU_FIXED, 0, 0.01, 100.0},
    {"bias_limit", 1003, 1, offsetof(ukf_instance, params.bias_limit), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"gyro_noise", 1040, 1, offsetof(ukf_instance, params.gyro_noise), FMU_REAL, FMU_TUNABLE, 0, 1e-07, 100.0},
    {"gyro_bias_noise", 1041, 1, offsetof(ukf_instance, params.gyro_bias_noise), FMU_REAL, FMU_TUNABLE, 0, 0.0, 100.0},
    {"accel_noise", 1042, 1, offsetof(ukf_instance, params.accel_noise), FMU_REAL, FMU_TUNABLE, 0, 0.0001, 1000.0},
    {"mag_noise", 1043, 1, offsetof(ukf_instance, params.mag_noise), FMU_REAL, FMU_TUNABLE, 0, 1e-09, 1.0},
    {"motion_noise", 1047, 1, offsetof(ukf_instance, params.motion_noise), FMU_REAL, FMU_TUNABLE, 0, 0.0, 1000.0},
    {"initial_attitude_std", 1048, 1, offsetof(ukf_instance, params.initial_attitude_std), FMU_REAL, FMU_FIXED, 0, 0.0001, 1.0},
    {"initial_bias_std", 1049, 1, offsetof(ukf_instance, params.initial_bias_std), FMU_REAL, FMU_FIXED, 0, 1e-06, 10.0},
    {"alpha", 1090, 1, offsetof(ukf_instance, params.alpha), FMU_REAL, FMU_FIXED, 0, 0.0001, 2.0},
    {"beta", 1091, 1, offsetof(ukf_instance, params.beta), FMU_REAL, FMU_FIXED, 0, 0.0, 10.0},
    {"kappa", 1092, 1, offsetof(ukf_instance, params.kappa), FMU_REAL, FMU_FIXED, 0, -5.0, 100.0},
};

static bool ukf_limit_0(const void *data) {
    const ahrs_ukf_params *p = &((const ukf_instance *)data)->params;
    return (p->common.initialisation == AHRS_INITIALISATION_SENSORS) || (((((p->common.q0[0] * p->common.q0[0]) + (p->common.q0[1] * p->common.q0[1])) + (p->common.q0[2] * p->common.q0[2])) + (p->common.q0[3] * p->common.q0[3])) > AHRS_C(1e-06));
}

static const uint32_t ukf_limit_0_vrs[] = {207, 208};

static bool ukf_limit_1(const void *data) {
    const ahrs_ukf_params *p = &((const ukf_instance *)data)->params;
    return (!(p->common.motion_compensation)) || (p->common.motion_time_constant < AHRS_INFINITY);
}

static const uint32_t ukf_limit_1_vrs[] = {213, 214};

static bool ukf_limit_2(const void *data) {
    const ahrs_ukf_params *p = &((const ukf_instance *)data)->params;
    return (p->common.accel_cutoff * p->common.sample_time) < AHRS_C(0.4);
}

static const uint32_t ukf_limit_2_vrs[] = {223, 200};

static bool ukf_limit_3(const void *data) {
    const ahrs_ukf_params *p = &((const ukf_instance *)data)->params;
    return (p->alpha >= AHRS_C(0.01)) || (AHRS_REAL_EPSILON < AHRS_C(1e-09));
}

static const uint32_t ukf_limit_3_vrs[] = {1090};

static const fmu_limit ukf_limits[] = {
    {"initialisation == sensors or q0[0]*q0[0] + q0[1]*q0[1] + q0[2]*q0[2] + q0[3]*q0[3] > 1e-6", "q0 has no direction: give a quaternion of about unit length", false, ukf_limit_0_vrs, 2, ukf_limit_0},
    {"not motion_compensation or motion_time_constant < inf", "tilt is not observed at all with an infinite motion_time_constant: use it for bursts of less than half a minute only", true, ukf_limit_1_vrs, 2, ukf_limit_1},
    {"accel_cutoff*sample_time < 0.4", "the low-pass needs more than two samples per period: lower accel_cutoff or sample_time", false, ukf_limit_2_vrs, 2, ukf_limit_2},
    {"alpha >= 0.01 or epsilon < 1e-9", "in single precision little more than rounding is left of the points of so small an alpha: use double, or a larger alpha", false, ukf_limit_3_vrs, 1, ukf_limit_3},
};

static inline void ahrs_ukf_defaults(ahrs_ukf_params *p, ahrs_ukf_inputs *u) {
    memset(p, 0, sizeof *p);
    memset(u, 0, sizeof *u);
    p->common.sample_time = AHRS_C(0.01);
    p->common.frame = 0;
    p->common.declination = AHRS_C(0.0);
    p->common.gravity = AHRS_C(9.80665);
    p->common.field_reference = 0;
    p->common.field_magnitude = AHRS_C(5e-05);
    p->common.field_dip = AHRS_C(1.1);
    p->common.initialisation = 0;
    p->common.q0[0] = AHRS_C(1.0);
    p->common.q0[1] = AHRS_C(0.0);
    p->common.q0[2] = AHRS_C(0.0);
    p->common.q0[3] = AHRS_C(0.0);
    p->common.init_time = AHRS_C(0.0);
    p->common.motion_compensation = 0;
    p->common.motion_time_constant = AHRS_C(1.0);
    p->common.accel_gating = 0;
    p->common.accel_gate = AHRS_C(1.0);
    p->common.accel_gate_time = AHRS_C(10.0);
    p->common.gyro_zero_samples = 0;
    p->common.gyro_zero_std = AHRS_C(0.02);
    p->common.gyro_zero_limit = AHRS_C(0.1);
    p->common.accel_cutoff = AHRS_C(0.0);
    p->common.mag_offset[0] = AHRS_C(0.0);
    p->common.mag_offset[1] = AHRS_C(0.0);
    p->common.mag_offset[2] = AHRS_C(0.0);
    p->common.mag_gain[0] = AHRS_C(1.0);
    p->common.mag_gain[1] = AHRS_C(1.0);
    p->common.mag_gain[2] = AHRS_C(1.0);
    p->bias_limit = AHRS_C(0.2);
    p->gyro_noise = AHRS_C(0.0002);
    p->gyro_bias_noise = AHRS_C(0.000175);
    p->accel_noise = AHRS_C(0.1);
    p->mag_noise = AHRS_C(1e-07);
    p->motion_noise = AHRS_C(0.5);
    p->initial_attitude_std = AHRS_C(0.1);
    p->initial_bias_std = AHRS_C(0.02);
    p->alpha = AHRS_C(1.0);
    p->beta = AHRS_C(0.0);
    p->kappa = AHRS_C(0.0);
    u->gyro[0] = AHRS_C(0.0);
    u->gyro[1] = AHRS_C(0.0);
    u->gyro[2] = AHRS_C(0.0);
    u->accel[0] = AHRS_C(0.0);
    u->accel[1] = AHRS_C(0.0);
    u->accel[2] = AHRS_C(0.0);
    u->mag[0] = AHRS_C(0.0);
    u->mag[1] = AHRS_C(0.0);
    u->mag[2] = AHRS_C(0.0);
    u->accel_valid = 1;
    u->mag_valid = 1;
}

static void ukf_defaults(void *data) {
    ukf_instance *i = data;
    memset(i, 0, sizeof *i);
    ahrs_ukf_defaults(&i->params, &i->inputs);
}

static void ukf_init(void *data) {
    ukf_instance *i = data;
    ahrs_ukf_init(&i->state, &i->params);
}

static void ukf_update(void *data, ahrs_real dt) {
    ukf_instance *i = data;
    ahrs_ukf_update(&i->state, &i->params, &i->inputs, dt);
}

static void ukf_compute_outputs(void *data) {
    ukf_instance *i = data;
    ahrs_ukf_outputs(&i->state, &i->params, &i->outputs);
}

static const fmu_model ahrs_ukf_model = {
    "ukf", "UKF", sizeof(ukf_instance), {offsetof(ukf_instance, params), sizeof(((ukf_instance *)0)->params)}, {offsetof(ukf_instance, inputs), sizeof(((ukf_instance *)0)->inputs)}, {offsetof(ukf_instance, outputs), sizeof(((ukf_instance *)0)->outputs)}, {offsetof(ukf_instance, state), sizeof(((ukf_instance *)0)->state)},
    offsetof(ukf_instance, params.common.sample_time), 0.01,
    ukf_variables, sizeof ukf_variables / sizeof ukf_variables[0],
    ukf_limits, sizeof ukf_limits / sizeof ukf_limits[0],
    ukf_defaults, ukf_init, ukf_update, ukf_compute_outputs};

static const fmu_model *const ahrs_models[] = {
    &ahrs_adaptive_ckf_model,
    &ahrs_cg_ekf_model,
    &ahrs_complementary_model,
    &ahrs_gcf_model,
    &ahrs_improved_ekf_model,
    &ahrs_kcf_model,
    &ahrs_mahony_model,
    &ahrs_mahony_ekf_model,
    &ahrs_mekf_model,
    &ahrs_strapdown_model,
    &ahrs_ukf_model,
};

/* What a Modelica tool calls: an estimator as an external object (modelica/AHRSExternal). */
#ifndef AHRS_EXTERNAL_H
#define AHRS_EXTERNAL_H


#include "ModelicaUtilities.h"

#include <stdlib.h>
#include <string.h>

/* Numbers that a step gives: attitude, rate, gyroscope bias, status. */
enum { AHRS_EXTERNAL_Q = 0, AHRS_EXTERNAL_RATE = 4, AHRS_EXTERNAL_BIAS = 7, AHRS_EXTERNAL_STATUS = 10 };

typedef struct {
    const fmu_model *model;
    double instance[]; /* aligned for everything an instance holds */
} ahrs_external;

static const fmu_model *ahrs_external_model(const char *name) {
    for (size_t i = 0; i < sizeof ahrs_models / sizeof ahrs_models[0]; i++) {
        if (strcmp(ahrs_models[i]->name, name) == 0) {
            return ahrs_models[i];
        }
    }
    return NULL;
}

/* Whether the value is one that the variable may have; if so it is set. */
static bool ahrs_external_assign(const ahrs_external *e, const fmu_variable *v, size_t element, double value) {
    char *target = (char *)(uintptr_t)e->instance + v->offset;
    const bool above = (v->flags & FMU_MIN_OPEN) ? value > v->min : value >= v->min;
    const bool below = (v->flags & FMU_MAX_OPEN) ? value < v->max : value <= v->max;
    if (!above || !below) {
        return false;
    }
    if (v->type == FMU_REAL) {
        ((ahrs_real *)(void *)target)[element] = (ahrs_real)value;
    } else {
        ((int32_t *)(void *)target)[element] = (int32_t)value;
    }
    return true;
}

/* "kp" is the scalar parameter kp, "q0[2]" the second element of q0. Returns what is wrong, or NULL. */
static const char *ahrs_external_set(const ahrs_external *e, const char *name, double value) {
    const char *bracket = strchr(name, '[');
    const size_t length = bracket ? (size_t)(bracket - name) : strlen(name);
    const unsigned long index = bracket ? strtoul(bracket + 1, NULL, 10) : 1;
    for (size_t i = 0; i < e->model->n_variables; i++) {
        const fmu_variable *v = &e->model->variables[i];
        const bool is_parameter = v->role == FMU_FIXED || v->role == FMU_TUNABLE;
        if (is_parameter && strncmp(v->name, name, length) == 0 && v->name[length] == '\0') {
            if (index < 1 || index > v->size) {
                return "has no such element";
            }
            return ahrs_external_assign(e, v, index - 1, value) ? NULL : "is outside its limits";
        }
    }
    return "is no parameter of this estimator";
}

static const char *ahrs_external_broken_rule(const ahrs_external *e) {
    for (size_t i = 0; i < e->model->n_limits; i++) {
        const fmu_limit *limit = &e->model->limits[i];
        if (!limit->is_warning && !limit->holds(e->instance)) {
            return limit->says;
        }
    }
    return NULL;
}

/* Constructor. What is wrong is reported through ModelicaFormatError, which does not return. */
static inline void *ahrs_external_create(const char *model, const char *const *names, size_t n, const double *values) {
    const fmu_model *found = ahrs_external_model(model);
    if (!found) {
        ModelicaFormatError("AHRS: there is no estimator '%s'", model);
        return NULL;
    }
    ahrs_external *e = malloc(sizeof *e + found->instance_size);
    if (!e) {
        ModelicaError("AHRS: no memory for an estimator");
        return NULL;
    }
    e->model = found;
    found->defaults(e->instance);
    for (size_t i = 0; i < n; i++) {
        const char *problem = ahrs_external_set(e, names[i], values[i]);
        if (problem) {
            free(e);
            ModelicaFormatError("AHRS: %s: parameter %s = %g %s", model, names[i], values[i], problem);
            return NULL;
        }
    }
    const char *rule = ahrs_external_broken_rule(e);
    if (rule) {
        free(e);
        ModelicaFormatError("AHRS: %s: %s", model, rule);
        return NULL;
    }
    found->init(e->instance);
    return e;
}

static inline void ahrs_external_destroy(void *object) { free(object); }

/* One sample. */
static inline void ahrs_external_step(void *object, double dt, const double *gyro, const double *accel,
                                      const double *mag, int accel_valid, int mag_valid, double *y) {
    ahrs_external *e = object;
    char *instance = (char *)e->instance;
    /* Every estimator begins its inputs and outputs with the common ones. */
    ahrs_estimator_inputs *u = (ahrs_estimator_inputs *)(void *)(instance + e->model->inputs.offset);
    const ahrs_estimator_outputs_t *out =
        (const ahrs_estimator_outputs_t *)(const void *)(instance + e->model->outputs.offset);
    for (int i = 0; i < 3; i++) {
        u->gyro[i] = (ahrs_real)gyro[i];
        u->accel[i] = (ahrs_real)accel[i];
        u->mag[i] = (ahrs_real)mag[i];
    }
    u->accel_valid = accel_valid != 0;
    u->mag_valid = mag_valid != 0;
    e->model->update(e->instance, (ahrs_real)dt);
    e->model->compute_outputs(e->instance);
    for (int i = 0; i < 4; i++) {
        y[AHRS_EXTERNAL_Q + i] = (double)out->q[i];
    }
    for (int i = 0; i < 3; i++) {
        y[AHRS_EXTERNAL_RATE + i] = (double)out->rate[i];
        y[AHRS_EXTERNAL_BIAS + i] = (double)out->gyro_bias[i];
    }
    y[AHRS_EXTERNAL_STATUS] = (double)out->status;
}

#endif
