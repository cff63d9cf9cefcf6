/* The component behind both FMI versions, with memory that can run out and an engine that can fail.
 *
 * Every C file is compiled with calloc, malloc and free renamed to the functions below. */
#undef calloc
#undef malloc
#undef free

#include "component.h"
#include "fmi2Functions.h"
#include "fmi3Functions.h"
#include "fmu_config.h"
#include "test_core.h"

/* The engine under test wraps the real one. */
#define fmu_the_engine core_engine
#include "engine_core.c"
#undef fmu_the_engine

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(condition)                                                                                         \
    do {                                                                                                         \
        if (!(condition)) {                                                                                      \
            (void)fprintf(stderr, "%s:%d: %s\nlast log line: %s\n", __FILE__, __LINE__, #condition, last.message); \
            exit(1);                                                                                             \
        }                                                                                                        \
    } while (0)

/* ---------------------------------------------------------------- memory that can run out */

static long allocations, outstanding, fail_after = -1;

void *test_calloc(size_t n, size_t size);
void *test_malloc(size_t size);
void test_free(void *memory);

static bool runs_out(void) {
    allocations++;
    return fail_after >= 0 && fail_after-- == 0;
}

void *test_calloc(size_t n, size_t size) {
    void *memory = runs_out() ? NULL : calloc(n, size);
    outstanding += memory != NULL;
    return memory;
}

void *test_malloc(size_t size) {
    void *memory = runs_out() ? NULL : malloc(size);
    outstanding += memory != NULL;
    return memory;
}

void test_free(void *memory) {
    outstanding -= memory != NULL;
    free(memory);
}

/* ---------------------------------------------------------------- log */

static struct {
    int lines, status;
    char category[64], message[FMU_WHY_SIZE];
} last;

static void keep(int status, const char *category, const char *message) {
    last.lines++;
    last.status = status;
    (void)snprintf(last.category, sizeof last.category, "%s", category);
    (void)snprintf(last.message, sizeof last.message, "%s", message);
}

static void log_2(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                  fmi2String message, ...) {
    (void)environment, (void)name;
    keep((int)status, category, message);
}

static void log_3(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
    (void)environment;
    keep((int)status, category, message);
}

static bool refused(int64_t status, const char *word) {
    return status == FMU_ERROR && last.status == FMU_ERROR && strcmp(last.category, "logStatusError") == 0 &&
           strstr(last.message, word) != NULL;
}

/* ---------------------------------------------------------------- an engine that can fail */

typedef enum { NOWHERE, AT_OPEN, AT_START, AT_RUN, AT_OUTPUTS, AT_SAVE, AT_RESTORE } place;
static place fails;

typedef struct {
    uint64_t ticks; /* state kept outside the instance */
    uint64_t opened;
} test_process;

static bool passes(place here, fmu_why *why) {
    (void)snprintf(why->text, sizeof why->text, "engine out of order");
    return fails != here;
}

static bool test_open(void *process, const fmu_model *model, const char *resources, fmu_why *why) {
    ((test_process *)process)->opened = 1;
    return passes(AT_OPEN, why) && core_engine.open(process, model, resources, why);
}

static void test_close(void *process) {
    CHECK(((test_process *)process)->opened == 1);
    core_engine.close(process);
}

static void test_reset(void *process) {
    ((test_process *)process)->ticks = 0;
    core_engine.reset(process);
}

static const char *test_said(void *process) { return core_engine.said(process); }

static bool test_start(void *process, const fmu_model *model, void *instance, fmu_why *why) {
    ((test_process *)process)->ticks = 0;
    return passes(AT_START, why) && core_engine.start(process, model, instance, why);
}

static bool test_run(void *process, const fmu_model *model, void *instance, uint32_t ticks, ahrs_real dt,
                     fmu_why *why) {
    if (!passes(AT_RUN, why)) {
        return false;
    }
    ((test_process *)process)->ticks += ticks;
    return core_engine.run(process, model, instance, ticks, dt, why);
}

static bool test_outputs(void *process, const fmu_model *model, void *instance, fmu_why *why) {
    return passes(AT_OUTPUTS, why) && core_engine.outputs(process, model, instance, why);
}

/* As many bytes as the number of ticks has digits, so that the size of a state varies. */
static bool test_save(void *process, const void **bytes, size_t *size, fmu_why *why) {
    const bool done = core_engine.save(process, bytes, size, why);
    *bytes = &((test_process *)process)->ticks;
    *size = ((test_process *)process)->ticks < 256 ? 1 : sizeof(uint64_t);
    return done && passes(AT_SAVE, why);
}

static bool test_restore(void *process, const void *bytes, size_t size, fmu_why *why) {
    CHECK(core_engine.restore(process, NULL, 0, why));
    CHECK(!core_engine.restore(process, bytes, size, why));
    ((test_process *)process)->ticks = 0;
    memcpy(&((test_process *)process)->ticks, bytes, size);
    return passes(AT_RESTORE, why);
}

const fmu_engine fmu_the_engine = {sizeof(test_process), test_open, test_close,   test_reset,   test_start,
                                   test_run,             test_outputs, test_save, test_restore, test_said};

/* ---------------------------------------------------------------- helpers */

enum { GYRO = 1, ACCEL = 4, MAG = 7, ACCEL_VALID = 10, Q = 100, ROLL = 104, STATUS = 119, MAG_USED = 122 };
enum { SAMPLE_TIME = 200, FRAME = 201, FIELD_REFERENCE = 204, INITIALISATION = 207, INIT_TIME = 212 };
enum { MOTION_COMPENSATION = 213, MOTION_TIME_CONSTANT = 214, ACCEL_GATING = 215 };
enum { KP = 1000, KI = 1001, KII = 1002, REALISATION = 1010, FORM = 1011, COUPLING = 1012 };

static const fmi2CallbackFunctions CALLBACKS = {log_2, NULL, NULL, NULL, NULL};

static fmi2Component create_2(void) {
    return fmi2Instantiate("two", fmi2CoSimulation, FMU_TOKEN, "", &CALLBACKS, fmi2False, fmi2False);
}

static fmi3Instance create_3(void) {
    return fmi3InstantiateCoSimulation("three", FMU_TOKEN, "", false, false, false, false, NULL, 0, NULL, log_3, NULL);
}

static void set_real(fmi2Component c, unsigned vr, double value) { CHECK(fmi2SetReal(c, &vr, 1, &value) == fmi2OK); }

static double get_real(fmi2Component c, unsigned vr) {
    double value = 0;
    CHECK(fmi2GetReal(c, &vr, 1, &value) == fmi2OK);
    return value;
}

static void set_sensors(fmi2Component c, double t) {
    static const unsigned VRS[9] = {1, 2, 3, 4, 5, 6, 7, 8, 9};
    const double values[9] = {0.3, 0.2 * t, -0.1, 0.4, 0.1 * t, -9.7, 2e-5, 1e-6 * t, 4e-5};
    CHECK(fmi2SetReal(c, VRS, 9, values) == fmi2OK);
}

static void initialise(fmi2Component c) {
    CHECK(fmi2SetupExperiment(c, fmi2False, 0, 0, fmi2True, 100) == fmi2OK);
    CHECK(fmi2EnterInitializationMode(c) == fmi2OK);
    CHECK(fmi2ExitInitializationMode(c) <= fmi2Warning);
}

static void steps(fmi2Component c, int from, int to) {
    for (int k = from; k < to; k++) {
        set_sensors(c, 0.01 * k);
        CHECK(fmi2DoStep(c, 0.01 * k, 0.01, fmi2True) <= fmi2Warning);
    }
}

/* ---------------------------------------------------------------- tests */

static void instances_are_refused_with_a_reason(void) {
    CHECK(fmi2Instantiate("x", fmi2CoSimulation, FMU_TOKEN, "", NULL, fmi2False, fmi2False) == NULL);
    CHECK(fmi2Instantiate("x", fmi2ModelExchange, FMU_TOKEN, "", &CALLBACKS, fmi2False, fmi2False) == NULL);
    CHECK(refused(FMU_ERROR, "co-simulation only"));
    CHECK(fmi2Instantiate("x", fmi2CoSimulation, NULL, "", &CALLBACKS, fmi2False, fmi2False) == NULL);
    CHECK(refused(FMU_ERROR, "token"));
    CHECK(fmi2Instantiate(NULL, fmi2CoSimulation, FMU_TOKEN, "", &CALLBACKS, fmi2False, fmi2False) == NULL);
    CHECK(refused(FMU_ERROR, "name"));
    CHECK(fmi3InstantiateModelExchange("x", FMU_TOKEN, "", false, false, NULL, log_3) == NULL);
    CHECK(refused(FMU_ERROR, "fmi3InstantiateModelExchange: this model is for co-simulation only"));
    CHECK(fmi3InstantiateScheduledExecution("x", FMU_TOKEN, "", false, false, NULL, log_3, NULL, NULL, NULL) == NULL);
    CHECK(refused(FMU_ERROR, "co-simulation only"));
    CHECK(fmi3InstantiateCoSimulation("x", FMU_TOKEN, "", false, false, true, false, NULL, 0, NULL, log_3, NULL) == NULL);
    CHECK(refused(FMU_ERROR, "event mode"));
    /* Without a logger there is silence, not a crash. */
    CHECK(fmi3InstantiateCoSimulation("x", "?", "", false, false, false, false, NULL, 0, NULL, NULL, NULL) == NULL);
    fails = AT_OPEN;
    CHECK(create_2() == NULL);
    CHECK(refused(FMU_ERROR, "fmi2Instantiate: engine out of order"));
    fails = NOWHERE;
    CHECK(outstanding == 0);
    CHECK(strcmp(fmi2GetVersion(), "2.0") == 0 && strcmp(fmi3GetVersion(), "3.0") == 0);
    CHECK(strcmp(fmi2GetTypesPlatform(), "default") == 0);
}

static void every_failed_allocation_is_survived(void) {
    fail_after = 0;
    CHECK(create_2() == NULL);
    CHECK(refused(FMU_ERROR, "out of memory"));
    fail_after = 0;
    CHECK(create_3() == NULL);
    CHECK(refused(FMU_ERROR, "out of memory"));
    fmi2Component c = create_2();
    initialise(c);
    fmi2FMUstate state = NULL;
    fail_after = 0;
    CHECK(refused(fmi2GetFMUstate(c, &state), "out of memory"));
    CHECK(state == NULL);
    CHECK(fmi2GetFMUstate(c, &state) == fmi2OK);
    void *kept = state;
    fail_after = 0;
    CHECK(refused(fmi2GetFMUstate(c, &state), "out of memory"));
    CHECK(state == kept);
    static char bytes[4096];
    size_t size = 0;
    CHECK(fmi2SerializedFMUstateSize(c, state, &size) == fmi2OK && size <= sizeof bytes);
    CHECK(fmi2SerializeFMUstate(c, state, bytes, sizeof bytes) == fmi2OK);
    fail_after = 0;
    CHECK(refused(fmi2DeSerializeFMUstate(c, bytes, size, &state), "out of memory"));
    CHECK(state == kept);
    CHECK(fmi2DeSerializeFMUstate(c, bytes, size, &state) == fmi2OK);
    CHECK(fmi2DoStep(c, 0, 0.01, fmi2True) == fmi2OK);
    CHECK(fmi2FreeFMUstate(c, &state) == fmi2OK);
    fmi2FreeInstance(c);
    CHECK(outstanding == 0);
}

static void no_memory_is_taken_inside_a_step(void) {
    fmi2Component two = create_2();
    fmi3Instance three = create_3();
    initialise(two);
    CHECK(fmi3EnterInitializationMode(three, false, 0, 0, false, 0) == fmi3OK);
    CHECK(fmi3ExitInitializationMode(three) == fmi3OK);
    const long before = allocations;
    steps(two, 0, 500);
    for (int k = 0; k < 500; k++) {
        const uint32_t gyro = GYRO, q = Q;
        const double rate[3] = {0.1, 0.2, 0.3};
        double attitude[4], end;
        bool flag[3];
        CHECK(fmi3SetFloat64(three, &gyro, 1, rate, 3) == fmi3OK);
        CHECK(fmi3DoStep(three, 0.01 * k, 0.01, true, flag, flag + 1, flag + 2, &end) == fmi3OK);
        CHECK(end == 0.01 * k + 0.01);
        CHECK(fmi3GetFloat64(three, &q, 1, attitude, 4) == fmi3OK);
        CHECK(get_real(two, ROLL) == get_real(two, ROLL));
    }
    CHECK(allocations == before);
    CHECK(fmi3Terminate(three) == fmi3OK);
    CHECK(fmi3Reset(three) == fmi3OK);
    fmi2FreeInstance(two);
    fmi3FreeInstance(three);
    CHECK(outstanding == 0);
}

static void two_thousand_instances_come_and_go(void) {
    for (int k = 0; k < 2000; k++) {
        fmi2Component c = create_2();
        CHECK(c != NULL);
        initialise(c);
        CHECK(fmi2DoStep(c, 0, 0.02, fmi2True) == fmi2OK);
        fmi2FreeInstance(c);
    }
    CHECK(outstanding == 0);
}

static void fifty_instances_do_not_know_of_each_other(void) {
    enum { N = 50 };
    fmi2Component all[N];
    double alone[N];
    for (int i = 0; i < N; i++) {
        fmi2Component c = create_2();
        set_real(c, KP, 0.1 + 0.02 * i);
        set_sensors(c, i);
        initialise(c);
        steps(c, 0, 100);
        alone[i] = get_real(c, ROLL);
        CHECK(i == 0 || alone[i] != alone[i - 1]);
        fmi2FreeInstance(c);
    }
    for (int i = 0; i < N; i++) {
        all[i] = create_2();
        set_real(all[i], KP, 0.1 + 0.02 * i);
        set_sensors(all[i], i);
        initialise(all[i]);
    }
    for (int k = 0; k < 100; k++) {
        for (int i = 0; i < N; i++) {
            steps(all[i], k, k + 1);
        }
    }
    for (int i = 0; i < N; i++) {
        CHECK(get_real(all[i], ROLL) == alone[i]);
        fmi2FreeInstance(all[i]);
    }
    CHECK(outstanding == 0);
}

static void a_failing_engine_is_an_error_with_its_reason(void) {
    fmi2Component c = create_2();
    CHECK(fmi2SetupExperiment(c, fmi2False, 0, 0, fmi2False, 0) == fmi2OK);
    CHECK(fmi2EnterInitializationMode(c) == fmi2OK);
    unsigned vr = ROLL;
    double value = 0;
    fails = AT_START;
    CHECK(refused(fmi2GetReal(c, &vr, 1, &value), "fmi2GetReal: engine out of order"));
    CHECK(refused(fmi2ExitInitializationMode(c), "engine out of order"));
    fails = NOWHERE;
    CHECK(fmi2ExitInitializationMode(c) == fmi2OK);
    fails = AT_RUN;
    CHECK(refused(fmi2DoStep(c, 0, 0.01, fmi2True), "engine out of order"));
    CHECK(fmi2DoStep(c, 0, 0.004, fmi2True) == fmi2OK);
    fails = NOWHERE;
    CHECK(fmi2DoStep(c, 0.004, 0.006, fmi2True) == fmi2OK);
    fails = AT_OUTPUTS;
    CHECK(refused(fmi2GetReal(c, &vr, 1, &value), "engine out of order"));
    fails = AT_SAVE;
    fmi2FMUstate state = NULL;
    CHECK(refused(fmi2GetFMUstate(c, &state), "engine out of order"));
    fails = NOWHERE;
    CHECK(fmi2GetFMUstate(c, &state) == fmi2OK);
    fails = AT_RESTORE;
    CHECK(refused(fmi2SetFMUstate(c, state), "engine out of order"));
    fails = NOWHERE;
    CHECK(fmi2SetFMUstate(c, state) == fmi2OK);
    CHECK(fmi2FreeFMUstate(c, &state) == fmi2OK);
    fmi2FreeInstance(c);
}

static void states_of_different_size_replace_each_other(void) {
    fmi2Component c = create_2();
    initialise(c);
    fmi2FMUstate state = NULL;
    size_t small = 0, large = 0;
    CHECK(fmi2GetFMUstate(c, &state) == fmi2OK);
    CHECK(fmi2SerializedFMUstateSize(c, state, &small) == fmi2OK);
    steps(c, 0, 300);
    CHECK(fmi2GetFMUstate(c, &state) == fmi2OK);
    CHECK(fmi2SerializedFMUstateSize(c, state, &large) == fmi2OK);
    CHECK(large == small + 7);
    const double here = get_real(c, ROLL);
    steps(c, 300, 400);
    CHECK(get_real(c, ROLL) != here);
    CHECK(fmi2SetFMUstate(c, state) == fmi2OK);
    CHECK(get_real(c, ROLL) == here);
    CHECK(fmi2FreeFMUstate(c, &state) == fmi2OK);
    fmi2FreeInstance(c);
    CHECK(outstanding == 0);
}

static void log_lines_of_fmi_2_are_formats(void) {
    fmi2Component c = create_2();
    const fmi2String category = "100% #1";
    CHECK(fmi2SetDebugLogging(c, fmi2True, 1, &category) == fmi2Error);
    CHECK(strstr(last.message, "'100%% ##1'") != NULL);
    const fmi2String none = NULL;
    CHECK(fmi2SetDebugLogging(c, fmi2True, 1, &none) == fmi2Error);
    char endless[3000];
    memset(endless, '%', sizeof endless - 1);
    endless[sizeof endless - 1] = '\0';
    const fmi2String long_name = endless;
    CHECK(fmi2SetDebugLogging(c, fmi2True, 1, &long_name) == fmi2Error);
    CHECK(strlen(last.message) % 2 == strlen("fmi2SetDebugLogging: log category '' is not declared; there are "
                                             "logStatusError, logStatusWarning, logEvents and logAll") % 2);
    fmi2FreeInstance(c);
}

static void values_are_refused_by_name(void) {
    fmi3Instance c = create_3();
    const uint32_t kp = KP, frame = FRAME, valid = ACCEL_VALID, gyro = GYRO, q = Q, time = 0, period = SAMPLE_TIME;
    const uint32_t taus = MOTION_TIME_CONSTANT;
    double real = (double)NAN, three[3] = {1, 2, 3}, four[4];
    int64_t item = 1;
    bool flag = false;
    CHECK(refused(fmi3SetFloat64(c, &kp, 1, &real, 1), "kp = nan is outside [0, 1000]") ||
          refused(FMU_ERROR, "kp = -nan is outside [0, 1000]"));
    real = 0;
    CHECK(refused(fmi3SetFloat64(c, &taus, 1, &real, 1), "motion_time_constant = 0 is outside (0"));
    CHECK(refused(fmi3SetFloat64(c, &gyro, 1, three, 2), "the variables have 3 values, 2 given"));
    CHECK(refused(fmi3SetFloat64(c, &q, 1, four, 4), "q is computed"));
    CHECK(refused(fmi3GetFloat64(c, &q, 1, four, 4), "before initialisation"));
    CHECK(fmi3SetInt64(c, &frame, 1, &item, 1) == fmi3OK && fmi3GetInt64(c, &frame, 1, &item, 1) == fmi3OK);
    CHECK(fmi3SetBoolean(c, &valid, 1, &flag, 1) == fmi3OK && fmi3GetBoolean(c, &valid, 1, &flag, 1) == fmi3OK);
    CHECK(item == 1 && !flag);
    real = 150;
    CHECK(fmi3SetFloat64(c, &kp, 1, &real, 1) == fmi3OK);
    CHECK(fmi3EnterInitializationMode(c, false, 0, 2, false, 0) == fmi3OK);
    CHECK(refused(fmi3GetFloat64(c, &q, 1, four, 4), "kp*sample_time < 1"));
    CHECK(refused(fmi3ExitInitializationMode(c), "kp = 150, sample_time = 0.01"));
    real = 0.4;
    CHECK(fmi3SetFloat64(c, &kp, 1, &real, 1) == fmi3OK);
    CHECK(fmi3ExitInitializationMode(c) == fmi3OK);
    CHECK(refused(fmi3SetFloat64(c, &period, 1, &real, 1), "sample_time is fixed"));
    CHECK(fmi3GetFloat64(c, &period, 1, &real, 1) == fmi3OK && real == 0.01);
    CHECK(fmi3GetFloat64(c, &time, 1, &real, 1) == fmi3OK && real == 2);
    fmi3FreeInstance(c);
}

static void steps_are_refused_when_they_make_no_sense(void) {
    fmi2Component c = create_2();
    initialise(c);
    set_sensors(c, 0);
    CHECK(refused(fmi2DoStep(c, (double)NAN, 0.01, fmi2True), "finite"));
    CHECK(refused(fmi2DoStep(c, 0, -0.01, fmi2True), "not negative"));
    CHECK(refused(fmi2DoStep(c, 0.1, 0.01, fmi2True), "the one before ended"));
    CHECK(refused(fmi2DoStep(c, 0, 2e9, fmi2True), "1e+09"));
    CHECK(refused(fmi2DoStep(c, 0, 1e8, fmi2True), "take shorter steps"));
    CHECK(refused(fmi2EnterInitializationMode(c), "once initialisation has ended"));
    double time = -1;
    int ended = 1;
    CHECK(fmi2DoStep(c, 0, 0.01, fmi2True) == fmi2OK);
    CHECK(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &time) == fmi2OK && time == 0.01);
    CHECK(fmi2GetBooleanStatus(c, fmi2Terminated, &ended) == fmi2OK && ended == fmi2False);
    set_real(c, KP, 500);
    CHECK(refused(fmi2DoStep(c, 0.01, 0.01, fmi2True), "kp*sample_time < 1"));
    CHECK(get_real(c, KP) == 0.5);
    set_real(c, KP, 1.5);
    CHECK(fmi2DoStep(c, 0.01, 0.01, fmi2True) == fmi2OK);
    CHECK(get_real(c, KP) == 1.5);
    fmi2FreeInstance(c);
}

