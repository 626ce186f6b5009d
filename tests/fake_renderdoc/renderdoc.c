// A library with RenderDoc's in-application API that captures nothing. It appends a line for each
// call to the file NIMBUS_FAKE_RENDERDOC_LOG. NIMBUS_FAKE_RENDERDOC_FAULT may be "old",
// for a library without that version of the API, or "full", with which no capture succeeds.

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint32_t n_captures = 0;
static const char *const FILE_NAME = "/tmp/fake_frame.rdc";

static void write_line(const char *line) {
    const char *path = getenv("NIMBUS_FAKE_RENDERDOC_LOG");
    FILE *log = path ? fopen(path, "a") : NULL;
    if (log) {
        fprintf(log, "%s\n", line);
        fclose(log);
    }
}

static int has_fault(const char *name) {
    const char *fault = getenv("NIMBUS_FAKE_RENDERDOC_FAULT");
    return fault && strcmp(fault, name) == 0;
}

static void start(void *device, void *window) {
    write_line(device && !window ? "start" : "start without a device, or with a window");
}

static uint32_t end(void *device, void *window) {
    write_line(device && !window ? "end" : "end without a device, or with a window");
    if (has_fault("full")) {
        return 0;
    }
    n_captures += 1;
    return 1;
}

static uint32_t count(void) { return n_captures; }

static uint32_t name_of(uint32_t i, char *name, uint32_t *n_bytes, uint64_t *timestamp) {
    (void)timestamp;
    if (i >= n_captures) {
        return 0;
    }
    if (n_bytes) {
        *n_bytes = (uint32_t)strlen(FILE_NAME) + 1;
    }
    if (name) {
        strcpy(name, FILE_NAME);
    }
    return 1;
}

// The table of version 1.1.2 by place (renderdoc_app.h): 13 GetNumCaptures, 14 GetCapture, 19
// StartFrameCapture, 21 EndFrameCapture. A call of another function would be a call of null.
static void *table[32];

__attribute__((visibility("default"))) int RENDERDOC_GetAPI(int version, void **found) {
    if (has_fault("old") || version != 10102) {
        return 0;
    }
    table[13] = (void *)count;
    table[14] = (void *)name_of;
    table[19] = (void *)start;
    table[21] = (void *)end;
    *found = table;
    return 1;
}
