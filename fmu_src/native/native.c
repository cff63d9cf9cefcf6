/* Runs a model over whole recordings for the host library: columns in, columns out, no allocation. */
#include "model.h"
#include "native.h"

#include <string.h>

static void load(char *instance, const ahrs_column *c, int64_t row) {
    if (c->kind == AHRS_COLUMN_REAL) {
        const double *from = (const double *)c->data + row * c->size;
        ahrs_real *to = (ahrs_real *)(void *)(instance + c->offset);
        for (int32_t i = 0; i < c->size; i++) {
            to[i] = (ahrs_real)from[i];
        }
    } else {
        memcpy(instance + c->offset, (const int32_t *)c->data + row * c->size, sizeof(int32_t) * (size_t)c->size);
    }
}

static void store(const char *instance, const ahrs_column *c, int64_t row) {
    if (c->kind == AHRS_COLUMN_REAL) {
        const ahrs_real *from = (const ahrs_real *)(const void *)(instance + c->offset);
        double *to = (double *)c->data + row * c->size;
        for (int32_t i = 0; i < c->size; i++) {
            to[i] = (double)from[i];
        }
    } else {
        memcpy((int32_t *)c->data + row * c->size, instance + c->offset, sizeof(int32_t) * (size_t)c->size);
    }
}

void ahrs_native_run(const fmu_model *model, void *instance, int64_t rows, const double *dt, const ahrs_column *in,
                     int32_t n_in, const ahrs_column *out, int32_t n_out) {
    for (int64_t row = 0; row < rows; row++) {
        for (int32_t i = 0; i < n_in; i++) {
            load(instance, &in[i], row);
        }
        model->update(instance, (ahrs_real)dt[row]);
        if (n_out > 0) {
            model->compute_outputs(instance);
        }
        for (int32_t i = 0; i < n_out; i++) {
            store(instance, &out[i], row);
        }
    }
}
