/* A loop over communication steps at the speed of C, for tests that run whole recordings through an FMU. */
#include <stddef.h>
#include <stdint.h>

typedef int (*set_2)(void *, const uint32_t *, size_t, const double *);
typedef int (*set_3)(void *, const uint32_t *, size_t, const double *, size_t);
typedef int (*get_2)(void *, const uint32_t *, size_t, double *);
typedef int (*get_3)(void *, const uint32_t *, size_t, double *, size_t);
typedef int (*step_2)(void *, double, double, int);
typedef int (*step_3)(void *, double, double, _Bool, _Bool *, _Bool *, _Bool *, double *);

enum { INPUTS = 9, OUTPUTS = 4 };

int64_t replay(int version, void *set, void *step, void *get, void *instance, const uint32_t *in, size_t n_in,
               const uint32_t *out, size_t n_out, int64_t steps, const double *from, const double *length,
               const int64_t *row, const double *rows, double *q);

/* Step j sets row[j] of the inputs, unless that is negative, takes a step, and reads the attitude. Returns the
 * number of steps that went well. */
int64_t replay(int version, void *set, void *step, void *get, void *instance, const uint32_t *in, size_t n_in,
               const uint32_t *out, size_t n_out, int64_t steps, const double *from, const double *length,
               const int64_t *row, const double *rows, double *q) {
    for (int64_t j = 0; j < steps; j++) {
        int status = 0;
        if (row[j] >= 0) {
            const double *values = rows + INPUTS * row[j];
            status |= version == 2 ? ((set_2)set)(instance, in, n_in, values)
                                   : ((set_3)set)(instance, in, n_in, values, INPUTS);
        }
        _Bool flags[3];
        double last;
        status |= version == 2
                      ? ((step_2)step)(instance, from[j], length[j], 1)
                      : ((step_3)step)(instance, from[j], length[j], 1, flags, flags + 1, flags + 2, &last);
        status |= version == 2 ? ((get_2)get)(instance, out, n_out, q + OUTPUTS * j)
                               : ((get_3)get)(instance, out, n_out, q + OUTPUTS * j, OUTPUTS);
        if (status != 0) {
            return j;
        }
    }
    return steps;
}
