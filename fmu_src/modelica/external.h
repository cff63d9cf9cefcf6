/* What a Modelica tool calls: an estimator as an external object (modelica/AHRSExternal). */
#ifndef AHRS_EXTERNAL_H
#define AHRS_EXTERNAL_H

#include "ahrs_estimator.h"
#include "model.h"

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
