/* The one interface between a model and everything that runs it: FMI 2, FMI 3, the host library.
 * A model's table of this shape is generated from its descriptor (models/NAME/NAME_table.c). */
#ifndef FMU_MODEL_H
#define FMU_MODEL_H

#include "ahrs_real.h"

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