static void states_of_others_are_refused(void) {
    fmi2Component c = create_2();
    initialise(c);
    fmi2FMUstate state = NULL;
    size_t size = 0;
    static char bytes[4096], changed[4096];
    CHECK(fmi2GetFMUstate(c, &state) == fmi2OK);
    CHECK(fmi2SerializedFMUstateSize(c, state, &size) == fmi2OK);
    CHECK(refused(fmi2SerializeFMUstate(c, state, bytes, size - 1), "there is room for"));
    CHECK(fmi2SerializeFMUstate(c, state, bytes, size) == fmi2OK);
    static const struct {
        size_t at;
        const char *says;
    } CHANGES[] = {{0, "no state"}, {8, "no state"}, {16, "truncated"}, {24, "another model"}, {56, "another model"},
                   {300, "damaged"}};
    for (size_t i = 0; i < sizeof CHANGES / sizeof CHANGES[0]; i++) {
        memcpy(changed, bytes, size);
        changed[CHANGES[i].at] ^= 4;
        fmi2FMUstate other = NULL;
        CHECK(refused(fmi2DeSerializeFMUstate(c, changed, size, &other), CHANGES[i].says));
        CHECK(other == NULL);
        other = changed;
        CHECK(fmi2SetFMUstate(c, other) == fmi2Error);
        CHECK(fmi2FreeFMUstate(c, &other) == fmi2Error);
        CHECK(fmi2GetFMUstate(c, &other) == fmi2Error);
        CHECK(fmi2DeSerializeFMUstate(c, bytes, size, &other) == fmi2Error);
    }
    CHECK(fmi2FreeFMUstate(c, &state) == fmi2OK && fmi2FreeFMUstate(c, &state) == fmi2OK);
    fmi2FreeInstance(c);
    CHECK(outstanding == 0);
}

