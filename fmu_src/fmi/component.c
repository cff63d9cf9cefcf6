#include "component.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A tick counts as reached this many ticks early. The position is kept as a whole number of ticks and a fraction,
 * so it stays exact to 1e-9 of a tick over millions of steps of any size, wherever the time starts and however the
 * importer adds up its own. What is left is the rounding of step sizes that are differences of large times:
 * 1.5e-8 of a tick of 1 ms at 1e5 s. */
#define TICK_TOLERANCE 1e-6
/* How many ticks an importer's time may differ from the end of its previous step. */
#define POINT_TOLERANCE 1e-3
#define MOST_TICKS 1000000
/* In seconds; beyond 30 years a double resolves no sample time. */
#define TIME_LIMIT 1e9

static const char STATE_MAGIC[8] = {'A', 'H', 'R', 'S', 'F', 'M', 'U', '\0'};
enum { STATE_VERSION = 1 };

typedef enum { LOG_ERROR, LOG_WARNING, LOG_EVENT, LOG_ALL } log_category;
static const char *const CATEGORIES[] = {"logStatusError", "logStatusWarning", "logEvents", "logAll"};
enum { N_CATEGORIES = 4, EVERY_CATEGORY = (1 << N_CATEGORIES) - 1 };

static const char *const TYPES[] = {"a real", "an integer", "a Boolean", "an enumeration"};

typedef struct {
    double start;       /* s */
    double now;         /* s, the communication point as the importer names it */
    double sample_time; /* s */
    double fraction;    /* ticks from the last one to now; may be short of 0 by the tolerance */
    uint64_t ticks;     /* since the start */
} fmu_clock;

struct fmu_component {
    const fmu_model *model;
    const char *name;
    const char *token;
    const char *function; /* the FMI function at work */
    fmu_addressing addressing;
    fmu_logger logger;
    unsigned log; /* bits 1 << log_category */
    fmu_phase phase;
    fmu_clock clock;
    bool outputs_due; /* something they follow from has changed */
    bool limits_due;  /* parameters have changed since they were checked */
    unsigned char *instance;
    unsigned char *accepted; /* the parameters with which the limits last held */
    void *process;
};

/* Head of a saved state, in memory and serialised alike. The instance, the accepted parameters and what the
 * engine adds follow. There is no padding. */
typedef struct {
    char magic[8];
    uint32_t version;
    uint32_t phase;
    uint64_t length; /* of the whole */
    char model[32];
    char token[64];
    fmu_clock clock;
    uint64_t limits_due;
    uint64_t checksum; /* of everything else */
} state_head;

/* ---------------------------------------------------------------- log */

static void write_log(const fmu_component *c, log_category category, fmu_status status, const char *text) {
    if ((c->log & 1U << category) != 0 && c->logger.callback != NULL) {
        char line[FMU_WHY_SIZE + 64];
        (void)snprintf(line, sizeof line, "%s: %s", c->function, text);
        c->logger.write(&c->logger, c->name, status, CATEGORIES[category], line);
    }
}

static void log_event(const fmu_component *c, const char *format, ...) {
    fmu_why why;
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(why.text, sizeof why.text, format, arguments);
    va_end(arguments);
    write_log(c, LOG_EVENT, FMU_OK, why.text);
}

fmu_status fmu_refuse(fmu_component *c, const char *format, ...) {
    fmu_why why;
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(why.text, sizeof why.text, format, arguments);
    va_end(arguments);
    write_log(c, LOG_ERROR, FMU_ERROR, why.text);
    return FMU_ERROR;
}

void fmu_log_refusal(const fmu_logger *logger, const char *name, const char *function, const char *reason) {
    const fmu_component nobody = {
        .name = name != NULL ? name : "", .function = function, .logger = *logger, .log = EVERY_CATEGORY};
    write_log(&nobody, LOG_ERROR, FMU_ERROR, reason);
}

