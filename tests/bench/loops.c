/* The loops that the benchmark times: samples in, updates, outputs out, as a C program or an importer does it. */
#define _POSIX_C_SOURCE 199309L
#include "model.h"

#include <string.h>
#include <time.h>

enum { SAMPLE = 9 }; /* gyro, accel, mag: the first inputs of every estimator */

size_t bench_size(const fmu_model *model);
size_t bench_outputs_size(const fmu_model *model);
void bench_begin(const fmu_model *model, char *instance, const char *name, int32_t value);
void bench_held(const fmu_model *model, char *instance, int64_t rows, double dt);
void bench_update(const fmu_model *model, char *instance, int64_t rows, double dt, const ahrs_real *samples);
void bench_outputs(const fmu_model *model, char *instance, int64_t rows, double dt, const ahrs_real *samples,
                   char *outputs);
void bench_fresh(const fmu_model *model, char *instance, int64_t rows, double dt, const ahrs_real *samples);
void bench_each(const fmu_model *model, char *instance, int64_t rows, double dt, const ahrs_real *samples,
                int64_t *least);

size_t bench_size(const fmu_model *model) { return model->instance_size; }

size_t bench_outputs_size(const fmu_model *model) { return model->outputs.size; }

/* A fresh instance in which the enumeration `name`, if there is one, has another value than its default. */
void bench_begin(const fmu_model *model, char *instance, const char *name, int32_t value) {
    model->defaults(instance);
    for (size_t i = 0; i < model->n_variables; i++) {
        if (strcmp(model->variables[i].name, name) == 0) {
            memcpy(instance + model->variables[i].offset, &value, sizeof value);
        }
    }
    model->init(instance);
}

/* The same sample again and again: what an FMU does in steps without new inputs. */
void bench_held(const fmu_model *model, char *instance, int64_t rows, double dt) {
    for (int64_t row = 0; row < rows; row++) {
        model->update(instance, (ahrs_real)dt);
    }
}

void bench_update(const fmu_model *model, char *instance, int64_t rows, double dt, const ahrs_real *samples) {
    for (int64_t row = 0; row < rows; row++) {
        memcpy(instance + model->inputs.offset, samples + SAMPLE * row, SAMPLE * sizeof *samples);
        model->update(instance, (ahrs_real)dt);
    }
}

/* A recording from a fresh start, with all outputs of every row. */
void bench_outputs(const fmu_model *model, char *instance, int64_t rows, double dt, const ahrs_real *samples,
                   char *outputs) {
    model->init(instance);
    for (int64_t row = 0; row < rows; row++) {
        memcpy(instance + model->inputs.offset, samples + SAMPLE * row, SAMPLE * sizeof *samples);
        model->update(instance, row > 0 ? (ahrs_real)dt : 0);
        model->compute_outputs(instance);
        memcpy(outputs + (size_t)row * model->outputs.size, instance + model->outputs.offset, model->outputs.size);
    }
}

/* A recording from a fresh start. */
void bench_fresh(const fmu_model *model, char *instance, int64_t rows, double dt, const ahrs_real *samples) {
    model->init(instance);
    bench_update(model, instance, rows, dt, samples);
}

static int64_t now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1000000000 * (int64_t)t.tv_sec + t.tv_nsec;
}

/* The same, with the nanoseconds of every update, where they are fewer than those in `least`. */
void bench_each(const fmu_model *model, char *instance, int64_t rows, double dt, const ahrs_real *samples,
                int64_t *least) {
    model->init(instance);
    for (int64_t row = 0; row < rows; row++) {
        memcpy(instance + model->inputs.offset, samples + SAMPLE * row, SAMPLE * sizeof *samples);
        const int64_t start = now(), clock = now() - start;
        model->update(instance, (ahrs_real)dt);
        const int64_t spent = now() - start - 2 * clock;
        least[row] = spent < least[row] ? spent : least[row];
    }
}

/* ---------------------------------------------------------------- an importer */

typedef int (*set_2)(void *, const uint32_t *, size_t, const double *);
typedef int (*set_3)(void *, const uint32_t *, size_t, const double *, size_t);
typedef int (*get_2)(void *, const uint32_t *, size_t, double *);
typedef int (*get_3)(void *, const uint32_t *, size_t, double *, size_t);
typedef int (*step_2)(void *, double, double, int);
typedef int (*step_3)(void *, double, double, _Bool, _Bool *, _Bool *, _Bool *, double *);

/* An FMU with the variables of type real that are set before each step and got after it. */
typedef struct {
    void *instance;
    void *set, *step, *get;
    const uint32_t *in, *out; /* value references */
    size_t n_in, n_out;       /* how many of them, 0 to leave this out */
    size_t n_values;          /* elements got */
} importer;

int bench_fmi2(const importer *i, int64_t first, int64_t rows, double dt, const double *samples, double *values);
int bench_fmi3(const importer *i, int64_t first, int64_t rows, double dt, const double *samples, double *values);

/* Steps of `dt` from first * dt on, up to the first that does not go well; returns its status. */
int bench_fmi2(const importer *i, int64_t first, int64_t rows, double dt, const double *samples, double *values) {
    int status = 0;
    for (int64_t row = 0; row < rows && status == 0; row++) {
        if (i->n_in > 0) {
            status |= ((set_2)i->set)(i->instance, i->in, i->n_in, samples + SAMPLE * row);
        }
        status |= ((step_2)i->step)(i->instance, (double)(first + row) * dt, dt, 1);
        if (i->n_out > 0) {
            status |= ((get_2)i->get)(i->instance, i->out, i->n_out, values);
        }
    }
    return status;
}

int bench_fmi3(const importer *i, int64_t first, int64_t rows, double dt, const double *samples, double *values) {
    int status = 0;
    _Bool event, terminate, early;
    double last;
    for (int64_t row = 0; row < rows && status == 0; row++) {
        if (i->n_in > 0) {
            status |= ((set_3)i->set)(i->instance, i->in, i->n_in, samples + SAMPLE * row, SAMPLE);
        }
        status |= ((step_3)i->step)(i->instance, (double)(first + row) * dt, dt, 1, &event, &terminate, &early, &last);
        if (i->n_out > 0) {
            status |= ((get_3)i->get)(i->instance, i->out, i->n_out, values, i->n_values);
        }
    }
    return status;
}