static void categories_choose_what_is_logged(void) {
    fmi3Instance c = create_3();
    const char *const events = "logEvents", *const all = "logAll";
    bool flag[3];
    double end;
    CHECK(fmi3SetDebugLogging(c, true, 1, &events) == fmi3OK);
    int before = last.lines;
    CHECK(fmi3DoStep(c, 0, 1, true, flag, flag, flag, &end) == fmi3Error && last.lines == before);
    CHECK(fmi3EnterInitializationMode(c, false, 0, 0, false, 0) == fmi3OK);
    CHECK(fmi3ExitInitializationMode(c) == fmi3OK && last.lines == before + 1);
    CHECK(fmi3SetDebugLogging(c, true, 1, &all) == fmi3OK);
    CHECK(fmi3ExitInitializationMode(c) == fmi3Error && last.lines == before + 2);
    CHECK(fmi3SetDebugLogging(c, false, 0, NULL) == fmi3OK);
    CHECK(fmi3ExitInitializationMode(c) == fmi3Error && last.lines == before + 2);
    fmi3FreeInstance(c);
}

/* Every setting of the filter over good and bad samples, for what the sanitizers and the coverage see. */
static void all_settings_run(void) {
    static const double TIMES[] = {1.0, (double)INFINITY};
    for (int setting = 0; setting < 4 * 2 * 2 * 2 * 2; setting++) {
        fmi2Component c = create_2();
        const unsigned enumerations[] = {REALISATION, FORM, COUPLING, FRAME, INITIALISATION, FIELD_REFERENCE};
        const int values[] = {setting & 3,        setting >> 2 & 1, setting >> 3 & 1,
                              setting >> 4 & 1, setting >> 5 & 1, setting >> 4 & 1};
        CHECK(fmi2SetInteger(c, enumerations, 6, values) == fmi2OK);
        const unsigned booleans[] = {MOTION_COMPENSATION, ACCEL_GATING};
        const int flags[] = {setting >> 5 & 1, setting >> 4 & 1};
        CHECK(fmi2SetBoolean(c, booleans, 2, flags) == fmi2OK);
        set_real(c, MOTION_TIME_CONSTANT, TIMES[setting >> 3 & 1]);
        set_real(c, INIT_TIME, setting >> 2 & 1 ? 0.05 : 0.0);
        set_real(c, KII, setting >> 5 & 1 ? 0.01 : 0.0);
        set_real(c, SAMPLE_TIME, setting & 1 ? 0.02 : 0.01);
        set_sensors(c, 0);
        CHECK(fmi2EnterInitializationMode(c) == fmi2OK);
        if (fmi2ExitInitializationMode(c) > fmi2Warning) {
            CHECK(last.status == FMU_ERROR);
            fmi2FreeInstance(c);
            continue;
        }
        for (int k = 0; k < 200; k++) {
            set_sensors(c, 0.01 * k);
            if (k % 7 == 3) {
                const unsigned spoilt = (unsigned)(k % 9) + 1;
                const double bad[] = {(double)NAN, (double)INFINITY, 0.0, 1e300};
                CHECK(fmi2SetReal(c, &spoilt, 1, &bad[k % 4]) == fmi2OK);
            }
            if (k % 31 == 5) {
                const unsigned none[6] = {4, 5, 6, 7, 8, 9};
                const double zero[6] = {0};
                CHECK(fmi2SetReal(c, none, 6, zero) == fmi2OK);
            }
            const unsigned valid[2] = {ACCEL_VALID, ACCEL_VALID + 1};
            const int on[2] = {k % 50 != 9, k % 40 != 11};
            CHECK(fmi2SetBoolean(c, valid, 2, on) == fmi2OK);
            CHECK(fmi2DoStep(c, 0.01 * k, 0.01, fmi2True) == fmi2OK);
            for (unsigned vr = Q; vr < STATUS; vr++) {
                if (vr < 116) {
                    CHECK(ahrs_is_finite((ahrs_real)get_real(c, vr)));
                }
            }
        }
        const unsigned used = MAG_USED, status = STATUS;
        int value = -1;
        CHECK(fmi2GetBoolean(c, &used, 1, &value) == fmi2OK && (value == 0 || value == 1));
        CHECK(fmi2GetInteger(c, &status, 1, &value) == fmi2OK && value >= 0 && value <= 9);
        CHECK(fmi2Terminate(c) == fmi2OK);
        fmi2FreeInstance(c);
    }
    CHECK(outstanding == 0);
}

