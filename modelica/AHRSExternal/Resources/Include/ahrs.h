/* The attitude estimators in C, generated from fmu_src by `python -m ahrs_fmu.export.modelica`. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
#endif

/* Generated from models/gcf/gcf.toml by `python -m ahrs_fmu.export.headers`: change that file, not this one. */
#ifndef AHRS_GCF_H
#define AHRS_GCF_H

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
    return x < low ? low : (x > high ? high : x);
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
    int32_t frame; /* Navigation and body frame of inputs and outputs (enumeration frame) */
    int32_t field_reference; /* Where the local magnetic field is known from (enumeration field_reference) */
    int32_t initialisation; /* Where the first attitude comes from (enumeration initialisation) */
    int32_t motion_compensation; /* Subtract the estimated motion acceleration from the accelerometer; tilt is then observed more slowly */
    int32_t accel_gating; /* Ignore the accelerometer while its magnitude is far from gravity */
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
    ahrs_real motion_accel[3]; /* Estimated motion acceleration, body axes [m/s2] */
    ahrs_real field[2]; /* Reference field: horizontal and downward part [T] */
    ahrs_real accel_sum[3]; /* Sum of the accelerometer samples that initialise the attitude [m/s2] */
    ahrs_real mag_sum[3]; /* Sum of the magnetometer samples that initialise the attitude [T] */
    ahrs_real elapsed; /* Time since the first sample that initialises the attitude [s] */
    ahrs_real gated; /* Time for which the accelerometer has been ignored because of its magnitude [s] */
    int32_t conditions; /* Bits of ahrs_condition: what is known, what was used, what went wrong at the last sample */
} ahrs_estimator_state;

#endif

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

/* Unit quaternions, Hamilton product, scalar first, passed by value.
 * As an attitude q turns body vectors into navigation vectors: v_n = q v_b q* (docs/algorithms.md section 0). */
#ifndef AHRS_QUAT_H
#define AHRS_QUAT_H

/* 3 x 3 matrices, row by row, passed by value. */
#ifndef AHRS_MAT3_H
#define AHRS_MAT3_H

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

static inline bool ahrs_vec3_is_finite(ahrs_vec3 a) {
    return ahrs_is_finite(a.x) && ahrs_is_finite(a.y) && ahrs_is_finite(a.z);
}

#endif

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

#endif
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
    if (!(x < 80)) {
        return 0;
    }
    const int32_t k = (int32_t)(x * AHRS_C(1.4426950408889634) + AHRS_C(0.5));
    const ahrs_real n = (ahrs_real)k;
    const ahrs_real r = (x - n * AHRS_LN2_1) - n * AHRS_LN2_2;
    ahrs_real y = 1;
    for (int32_t i = 15; i > 0; i--) {
        y = 1 - y * r / (ahrs_real)i;
    }
    for (int32_t i = 0; i < k; i++) {
        y *= AHRS_C(0.5);
    }
    return y;
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
    return (ahrs_quat){p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z, p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
                       p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x, p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w};
}

static inline ahrs_quat ahrs_quat_conj(ahrs_quat q) { return (ahrs_quat){q.w, -q.x, -q.y, -q.z}; }
static inline ahrs_quat ahrs_quat_negate(ahrs_quat q) { return (ahrs_quat){-q.w, -q.x, -q.y, -q.z}; }
static inline ahrs_real ahrs_quat_dot(ahrs_quat p, ahrs_quat q) { return p.w * q.w + p.x * q.x + p.y * q.y + p.z * q.z; }

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

/* Rotation vector to quaternion: [cos(|v|/2), sin(|v|/2) v/|v|]. */
static inline ahrs_quat ahrs_quat_exp_large(ahrs_vec3 v) {
    const ahrs_real half = AHRS_C(0.5) * ahrs_vec3_norm(v);
    ahrs_real sine, cosine;
    ahrs_sincos(half, &sine, &cosine);
    const ahrs_real k = AHRS_C(0.5) * sine / half;
    return (ahrs_quat){cosine, k * v.x, k * v.y, k * v.z};
}