fmu_status fmu_set_logging(fmu_component *c, bool on, size_t n, const char *const categories[]) {
    unsigned named = n == 0 ? EVERY_CATEGORY : 0;
    if (n > 0 && categories == NULL) {
        return fmu_refuse(c, "no categories given");
    }
    for (size_t i = 0; i < n; i++) {
        const char *wanted = categories[i] != NULL ? categories[i] : "(null)";
        size_t k = 0;
        while (k < N_CATEGORIES && strcmp(wanted, CATEGORIES[k]) != 0) {
            k++;
        }
        if (k == N_CATEGORIES) {
            return fmu_refuse(c, "log category '%.64s' is not declared; there are logStatusError, logStatusWarning, "
                                 "logEvents and logAll", wanted);
        }
        named |= k == LOG_ALL ? EVERY_CATEGORY : 1U << k;
    }
    c->log = on ? named : c->log & ~named;
    return FMU_OK;
}

/* Logs what the model printed during a call of the engine, and why the call failed if it did. */
static bool did(fmu_component *c, bool succeeded, const fmu_why *why) {
    const char *printed = fmu_the_engine.said(c->process);
    if (printed != NULL) {
        log_event(c, "%s", printed);
    }
    if (!succeeded) {
        (void)fmu_refuse(c, "%s", why->text);
    }
    return succeeded;
}

bool fmu_enter(fmu_component *c, const char *function, unsigned phases) {
    if (c == NULL) {
        return false;
    }
    c->function = function;
    if (((unsigned)c->phase & phases) == 0) {
        const char *const now = c->phase == FMU_INSTANTIATED   ? "before initialisation"
                                : c->phase == FMU_INITIALISING ? "during initialisation"
                                : c->phase == FMU_STEPPING     ? "once initialisation has ended"
                                                               : "after the end of the simulation";
        (void)fmu_refuse(c, "not allowed %s", now);
        return false;
    }
    return true;
}

/* ---------------------------------------------------------------- variables */

/* The independent variable belongs to every model; its value is the clock's. */
static const fmu_variable TIME = {.name = "time", .size = 1, .type = FMU_REAL, .role = FMU_OUTPUT};

/* The elements that one value reference means. */
typedef struct {
    const fmu_variable *variable;
    uint32_t first, count;
} selection;

static bool is_parameter(const fmu_variable *v) { return v->role == FMU_FIXED || v->role == FMU_TUNABLE; }

static const fmu_variable *find(const fmu_model *model, uint32_t vr) {
    size_t low = 0, high = model->n_variables; /* the last variable that does not begin after vr is in [low, high) */
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (model->variables[middle].vr <= vr) {
            low = middle;
        } else {
            high = middle;
        }
    }
    const fmu_variable *v = &model->variables[low];
    return vr >= v->vr && vr - v->vr < v->size ? v : NULL;
}

/* Fails with a log line. */
static bool choose(fmu_component *c, uint32_t vr, unsigned types, selection *s) {
    const fmu_variable *v = vr == 0 ? &TIME : find(c->model, vr);
    if (v == NULL || (c->addressing == FMU_ARRAYS && vr != v->vr)) {
        (void)fmu_refuse(c, "value reference %lu is unknown", (unsigned long)vr);
        return false;
    }
    if ((types & 1U << v->type) == 0) {
        (void)fmu_refuse(c, "%s (value reference %lu) is %s", v->name, (unsigned long)vr, TYPES[v->type]);
        return false;
    }
    const bool whole = c->addressing == FMU_ARRAYS;
    *s = (selection){v, whole ? 0 : vr - v->vr, whole ? v->size : 1};
    return true;
}

static double peek(const fmu_component *c, const fmu_variable *v, uint32_t element) {
    if (v == &TIME) {
        return c->clock.now;
    }
    if (v->offset == c->model->sample_time_offset) {
        return c->clock.sample_time;
    }
    const unsigned char *at = c->instance + v->offset;
    return v->type == FMU_REAL ? (double)((const ahrs_real *)(const void *)at)[element]
                               : (double)((const int32_t *)(const void *)at)[element];
}

static void poke(fmu_component *c, const fmu_variable *v, uint32_t element, double value) {
    unsigned char *at = c->instance + v->offset;
    if (v->type == FMU_REAL) {
        ((ahrs_real *)(void *)at)[element] = (ahrs_real)value;
    } else {
        ((int32_t *)(void *)at)[element] = v->type == FMU_BOOLEAN ? value != 0 : (int32_t)value;
    }
    /* The clock must count in what the importer set, not in what a float makes of it. */
    if (v->offset == c->model->sample_time_offset) {
        c->clock.sample_time = value;
    }
}

