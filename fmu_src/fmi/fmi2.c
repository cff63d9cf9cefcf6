/* FMI 2.0 for co-simulation: translation only, what happens is in component.c. */
#include "fmu_config.h"

#include "component.h"
#include "fmi2Functions.h"

extern const fmu_model FMU_MODEL;

#define REALS (1U << FMU_REAL)
#define INTEGERS (1U << FMU_INTEGER | 1U << FMU_ENUMERATION)
#define BOOLEANS (1U << FMU_BOOLEAN)

/* ---------------------------------------------------------------- log */

/* The message is a format to the importer, and # starts a reference to a variable in it. */
static void escape(const char *text, char *escaped, size_t size) {
    size_t used = 0;
    for (; *text != '\0' && used + 2 < size; text++) {
        if (*text == '%' || *text == '#') {
            escaped[used++] = *text;
        }
        escaped[used++] = *text;
    }
    escaped[used] = '\0';
}

static void write_message(const fmu_logger *logger, const char *instance_name, fmu_status status,
                          const char *category, const char *message) {
    char format[2 * FMU_WHY_SIZE];
    escape(message, format, sizeof format);
    ((fmi2CallbackLogger)logger->callback)(logger->environment, instance_name, (fmi2Status)status, category, format);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
    return fmu_enter(c, __func__, FMU_ANY_PHASE)
               ? (fmi2Status)fmu_set_logging(c, loggingOn != fmi2False, nCategories, categories)
               : fmi2Error;
}

/* ---------------------------------------------------------------- life cycle */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn) {
    (void)visible;
    if (functions == NULL) {
        return NULL;
    }
    const fmu_request request = {
        .name = instanceName,
        .token = fmuGUID,
        .expected_token = FMU_TOKEN,
        .resources = fmuResourceLocation,
        .addressing = FMU_SCALARS,
        .log_events = loggingOn != fmi2False,
        .logger = {write_message, (void (*)(void))functions->logger, functions->componentEnvironment},
        .function = __func__,
    };
    if (fmuType != fmi2CoSimulation) {
        fmu_log_refusal(&request.logger, instanceName, __func__, "this model is for co-simulation only");
        return NULL;
    }
    return fmu_create(&FMU_MODEL, &request);
}

void fmi2FreeInstance(fmi2Component c) { fmu_destroy(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    (void)toleranceDefined, (void)tolerance;
    return fmu_enter(c, __func__, FMU_INSTANTIATED)
               ? (fmi2Status)fmu_set_start(c, startTime, stopTimeDefined != fmi2False, stopTime)
               : fmi2Error;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    return fmu_enter(c, __func__, FMU_INSTANTIATED) ? (fmi2Status)fmu_enter_initialisation(c) : fmi2Error;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    return fmu_enter(c, __func__, FMU_INITIALISING) ? (fmi2Status)fmu_exit_initialisation(c) : fmi2Error;
}

fmi2Status fmi2Terminate(fmi2Component c) {
    return fmu_enter(c, __func__, FMU_STEPPING) ? (fmi2Status)fmu_terminate(c) : fmi2Error;
}

fmi2Status fmi2Reset(fmi2Component c) {
    return fmu_enter(c, __func__, FMU_ANY_PHASE) ? (fmi2Status)fmu_reset(c) : fmi2Error;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    (void)noSetFMUStatePriorToCurrentPoint;
    return fmu_enter(c, __func__, FMU_STEPPING)
               ? (fmi2Status)fmu_step(c, currentCommunicationPoint, communicationStepSize)
               : fmi2Error;
}

/* ---------------------------------------------------------------- variables */

static fmi2Status get(fmi2Component c, const char *function, unsigned types, fmu_form form,
                      const fmi2ValueReference vr[], size_t nvr, void *value) {
    return fmu_enter(c, function, FMU_ANY_PHASE) ? (fmi2Status)fmu_get(c, types, form, vr, nvr, value, nvr)
                                                 : fmi2Error;
}

static fmi2Status set(fmi2Component c, const char *function, unsigned types, fmu_form form,
                      const fmi2ValueReference vr[], size_t nvr, const void *value) {
    return fmu_enter(c, function, FMU_INSTANTIATED | FMU_INITIALISING | FMU_STEPPING)
               ? (fmi2Status)fmu_set(c, types, form, vr, nvr, value, nvr)
               : fmi2Error;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    return get(c, __func__, REALS, FMU_DOUBLES, vr, nvr, value);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
    return get(c, __func__, INTEGERS, FMU_INT32S, vr, nvr, value);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[]) {
    return get(c, __func__, BOOLEANS, FMU_INT32S, vr, nvr, value);
}

/* No model has strings: any value reference is refused. */
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[]) {
    return get(c, __func__, 0, FMU_DOUBLES, vr, nvr, value);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
    return set(c, __func__, REALS, FMU_DOUBLES, vr, nvr, value);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[]) {
    return set(c, __func__, INTEGERS, FMU_INT32S, vr, nvr, value);
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[]) {
    return set(c, __func__, BOOLEANS, FMU_INT32S, vr, nvr, value);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[]) {
    return set(c, __func__, 0, FMU_DOUBLES, vr, nvr, value);
}

