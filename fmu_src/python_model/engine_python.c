/* The model runs in a Python process that this instance owns: `python -m ahrs_fmu.serve RESOURCES`.
 *
 * A message is a head and a payload, little-endian as all platforms of FMUs are; the other side is
 * python/ahrs_fmu/serve. Variables travel as doubles, those of one role in ascending order of their value
 * references. Every message is answered by one REPLY or one RAISED. */
#include "child.h"
#include "engine.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PROTOCOL = 1, MAGIC = 0x53524841 };

typedef enum {
    OPEN = 1, /* the counts of variables -> nothing */
    START,    /* parameters, inputs -> outputs */
    RUN,      /* run_head, inputs, parameters if they have changed -> outputs */
    OUTPUTS,  /* parameters -> outputs */
    SAVE,     /* nothing -> bytes */
    RESTORE,  /* bytes -> nothing */
    REPLY = 100,
    RAISED /* text */
} kind;

typedef struct {
    uint32_t magic, kind;
    uint64_t size; /* of the payload */
} message_head;

typedef struct {
    uint32_t protocol, n_params, n_inputs, n_outputs;
} open_payload;

typedef struct {
    double dt;
    uint32_t ticks, n_params;
} run_head;

#define LARGEST_MESSAGE ((uint64_t)1 << 30)
/* s, unless AHRS_FMU_TIMEOUT says otherwise; the start may always take that long. */
#define TIME_OUT 30.0
/* s that a process has to clean up in when its instance is freed. */
#define PATIENCE 2.0

#ifdef _WIN32
#define DEFAULT_PYTHON "python"
#else
#define DEFAULT_PYTHON "python3"
#endif

typedef struct {
    child child;
    const fmu_model *model;
    size_t n_params, n_inputs, n_outputs;
    double *sent; /* parameters as the child has them */
    bool are_sent;
    bool has_started;     /* there is a state */
    bool are_outputs_due; /* those in the instance are not of this state */
    unsigned char *message;
    size_t capacity;
    double time_out;                /* s */
    char folder[CHILD_PATH_SIZE];   /* resources */
    char python[CHILD_PATH_SIZE];
    const char *python_source; /* who named the interpreter */
    char printed[CHILD_PRINTED_SIZE + 64];
} python_process;

static bool fail(fmu_why *why, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(why->text, sizeof why->text, format, arguments);
    va_end(arguments);
    return false;
}

/* ---------------------------------------------------------------- variables */

static bool is_of(const fmu_variable *v, fmu_role role) {
    return v->role == role || (role == FMU_FIXED && v->role == FMU_TUNABLE);
}

static size_t count(const fmu_model *model, fmu_role role) {
    size_t n = 0;
    for (size_t i = 0; i < model->n_variables; i++) {
        n += is_of(&model->variables[i], role) ? model->variables[i].size : 0;
    }
    return n;
}

/* All values of a role, FMU_FIXED standing for every parameter. */
static void gather(const fmu_model *model, const void *instance, fmu_role role, double *values) {
    for (size_t i = 0; i < model->n_variables; i++) {
        const fmu_variable *v = &model->variables[i];
        const void *at = (const unsigned char *)instance + v->offset;
        for (uint32_t k = 0; is_of(v, role) && k < v->size; k++) {
            *values++ = v->type == FMU_REAL ? (double)((const ahrs_real *)at)[k] : (double)((const int32_t *)at)[k];
        }
    }
}

static int32_t whole(double value) {
    return value >= (double)INT32_MIN && value <= (double)INT32_MAX ? (int32_t)value : 0;
}

static void scatter_outputs(const fmu_model *model, void *instance, const double *values) {
    for (size_t i = 0; i < model->n_variables; i++) {
        const fmu_variable *v = &model->variables[i];
        void *at = (unsigned char *)instance + v->offset;
        for (uint32_t k = 0; v->role == FMU_OUTPUT && k < v->size; k++) {
            const double value = *values++;
            if (v->type == FMU_REAL) {
                ((ahrs_real *)at)[k] = (ahrs_real)value;
            } else {
                ((int32_t *)at)[k] = whole(value);
            }
        }
    }
}

/* ---------------------------------------------------------------- messages */

