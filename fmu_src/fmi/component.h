/* One running model: life cycle, clock, access to variables, saved states and log, the same for every FMI
 * version. fmi2.c and fmi3.c only translate to it. */
#ifndef FMU_COMPONENT_H
#define FMU_COMPONENT_H

#include "engine.h"

/* Numbered as in FMI 2 and FMI 3. */
typedef enum { FMU_OK, FMU_WARNING, FMU_DISCARD, FMU_ERROR, FMU_FATAL } fmu_status;

typedef enum { FMU_INSTANTIATED = 1, FMU_INITIALISING = 2, FMU_STEPPING = 4, FMU_TERMINATED = 8 } fmu_phase;
enum { FMU_ANY_PHASE = FMU_INSTANTIATED | FMU_INITIALISING | FMU_STEPPING | FMU_TERMINATED };

/* What the elements of an importer's array are. */
typedef enum { FMU_DOUBLES, FMU_INT32S, FMU_INT64S, FMU_BOOLS } fmu_form;

/* How an importer wants its variables: one reference per element, or per variable. */
typedef enum { FMU_SCALARS, FMU_ARRAYS } fmu_addressing;

/* Where log lines go: `write` is the FMI version's own translation, `callback` the importer's function. */
typedef struct fmu_logger {
    void (*write)(const struct fmu_logger *logger, const char *instance_name, fmu_status status,
                  const char *category, const char *message);
    void (*callback)(void);
    void *environment;
} fmu_logger;

typedef struct {
    const char *name;
    const char *token;          /* as the importer gave it */
    const char *expected_token; /* as compiled in */
    const char *resources;
    fmu_addressing addressing;
    bool log_events;
    fmu_logger logger;
    const char *function; /* that creates it, for the log */
} fmu_request;

typedef struct fmu_component fmu_component;

/* NULL, with a log line, when the request is refused or memory is short. */
fmu_component *fmu_create(const fmu_model *model, const fmu_request *request);
void fmu_destroy(fmu_component *c);

/* To be asked first in every FMI function: false, with a log line, when it may not be called in this phase. */
bool fmu_enter(fmu_component *c, const char *function, unsigned phases);
/* Writes the log line and is FMU_ERROR. */
fmu_status fmu_refuse(fmu_component *c, const char *format, ...);
/* A log line from a function that has no component yet. */
void fmu_log_refusal(const fmu_logger *logger, const char *name, const char *function, const char *reason);
fmu_status fmu_set_logging(fmu_component *c, bool on, size_t n, const char *const categories[]);

fmu_status fmu_set_start(fmu_component *c, double start, bool stop_defined, double stop);
fmu_status fmu_enter_initialisation(fmu_component *c);
fmu_status fmu_exit_initialisation(fmu_component *c);
fmu_status fmu_terminate(fmu_component *c);
fmu_status fmu_reset(fmu_component *c);

/* Runs the ticks inside (time, time + step]. */
fmu_status fmu_step(fmu_component *c, double time, double step);
double fmu_time(const fmu_component *c);

/* `types` is a set of 1 << fmu_type. Either all values are set or none. */
fmu_status fmu_get(fmu_component *c, unsigned types, fmu_form form, const uint32_t vrs[], size_t n_vrs,
                   void *values, size_t n_values);
fmu_status fmu_set(fmu_component *c, unsigned types, fmu_form form, const uint32_t vrs[], size_t n_vrs,
                   const void *values, size_t n_values);

fmu_status fmu_save_state(fmu_component *c, void **state);
fmu_status fmu_restore_state(fmu_component *c, const void *state);
fmu_status fmu_free_state(fmu_component *c, void **state);
fmu_status fmu_state_size(fmu_component *c, const void *state, size_t *size);
fmu_status fmu_serialise(fmu_component *c, const void *state, void *bytes, size_t size);
fmu_status fmu_deserialise(fmu_component *c, const void *bytes, size_t size, void **state);

#endif
