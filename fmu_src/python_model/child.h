/* A process that answers messages: started, spoken to with a time limit, ended. What it prints is kept.
 * child_posix.c and child_windows.c implement it; nothing here knows what the messages mean. */
#ifndef FMU_CHILD_H
#define FMU_CHILD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { CHILD_PRINTED_SIZE = 2048, CHILD_PATH_SIZE = 4096 };

typedef enum { CHILD_DONE, CHILD_ENDED, CHILD_LATE } child_result;

/* Zeroed, it is a child that was never started. */
typedef struct {
    bool running;
#ifdef _WIN32
    void *process, *to, *from, *errors;
#else
    int pid, channel, errors; /* `errors` is -1 once the child has closed it */
#endif
    bool has_status; /* how it ended is known */
    int status;      /* exit code, or minus the signal */
    char printed[CHILD_PRINTED_SIZE]; /* the last of it */
    size_t n_printed, n_dropped;
} child;

/* Runs `program` (a path, or a name that is looked for) with the arguments, which end with NULL. False, with the
 * system's error number, when that is not possible. */
bool child_start(child *c, const char *program, const char *const arguments[], int *error);

/* Both keep what the child prints meanwhile. `deadline` is of child_now. */
child_result child_send(child *c, const void *bytes, size_t size, double deadline);
/* Waits for at least `least` bytes and takes up to `most`. */
child_result child_receive(child *c, void *bytes, size_t least, size_t most, size_t *received, double deadline);

/* Tells the child to end by closing its channel, waits for `patience` seconds, then kills it. Nothing of it is left. */
void child_stop(child *c, double patience);

/* Seconds on a clock that is never set. */
double child_now(void);
/* An environment variable or the first line of a file; false when it is missing, empty or too long. */
bool child_variable(const char *name, char *text, size_t size);
bool child_first_line(const char *path, char *text, size_t size);
bool child_file_exists(const char *path);

/* For the implementations: keeps the last of what was printed. */
static inline void child_keep(child *c, const char *text, size_t size) {
    const size_t room = CHILD_PRINTED_SIZE - 1;
    size_t kept = c->n_printed;
    if (size > room) {
        c->n_dropped += size - room;
        text += size - room;
        size = room;
    }
    if (kept + size > room) {
        const size_t drop = kept + size - room;
        for (size_t i = drop; i < kept; i++) {
            c->printed[i - drop] = c->printed[i];
        }
        c->n_dropped += drop;
        kept -= drop;
    }
    for (size_t i = 0; i < size; i++) {
        c->printed[kept + i] = text[i] != '\0' ? text[i] : ' ';
    }
    c->n_printed = kept + size;
    c->printed[c->n_printed] = '\0';
}

#endif
