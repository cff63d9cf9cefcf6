/* What carries out a model's computations. engine_core.c calls the compiled model in this process; another
 * implementation may speak to a process elsewhere. The component above never sees the difference.
 *
 * `instance` is the model's data (parameters, inputs, outputs, state) as laid out by its table. `process` is
 * `process_size` zeroed bytes that the component keeps for the engine. A function that returns false has
 * written one line into `why` and has left the instance fit for another try. */
#ifndef FMU_ENGINE_H
#define FMU_ENGINE_H

#include "model.h"

/* Room for a traceback. */
enum { FMU_WHY_SIZE = 4096 };

typedef struct {
    char text[FMU_WHY_SIZE];
} fmu_why;

typedef struct {
    size_t process_size;

    /* Once, before anything else. `resources` is what the importer named: a URI in FMI 2, a path in FMI 3. */
    bool (*open)(void *process, const fmu_model *model, const char *resources, fmu_why *why);
    void (*close)(void *process);
    /* Back to before the first start. */
    void (*reset)(void *process);

    /* State as at the first instant, from the parameters and inputs present. Outputs are not computed. */
    bool (*start)(void *process, const fmu_model *model, void *instance, fmu_why *why);
    /* `ticks` updates of `dt` seconds each, the inputs held. */
    bool (*run)(void *process, const fmu_model *model, void *instance, uint32_t ticks, ahrs_real dt, fmu_why *why);
    bool (*outputs)(void *process, const fmu_model *model, void *instance, fmu_why *why);

    /* State kept outside the instance; the bytes stay valid until the next call. */
    bool (*save)(void *process, const void **bytes, size_t *size, fmu_why *why);
    bool (*restore)(void *process, const void *bytes, size_t size, fmu_why *why);

    /* What the model has printed since the last call, or NULL; valid until the next call. */
    const char *(*said)(void *process);
} fmu_engine;

extern const fmu_engine fmu_the_engine;

/* Memory for an engine that needs more than `process_size`; NULL when it is short. */
void *fmu_allocate(size_t size);
void fmu_release(void *memory);

#endif
