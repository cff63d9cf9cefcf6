/* FMI 3.0 for co-simulation: translation only, what happens is in component.c. */
#include "fmu_config.h"

#include "component.h"
#include "fmi3Functions.h"

extern const fmu_model FMU_MODEL;

/* ---------------------------------------------------------------- log */

static void write_message(const fmu_logger *logger, const char *instance_name, fmu_status status,
                          const char *category, const char *message) {
    (void)instance_name;
    ((fmi3LogMessageCallback)logger->callback)(logger->environment, (fmi3Status)status, category, message);
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
    return fmu_enter(instance, __func__, FMU_ANY_PHASE)
               ? (fmi3Status)fmu_set_logging(instance, loggingOn, nCategories, categories)
               : fmi3Error;
}

/* ---------------------------------------------------------------- life cycle */

const char *fmi3GetVersion(void) { return fmi3Version; }

static fmu_logger logger_of(fmi3LogMessageCallback logMessage, fmi3InstanceEnvironment instanceEnvironment) {
    return (fmu_logger){write_message, (void (*)(void))logMessage, instanceEnvironment};
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken,
                                         fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                         fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
                                         const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables,
                                         fmi3InstanceEnvironment instanceEnvironment,
                                         fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback intermediateUpdate) {
    (void)visible, (void)earlyReturnAllowed, (void)requiredIntermediateVariables;
    (void)nRequiredIntermediateVariables, (void)intermediateUpdate;
    const fmu_request request = {
        .name = instanceName,
        .token = instantiationToken,
        .expected_token = FMU_TOKEN,
        .resources = resourcePath,
        .addressing = FMU_ADDRESSING,
        .log_events = loggingOn,
        .logger = logger_of(logMessage, instanceEnvironment),
        .function = __func__,
    };
    if (eventModeUsed) {
        fmu_log_refusal(&request.logger, instanceName, __func__, "this model has no event mode");
        return NULL;
    }
    return fmu_create(&FMU_MODEL, &request);
}

static fmi3Instance refuse_instance(fmi3String name, const char *function, fmi3LogMessageCallback logMessage,
                                    fmi3InstanceEnvironment environment) {
    const fmu_logger logger = logger_of(logMessage, environment);
    fmu_log_refusal(&logger, name, function, "this model is for co-simulation only");
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    return refuse_instance(instanceName, __func__, logMessage, instanceEnvironment);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
                                               fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption) {
    (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    return refuse_instance(instanceName, __func__, logMessage, instanceEnvironment);
}

void fmi3FreeInstance(fmi3Instance instance) { fmu_destroy(instance); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    (void)toleranceDefined, (void)tolerance;
    if (!fmu_enter(instance, __func__, FMU_INSTANTIATED) ||
        fmu_set_start(instance, startTime, stopTimeDefined, stopTime) != FMU_OK) {
        return fmi3Error;
    }
    return (fmi3Status)fmu_enter_initialisation(instance);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    return fmu_enter(instance, __func__, FMU_INITIALISING) ? (fmi3Status)fmu_exit_initialisation(instance)
                                                           : fmi3Error;
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    return fmu_enter(instance, __func__, FMU_STEPPING) ? (fmi3Status)fmu_terminate(instance) : fmi3Error;
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    return fmu_enter(instance, __func__, FMU_ANY_PHASE) ? (fmi3Status)fmu_reset(instance) : fmi3Error;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn,
                      fmi3Float64 *lastSuccessfulTime) {
    (void)noSetFMUStatePriorToCurrentPoint;
    if (!fmu_enter(instance, __func__, FMU_STEPPING)) {
        return fmi3Error;
    }
    if (eventHandlingNeeded == NULL || terminateSimulation == NULL || earlyReturn == NULL ||
        lastSuccessfulTime == NULL) {
        return (fmi3Status)fmu_refuse(instance, "an argument is NULL");
    }
    const fmu_status status = fmu_step(instance, currentCommunicationPoint, communicationStepSize);
    *eventHandlingNeeded = fmi3False;
    *terminateSimulation = fmi3False;
    *earlyReturn = fmi3False;
    *lastSuccessfulTime = fmu_time(instance);
    return (fmi3Status)status;
}

/* ---------------------------------------------------------------- variables */

static fmi3Status get(fmi3Instance instance, const char *function, unsigned types, fmu_form form,
                      const fmi3ValueReference vrs[], size_t n_vrs, void *values, size_t n_values) {
    return fmu_enter(instance, function, FMU_ANY_PHASE)
               ? (fmi3Status)fmu_get(instance, types, form, vrs, n_vrs, values, n_values)
               : fmi3Error;
}

static fmi3Status set(fmi3Instance instance, const char *function, unsigned types, fmu_form form,
                      const fmi3ValueReference vrs[], size_t n_vrs, const void *values, size_t n_values) {
    return fmu_enter(instance, function, FMU_INSTANTIATED | FMU_INITIALISING | FMU_STEPPING)
               ? (fmi3Status)fmu_set(instance, types, form, vrs, n_vrs, values, n_values)
               : fmi3Error;
}

#define ACCESS(Type, types, form)                                                                                \
    fmi3Status fmi3Get##Type(fmi3Instance instance, const fmi3ValueReference valueReferences[],                  \
                             size_t nValueReferences, fmi3##Type values[], size_t nValues) {                     \
        return get(instance, __func__, types, form, valueReferences, nValueReferences, values, nValues);         \
    }                                                                                                            \
    fmi3Status fmi3Set##Type(fmi3Instance instance, const fmi3ValueReference valueReferences[],                  \
                             size_t nValueReferences, const fmi3##Type values[], size_t nValues) {               \
        return set(instance, __func__, types, form, valueReferences, nValueReferences, values, nValues);         \
    }