/* An error, and one log line where there is an instance `c` to log for. */
#define REFUSED(call)                                                                                            \
    do {                                                                                                         \
        const int lines_before = last.lines;                                                                     \
        CHECK((int)(call) == FMU_ERROR);                                                                         \
        CHECK(last.lines == lines_before + (c != NULL));                                                         \
    } while (0)

static void wrong_calls_of_fmi_2(fmi2Component c) {
    const unsigned kp = KP, unknown = 12;
    double real = 0.5;
    int whole = 0;
    fmi2String text = "";
    fmi2Status status = fmi2OK;
    fmi2EventInfo info;
    fmi2Boolean a, b;
    fmi2FMUstate state = NULL;
    char bytes[16] = {0};
    size_t size = 0;
    REFUSED(fmi2SetReal(c, &unknown, 1, &real));
    REFUSED(fmi2SetInteger(c, &kp, 1, &whole));
    REFUSED(fmi2SetBoolean(c, &kp, 1, &whole));
    REFUSED(fmi2SetString(c, &kp, 1, &text));
    REFUSED(fmi2GetReal(c, &unknown, 1, &real));
    REFUSED(fmi2GetReal(c, NULL, 1, &real));
    REFUSED(fmi2GetInteger(c, &kp, 1, &whole));
    REFUSED(fmi2GetBoolean(c, &kp, 1, &whole));
    REFUSED(fmi2GetString(c, &kp, 1, &text));
    REFUSED(fmi2SetDebugLogging(c, fmi2True, 1, NULL));
    REFUSED(fmi2SetupExperiment(c, fmi2False, 0, -1, fmi2False, 0));
    REFUSED(fmi2SetupExperiment(c, fmi2False, 0, 2, fmi2True, 1));
    REFUSED(fmi2ExitInitializationMode(c));
    REFUSED(fmi2Terminate(c));
    REFUSED(fmi2DoStep(c, 0, 0.01, fmi2True));
    REFUSED(fmi2GetFMUstate(c, NULL));
    REFUSED(fmi2SetFMUstate(c, NULL));
    REFUSED(fmi2FreeFMUstate(c, NULL));
    REFUSED(fmi2SerializedFMUstateSize(c, NULL, &size));
    REFUSED(fmi2SerializedFMUstateSize(c, NULL, NULL));
    REFUSED(fmi2SerializeFMUstate(c, NULL, bytes, sizeof bytes));
    REFUSED(fmi2DeSerializeFMUstate(c, bytes, sizeof bytes, &state));
    REFUSED(fmi2DeSerializeFMUstate(c, NULL, 0, &state));
    REFUSED(fmi2GetDirectionalDerivative(c, &kp, 1, &kp, 1, &real, &real));
    REFUSED(fmi2SetRealInputDerivatives(c, &kp, 1, &whole, &real));
    REFUSED(fmi2GetRealOutputDerivatives(c, &kp, 1, &whole, &real));
    REFUSED(fmi2CancelStep(c));
    REFUSED(fmi2GetStatus(c, fmi2DoStepStatus, &status));
    REFUSED(fmi2GetRealStatus(c, fmi2DoStepStatus, &real));
    REFUSED(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &real));
    REFUSED(fmi2GetIntegerStatus(c, fmi2DoStepStatus, &whole));
    REFUSED(fmi2GetBooleanStatus(c, fmi2DoStepStatus, &whole));
    REFUSED(fmi2GetBooleanStatus(c, fmi2Terminated, &whole));
    REFUSED(fmi2GetStringStatus(c, fmi2DoStepStatus, &text));
    REFUSED(fmi2EnterEventMode(c));
    REFUSED(fmi2NewDiscreteStates(c, &info));
    REFUSED(fmi2EnterContinuousTimeMode(c));
    REFUSED(fmi2CompletedIntegratorStep(c, fmi2True, &a, &b));
    REFUSED(fmi2SetTime(c, 0));
    REFUSED(fmi2SetContinuousStates(c, &real, 1));
    REFUSED(fmi2GetDerivatives(c, &real, 1));
    REFUSED(fmi2GetEventIndicators(c, &real, 1));
    REFUSED(fmi2GetContinuousStates(c, &real, 1));
    REFUSED(fmi2GetNominalsOfContinuousStates(c, &real, 1));
}

