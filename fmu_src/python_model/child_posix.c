#ifdef __APPLE__
#define _DARWIN_C_SOURCE
#else
#define _GNU_SOURCE /* close-on-exec from the start: another thread may start a process at any time */
#endif

#include "child.h"

#ifndef _WIN32
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#ifdef __APPLE__
#include <crt_externs.h>
#define ENVIRONMENT (*_NSGetEnviron())
#define SEND_FLAGS MSG_DONTWAIT
#else
extern char **environ;
#define ENVIRONMENT environ
#define SEND_FLAGS (MSG_DONTWAIT | MSG_NOSIGNAL)
#endif

/* A child that prints without end must not keep its parent from looking at the time. */
enum { MOST_READS = 32 };

double child_now(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* ---------------------------------------------------------------- descriptors */

static void close_one(int *fd) {
    if (*fd >= 0) {
        (void)close(*fd);
        *fd = -1;
    }
}

static void close_pair(int pair[2]) {
    close_one(&pair[0]);
    close_one(&pair[1]);
}

/* Above the standard ones, which an importer may have closed, and closed in other programs. */
static bool make_private(int pair[2]) {
    for (int i = 0; i < 2; i++) {
        const int moved = pair[i] > STDERR_FILENO ? pair[i] : fcntl(pair[i], F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
        if (moved < 0 || fcntl(moved, F_SETFD, FD_CLOEXEC) != 0) {
            const int error = errno;
            close_pair(pair);
            errno = error;
            return false;
        }
        if (moved != pair[i]) {
            (void)close(pair[i]);
            pair[i] = moved;
        }
    }
    return true;
}

/* A socket, because writing to a dead pipe would send the importer a signal. */
static bool make_channel(int pair[2]) {
#ifdef __APPLE__
    const int on = 1;
    return socketpair(AF_UNIX, SOCK_STREAM, 0, pair) == 0 && make_private(pair) &&
           setsockopt(pair[0], SOL_SOCKET, SO_NOSIGPIPE, &on, sizeof on) == 0;
#else
    return socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) == 0 && make_private(pair);
#endif
}

static bool make_pipe(int pair[2]) {
#ifdef __APPLE__
    const bool made = pipe(pair) == 0;
#else
    const bool made = pipe2(pair, O_CLOEXEC) == 0;
#endif
    return made && make_private(pair) && fcntl(pair[0], F_SETFL, O_NONBLOCK) == 0;
}

/* ---------------------------------------------------------------- start */

/* The channel becomes the child's standard input; all that it prints goes into the pipe. */
static int spawn(pid_t *pid, const char *program, const char *const arguments[], int channel, int errors) {
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    sigset_t none, defaults;
    short flags = POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF;
    int error = posix_spawn_file_actions_init(&actions);
    if (error != 0) {
        return error;
    }
    error = posix_spawnattr_init(&attributes);
    if (error != 0) {
        (void)posix_spawn_file_actions_destroy(&actions);
        return error;
    }
#ifdef __APPLE__
    flags |= POSIX_SPAWN_CLOEXEC_DEFAULT;
#endif
    (void)sigemptyset(&none);
    (void)sigemptyset(&defaults);
    (void)sigaddset(&defaults, SIGCHLD);
    (void)sigaddset(&defaults, SIGTERM);
    error = posix_spawn_file_actions_adddup2(&actions, channel, STDIN_FILENO);
    error = error != 0 ? error : posix_spawn_file_actions_adddup2(&actions, errors, STDOUT_FILENO);
    error = error != 0 ? error : posix_spawn_file_actions_adddup2(&actions, errors, STDERR_FILENO);
    error = error != 0 ? error : posix_spawnattr_setsigmask(&attributes, &none);
    error = error != 0 ? error : posix_spawnattr_setsigdefault(&attributes, &defaults);
    error = error != 0 ? error : posix_spawnattr_setflags(&attributes, flags);
    if (error == 0) {
        /* The strings are not written to; the standard's type is older than const. */
        union {
            const char *const *given;
            char *const *wanted;
        } list = {arguments};
        error = posix_spawnp(pid, program, &actions, &attributes, list.wanted, ENVIRONMENT);
    }
    (void)posix_spawnattr_destroy(&attributes);
    (void)posix_spawn_file_actions_destroy(&actions);
    return error;
}

bool child_start(child *c, const char *program, const char *const arguments[], int *error) {
    int channel[2] = {-1, -1}, errors[2] = {-1, -1};
    pid_t pid = -1;
    *error = 0;
    if (!make_channel(channel) || !make_pipe(errors)) {
        *error = errno;
    } else {
        *error = spawn(&pid, program, arguments, channel[1], errors[1]);
    }
    close_one(&channel[1]);
    close_one(&errors[1]);
    if (*error != 0) {
        close_one(&channel[0]);
        close_one(&errors[0]);
        return false;
    }
    *c = (child){.running = true, .pid = (int)pid, .channel = channel[0], .errors = errors[0]};
    return true;
}

/* ---------------------------------------------------------------- messages */

static void keep_printed(child *c) {
    char text[4096];
    for (int i = 0; i < MOST_READS && c->errors >= 0; i++) {
        const ssize_t n = read(c->errors, text, sizeof text);
        if (n > 0) {
            child_keep(c, text, (size_t)n);
        } else if (n == 0) {
            close_one(&c->errors);
        } else if (errno != EINTR) {
            if (errno != EAGAIN && errno != EWOULDBLOCK) {
                close_one(&c->errors);
            }
            return;
        }
    }
}

/* Until the channel is ready for `events`; what is printed before is kept. */
static child_result wait_for(child *c, short events, double deadline) {
    for (;;) {
        struct pollfd both[2] = {{c->channel, events, 0}, {c->errors, POLLIN, 0}};
        const double left = deadline - child_now();
        const int milliseconds = left <= 0 ? 0 : left > 1e6 ? 1000000000 : (int)(1e3 * left) + 1;
        const int ready = poll(both, c->errors >= 0 ? 2 : 1, milliseconds);
        if (ready < 0 && errno != EINTR) {
            return CHILD_ENDED;
        }
        if (ready > 0 && both[1].revents != 0) {
            keep_printed(c);
        }
        if (ready > 0 && both[0].revents != 0) {
            return CHILD_DONE;
        }
        if (left <= 0) {
            return CHILD_LATE;
        }
    }
}

child_result child_send(child *c, const void *bytes, size_t size, double deadline) {
    const char *at = bytes;
    while (size > 0) {
        const ssize_t n = send(c->channel, at, size, SEND_FLAGS);
        if (n > 0) {
            at += n;
            size -= (size_t)n;
        } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
            const child_result result = wait_for(c, POLLOUT, deadline);
            if (result != CHILD_DONE) {
                return result;
            }
        } else if (errno != EINTR) {
            return CHILD_ENDED;
        }
    }
    return CHILD_DONE;
}