static double load(fmu_form form, const void *values, size_t i) {
    switch (form) {
    case FMU_DOUBLES: return ((const double *)values)[i];
    case FMU_INT32S: return ((const int32_t *)values)[i];
    case FMU_INT64S: return (double)((const int64_t *)values)[i];
    default: return ((const bool *)values)[i];
    }
}

static void store(fmu_form form, void *values, size_t i, double value) {
    switch (form) {
    case FMU_DOUBLES: ((double *)values)[i] = value; break;
    case FMU_INT32S: ((int32_t *)values)[i] = (int32_t)value; break;
    case FMU_INT64S: ((int64_t *)values)[i] = (int64_t)value; break;
    default: ((bool *)values)[i] = value != 0; break;
    }
}

/* Real inputs are never refused: a sensor may say anything, and the model copes with it. */
static bool is_in_range(const fmu_variable *v, double value) {
    if (v->type == FMU_BOOLEAN || (v->type == FMU_REAL && v->role == FMU_INPUT)) {
        return true;
    }
    if (v->type == FMU_REAL && !ahrs_is_finite((ahrs_real)value)) {
        return (v->flags & FMU_INFINITY_ALLOWED) != 0 && value > 0;
    }
    const bool above = (v->flags & FMU_MIN_OPEN) != 0 ? value > v->min : value >= v->min;
    const bool below = (v->flags & FMU_MAX_OPEN) != 0 ? value < v->max : value <= v->max;
    return above && below;
}

static bool is_settable(fmu_component *c, const selection *s, fmu_form form, const void *values, size_t at) {
    const fmu_variable *v = s->variable;
    if (v->role == FMU_OUTPUT) {
        (void)fmu_refuse(c, "%s is computed and cannot be set", v->name);
        return false;
    }
    if (v->role == FMU_FIXED && c->phase == FMU_STEPPING) {
        (void)fmu_refuse(c, "%s is fixed once initialisation has ended", v->name);
        return false;
    }
    for (uint32_t i = 0; i < s->count; i++) {
        const double value = load(form, values, at + i);
        if (!is_in_range(v, value)) {
            (void)fmu_refuse(c, "%s = %.9g is outside %s%.9g, %.9g%s (element %lu)", v->name, value,
                             (v->flags & FMU_MIN_OPEN) != 0 ? "(" : "[", v->min, v->max,
                             (v->flags & FMU_MAX_OPEN) != 0 ? ")" : "]", (unsigned long)(s->first + i + 1));
            return false;
        }
    }
    return true;
}

/* Compares the importer's arrays with what its value references ask for. */
static bool is_complete(fmu_component *c, unsigned types, const uint32_t vrs[], size_t n_vrs, const void *values,
                        size_t n_values) {
    if ((n_vrs > 0 && vrs == NULL) || (n_values > 0 && values == NULL)) {
        (void)fmu_refuse(c, "an array is NULL");
        return false;
    }
    size_t wanted = 0;
    for (size_t i = 0; i < n_vrs; i++) {
        selection s;
        if (!choose(c, vrs[i], types, &s)) {
            return false;
        }
        wanted += s.count;
    }
    if (wanted != n_values) {
        (void)fmu_refuse(c, "the variables have %lu values, %lu given", (unsigned long)wanted, (unsigned long)n_values);
        return false;
    }
    return true;
}

fmu_status fmu_set(fmu_component *c, unsigned types, fmu_form form, const uint32_t vrs[], size_t n_vrs,
                   const void *values, size_t n_values) {
    if (!is_complete(c, types, vrs, n_vrs, values, n_values)) {
        return FMU_ERROR;
    }
    selection s;
    for (size_t i = 0, at = 0; i < n_vrs; i++, at += s.count) {
        (void)choose(c, vrs[i], types, &s);
        if (!is_settable(c, &s, form, values, at)) {
            return FMU_ERROR;
        }
    }
    for (size_t i = 0, at = 0; i < n_vrs; i++, at += s.count) {
        (void)choose(c, vrs[i], types, &s);
        for (uint32_t k = 0; k < s.count; k++) {
            poke(c, s.variable, s.first + k, load(form, values, at + k));
        }
        c->limits_due = c->limits_due || is_parameter(s.variable);
        /* Only the first outputs follow from inputs of the same instant. */
        c->outputs_due = c->outputs_due || is_parameter(s.variable) || c->phase != FMU_STEPPING;
    }
    return FMU_OK;
}

