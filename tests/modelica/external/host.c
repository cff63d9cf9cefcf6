/* Calls an estimator as the code does that a Modelica tool generates: constructor, steps, destructor. */
#include "ahrs.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

int run(const char *kind, const char *const *names, int n_names, const double *values, int rows, double dt,
        const double *samples, double *results);
const char *last_error(void);
void *create_elsewhere(const char *kind);

static jmp_buf failed;
static char message[512];

/* A tool does not return from these: the simulation ends. */
void ModelicaError(const char *text) { ModelicaFormatError("%s", text); }

void ModelicaFormatError(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    longjmp(failed, 1);
}

const char *last_error(void) { return message; }

/* A row of samples: gyro, accel, mag, accel_valid, mag_valid. Gives 0, or 1 after an error. */
int run(const char *kind, const char *const *names, int n_names, const double *values, int rows, double dt,
        const double *samples, double *results) {
    message[0] = '\0';
    if (setjmp(failed)) {
        return 1;
    }
    void *object = ahrs_external_create(kind, names, (size_t)n_names, values);
    void *other = create_elsewhere(kind);
    for (int i = 0; i < rows; i++) {
        const double *row = samples + 11 * i;
        double unused[11];
        ahrs_external_step(object, dt, row, row + 3, row + 6, row[9] > 0.5, row[10] > 0.5, results + 11 * i);
        ahrs_external_step(other, dt, row + 3, row + 6, row, 1, 0, unused);
    }
    ahrs_external_destroy(other);
    ahrs_external_destroy(object);
    return 0;
}