/* Makes room for a payload, keeping what is there. */
static bool reserve(python_process *p, size_t size, fmu_why *why) {
    const size_t needed = sizeof(message_head) + size;
    if (needed <= p->capacity) {
        return true;
    }
    unsigned char *larger = fmu_allocate(needed);
    if (larger == NULL) {
        return fail(why, "out of memory");
    }
    if (p->message != NULL) {
        memcpy(larger, p->message, p->capacity);
    }
    fmu_release(p->message);
    p->message = larger;
    p->capacity = needed;
    return true;
}

static double *payload(const python_process *p) { return (double *)(void *)(p->message + sizeof(message_head)); }

/* Short enough to leave room for what is said around it. */
static const char *printed_tail(const child *c) {
    return c->n_printed > 1024 ? c->printed + (c->n_printed - 1024) : c->printed;
}

static bool give_up(python_process *p, child_result result, fmu_why *why) {
    char how[96];
    child_stop(&p->child, result == CHILD_ENDED ? 0.5 : 0);
    if (result == CHILD_LATE) {
        (void)snprintf(how, sizeof how, "did not answer within %g s (set AHRS_FMU_TIMEOUT for more) and was ended",
                       p->time_out);
    } else if (!p->child.has_status) {
        (void)snprintf(how, sizeof how, "ended");
    } else if (p->child.status < 0) {
        (void)snprintf(how, sizeof how, "was ended by signal %d", -p->child.status);
    } else {
        (void)snprintf(how, sizeof how, "ended with exit code %d", p->child.status);
    }
    const bool has_printed = p->child.n_printed > 0;
    return fail(why, "the Python process %s; reset the instance to start another%s%s", how,
                has_printed ? "; last it printed:\n" : "", has_printed ? printed_tail(&p->child) : "");
}

static bool garbled(python_process *p, fmu_why *why) {
    child_stop(&p->child, 0);
    return fail(why, "the Python process answered with bytes that are no message and was ended; reset the instance to "
                     "start another");
}

/* Sends the message whose payload is in place; the reply's payload takes its place. */
static bool exchange(python_process *p, kind asked, size_t size, size_t *replied, fmu_why *why) {
    const double limit = asked == OPEN && p->time_out < TIME_OUT ? TIME_OUT : p->time_out;
    const double deadline = child_now() + limit;
    message_head head = {MAGIC, (uint32_t)asked, size};
    size_t received = 0, more = 0;
    if (!p->child.running) {
        return fail(why, "the Python process has ended; reset the instance to start another");
    }
    memcpy(p->message, &head, sizeof head);
    child_result result = child_send(&p->child, p->message, sizeof head + size, deadline);
    if (result == CHILD_DONE) {
        result = child_receive(&p->child, p->message, sizeof head, p->capacity, &received, deadline);
    }
    if (result != CHILD_DONE) {
        return give_up(p, result, why);
    }
    memcpy(&head, p->message, sizeof head);
    if (head.magic != MAGIC || (head.kind != REPLY && head.kind != RAISED) || head.size > LARGEST_MESSAGE) {
        return garbled(p, why);
    }
    const size_t whole_size = sizeof head + (size_t)head.size;
    if (received > whole_size) {
        return garbled(p, why);
    }
    if (received < whole_size) {
        if (!reserve(p, (size_t)head.size, why)) {
            child_stop(&p->child, 0);
            return false;
        }
        const size_t rest = whole_size - received;
        result = child_receive(&p->child, p->message + received, rest, rest, &more, deadline);
        if (result != CHILD_DONE) {
            return give_up(p, result, why);
        }
    }
    *replied = (size_t)head.size;
    if (head.kind == RAISED) {
        return fail(why, "%.*s", (int)*replied, (const char *)payload(p));
    }
    return true;
}

/* A message that is answered with the outputs. */
static bool compute(python_process *p, kind asked, size_t n_bytes, void *instance, fmu_why *why) {
    size_t replied = 0;
    if (!exchange(p, asked, n_bytes, &replied, why)) {
        return false;
    }
    if (replied != p->n_outputs * sizeof(double)) {
        return garbled(p, why);
    }
    scatter_outputs(p->model, instance, payload(p));
    p->are_outputs_due = false;
    return true;
}