/* ---------------------------------------------------------------- limits and outputs */

/* "kp = 5, sample_time = 0.5" */
static void describe(const fmu_component *c, const fmu_limit *limit, char *text, size_t size) {
    size_t used = 0;
    text[0] = '\0';
    for (uint32_t i = 0; i < limit->n_vrs && used < size; i++) {
        const fmu_variable *v = find(c->model, limit->vrs[i]);
        for (uint32_t k = 0; k < v->size && used < size; k++) {
            const char *start = i == 0 && k == 0 ? "" : ", ";
            const int n = snprintf(text + used, size - used, "%s%s = %.9g", start, v->name, peek(c, v, k));
            used += n > 0 ? (size_t)n : 0;
        }
    }
}

static fmu_status check_limits(fmu_component *c) {
    fmu_status status = FMU_OK;
    for (size_t i = 0; i < c->model->n_limits; i++) {
        const fmu_limit *limit = &c->model->limits[i];
        if (limit->holds(c->instance)) {
            continue;
        }
        char values[256];
        fmu_why why;
        describe(c, limit, values, sizeof values);
        (void)snprintf(why.text, sizeof why.text, "'%s' does not hold (%s): %s", limit->rule, values, limit->says);
        if (!limit->is_warning) {
            return fmu_refuse(c, "%s", why.text);
        }
        write_log(c, LOG_WARNING, FMU_WARNING, why.text);
        status = FMU_WARNING;
    }
    return status;
}

static void accept_parameters(fmu_component *c) {
    memcpy(c->accepted, c->instance + c->model->params.offset, c->model->params.size);
    c->limits_due = false;
}

static void take_back_parameters(fmu_component *c) {
    memcpy(c->instance + c->model->params.offset, c->accepted, c->model->params.size);
    c->limits_due = false;
    c->outputs_due = true;
}

/* During initialisation the outputs are those of the first instant, whatever is set by then. */
static fmu_status compute_outputs(fmu_component *c) {
    fmu_why why;
    if (c->phase == FMU_INITIALISING) {
        if (check_limits(c) > FMU_WARNING) {
            return FMU_ERROR;
        }
        if (!did(c, fmu_the_engine.start(c->process, c->model, c->instance, &why), &why)) {
            return FMU_ERROR;
        }
    }
    if (!did(c, fmu_the_engine.outputs(c->process, c->model, c->instance, &why), &why)) {
        return FMU_ERROR;
    }
    c->outputs_due = false;
    return FMU_OK;
}

fmu_status fmu_get(fmu_component *c, unsigned types, fmu_form form, const uint32_t vrs[], size_t n_vrs, void *values,
                   size_t n_values) {
    if (!is_complete(c, types, vrs, n_vrs, values, n_values)) {
        return FMU_ERROR;
    }
    selection s;
    bool needs_outputs = false;
    for (size_t i = 0; i < n_vrs; i++) {
        (void)choose(c, vrs[i], types, &s);
        needs_outputs = needs_outputs || (s.variable->role == FMU_OUTPUT && s.variable != &TIME);
    }
    if (needs_outputs && c->phase == FMU_INSTANTIATED) {
        return fmu_refuse(c, "outputs are not known before initialisation");
    }
    if (needs_outputs && c->outputs_due && compute_outputs(c) != FMU_OK) {
        return FMU_ERROR;
    }
    for (size_t i = 0, at = 0; i < n_vrs; i++, at += s.count) {
        (void)choose(c, vrs[i], types, &s);
        for (uint32_t k = 0; k < s.count; k++) {
            store(form, values, at + k, peek(c, s.variable, s.first + k));
        }
    }
    return FMU_OK;
}

/* ---------------------------------------------------------------- memory */

void *fmu_allocate(size_t size) { return malloc(size); }

void fmu_release(void *memory) { free(memory); }

/* ---------------------------------------------------------------- life cycle */