ACCESS(Float64, 1U << FMU_REAL, FMU_DOUBLES)
ACCESS(Int32, 1U << FMU_INTEGER, FMU_INT32S)
ACCESS(Int64, 1U << FMU_ENUMERATION, FMU_INT64S)
ACCESS(Boolean, 1U << FMU_BOOLEAN, FMU_BOOLS)

/* No model has variables of these types: any value reference is refused, so that the form does not matter. */
ACCESS(Float32, 0, FMU_DOUBLES)
ACCESS(Int8, 0, FMU_DOUBLES)
ACCESS(UInt8, 0, FMU_DOUBLES)
ACCESS(Int16, 0, FMU_DOUBLES)
ACCESS(UInt16, 0, FMU_DOUBLES)
ACCESS(UInt32, 0, FMU_DOUBLES)
ACCESS(UInt64, 0, FMU_DOUBLES)
ACCESS(String, 0, FMU_DOUBLES)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         size_t valueSizes[], fmi3Binary values[], size_t nValues) {
    (void)valueSizes;
    return get(instance, __func__, 0, FMU_DOUBLES, valueReferences, nValueReferences, values, nValues);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const size_t valueSizes[], const fmi3Binary values[], size_t nValues) {
    (void)valueSizes;
    return set(instance, __func__, 0, FMU_DOUBLES, valueReferences, nValueReferences, values, nValues);
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Clock values[]) {
    return get(instance, __func__, 0, FMU_DOUBLES, valueReferences, nValueReferences, values, nValueReferences);
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        const fmi3Clock values[]) {
    return set(instance, __func__, 0, FMU_DOUBLES, valueReferences, nValueReferences, values, nValueReferences);
}

/* ---------------------------------------------------------------- states */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    return fmu_enter(instance, __func__, FMU_ANY_PHASE) ? (fmi3Status)fmu_save_state(instance, FMUState) : fmi3Error;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    return fmu_enter(instance, __func__, FMU_ANY_PHASE) ? (fmi3Status)fmu_restore_state(instance, FMUState)
                                                        : fmi3Error;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    return fmu_enter(instance, __func__, FMU_ANY_PHASE) ? (fmi3Status)fmu_free_state(instance, FMUState) : fmi3Error;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    return fmu_enter(instance, __func__, FMU_ANY_PHASE) ? (fmi3Status)fmu_state_size(instance, FMUState, size)
                                                        : fmi3Error;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[],
                                 size_t size) {
    return fmu_enter(instance, __func__, FMU_ANY_PHASE)
               ? (fmi3Status)fmu_serialise(instance, FMUState, serializedState, size)
               : fmi3Error;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState) {
    return fmu_enter(instance, __func__, FMU_ANY_PHASE)
               ? (fmi3Status)fmu_deserialise(instance, serializedState, size, FMUState)
               : fmi3Error;
}

/* ---------------------------------------------------------------- what a sampled model does not have */

static fmi3Status refuse(fmi3Instance instance, const char *function, const char *reason) {
    return fmu_enter(instance, function, FMU_ANY_PHASE) ? (fmi3Status)fmu_refuse(instance, "%s", reason) : fmi3Error;
}

static fmi3Status no_derivatives(fmi3Instance instance, const char *function) {
    return refuse(instance, function, "a sampled model has no derivatives");
}

static fmi3Status no_model_exchange(fmi3Instance instance, const char *function) {
    return refuse(instance, function, "this function belongs to model exchange");
}

static fmi3Status no_events(fmi3Instance instance, const char *function) {
    return refuse(instance, function, "this model has no event mode");
}

static fmi3Status no_configuration(fmi3Instance instance, const char *function) {
    return refuse(instance, function, "this model has no structural parameters");
}

