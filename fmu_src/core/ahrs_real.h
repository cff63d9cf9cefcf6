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