child_result child_receive(child *c, void *bytes, size_t least, size_t most, size_t *received, double deadline) {
    *received = 0;
    while (*received < least) {
        const child_result result = wait_for(c, POLLIN, deadline);
        if (result != CHILD_DONE) {
            return result;
        }
        const ssize_t n = recv(c->channel, (char *)bytes + *received, most - *received, MSG_DONTWAIT);
        if (n > 0) {
            *received += (size_t)n;
        } else if (n == 0 || (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)) {
            return CHILD_ENDED;
        }
    }
    return CHILD_DONE;
}

/* ---------------------------------------------------------------- end */

/* True once the process is gone. An importer that waits for every process may have been first. */
static bool has_ended(child *c, bool wait) {
    int status = 0;
    pid_t pid;
    do {
        pid = waitpid((pid_t)c->pid, &status, wait ? 0 : WNOHANG);
    } while (pid < 0 && errno == EINTR);
    if (pid > 0) {
        c->has_status = true;
        c->status = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    }
    return pid != 0;
}

void child_stop(child *c, double patience) {
    if (!c->running) {
        return;
    }
    const double deadline = child_now() + patience;
    /* Also where a copy of the importer holds the channel open. */
    (void)shutdown(c->channel, SHUT_RDWR);
    close_one(&c->channel);
    bool ended = has_ended(c, false);
    while (!ended && child_now() < deadline) {
        struct pollfd printed = {c->errors, POLLIN, 0};
        (void)poll(&printed, c->errors >= 0 ? 1 : 0, c->errors >= 0 ? 10 : 1);
        keep_printed(c);
        ended = has_ended(c, false);
    }
    if (!ended) {
        (void)kill((pid_t)c->pid, SIGKILL);
        (void)has_ended(c, true);
    }
    keep_printed(c);
    close_one(&c->errors);
    c->running = false;
}

/* ---------------------------------------------------------------- surroundings */

static bool copy_text(const char *from, size_t length, char *text, size_t size) {
    if (length == 0 || length >= size) {
        return false;
    }
    memcpy(text, from, length);
    text[length] = '\0';
    return true;
}

bool child_variable(const char *name, char *text, size_t size) {
    const char *value = getenv(name);
    return value != NULL && copy_text(value, strlen(value), text, size);
}

bool child_first_line(const char *path, char *text, size_t size) {
    char line[CHILD_PATH_SIZE];
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    const ssize_t n = fd < 0 ? -1 : read(fd, line, sizeof line - 1);
    if (fd >= 0) {
        (void)close(fd);
    }
    if (n < 0) {
        return false;
    }
    line[n] = '\0';
    return copy_text(line, strcspn(line, "\r\n"), text, size);
}

bool child_file_exists(const char *path) { return access(path, F_OK) == 0; }
#endif