static size_t aligned(size_t size) { return (size + 15) & ~(size_t)15; }

static void begin(fmu_component *c) {
    c->model->defaults(c->instance);
    c->clock = (fmu_clock){.sample_time = c->model->sample_time};
    c->phase = FMU_INSTANTIATED;
    c->outputs_due = true;
    accept_parameters(c);
}

fmu_component *fmu_create(const fmu_model *model, const fmu_request *request) {
    const char *reason = NULL;
    if (request->name == NULL || request->name[0] == '\0') {
        reason = "the instance has no name";
    } else if (request->token == NULL || strcmp(request->token, request->expected_token) != 0) {
        reason = "the token is not the one of this model description";
    }
    if (reason != NULL) {
        fmu_log_refusal(&request->logger, request->name, request->function, reason);
        return NULL;
    }
    const size_t head = aligned(sizeof(fmu_component)), process = aligned(fmu_the_engine.process_size);
    const size_t instance = aligned(model->instance_size), params = aligned(model->params.size);
    const size_t name = strlen(request->name) + 1;
    unsigned char *memory = calloc(1, head + process + instance + params + name);
    if (memory == NULL) {
        fmu_log_refusal(&request->logger, request->name, request->function, "out of memory");
        return NULL;
    }
    fmu_component *c = (fmu_component *)(void *)memory;
    *c = (fmu_component){
        .model = model,
        .name = memcpy(memory + head + process + instance + params, request->name, name),
        .token = request->expected_token,
        .function = request->function,
        .addressing = request->addressing,
        .logger = request->logger,
        .log = 1U << LOG_ERROR | 1U << LOG_WARNING | (request->log_events ? 1U << LOG_EVENT : 0),
        .process = memory + head,
        .instance = memory + head + process,
        .accepted = memory + head + process + instance,
    };
    fmu_why why;
    if (!did(c, fmu_the_engine.open(c->process, model, request->resources, &why), &why)) {
        free(c);
        return NULL;
    }
    begin(c);
    return c;
}

void fmu_destroy(fmu_component *c) {
    if (c != NULL) {
        fmu_the_engine.close(c->process);
        free(c);
    }
}

static bool is_finite(double x) { return x - x == 0; }

fmu_status fmu_set_start(fmu_component *c, double start, bool stop_defined, double stop) {
    if (!is_finite(start) || start < 0 || start > TIME_LIMIT) {
        return fmu_refuse(c, "start time %.9g s is outside [0, %.0e] s", start, TIME_LIMIT);
    }
    if (stop_defined && !(stop >= start)) {
        return fmu_refuse(c, "stop time %.9g s is before the start time %.9g s", stop, start);
    }
    c->clock.start = c->clock.now = start;
    return FMU_OK;
}

fmu_status fmu_enter_initialisation(fmu_component *c) {
    c->phase = FMU_INITIALISING;
    c->outputs_due = true;
    return FMU_OK;
}

fmu_status fmu_exit_initialisation(fmu_component *c) {
    const fmu_status status = check_limits(c);
    if (status > FMU_WARNING) {
        return status;
    }
    fmu_why why;
    if (!did(c, fmu_the_engine.start(c->process, c->model, c->instance, &why), &why)) {
        return FMU_ERROR;
    }
    accept_parameters(c);
    c->phase = FMU_STEPPING;
    c->outputs_due = true;
    log_event(c, "%s runs every %.9g s from %.9g s", c->model->title, c->clock.sample_time, c->clock.start);
    return status;
}

fmu_status fmu_terminate(fmu_component *c) {
    c->phase = FMU_TERMINATED;
    log_event(c, "%s ended at %.9g s after %llu ticks", c->model->title, c->clock.now,
              (unsigned long long)c->clock.ticks);
    return FMU_OK;
}

fmu_status fmu_reset(fmu_component *c) {
    fmu_the_engine.reset(c->process);
    begin(c);
    return FMU_OK;
}

double fmu_time(const fmu_component *c) { return c->clock.now; }

/* ---------------------------------------------------------------- steps */

static double larger(double x, double y) { return x > y ? x : y; }