#define NO_SUCH_TYPE(Type)                                                                                       \
    do {                                                                                                         \
        fmi3##Type value[1] = {0};                                                                               \
        CHECK(fmi3Get##Type(c, &kp, 1, value, 1) == fmi3Error);                                                  \
        CHECK(fmi3Set##Type(c, &kp, 1, value, 1) == fmi3Error);                                                  \
    } while (0)

static void wrong_calls_of_fmi_3(fmi3Instance c) {
    const uint32_t kp = KP, element = GYRO + 1;
    double real = 0.5;
    bool flag[5];
    size_t size = 0;
    uint64_t count = 0;
    int32_t order = 1;
    fmi3Binary binary = NULL;
    fmi3FMUState state = NULL;
    fmi3DependencyKind kind;
    fmi3IntervalQualifier qualifier;
    uint32_t vr = 0;
    uint8_t bytes[16] = {0};
    NO_SUCH_TYPE(Float32);
    NO_SUCH_TYPE(Int8);
    NO_SUCH_TYPE(UInt8);
    NO_SUCH_TYPE(Int16);
    NO_SUCH_TYPE(UInt16);
    NO_SUCH_TYPE(Int32);
    NO_SUCH_TYPE(UInt32);
    NO_SUCH_TYPE(Int64);
    NO_SUCH_TYPE(UInt64);
    NO_SUCH_TYPE(Boolean);
    NO_SUCH_TYPE(String);
    REFUSED(fmi3GetFloat64(c, &element, 1, &real, 1));
    REFUSED(fmi3SetFloat64(c, &element, 1, &real, 1));
    REFUSED(fmi3GetBinary(c, &kp, 1, &size, &binary, 1));
    REFUSED(fmi3SetBinary(c, &kp, 1, &size, &binary, 1));
    REFUSED(fmi3GetClock(c, &kp, 1, flag));
    REFUSED(fmi3SetClock(c, &kp, 1, flag));
    REFUSED(fmi3SetDebugLogging(c, true, 1, NULL));
    REFUSED(fmi3EnterInitializationMode(c, false, 0, -1, false, 0));
    REFUSED(fmi3ExitInitializationMode(c));
    REFUSED(fmi3Terminate(c));
    REFUSED(fmi3DoStep(c, 0, 0.01, true, flag, flag, flag, &real));
    REFUSED(fmi3GetFMUState(c, NULL));
    REFUSED(fmi3SetFMUState(c, NULL));
    REFUSED(fmi3FreeFMUState(c, NULL));
    REFUSED(fmi3SerializedFMUStateSize(c, NULL, &size));
    REFUSED(fmi3SerializeFMUState(c, NULL, bytes, sizeof bytes));
    REFUSED(fmi3DeserializeFMUState(c, bytes, sizeof bytes, &state));
    REFUSED(fmi3GetNumberOfVariableDependencies(c, kp, &size));
    REFUSED(fmi3GetVariableDependencies(c, kp, &size, &vr, &size, &kind, 1));
    REFUSED(fmi3GetDirectionalDerivative(c, &kp, 1, &kp, 1, &real, 1, &real, 1));
    REFUSED(fmi3GetAdjointDerivative(c, &kp, 1, &kp, 1, &real, 1, &real, 1));
    REFUSED(fmi3GetOutputDerivatives(c, &kp, 1, &order, &real, 1));
    REFUSED(fmi3EnterConfigurationMode(c));
    REFUSED(fmi3ExitConfigurationMode(c));
    REFUSED(fmi3EnterEventMode(c));
    REFUSED(fmi3EnterStepMode(c));
    REFUSED(fmi3EvaluateDiscreteStates(c));
    REFUSED(fmi3UpdateDiscreteStates(c, flag, flag, flag, flag, flag, &real));
    REFUSED(fmi3GetIntervalDecimal(c, &kp, 1, &real, &qualifier));
    REFUSED(fmi3GetIntervalFraction(c, &kp, 1, &count, &count, &qualifier));
    REFUSED(fmi3GetShiftDecimal(c, &kp, 1, &real));
    REFUSED(fmi3GetShiftFraction(c, &kp, 1, &count, &count));
    REFUSED(fmi3SetIntervalDecimal(c, &kp, 1, &real));
    REFUSED(fmi3SetIntervalFraction(c, &kp, 1, &count, &count));
    REFUSED(fmi3SetShiftDecimal(c, &kp, 1, &real));
    REFUSED(fmi3SetShiftFraction(c, &kp, 1, &count, &count));
    REFUSED(fmi3ActivateModelPartition(c, kp, 0));
    REFUSED(fmi3EnterContinuousTimeMode(c));
    REFUSED(fmi3CompletedIntegratorStep(c, true, flag, flag));
    REFUSED(fmi3SetTime(c, 0));
    REFUSED(fmi3SetContinuousStates(c, &real, 1));
    REFUSED(fmi3GetContinuousStateDerivatives(c, &real, 1));
    REFUSED(fmi3GetEventIndicators(c, &real, 1));
    REFUSED(fmi3GetContinuousStates(c, &real, 1));
    REFUSED(fmi3GetNominalsOfContinuousStates(c, &real, 1));
    REFUSED(fmi3GetNumberOfEventIndicators(c, &size));
    REFUSED(fmi3GetNumberOfContinuousStates(c, &size));
}

/* Each exported function, without an instance and with one that has just begun: a line for each, no change. */
static void every_function_answers_wrong_calls(void) {
    wrong_calls_of_fmi_2(NULL);
    wrong_calls_of_fmi_3(NULL);
    CHECK(fmi2Reset(NULL) == fmi2Error && fmi3Reset(NULL) == fmi3Error);
    CHECK(fmi2EnterInitializationMode(NULL) == fmi2Error);
    fmi2FreeInstance(NULL);
    fmi3FreeInstance(NULL);
    fmi2Component two = create_2();
    fmi3Instance three = create_3();
    wrong_calls_of_fmi_2(two);
    wrong_calls_of_fmi_3(three);
    CHECK(get_real(two, KP) == 0.5);
    fmi2FreeInstance(two);
    fmi3FreeInstance(three);
    CHECK(outstanding == 0);
}

static void states_go_through_bytes_in_fmi_3(void) {
    fmi3Instance c = create_3();
    CHECK(fmi3EnterInitializationMode(c, false, 0, 0, true, 5) == fmi3OK);
    CHECK(fmi3ExitInitializationMode(c) == fmi3OK);
    fmi3FMUState state = NULL, copy = NULL;
    static uint8_t bytes[4096];
    size_t size = 0;
    bool flag[3];
    double end;
    CHECK(fmi3GetFMUState(c, &state) == fmi3OK);
    CHECK(fmi3SerializedFMUStateSize(c, state, &size) == fmi3OK);
    CHECK(fmi3SerializeFMUState(c, state, bytes + 1, size) == fmi3OK);
    CHECK(fmi3DeserializeFMUState(c, bytes + 1, size, &copy) == fmi3OK);
    CHECK(fmi3DoStep(c, 0, 0.05, true, flag, flag + 1, flag + 2, &end) == fmi3OK);
    CHECK(fmi3SetFMUState(c, copy) == fmi3OK);
    CHECK(refused(fmi3DoStep(c, 0, 0.05, true, NULL, flag, flag, &end), "NULL"));
    CHECK(fmi3DoStep(c, 0, 0.05, true, flag, flag + 1, flag + 2, &end) == fmi3OK);
    CHECK(fmi3FreeFMUState(c, &state) == fmi3OK && fmi3FreeFMUState(c, &copy) == fmi3OK);
    fmi3FreeInstance(c);
    CHECK(outstanding == 0);
}

int main(void) {
    test_core();
    instances_are_refused_with_a_reason();
    values_are_refused_by_name();
    steps_are_refused_when_they_make_no_sense();
    states_of_others_are_refused();
    categories_choose_what_is_logged();
    every_failed_allocation_is_survived();
    no_memory_is_taken_inside_a_step();
    two_thousand_instances_come_and_go();
    fifty_instances_do_not_know_of_each_other();
    a_failing_engine_is_an_error_with_its_reason();
    states_of_different_size_replace_each_other();
    states_go_through_bytes_in_fmi_3();
    log_lines_of_fmi_2_are_formats();
    all_settings_run();
    every_function_answers_wrong_calls();
    (void)puts("all tests passed");
    return 0;
}
