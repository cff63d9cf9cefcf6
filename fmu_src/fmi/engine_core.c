/* The model runs in this process; all of its state is in the instance. */
#include "engine.h"

#include <stdio.h>

static bool open_core(void *process, const fmu_model *model, const char *resources, fmu_why *why) {
    (void)process, (void)model, (void)resources, (void)why;
    return true;
}

static void close_core(void *process) { (void)process; }

static void reset(void *process) { (void)process; }

/* The update of zero duration takes the initial attitude from the sensors, where they are usable. */
static bool start(void *process, const fmu_model *model, void *instance, fmu_why *why) {
    (void)process, (void)why;
    model->init(instance);
    model->update(instance, 0);
    return true;
}

static bool run(void *process, const fmu_model *model, void *instance, uint32_t ticks, ahrs_real dt, fmu_why *why) {
    (void)process, (void)why;
    for (uint32_t i = 0; i < ticks; i++) {
        model->update(instance, dt);
    }
    return true;
}

static bool outputs(void *process, const fmu_model *model, void *instance, fmu_why *why) {
    (void)process, (void)why;
    model->compute_outputs(instance);
    return true;
}

static bool save(void *process, const void **bytes, size_t *size, fmu_why *why) {
    (void)process, (void)why;
    *bytes = NULL;
    *size = 0;
    return true;
}

static bool restore(void *process, const void *bytes, size_t size, fmu_why *why) {
    (void)process, (void)bytes;
    (void)snprintf(why->text, sizeof why->text, "the state holds more than this model's");
    return size == 0;
}

static const char *said(void *process) {
    (void)process;
    return NULL;
}

const fmu_engine fmu_the_engine = {0, open_core, close_core, reset, start, run, outputs, save, restore, said};