fmu_status fmu_step(fmu_component *c, double time, double step) {
    fmu_clock *clock = &c->clock;
    if (!is_finite(time) || !is_finite(step) || time < 0 || step < 0) {
        return fmu_refuse(c, "time %.17g s and step %.17g s must be finite and not negative", time, step);
    }
    const double gap = time - clock->now;
    if (larger(gap, -gap) > POINT_TOLERANCE * clock->sample_time) {
        return fmu_refuse(c, "the step begins at %.17g s, the one before ended at %.17g s", time, clock->now);
    }
    if (time + step > TIME_LIMIT) {
        return fmu_refuse(c, "the step would end after %.0e s", TIME_LIMIT);
    }
    /* An importer that multiplies finds its next time a rounding away from the sum: that is no distance. */
    const bool is_rounding = larger(gap, -gap) <= 4 * DBL_EPSILON * larger(time, clock->now);
    const double position = clock->fraction + ((is_rounding ? 0 : gap) + step) / clock->sample_time;
    const double reached = larger(position + TICK_TOLERANCE, 0);
    if (!(reached < MOST_TICKS + 1.0)) {
        return fmu_refuse(c, "a step of %.9g s has more than %d ticks of %.9g s: take shorter steps", step, MOST_TICKS,
                          clock->sample_time);
    }
    fmu_status status = FMU_OK;
    if (c->limits_due) {
        status = check_limits(c);
        if (status > FMU_WARNING) {
            take_back_parameters(c);
            return status;
        }
        accept_parameters(c);
    }
    const uint32_t ticks = (uint32_t)reached;
    if (ticks > 0) {
        fmu_why why;
        const ahrs_real dt = (ahrs_real)clock->sample_time;
        if (!did(c, fmu_the_engine.run(c->process, c->model, c->instance, ticks, dt, &why), &why)) {
            return FMU_ERROR;
        }
        c->outputs_due = true;
    }
    clock->ticks += ticks;
    clock->fraction = position - ticks;
    clock->now = time + step;
    return status;
}

/* ---------------------------------------------------------------- saved states */

/* FNV-1a over all bytes but the checksum's own. Each step is a bijection of the sum, so no change of a single
 * byte leaves it as it was. */
static uint64_t checksum(const unsigned char *bytes, size_t size) {
    const size_t own = offsetof(state_head, checksum);
    uint64_t sum = 0xcbf29ce484222325U;
    for (size_t i = 0; i < size; i++) {
        if (i < own || i >= own + sizeof(uint64_t)) {
            sum = (sum ^ bytes[i]) * 0x100000001b3U;
        }
    }
    return sum;
}

static size_t least_size(const fmu_component *c) {
    return sizeof(state_head) + c->model->instance_size + c->model->params.size;
}

/* Why these bytes are no state of this model, or NULL. Only then is a byte beyond the head looked at. */
static const char *fault(const fmu_component *c, const void *bytes, size_t size) {
    state_head head;
    if (size < least_size(c)) {
        return "the state is too short";
    }
    memcpy(&head, bytes, sizeof head);
    if (memcmp(head.magic, STATE_MAGIC, sizeof head.magic) != 0 || head.version != STATE_VERSION) {
        return "this is no state, or one of another version";
    }
    if (head.length != size) {
        return "the state is truncated or extended";
    }
    if (strncmp(head.model, c->model->name, sizeof head.model) != 0 ||
        strncmp(head.token, c->token, sizeof head.token) != 0) {
        return "the state is one of another model";
    }
    return head.checksum == checksum(bytes, size) ? NULL : "the state is damaged";
}

/* The length that a state in memory claims; 0 when it is no state at all. */
static size_t claimed_size(const void *state) {
    state_head head;
    memcpy(&head, state, sizeof head);
    return memcmp(head.magic, STATE_MAGIC, sizeof head.magic) == 0 ? (size_t)head.length : 0;
}

/* Fails with a log line. */
static bool is_state(fmu_component *c, const void *state) {
    const char *wrong = state == NULL ? "the state is NULL" : fault(c, state, claimed_size(state));
    if (wrong != NULL) {
        (void)fmu_refuse(c, "%s", wrong);
    }
    return wrong == NULL;
}