static fmi3Status no_clocks(fmi3Instance instance, const char *function) {
    return refuse(instance, function, "this model has no clocks");
}

static fmi3Status no_dependencies(fmi3Instance instance, const char *function) {
    return refuse(instance, function, "dependencies are in the model description");
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference valueReference,
                                               size_t *nDependencies) {
    (void)valueReference, (void)nDependencies;
    return no_dependencies(instance, __func__);
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
                                       size_t elementIndicesOfDependent[], fmi3ValueReference independents[],
                                       size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[],
                                       size_t nDependencies) {
    (void)dependent, (void)elementIndicesOfDependent, (void)independents, (void)elementIndicesOfIndependents;
    (void)dependencyKinds, (void)nDependencies;
    return no_dependencies(instance, __func__);
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
    (void)unknowns, (void)nUnknowns, (void)knowns, (void)nKnowns;
    (void)seed, (void)nSeed, (void)sensitivity, (void)nSensitivity;
    return no_derivatives(instance, __func__);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
    (void)unknowns, (void)nUnknowns, (void)knowns, (void)nKnowns;
    (void)seed, (void)nSeed, (void)sensitivity, (void)nSensitivity;
    return no_derivatives(instance, __func__);
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                    size_t nValueReferences, const fmi3Int32 orders[], fmi3Float64 values[],
                                    size_t nValues) {
    (void)valueReferences, (void)nValueReferences, (void)orders, (void)values, (void)nValues;
    return no_derivatives(instance, __func__);
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance) { return no_configuration(instance, __func__); }

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance) { return no_configuration(instance, __func__); }

fmi3Status fmi3EnterEventMode(fmi3Instance instance) { return no_events(instance, __func__); }

fmi3Status fmi3EnterStepMode(fmi3Instance instance) { return no_events(instance, __func__); }

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) { return no_events(instance, __func__); }

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime) {
    (void)discreteStatesNeedUpdate, (void)terminateSimulation, (void)nominalsOfContinuousStatesChanged;
    (void)valuesOfContinuousStatesChanged, (void)nextEventTimeDefined, (void)nextEventTime;
    return no_events(instance, __func__);
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                  size_t nValueReferences, fmi3Float64 intervals[],
                                  fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences, (void)nValueReferences, (void)intervals, (void)qualifiers;
    return no_clocks(instance, __func__);
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                   fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions, (void)qualifiers;
    return no_clocks(instance, __func__);
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                               size_t nValueReferences, fmi3Float64 shifts[]) {
    (void)valueReferences, (void)nValueReferences, (void)shifts;
    return no_clocks(instance, __func__);
}

fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                size_t nValueReferences, fmi3UInt64 counters[], fmi3UInt64 resolutions[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    return no_clocks(instance, __func__);
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                  size_t nValueReferences, const fmi3Float64 intervals[]) {
    (void)valueReferences, (void)nValueReferences, (void)intervals;
    return no_clocks(instance, __func__);
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                   size_t nValueReferences, const fmi3UInt64 counters[],
                                   const fmi3UInt64 resolutions[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    return no_clocks(instance, __func__);
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                               size_t nValueReferences, const fmi3Float64 shifts[]) {
    (void)valueReferences, (void)nValueReferences, (void)shifts;
    return no_clocks(instance, __func__);
}

fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                                size_t nValueReferences, const fmi3UInt64 counters[],
                                const fmi3UInt64 resolutions[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    return no_clocks(instance, __func__);
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference,
                                      fmi3Float64 activationTime) {
    (void)clockReference, (void)activationTime;
    return no_clocks(instance, __func__);
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) { return no_model_exchange(instance, __func__); }

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation) {
    (void)noSetFMUStatePriorToCurrentPoint, (void)enterEventMode, (void)terminateSimulation;
    return no_model_exchange(instance, __func__);
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
    (void)time;
    return no_model_exchange(instance, __func__);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
                                   size_t nContinuousStates) {
    (void)continuousStates, (void)nContinuousStates;
    return no_model_exchange(instance, __func__);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
                                             size_t nContinuousStates) {
    (void)derivatives, (void)nContinuousStates;
    return no_model_exchange(instance, __func__);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators) {
    (void)eventIndicators, (void)nEventIndicators;
    return no_model_exchange(instance, __func__);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates) {
    (void)continuousStates, (void)nContinuousStates;
    return no_model_exchange(instance, __func__);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[],
                                             size_t nContinuousStates) {
    (void)nominals, (void)nContinuousStates;
    return no_model_exchange(instance, __func__);
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators) {
    (void)nEventIndicators;
    return no_model_exchange(instance, __func__);
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates) {
    (void)nContinuousStates;
    return no_model_exchange(instance, __func__);
}