/* Whether the child has other parameters than the instance; keeps them as sent. */
static bool parameters_differ(python_process *p, const void *instance, double *scratch) {
    gather(p->model, instance, FMU_FIXED, scratch);
    if (p->are_sent && memcmp(scratch, p->sent, p->n_params * sizeof(double)) == 0) {
        return false;
    }
    memcpy(p->sent, scratch, p->n_params * sizeof(double));
    return true;
}

/* ---------------------------------------------------------------- where things are */

static int hexadecimal(char c) {
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

/* The folder that an importer names: a path, or a URI of the scheme file. */
static bool find_folder(const char *resources, char *folder, fmu_why *why) {
    if (resources == NULL || resources[0] == '\0') {
        return fail(why, "the importer does not say where the FMU's resources are");
    }
    const char *at = resources;
    const bool is_uri = strncmp(at, "file:", 5) == 0;
    if (is_uri) {
        at += 5;
        if (strncmp(at, "///", 3) == 0) {
            at += 2;
        } else if (strncmp(at, "//localhost/", 12) == 0) {
            at += 11;
        }
#ifdef _WIN32
        at += at[0] == '/' && at[1] != '/' ? 1 : 0; /* file:///C:/... */
#endif
    }
    size_t n = 0;
    for (; *at != '\0' && n + 1 < CHILD_PATH_SIZE; at++) {
        const int high = is_uri && *at == '%' ? hexadecimal(at[1]) : -1;
        const int low = high >= 0 ? hexadecimal(at[2]) : -1;
        folder[n++] = low >= 0 ? (char)(16 * high + low) : *at;
        at += low >= 0 ? 2 : 0;
    }
    while (n > 1 && (folder[n - 1] == '/' || folder[n - 1] == '\\')) {
        n--;
    }
    folder[n] = '\0';
    return *at == '\0' || fail(why, "the path of the FMU's resources is longer than %d bytes", CHILD_PATH_SIZE - 1);
}

/* Python as the user, else the FMU, else the system names it. */
static void find_python(python_process *p) {
    char file[CHILD_PATH_SIZE + 16];
    (void)snprintf(file, sizeof file, "%s/python.txt", p->folder);
    if (child_variable("AHRS_FMU_PYTHON", p->python, sizeof p->python)) {
        p->python_source = "AHRS_FMU_PYTHON";
    } else if (child_first_line(file, p->python, sizeof p->python) && child_file_exists(p->python)) {
        p->python_source = "recorded at the export";
    } else {
        (void)snprintf(p->python, sizeof p->python, "%s", DEFAULT_PYTHON);
        p->python_source = "from PATH";
    }
}

static double find_time_out(void) {
    char text[64];
    const double given = child_variable("AHRS_FMU_TIMEOUT", text, sizeof text) ? strtod(text, NULL) : 0;
    return given > 0 ? given : TIME_OUT;
}

/* Python as a new process that has loaded the model. */
static bool launch(python_process *p, fmu_why *why) {
    const char *const arguments[] = {p->python, "-P", "-u", "-m", "ahrs_fmu.serve", p->folder, NULL};
    fmu_why reason;
    size_t replied = 0;
    int error = 0;
    p->are_sent = p->has_started = false;
    p->are_outputs_due = true;
    if (!child_start(&p->child, p->python, arguments, &error)) {
        return fail(why, "Python cannot be started as '%s' (%s; system error %d): set AHRS_FMU_PYTHON to a Python that has "
                         "the package ahrs-fmu", p->python, p->python_source, error);
    }
    const open_payload counts = {PROTOCOL, (uint32_t)p->n_params, (uint32_t)p->n_inputs, (uint32_t)p->n_outputs};
    memcpy(payload(p), &counts, sizeof counts);
    if (!exchange(p, OPEN, sizeof counts, &replied, &reason)) {
        child_stop(&p->child, PATIENCE);
        return fail(why, "Python '%s' (%s) cannot run this model; AHRS_FMU_PYTHON names another one, which needs the "
                         "package ahrs-fmu. %s", p->python, p->python_source, reason.text);
    }
    return true;
}

/* ---------------------------------------------------------------- the engine */

static void close_python(void *process) {
    python_process *p = process;
    child_stop(&p->child, PATIENCE);
    fmu_release(p->sent);
    fmu_release(p->message);
    p->sent = NULL;
    p->message = NULL;
}

static bool open_python(void *process, const fmu_model *model, const char *resources, fmu_why *why) {
    python_process *p = process;
    p->model = model;
    p->n_params = count(model, FMU_FIXED);
    p->n_inputs = count(model, FMU_INPUT);
    p->n_outputs = count(model, FMU_OUTPUT);
    p->time_out = find_time_out();
    if (!find_folder(resources, p->folder, why)) {
        return false;
    }
    find_python(p);
    const size_t most = sizeof(run_head) + (p->n_params + p->n_inputs + p->n_outputs) * sizeof(double);
    p->sent = fmu_allocate(p->n_params * sizeof(double) + 1);
    if (p->sent == NULL) {
        (void)fail(why, "out of memory");
    }
    if (p->sent == NULL || !reserve(p, most, why) || !launch(p, why)) {
        close_python(p);
        return false;
    }
    return true;
}

static void reset(void *process) {
    python_process *p = process;
    p->has_started = false;
    p->are_outputs_due = true;
}

static bool start(void *process, const fmu_model *model, void *instance, fmu_why *why) {
    python_process *p = process;
    if (!p->child.running && !launch(p, why)) {
        return false;
    }
    gather(model, instance, FMU_FIXED, p->sent);
    memcpy(payload(p), p->sent, p->n_params * sizeof(double));
    gather(model, instance, FMU_INPUT, payload(p) + p->n_params);
    p->are_sent = p->has_started = compute(p, START, (p->n_params + p->n_inputs) * sizeof(double), instance, why);
    return p->has_started;
}

static bool run(void *process, const fmu_model *model, void *instance, uint32_t ticks, ahrs_real dt, fmu_why *why) {
    python_process *p = process;
    double *values = payload(p) + sizeof(run_head) / sizeof(double);
    gather(model, instance, FMU_INPUT, values);
    const size_t n_params = parameters_differ(p, instance, values + p->n_inputs) ? p->n_params : 0;
    const run_head head = {(double)dt, ticks, (uint32_t)n_params};
    memcpy(payload(p), &head, sizeof head);
    p->are_outputs_due = true;
    p->are_sent = compute(p, RUN, sizeof head + (p->n_inputs + n_params) * sizeof(double), instance, why);
    return p->are_sent;
}

static bool outputs(void *process, const fmu_model *model, void *instance, fmu_why *why) {
    (void)model;
    python_process *p = process;
    if (!parameters_differ(p, instance, payload(p)) && !p->are_outputs_due) {
        return true;
    }
    p->are_sent = compute(p, OUTPUTS, p->n_params * sizeof(double), instance, why);
    return p->are_sent;
}

static bool save(void *process, const void **bytes, size_t *size, fmu_why *why) {
    python_process *p = process;
    *bytes = payload(p);
    *size = 0;
    if (!p->has_started) {
        return true;
    }
    const bool done = exchange(p, SAVE, 0, size, why);
    *bytes = payload(p);
    return done;
}

static bool restore(void *process, const void *bytes, size_t size, fmu_why *why) {
    python_process *p = process;
    size_t replied = 0;
    if (size == 0) {
        reset(p);
        return true;
    }
    if ((!p->child.running && !launch(p, why)) || !reserve(p, size, why)) {
        return false;
    }
    memcpy(payload(p), bytes, size);
    p->are_sent = false;
    p->are_outputs_due = true;
    p->has_started = exchange(p, RESTORE, size, &replied, why);
    return p->has_started;
}

static const char *said(void *process) {
    python_process *p = process;
    if (p->child.n_printed == 0) {
        return NULL;
    }
    if (p->child.n_dropped > 0) {
        (void)snprintf(p->printed, sizeof p->printed, "the model printed %lu bytes, of which the last:\n%s",
                       (unsigned long)(p->child.n_dropped + p->child.n_printed), p->child.printed);
    } else {
        (void)snprintf(p->printed, sizeof p->printed, "the model printed:\n%s", p->child.printed);
    }
    p->child.n_printed = p->child.n_dropped = 0;
    return p->printed;
}

const fmu_engine fmu_the_engine = {sizeof(python_process), open_python, close_python, reset, start, run, outputs, save,
                                   restore, said};