static inline ahrs_quat ahrs_quat_exp(ahrs_vec3 v) {
    const ahrs_real x2 = AHRS_C(0.25) * ahrs_vec3_norm2(v);
    if (x2 > AHRS_C(0.01)) {
        return ahrs_quat_exp_large(v);
    }
    /* The rotation of one sample seldom exceeds 0.2 rad: the series are short. */
    const ahrs_real x4 = x2 * x2;
    const ahrs_real cosine = (1 - AHRS_C(0.5) * x2) + x4 * (AHRS_C(0.041666666666666664) - AHRS_C(0.001388888888888889) * x2 +
                                                            AHRS_C(2.48015873015873e-05) * x4);
    const ahrs_real k = (AHRS_C(0.5) - AHRS_C(0.08333333333333333) * x2) +
                        x4 * (AHRS_C(0.004166666666666667) - AHRS_C(9.92063492063492e-05) * x2 +
                              AHRS_C(1.3778659611992945e-06) * x4);
    return (ahrs_quat){cosine, k * v.x, k * v.y, k * v.z};
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
static inline ahrs_vec3 ahrs_quat_north(ahrs_quat q) {
    return (ahrs_vec3){q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z, 2 * (q.x * q.y - q.w * q.z),
                       2 * (q.x * q.z + q.w * q.y)};
}

static inline ahrs_vec3 ahrs_quat_east(ahrs_quat q) {
    return (ahrs_vec3){2 * (q.x * q.y + q.w * q.z), q.w * q.w - q.x * q.x + q.y * q.y - q.z * q.z,
                       2 * (q.y * q.z - q.w * q.x)};
}

static inline ahrs_vec3 ahrs_quat_down(ahrs_quat q) {
    return (ahrs_vec3){2 * (q.x * q.z - q.w * q.y), 2 * (q.y * q.z + q.w * q.x),
                       q.w * q.w - q.x * q.x - q.y * q.y + q.z * q.z};
}

static inline ahrs_mat3 ahrs_quat_to_mat3(ahrs_quat q) {
    return (ahrs_mat3){{ahrs_quat_north(q), ahrs_quat_east(q), ahrs_quat_down(q)}};
}

/* Body to navigation, and back. */
static inline ahrs_vec3 ahrs_quat_rotate(ahrs_quat q, ahrs_vec3 v) { return ahrs_mat3_apply(ahrs_quat_to_mat3(q), v); }

static inline ahrs_vec3 ahrs_quat_rotate_back(ahrs_quat q, ahrs_vec3 v) {
    return ahrs_mat3_apply_transposed(ahrs_quat_to_mat3(q), v);
}

/* From a rotation matrix; the largest component is the pivot, so that no division is by a small number. */
static inline ahrs_quat ahrs_quat_from_mat3(ahrs_mat3 c) {
    const ahrs_vec3 *r = c.row;
    ahrs_quat q;
    if (r[0].x + r[1].y + r[2].z > 0) {
        q = (ahrs_quat){1 + r[0].x + r[1].y + r[2].z, r[2].y - r[1].z, r[0].z - r[2].x, r[1].x - r[0].y};
    } else if (r[0].x >= r[1].y && r[0].x >= r[2].z) {
        q = (ahrs_quat){r[2].y - r[1].z, 1 + r[0].x - r[1].y - r[2].z, r[1].x + r[0].y, r[0].z + r[2].x};
    } else if (r[1].y >= r[2].z) {
        q = (ahrs_quat){r[0].z - r[2].x, r[1].x + r[0].y, 1 - r[0].x + r[1].y - r[2].z, r[2].y + r[1].z};
    } else {
        q = (ahrs_quat){r[1].x - r[0].y, r[0].z + r[2].x, r[2].y + r[1].z, 1 - r[0].x - r[1].y + r[2].z};
    }
    return ahrs_quat_unit(q);
}

/* Roll, pitch and yaw, z-y-x order (docs/algorithms.md section 0). */
static inline ahrs_vec3 ahrs_quat_to_euler(ahrs_quat q) {
    const ahrs_vec3 down = ahrs_quat_down(q);
    const ahrs_real north_x = q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z;
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

/* Bits of ahrs_estimator_state.conditions. */
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
    AHRS_MAG_DISTURBED = 4096
};

/* Those that tell of one sample only. */
#define AHRS_MOMENTARY                                                                                           \
    (AHRS_GYRO_HELD | AHRS_ACCEL_USED | AHRS_MAG_USED | AHRS_STEP_REJECTED | AHRS_COVARIANCE_RESET |           \
     AHRS_IMPLAUSIBLE | AHRS_MAG_DISTURBED)

typedef enum {
    AHRS_WAIT,  /* nothing to do: no attitude yet, or no time has passed */
    AHRS_START, /* the first attitude is in the common state: begin from it */
    AHRS_TURN,  /* as AHRS_RUN, after taking over the attitude in the common state: its heading was turned */
    AHRS_RUN    /* predict and correct */
} ahrs_action;

/* One sample in inner axes. Vectors that are not usable are zero. */
typedef struct {
    ahrs_vec3 rate;  /* rad/s */
    ahrs_vec3 force; /* m/s2, the accelerometer as read */
    ahrs_vec3 accel; /* m/s2, without the motion acceleration where that is compensated */
    ahrs_vec3 mag;   /* T */
    bool force_usable, accel_usable, mag_usable;
    ahrs_real dt;      /* s, of the prediction */
    ahrs_real gain_dt; /* s, of the correction: 0 after a gap */
} ahrs_sample;

static inline bool ahrs_condition(const ahrs_estimator_state *s, int32_t bit) { return (s->conditions & bit) != 0; }

static inline void ahrs_set_condition(ahrs_estimator_state *s, int32_t bit, bool on) {
    s->conditions = on ? s->conditions | bit : s->conditions & ~bit;
}

/* Forward-left-up to forward-right-down, and back. */
static inline ahrs_vec3 ahrs_swap_body(int32_t frame, ahrs_vec3 v) {
    return frame == AHRS_FRAME_ENU ? (ahrs_vec3){v.x, -v.y, -v.z} : v;
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
    return ahrs_vec3_norm2(ahrs_vec3_cross(vertical, mag)) >
           AHRS_MAG_SINE * AHRS_MAG_SINE * (ahrs_vec3_norm2(vertical) * ahrs_vec3_norm2(mag));
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
    const ahrs_vec3 gyro = ahrs_vec3_of(u->gyro), accel = ahrs_vec3_of(u->accel), mag = ahrs_vec3_of(u->mag);
    if (ahrs_vec3_norm2(gyro) <= AHRS_GYRO_LIMIT * AHRS_GYRO_LIMIT) {
        z.rate = ahrs_swap_body(p->frame, gyro);
        ahrs_vec3_to(s->gyro, z.rate);
    } else {
        z.rate = ahrs_vec3_of(s->gyro);
        s->conditions |= AHRS_GYRO_HELD;
    }
    const ahrs_real least = AHRS_ACCEL_LEAST * p->gravity;
    const ahrs_real force2 = ahrs_vec3_norm2(accel);
    if (u->accel_valid && force2 > least * least && force2 <= AHRS_ACCEL_LIMIT * AHRS_ACCEL_LIMIT) {
        z.force = ahrs_swap_body(p->frame, accel);
        z.force_usable = true;
    }
    if (u->mag_valid && ahrs_vec3_norm2(mag) <= AHRS_MAG_LIMIT * AHRS_MAG_LIMIT) {
        z.mag = ahrs_swap_body(p->frame, mag);
        const ahrs_vec3 vertical = z.force_usable ? z.force : ahrs_quat_down(ahrs_quat_of(s->q));
        z.mag_usable = ahrs_has_horizontal_part(z.mag, vertical);
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

static inline void ahrs_start(ahrs_estimator_state *s, const ahrs_estimator_params *p, const ahrs_sample *z) {
    const ahrs_vec3 down = ahrs_quat_down(ahrs_quat_of(s->q));
    s->conditions |= AHRS_HAS_ATTITUDE;
    ahrs_learn_field(s, p, z->mag_usable ? z->mag : (ahrs_vec3){0, 0, 0});
    ahrs_vec3_to(s->motion_accel,
                 z->force_usable ? ahrs_vec3_add_scaled(z->force, p->gravity, down) : (ahrs_vec3){0, 0, 0});
    ahrs_set_condition(s, AHRS_ACCEL_USED, z->force_usable);
    ahrs_set_condition(s, AHRS_MAG_USED, z->mag_usable);
}

/* Whether the accelerometer is so far from gravity that it is ignored, for a limited time. */
static inline bool ahrs_is_gated(ahrs_estimator_state *s, const ahrs_estimator_params *p, const ahrs_sample *z) {
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

/* The part of a sample that needs an attitude: reference field, gating, motion compensation. */
AHRS_INLINE ahrs_action ahrs_prepare_sample(ahrs_estimator_state *s, const ahrs_estimator_params *p, ahrs_sample *z) {
    const bool turn = z->mag_usable && !ahrs_condition(s, AHRS_HAS_HEADING);
    if (turn) {
        ahrs_align_heading(s, z->mag);
    }
    if (z->mag_usable && !ahrs_condition(s, AHRS_HAS_FIELD)) {
        ahrs_learn_field(s, p, z->mag);
    }
    const ahrs_real least2 =
        AHRS_MAG_LEAST * AHRS_MAG_LEAST * (s->field[0] * s->field[0] + s->field[1] * s->field[1]);
    z->mag_usable = z->mag_usable && ahrs_vec3_norm2(z->mag) > least2;
    z->accel_usable = z->force_usable && !(p->accel_gating && ahrs_is_gated(s, p, z));
    z->accel = z->force;
    if (p->motion_compensation) {
        const ahrs_real kept = ahrs_exp_decay(z->dt / p->motion_time_constant);
        const ahrs_vec3 motion = ahrs_vec3_scale(ahrs_vec3_of(s->motion_accel), kept);
        z->accel = ahrs_vec3_sub(z->force, motion);
        z->accel_usable = z->accel_usable && ahrs_vec3_norm2(z->accel) > 0;
        if (!z->force_usable) {
            ahrs_vec3_to(s->motion_accel, motion);
        }
    }
    ahrs_set_condition(s, AHRS_ACCEL_USED, z->accel_usable && z->gain_dt > 0);
    ahrs_set_condition(s, AHRS_MAG_USED, z->mag_usable && z->gain_dt > 0);
    return turn ? AHRS_TURN : AHRS_RUN;
}

static inline void ahrs_estimator_init(ahrs_estimator_state *s) {
    *s = (ahrs_estimator_state){.q = {1, 0, 0, 0}};
}

/* Takes in one sample and tells the estimator what to do with it. */
AHRS_INLINE ahrs_action ahrs_estimator_begin(ahrs_estimator_state *s, const ahrs_estimator_params *p,
                                             const ahrs_estimator_inputs *u, ahrs_real dt, ahrs_sample *z) {
    if (!(dt >= 0 && ahrs_is_finite(dt))) {
        s->conditions |= AHRS_STEP_REJECTED;
        return AHRS_WAIT;
    }
    const bool has_attitude = ahrs_condition(s, AHRS_HAS_ATTITUDE);
    if (has_attitude && !(dt > 0)) {
        return AHRS_WAIT;
    }
    s->conditions &= ~AHRS_MOMENTARY;
    *z = ahrs_read_sample(s, p, u, dt);
    if (has_attitude) {
        return ahrs_prepare_sample(s, p, z);
    }
    if (p->initialisation == AHRS_INITIALISATION_GIVEN) {
        ahrs_quat_to(s->q, ahrs_from_output_frame(p, ahrs_quat_unit(ahrs_quat_of(p->q0))));
        s->conditions |= AHRS_HAS_HEADING;
    } else if (!ahrs_initialise_from_sensors(s, p, z)) {
        return AHRS_WAIT;
    }
    ahrs_start(s, p, z);
    return AHRS_START;
}

/* Takes over the attitude after a sample, a unit quaternion; one that has lost its meaning is initialised anew. */
AHRS_INLINE void ahrs_estimator_end(ahrs_estimator_state *s, const ahrs_estimator_params *p, const ahrs_sample *z,
                                    ahrs_quat q) {
    const ahrs_real norm2 = ahrs_quat_dot(q, q);
    if (!(norm2 > AHRS_C(0.5) && norm2 < AHRS_C(2.0))) {
        ahrs_estimator_init(s);
        return;
    }
    ahrs_quat next = q;
    if (AHRS_UNLIKELY(ahrs_quat_dot(q, ahrs_quat_of(s->q)) < 0)) {
        next = ahrs_quat_negate(q);
    }
    ahrs_quat_to(s->q, next);
    if (z->force_usable) {
        ahrs_vec3_to(s->motion_accel, ahrs_vec3_add_scaled(z->force, p->gravity, ahrs_quat_down(next)));
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

/* The common outputs; `bias` is the gyroscope bias in inner axes. */
static inline void ahrs_estimator_outputs(const ahrs_estimator_state *s, const ahrs_estimator_params *p,
                                          ahrs_vec3 bias, ahrs_estimator_outputs_t *y) {
    const ahrs_quat q = ahrs_to_output_frame(p, ahrs_quat_of(s->q));
    const ahrs_vec3 euler = ahrs_quat_to_euler(q);
    ahrs_quat_to(y->q, q);
    y->roll = euler.x;
    y->pitch = euler.y;
    y->yaw = euler.z;
    ahrs_vec3_to(y->rate, ahrs_swap_body(p->frame, ahrs_vec3_sub(ahrs_vec3_of(s->gyro), bias)));
    ahrs_vec3_to(y->gyro_bias, ahrs_swap_body(p->frame, bias));
    ahrs_vec3_to(y->motion_accel, ahrs_swap_body(p->frame, ahrs_vec3_of(s->motion_accel)));
    y->status = ahrs_status_of(s);
    y->gyro_held = ahrs_condition(s, AHRS_GYRO_HELD);
    y->accel_used = ahrs_condition(s, AHRS_ACCEL_USED);
    y->mag_used = ahrs_condition(s, AHRS_MAG_USED);
}

#endif
/* Generalized complementary filter (docs/algorithms.md section 5). */

/* An attitude in the form of its realisation: a quaternion (quaternion, euler), or the navigation axes seen from the
 * body, which are the rows of the rotation matrix (dcm) or the first and the last of them (vector). */
typedef struct {
    int32_t realisation;
    ahrs_quat q;
    ahrs_mat3 c;
} gcf_attitude;

/* The axes that errors are formed with, seen from the body. */
typedef struct {
    ahrs_vec3 north, down;
} gcf_nav_axes;

enum { gcf_NORTH, gcf_EAST, gcf_DOWN };

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
        for (int32_t i = gcf_NORTH; i <= gcf_DOWN; i++) {
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
        for (int32_t i = gcf_NORTH; i <= gcf_DOWN; i++) {
            ahrs_vec3_to(&s->store[3 * i], a.c.row[i]);
        }
    } else if (a.realisation == AHRS_GCF_REALISATION_EULER) {
        ahrs_vec3_to(s->store, ahrs_quat_to_euler(a.q));
    }
}

AHRS_INLINE ahrs_quat gcf_quaternion_of(gcf_attitude a) {
    if (a.realisation == AHRS_GCF_REALISATION_VECTOR) {
        a.c.row[gcf_EAST] = ahrs_vec3_cross(a.c.row[gcf_DOWN], a.c.row[gcf_NORTH]);
    }
    return gcf_has_axes(a.realisation) ? ahrs_quat_from_mat3(a.c) : a.q;
}

AHRS_INLINE gcf_nav_axes gcf_axes_of(gcf_attitude a) {
    if (gcf_has_axes(a.realisation)) {
        return (gcf_nav_axes){a.c.row[gcf_NORTH], a.c.row[gcf_DOWN]};
    }
    return (gcf_nav_axes){ahrs_quat_north(a.q), ahrs_quat_down(a.q)};
}

/* Seen from the body, axes fixed in space turn backwards as the body turns by r. The two vectors are kept of unit length
 * and at right angles; down leads, because it is the better known. */
static ahrs_mat3 gcf_rotated_vectors(ahrs_mat3 c, ahrs_quat r) {
    const ahrs_vec3 down = ahrs_vec3_unit(ahrs_quat_rotate_back(r, c.row[gcf_DOWN]));
    const ahrs_vec3 turned = ahrs_quat_rotate_back(r, c.row[gcf_NORTH]);
    const ahrs_vec3 north = ahrs_vec3_unit(ahrs_vec3_add_scaled(turned, -ahrs_vec3_dot(turned, down), down));
    return (ahrs_mat3){{north, c.row[gcf_EAST], down}};
}

/* C R(r), then one step C := (3 C - C C' C)/2 towards the nearest rotation matrix. */
static ahrs_mat3 gcf_rotated_matrix(ahrs_mat3 c, ahrs_quat r) {
    const ahrs_mat3 turned = ahrs_mat3_mul(c, ahrs_quat_to_mat3(r));
    ahrs_mat3 gcf_refined;
    for (int32_t i = gcf_NORTH; i <= gcf_DOWN; i++) {
        const ahrs_vec3 back = ahrs_mat3_apply_transposed(turned, ahrs_mat3_apply(turned, turned.row[i]));
        gcf_refined.row[i] = ahrs_vec3_add_scaled(ahrs_vec3_scale(turned.row[i], AHRS_C(1.5)), AHRS_C(-0.5), back);
    }
    return gcf_refined;
}

/* The attitude after the body has turned by the rotation vector v. */
AHRS_INLINE gcf_attitude gcf_rotated(gcf_attitude a, ahrs_vec3 v) {
    const ahrs_quat r = ahrs_quat_exp(v);
    if (gcf_has_axes(a.realisation)) {
        a.c = a.realisation == AHRS_GCF_REALISATION_DCM ? gcf_rotated_matrix(a.c, r) : gcf_rotated_vectors(a.c, r);
    } else {
        a.q = ahrs_quat_mul(a.q, r);
    }
    return a;
}

/* Tilt from gravity, heading from the horizontal field: loop gain one on all axes. */
AHRS_INLINE ahrs_vec3 gcf_decoupled_error(gcf_nav_axes n, const ahrs_sample *z) {
    ahrs_vec3 e = {0, 0, 0};
    if (z->accel_usable) {
        e = ahrs_vec3_cross(n.down, ahrs_vec3_unit(z->accel)); /* a x s with s = -down */
    }
    if (z->mag_usable) {
        const ahrs_real x = ahrs_vec3_dot(n.north, z->mag);
        const ahrs_real y = ahrs_vec3_dot(ahrs_vec3_cross(n.down, n.north), z->mag);
        const ahrs_real norm2 = x * x + y * y;
        if (norm2 > 0) {
            e = ahrs_vec3_add_scaled(e, -y / ahrs_sqrt(norm2), n.down);
        }
    }
    return e;
}

/* Both cross products, measured x expected, weighted: loop gain kg (I - gg') + kh (I - hh'). */
static ahrs_vec3 gcf_coupled_error(const ahrs_gcf_state *s, const ahrs_gcf_params *p, gcf_nav_axes n, const ahrs_sample *z) {
    ahrs_vec3 e = {0, 0, 0};
    if (z->accel_usable) {
        e = ahrs_vec3_scale(ahrs_vec3_cross(n.down, ahrs_vec3_unit(z->accel)), p->kg);
    }
    const ahrs_vec3 field =
        ahrs_vec3_add_scaled(ahrs_vec3_scale(n.north, s->common.field[0]), s->common.field[1], n.down);
    if (z->mag_usable && ahrs_vec3_norm2(field) > 0) {
        const ahrs_vec3 cross = ahrs_vec3_cross(ahrs_vec3_unit(z->mag), ahrs_vec3_unit(field));
        e = ahrs_vec3_add_scaled(e, p->kh, cross);
    }
    return e;
}

/* The rotation from the predicted attitude to the one that accelerometer and magnetometer show. Without a usable
 * magnetometer it is the shortest one that brings down to its measured direction. */
static ahrs_vec3 gcf_attitude_error(gcf_attitude a, const ahrs_sample *z) {
    const ahrs_vec3 predicted = gcf_axes_of(a).down;
    if (!z->accel_usable) {
        return gcf_decoupled_error(gcf_axes_of(a), z);
    }
    if (z->mag_usable) {
        return ahrs_quat_log(ahrs_quat_mul(ahrs_quat_conj(gcf_quaternion_of(a)), ahrs_attitude_of(z->accel, z->mag)));
    }
    const ahrs_vec3 measured = ahrs_vec3_unit(ahrs_vec3_negate(z->accel));
    const ahrs_vec3 cross = ahrs_vec3_cross(measured, predicted);
    const ahrs_real sine = ahrs_vec3_norm(cross);
    return sine > 0 ? ahrs_vec3_scale(cross, ahrs_atan2(sine, ahrs_vec3_dot(measured, predicted)) / sine) : cross;
}

AHRS_INLINE ahrs_vec3 gcf_error_of(const ahrs_gcf_state *s, const ahrs_gcf_params *p, gcf_attitude a, const ahrs_sample *z) {
    if (p->form == AHRS_GCF_FORM_ATTITUDE) {
        return gcf_attitude_error(a, z);
    }
    return p->error == AHRS_GCF_ERROR_COUPLED ? gcf_coupled_error(s, p, gcf_axes_of(a), z) : gcf_decoupled_error(gcf_axes_of(a), z);
}

AHRS_INLINE ahrs_vec3 gcf_limited(ahrs_vec3 v, ahrs_real limit) {
    return (ahrs_vec3){ahrs_clamp(v.x, -limit, limit), ahrs_clamp(v.y, -limit, limit), ahrs_clamp(v.z, -limit, limit)};
}

static inline void ahrs_gcf_init(ahrs_gcf_state *s, const ahrs_gcf_params *p) {
    (void)p;
    *s = (ahrs_gcf_state){.bias = {0}};
    ahrs_estimator_init(&s->common);
}

/* Rounding of a product of unit quaternions taken out; matrices and vectors are kept so by their rotation. */
AHRS_INLINE gcf_attitude gcf_refined(gcf_attitude a) {
    a.q = ahrs_quat_refine(a.q);
    return a;
}

/* One prediction and one correction; the realisation is a constant wherever this is used. */
AHRS_INLINE void gcf_step(ahrs_gcf_state *s, const ahrs_gcf_params *p, const ahrs_sample *z, int32_t realisation) {
    const ahrs_real T = z->gain_dt;
    const ahrs_vec3 bias = ahrs_vec3_of(s->bias);
    const gcf_attitude predicted = gcf_rotated(gcf_load(s, realisation), ahrs_vec3_scale(ahrs_vec3_sub(z->rate, bias), z->dt));
    const ahrs_vec3 e = gcf_error_of(s, p, predicted, z);
    const ahrs_vec3 drift = ahrs_vec3_add_scaled(ahrs_vec3_of(s->drift), T * p->kii, e);
    const ahrs_vec3 slope = ahrs_vec3_add_scaled(drift, p->ki, e);
    const gcf_attitude corrected = gcf_rotated(gcf_refined(predicted), ahrs_vec3_scale(e, p->kp * T));

    ahrs_vec3_to(s->drift, drift);
    ahrs_vec3_to(s->bias, gcf_limited(ahrs_vec3_add_scaled(bias, -T, slope), p->bias_limit));
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
    return (p->kp * p->common.sample_time) < 1;
}

static const uint32_t gcf_limit_2_vrs[] = {1000, 200};

static bool gcf_limit_3(const void *data) {
    const ahrs_gcf_params *p = &((const gcf_instance *)data)->params;
    return (p->error == AHRS_GCF_ERROR_DECOUPLED) || (((p->kp * (p->kg + p->kh)) * p->common.sample_time) < 1);
}

static const uint32_t gcf_limit_3_vrs[] = {1012, 200, 1000, 1013, 1014};

static bool gcf_limit_4(const void *data) {
    const ahrs_gcf_params *p = &((const gcf_instance *)data)->params;
    return ((p->ki * p->common.sample_time) * p->common.sample_time) < (4 - ((2 * p->kp) * p->common.sample_time));
}

static const uint32_t gcf_limit_4_vrs[] = {200, 1001, 1000};

static bool gcf_limit_5(const void *data) {
    const ahrs_gcf_params *p = &((const gcf_instance *)data)->params;
    return (p->kii == 0) || ((p->kp * p->ki) > p->kii);
}

static const uint32_t gcf_limit_5_vrs[] = {1002, 1000, 1001};

static bool gcf_limit_6(const void *data) {
    const ahrs_gcf_params *p = &((const gcf_instance *)data)->params;
    return (p->realisation != AHRS_GCF_REALISATION_VECTOR) || (p->form == AHRS_GCF_FORM_DIRECT);
}

static const uint32_t gcf_limit_6_vrs[] = {1010, 1011};

static bool gcf_limit_7(const void *data) {
    const ahrs_gcf_params *p = &((const gcf_instance *)data)->params;
    return (p->error == AHRS_GCF_ERROR_DECOUPLED) || (p->form == AHRS_GCF_FORM_DIRECT);
}

static const uint32_t gcf_limit_7_vrs[] = {1012, 1011};

static const fmu_limit gcf_limits[] = {
    {"initialisation == sensors or q0[0]*q0[0] + q0[1]*q0[1] + q0[2]*q0[2] + q0[3]*q0[3] > 1e-6", "q0 has no direction: give a quaternion of about unit length", false, gcf_limit_0_vrs, 2, gcf_limit_0},
    {"not motion_compensation or motion_time_constant < inf", "tilt is not observed at all with an infinite motion_time_constant: use it for bursts of less than half a minute only", true, gcf_limit_1_vrs, 2, gcf_limit_1},
    {"kp*sample_time < 1", "the filter would correct more than the whole error in one sample: lower kp or sample_time", false, gcf_limit_2_vrs, 2, gcf_limit_2},
    {"error == decoupled or kp*(kg + kh)*sample_time < 1", "the coupled error raises the loop gain to kg + kh: lower kp, kg, kh or sample_time", false, gcf_limit_3_vrs, 5, gcf_limit_3},
    {"ki*sample_time*sample_time < 4 - 2*kp*sample_time", "the sampled loop is unstable: lower ki or sample_time", false, gcf_limit_4_vrs, 3, gcf_limit_4},
    {"kii == 0 or kp*ki > kii", "the third-order loop is unstable: lower kii, or raise kp or ki", false, gcf_limit_5_vrs, 3, gcf_limit_5},
    {"realisation != vector or form == direct", "realisation vector stores the measured directions and knows form direct only", false, gcf_limit_6_vrs, 2, gcf_limit_6},
    {"error == decoupled or form == direct", "form attitude has unit loop gain by construction: error coupled goes with form direct", false, gcf_limit_7_vrs, 2, gcf_limit_7},
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

static const fmu_model *const ahrs_models[] = {
    &ahrs_gcf_model,
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
