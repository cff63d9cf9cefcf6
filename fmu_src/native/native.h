/* What the host library offers beside the models' tables. */
#ifndef AHRS_NATIVE_H
#define AHRS_NATIVE_H

#include "model.h"

/* What a column holds: doubles for reals, bytes 0 and 1 for Booleans, int32_t for integers and enumerations. */
enum { AHRS_COLUMN_REAL, AHRS_COLUMN_BOOLEAN, AHRS_COLUMN_INTEGER };

/* A variable over time: row after row of `size` elements, one for what is not real. */
typedef struct {
    void *data;
    uint32_t offset; /* of the variable in the instance */
    int32_t size;
    int32_t kind;
} ahrs_column;

/* For each row: inputs in, one update of dt[row] seconds, outputs out. */
void ahrs_native_run(const fmu_model *model, void *instance, int64_t rows, const double *dt, const ahrs_column *in,
                     int32_t n_in, const ahrs_column *out, int32_t n_out);

#endif
