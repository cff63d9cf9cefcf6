#include "child.h"

#ifdef _WIN32
#ifndef WIN32_LEAN_AND_MEAN
#define WIN32_LEAN_AND_MEAN
#endif
#include <windows.h>

#include <string.h>

enum { PIPE_SIZE = 1 << 16, MOST_READS = 32, LINE_SIZE = 32767 };

double child_now(void) { return 1e-3 * (double)GetTickCount64(); }

static bool widen(const char *text, wchar_t *wide, int size) {
    return MultiByteToWideChar(CP_UTF8, 0, text, -1, wide, size) > 0;
}

static bool narrow(const wchar_t *wide, char *text, size_t size) {
    return wide[0] != L'\0' && WideCharToMultiByte(CP_UTF8, 0, wide, -1, text, (int)size, NULL, NULL) > 0;
}

static void close_one(void **handle) {
    if (*handle != NULL) {
        (void)CloseHandle(*handle);
        *handle = NULL;
    }
}

/* ---------------------------------------------------------------- start */

/* The end that the child gets is inherited, the other one is not. */
static bool make_pipe(void **reading, void **writing, bool child_reads) {
    SECURITY_ATTRIBUTES inherited = {sizeof inherited, NULL, TRUE};
    return CreatePipe(reading, writing, &inherited, PIPE_SIZE) &&
           SetHandleInformation(child_reads ? *writing : *reading, HANDLE_FLAG_INHERIT, 0);
}

/* Quoted and separated; a path holds no quotation mark, and the arguments do not end with a backslash. */
static bool join(const char *program, const char *const arguments[], char *line, size_t size) {
    size_t used = 0;
    for (size_t i = 0; i == 0 || arguments[i] != NULL; i++) {
        const char *word = i == 0 ? program : arguments[i];
        const size_t length = strlen(word);
        if (used + length + 4 > size || strchr(word, '"') != NULL) {
            return false;
        }
        line[used++] = '"';
        memcpy(line + used, word, length);
        used += length;
        line[used++] = '"';
        line[used++] = ' ';
    }
    line[used] = '\0';
    return true;
}

/* The three pipes become the child's standard streams, and nothing else is inherited. */
static bool spawn(child *c, const char *line, void *input, void *output, void *errors) {
    static const size_t LENGTH = LINE_SIZE * sizeof(wchar_t);
    void *given[] = {input, output, errors};
    SIZE_T size = 0;
    PROCESS_INFORMATION made;
    STARTUPINFOEXW start = {.StartupInfo = {.cb = sizeof start, .dwFlags = STARTF_USESTDHANDLES}};
    start.StartupInfo.hStdInput = input;
    start.StartupInfo.hStdOutput = output;
    start.StartupInfo.hStdError = errors;
    (void)InitializeProcThreadAttributeList(NULL, 1, 0, &size);
    wchar_t *wide = HeapAlloc(GetProcessHeap(), 0, LENGTH);
    start.lpAttributeList = HeapAlloc(GetProcessHeap(), 0, size);
    bool done = wide != NULL && start.lpAttributeList != NULL && widen(line, wide, LINE_SIZE) &&
                InitializeProcThreadAttributeList(start.lpAttributeList, 1, 0, &size);
    if (done) {
        done = UpdateProcThreadAttribute(start.lpAttributeList, 0, PROC_THREAD_ATTRIBUTE_HANDLE_LIST, given,
                                         sizeof given, NULL, NULL) &&
               CreateProcessW(NULL, wide, NULL, NULL, TRUE, CREATE_NO_WINDOW | EXTENDED_STARTUPINFO_PRESENT, NULL, NULL,
                              &start.StartupInfo, &made);
        DeleteProcThreadAttributeList(start.lpAttributeList);
    }
    (void)HeapFree(GetProcessHeap(), 0, wide);
    (void)HeapFree(GetProcessHeap(), 0, start.lpAttributeList);
    if (done) {
        (void)CloseHandle(made.hThread);
        c->process = made.hProcess;
    }
    return done;
}

bool child_start(child *c, const char *program, const char *const arguments[], int *error) {
    char line[LINE_SIZE];
    DWORD mode = PIPE_NOWAIT;
    void *input = NULL, *output = NULL, *errors = NULL;
    *c = (child){.running = false};
    *error = 0;
    /* A full pipe must not keep the importer waiting. */
    if (!join(program, arguments, line, sizeof line) || !make_pipe(&input, &c->to, true) ||
        !make_pipe(&c->from, &output, false) || !make_pipe(&c->errors, &errors, false) ||
        !SetNamedPipeHandleState(c->to, &mode, NULL, NULL) || !spawn(c, line, input, output, errors)) {
        *error = GetLastError() != 0 ? (int)GetLastError() : (int)ERROR_FILENAME_EXCED_RANGE;
    }
    close_one(&input);
    close_one(&output);
    close_one(&errors);
    if (*error != 0) {
        close_one(&c->to);
        close_one(&c->from);
        close_one(&c->errors);
        return false;
    }
    c->running = true;
    return true;
}