/* ---------------------------------------------------------------- states */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    return fmu_enter(c, __func__, FMU_ANY_PHASE) ? (fmi2Status)fmu_save_state(c, FMUstate) : fmi2Error;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    return fmu_enter(c, __func__, FMU_ANY_PHASE) ? (fmi2Status)fmu_restore_state(c, FMUstate) : fmi2Error;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    return fmu_enter(c, __func__, FMU_ANY_PHASE) ? (fmi2Status)fmu_free_state(c, FMUstate) : fmi2Error;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    return fmu_enter(c, __func__, FMU_ANY_PHASE) ? (fmi2Status)fmu_state_size(c, FMUstate, size) : fmi2Error;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
    return fmu_enter(c, __func__, FMU_ANY_PHASE) ? (fmi2Status)fmu_serialise(c, FMUstate, serializedState, size)
                                                 : fmi2Error;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate) {
    return fmu_enter(c, __func__, FMU_ANY_PHASE) ? (fmi2Status)fmu_deserialise(c, serializedState, size, FMUstate)
                                                 : fmi2Error;
}

/* ---------------------------------------------------------------- status: every step is complete when it returns */

static fmi2Status refuse(fmi2Component c, const char *function, const char *reason) {
    return fmu_enter(c, function, FMU_ANY_PHASE) ? (fmi2Status)fmu_refuse(c, "%s", reason) : fmi2Error;
}

static fmi2Status refuse_status(fmi2Component c, const char *function) {
    return refuse(c, function, "no such status: steps are complete when they return");
}

fmi2Status fmi2CancelStep(fmi2Component c) { return refuse(c, __func__, "no step is pending"); }

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value) {
    (void)s, (void)value;
    return refuse_status(c, __func__);
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    if (s != fmi2LastSuccessfulTime || value == NULL) {
        return refuse_status(c, __func__);
    }
    if (!fmu_enter(c, __func__, FMU_STEPPING | FMU_TERMINATED)) {
        return fmi2Error;
    }
    *value = fmu_time(c);
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value) {
    (void)s, (void)value;
    return refuse_status(c, __func__);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value) {
    if (s != fmi2Terminated || value == NULL) {
        return refuse_status(c, __func__);
    }
    if (!fmu_enter(c, __func__, FMU_STEPPING | FMU_TERMINATED)) {
        return fmi2Error;
    }
    *value = fmi2False; /* a model never asks for the end of the simulation */
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value) {
    (void)s, (void)value;
    return refuse_status(c, __func__);
}

/* ---------------------------------------------------------------- what a sampled model does not have */

static fmi2Status no_derivatives(fmi2Component c, const char *function) {
    return refuse(c, function, "a sampled model has no derivatives");
}

static fmi2Status no_model_exchange(fmi2Component c, const char *function) {
    return refuse(c, function, "this function belongs to model exchange");
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown,
                                        const fmi2Real dvKnown[], fmi2Real dvUnknown[]) {
    (void)vUnknown_ref, (void)nUnknown, (void)vKnown_ref, (void)nKnown, (void)dvKnown, (void)dvUnknown;
    return no_derivatives(c, __func__);
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    (void)vr, (void)nvr, (void)order, (void)value;
    return no_derivatives(c, __func__);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
    (void)vr, (void)nvr, (void)order, (void)value;
    return no_derivatives(c, __func__);
}

fmi2Status fmi2EnterEventMode(fmi2Component c) { return no_model_exchange(c, __func__); }

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *fmi2eventInfo) {
    (void)fmi2eventInfo;
    return no_model_exchange(c, __func__);
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { return no_model_exchange(c, __func__); }

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation) {
    (void)noSetFMUStatePriorToCurrentPoint, (void)enterEventMode, (void)terminateSimulation;
    return no_model_exchange(c, __func__);
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    (void)time;
    return no_model_exchange(c, __func__);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx) {
    (void)x, (void)nx;
    return no_model_exchange(c, __func__);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx) {
    (void)derivatives, (void)nx;
    return no_model_exchange(c, __func__);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni) {
    (void)eventIndicators, (void)ni;
    return no_model_exchange(c, __func__);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx) {
    (void)x, (void)nx;
    return no_model_exchange(c, __func__);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx) {
    (void)x_nominal, (void)nx;
    return no_model_exchange(c, __func__);
}