fmu_status fmu_save_state(fmu_component *c, void **state) {
    fmu_why why;
    const void *extra;
    size_t n_extra;
    if (state == NULL) {
        return fmu_refuse(c, "no place for the state");
    }
    if (*state != NULL && !is_state(c, *state)) {
        return FMU_ERROR;
    }
    if (!did(c, fmu_the_engine.save(c->process, &extra, &n_extra, &why), &why)) {
        return FMU_ERROR;
    }
    const fmu_part params = c->model->params;
    const size_t size = least_size(c) + n_extra;
    unsigned char *bytes = calloc(1, size);
    if (bytes == NULL) {
        return fmu_refuse(c, "out of memory");
    }
    state_head head = {.version = STATE_VERSION,
                       .phase = (uint32_t)c->phase,
                       .length = size,
                       .clock = c->clock,
                       .limits_due = c->limits_due};
    memcpy(head.magic, STATE_MAGIC, sizeof head.magic);
    (void)snprintf(head.model, sizeof head.model, "%s", c->model->name);
    (void)snprintf(head.token, sizeof head.token, "%s", c->token);
    unsigned char *at = bytes + sizeof head;
    memcpy(at, c->instance, c->model->instance_size);
    at += c->model->instance_size;
    memcpy(at, c->accepted, params.size);
    at += params.size;
    if (n_extra > 0) {
        memcpy(at, extra, n_extra);
    }
    memcpy(bytes, &head, sizeof head);
    head.checksum = checksum(bytes, size);
    memcpy(bytes, &head, sizeof head);
    free(*state);
    *state = bytes;
    return FMU_OK;
}

fmu_status fmu_restore_state(fmu_component *c, const void *state) {
    if (!is_state(c, state)) {
        return FMU_ERROR;
    }
    fmu_why why;
    state_head head;
    memcpy(&head, state, sizeof head);
    const unsigned char *instance = (const unsigned char *)state + sizeof head;
    const unsigned char *accepted = instance + c->model->instance_size;
    const unsigned char *extra = accepted + c->model->params.size;
    if (!did(c, fmu_the_engine.restore(c->process, extra, (size_t)head.length - least_size(c), &why), &why)) {
        return FMU_ERROR;
    }
    memcpy(c->instance, instance, c->model->instance_size);
    memcpy(c->accepted, accepted, c->model->params.size);
    c->clock = head.clock;
    c->phase = (fmu_phase)head.phase;
    c->limits_due = head.limits_due != 0;
    c->outputs_due = true;
    return FMU_OK;
}

fmu_status fmu_free_state(fmu_component *c, void **state) {
    if (state == NULL) {
        return fmu_refuse(c, "no state given");
    }
    if (*state != NULL) {
        if (!is_state(c, *state)) {
            return FMU_ERROR;
        }
        free(*state);
        *state = NULL;
    }
    return FMU_OK;
}

fmu_status fmu_state_size(fmu_component *c, const void *state, size_t *size) {
    if (size == NULL) {
        return fmu_refuse(c, "no place for the size");
    }
    if (!is_state(c, state)) {
        return FMU_ERROR;
    }
    *size = claimed_size(state);
    return FMU_OK;
}

fmu_status fmu_serialise(fmu_component *c, const void *state, void *bytes, size_t size) {
    if (!is_state(c, state)) {
        return FMU_ERROR;
    }
    const size_t needed = claimed_size(state);
    if (bytes == NULL || size < needed) {
        return fmu_refuse(c, "the state has %lu bytes, there is room for %lu", (unsigned long)needed,
                          (unsigned long)(bytes != NULL ? size : 0));
    }
    memcpy(bytes, state, needed);
    return FMU_OK;
}

fmu_status fmu_deserialise(fmu_component *c, const void *bytes, size_t size, void **state) {
    if (bytes == NULL || state == NULL) {
        return fmu_refuse(c, "an argument is NULL");
    }
    const char *wrong = fault(c, bytes, size);
    if (wrong != NULL) {
        return fmu_refuse(c, "%s", wrong);
    }
    if (*state != NULL && !is_state(c, *state)) {
        return FMU_ERROR;
    }
    void *copy = malloc(size);
    if (copy == NULL) {
        return fmu_refuse(c, "out of memory");
    }
    memcpy(copy, bytes, size);
    free(*state);
    *state = copy;
    return FMU_OK;
}
