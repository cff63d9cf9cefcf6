/* A host without Python: runs rows of gyro, accel, mag through an FMU of an attitude estimator.
 *
 *     host LIBRARY VERSION TOKEN RESOURCES SAMPLE_TIME ROWS ATTITUDES
 *
 * Both files hold doubles; VERSION is that of FMI. The first row initialises, each further one is a step. */
#include "fmi2Functions.h"
#include "fmi3Functions.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void *library;

static void log_2(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status, fmi2String category, fmi2String text, ...) {
    (void)e, (void)name, (void)status, (void)category;
    (void)fprintf(stderr, "%s\n", text);
}

static void log_3(fmi3InstanceEnvironment e, fmi3Status status, fmi3String category, fmi3String text) {
    (void)e, (void)status, (void)category;
    (void)fprintf(stderr, "%s\n", text);
}

static void check(int status) {
    if (status > 1) {
        exit(1);
    }
}

/* Object and function pointers are the same size wherever dlsym exists. */
#define FIND(type, name)                                                                                                \
    type name;                                                                                                          \
    {                                                                                                                   \
        void *found = dlsym(library, #name);                                                                            \
        memcpy(&name, &found, sizeof found);                                                                            \
    }

static void run_2(char *argv[], double dt, FILE *rows, FILE *attitudes) {
    static const fmi2CallbackFunctions callbacks = {log_2, NULL, NULL, NULL, NULL};
    static const fmi2ValueReference in[] = {1, 2, 3, 4, 5, 6, 7, 8, 9}, out[] = {100, 101, 102, 103}, time[] = {200};
    FIND(fmi2InstantiateTYPE *, fmi2Instantiate)
    FIND(fmi2SetupExperimentTYPE *, fmi2SetupExperiment)
    FIND(fmi2EnterInitializationModeTYPE *, fmi2EnterInitializationMode)
    FIND(fmi2ExitInitializationModeTYPE *, fmi2ExitInitializationMode)
    FIND(fmi2SetRealTYPE *, fmi2SetReal)
    FIND(fmi2GetRealTYPE *, fmi2GetReal)
    FIND(fmi2DoStepTYPE *, fmi2DoStep)
    FIND(fmi2FreeInstanceTYPE *, fmi2FreeInstance)
    double row[9], q[4];
    fmi2Component c = fmi2Instantiate("host", fmi2CoSimulation, argv[3], argv[4], &callbacks, fmi2False, fmi2False);
    check(c == NULL ? 3 : 0);
    check(fmi2SetReal(c, time, 1, &dt));
    for (long k = 0; fread(row, sizeof row, 1, rows) == 1; k++) {
        check(fmi2SetReal(c, in, 9, row));
        if (k == 0) {
            check(fmi2SetupExperiment(c, fmi2False, 0, 0, fmi2False, 0));
            check(fmi2EnterInitializationMode(c));
            check(fmi2ExitInitializationMode(c));
        } else {
            check(fmi2DoStep(c, (double)(k - 1) * dt, dt, fmi2True));
        }
        check(fmi2GetReal(c, out, 4, q));
        (void)fwrite(q, sizeof q, 1, attitudes);
    }
    fmi2FreeInstance(c);
}

static void run_3(char *argv[], double dt, FILE *rows, FILE *attitudes) {
    static const fmi3ValueReference in[] = {1, 4, 7}, out[] = {100}, time[] = {200};
    FIND(fmi3InstantiateCoSimulationTYPE *, fmi3InstantiateCoSimulation)
    FIND(fmi3EnterInitializationModeTYPE *, fmi3EnterInitializationMode)
    FIND(fmi3ExitInitializationModeTYPE *, fmi3ExitInitializationMode)
    FIND(fmi3SetFloat64TYPE *, fmi3SetFloat64)
    FIND(fmi3GetFloat64TYPE *, fmi3GetFloat64)
    FIND(fmi3DoStepTYPE *, fmi3DoStep)
    FIND(fmi3FreeInstanceTYPE *, fmi3FreeInstance)
    double row[9], q[4], last;
    bool event, terminate, early;
    fmi3Instance c = fmi3InstantiateCoSimulation("host", argv[3], argv[4], false, false, false, false, NULL, 0, NULL, log_3, NULL);
    check(c == NULL ? 3 : 0);
    check(fmi3SetFloat64(c, time, 1, &dt, 1));
    for (long k = 0; fread(row, sizeof row, 1, rows) == 1; k++) {
        check(fmi3SetFloat64(c, in, 3, row, 9));
        if (k == 0) {
            check(fmi3EnterInitializationMode(c, false, 0, 0, false, 0));
            check(fmi3ExitInitializationMode(c));
        } else {
            check(fmi3DoStep(c, (double)(k - 1) * dt, dt, true, &event, &terminate, &early, &last));
        }
        check(fmi3GetFloat64(c, out, 1, q, 4));
        (void)fwrite(q, sizeof q, 1, attitudes);
    }
    fmi3FreeInstance(c);
}

int main(int argc, char *argv[]) {
    if (argc != 8) {
        return 2;
    }
    library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    FILE *rows = fopen(argv[6], "rb"), *attitudes = fopen(argv[7], "wb");
    if (library == NULL || rows == NULL || attitudes == NULL) {
        return 2;
    }
    (argv[2][0] == '2' ? run_2 : run_3)(argv, strtod(argv[5], NULL), rows, attitudes);
    (void)fclose(rows);
    (void)fclose(attitudes);
    (void)dlclose(library);
    return 0;
}