/* ---------------------------------------------------------------- messages */

static void keep_printed(child *c) {
    char text[4096];
    for (int i = 0; i < MOST_READS; i++) {
        DWORD there = 0, n = 0;
        if (!PeekNamedPipe(c->errors, NULL, 0, NULL, &there, NULL) || there == 0 ||
            !ReadFile(c->errors, text, there < sizeof text ? there : (DWORD)sizeof text, &n, NULL) || n == 0) {
            return;
        }
        child_keep(c, text, n);
    }
}

/* An answer mostly comes at once: give the processor away before sleeping, which takes a millisecond or more. */
static bool rest(double since, double deadline) {
    const double now = child_now();
    if (now - since < 2e-3) {
        (void)SwitchToThread();
    } else {
        Sleep(1);
    }
    return now < deadline;
}

child_result child_send(child *c, const void *bytes, size_t size, double deadline) {
    const char *at = bytes;
    const double since = child_now();
    while (size > 0) {
        DWORD n = 0;
        const DWORD part = size < PIPE_SIZE / 2 ? (DWORD)size : PIPE_SIZE / 2;
        if (!WriteFile(c->to, at, part, &n, NULL)) {
            return CHILD_ENDED;
        }
        at += n;
        size -= n;
        keep_printed(c);
        if (n == 0 && !rest(since, deadline)) {
            return CHILD_LATE;
        }
    }
    return CHILD_DONE;
}

child_result child_receive(child *c, void *bytes, size_t least, size_t most, size_t *received, double deadline) {
    const double since = child_now();
    *received = 0;
    while (*received < least) {
        DWORD there = 0, n = 0;
        keep_printed(c);
        if (!PeekNamedPipe(c->from, NULL, 0, NULL, &there, NULL)) {
            return CHILD_ENDED;
        }
        if (there > 0) {
            const size_t room = most - *received;
            if (!ReadFile(c->from, (char *)bytes + *received, there < room ? there : (DWORD)room, &n, NULL)) {
                return CHILD_ENDED;
            }
            *received += n;
        } else if (!rest(since, deadline)) {
            return CHILD_LATE;
        }
    }
    return CHILD_DONE;
}

/* ---------------------------------------------------------------- end */

void child_stop(child *c, double patience) {
    if (!c->running) {
        return;
    }
    const double deadline = child_now() + patience;
    close_one(&c->to);
    while (WaitForSingleObject(c->process, 5) == WAIT_TIMEOUT && child_now() < deadline) {
        keep_printed(c);
    }
    (void)TerminateProcess(c->process, 1);
    (void)WaitForSingleObject(c->process, INFINITE);
    DWORD code = 0;
    c->has_status = GetExitCodeProcess(c->process, &code) != 0;
    c->status = (int)code;
    keep_printed(c);
    close_one(&c->from);
    close_one(&c->errors);
    close_one(&c->process);
    c->running = false;
}

/* ---------------------------------------------------------------- surroundings */

bool child_variable(const char *name, char *text, size_t size) {
    wchar_t wide_name[64], value[CHILD_PATH_SIZE];
    const bool named = widen(name, wide_name, 64);
    const DWORD n = named ? GetEnvironmentVariableW(wide_name, value, CHILD_PATH_SIZE) : 0;
    return n > 0 && n < CHILD_PATH_SIZE && narrow(value, text, size);
}

bool child_first_line(const char *path, char *text, size_t size) {
    wchar_t wide[CHILD_PATH_SIZE];
    DWORD n = 0;
    if (!widen(path, wide, CHILD_PATH_SIZE)) {
        return false;
    }
    void *file = CreateFileW(wide, GENERIC_READ, FILE_SHARE_READ, NULL, OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, NULL);
    if (file == INVALID_HANDLE_VALUE) {
        return false;
    }
    const bool was_read = ReadFile(file, text, (DWORD)size - 1, &n, NULL) != 0;
    (void)CloseHandle(file);
    text[was_read ? n : 0] = '\0';
    text[strcspn(text, "\r\n")] = '\0';
    return text[0] != '\0';
}

bool child_file_exists(const char *path) {
    wchar_t wide[CHILD_PATH_SIZE];
    return widen(path, wide, CHILD_PATH_SIZE) && GetFileAttributesW(wide) != INVALID_FILE_ATTRIBUTES;
}
#endif
