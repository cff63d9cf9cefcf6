/* Runs a model over whole recordings for the host library: columns in, columns out, no allocation. */
#include "native.h"

/* Scalars, vectors and quaternions, which nearly all variables are, take no loop: it would cost as much as an
 * update over all columns. */
static inline void load_reals(ahrs_real *restrict to, const double *restrict from, int32_t size) {
    switch (size) {
    case 4: to[3] = (ahrs_real)from[3]; /* fall through */
    case 3: to[2] = (ahrs_real)from[2]; /* fall through */
    case 2: to[1] = (ahrs_real)from[1]; /* fall through */
    case 1: to[0] = (ahrs_real)from[0]; break;
    default:
        for (int32_t i = 0; i < size; i++) {
            to[i] = (ahrs_real)from[i];
        }
    }
}

static inline void store_reals(double *restrict to, const ahrs_real *restrict from, int32_t size) {
    switch (size) {
    case 4: to[3] = (double)from[3]; /* fall through */
    case 3: to[2] = (double)from[2]; /* fall through */
    case 2: to[1] = (double)from[1]; /* fall through */
    case 1: to[0] = (double)from[0]; break;
    default:
        for (int32_t i = 0; i < size; i++) {
            to[i] = (double)from[i];
        }
    }
}

static inline void load(char *instance, const ahrs_column *c, int64_t row) {
    void *to = instance + c->offset;
    switch (c->kind) {
    case AHRS_COLUMN_REAL: load_reals(to, (const double *)c->data + row * c->size, c->size); break;
    case AHRS_COLUMN_BOOLEAN: *(int32_t *)to = ((const uint8_t *)c->data)[row]; break;
    default: *(int32_t *)to = ((const int32_t *)c->data)[row];
    }
}

static inline void store(const char *instance, const ahrs_column *c, int64_t row) {
    const void *from = instance + c->offset;
    switch (c->kind) {
    case AHRS_COLUMN_REAL: store_reals((double *)c->data + row * c->size, from, c->size); break;
    case AHRS_COLUMN_BOOLEAN: ((uint8_t *)c->data)[row] = *(const int32_t *)from != 0; break;
    default: ((int32_t *)c->data)[row] = *(const int32_t *)from;
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
