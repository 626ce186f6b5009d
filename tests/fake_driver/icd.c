/*
 * A Vulkan driver that fails on demand. It passes every call on to a real driver, but for the
 * faults that the environment asks for:
 *
 *   NIMBUS_FAKE_REAL         path of the real driver's library
 *   NIMBUS_FAKE_DEVICES      0: no physical device (two manifests make two devices)
 *   NIMBUS_FAKE_API          the devices' version of Vulkan, such as 1.2
 *   NIMBUS_FAKE_NO_GRAPHICS  1: no queue family draws
 *   NIMBUS_FAKE_FAIL         CALL:N:RESULT: the N-th call of CALL, from 1, fails with RESULT, which
 *                            is DEVICE_LOST, OUT_OF_DEVICE_MEMORY, OUT_OF_HOST_MEMORY,
 *                            INITIALIZATION_FAILED or HANG
 *   NIMBUS_FAKE_LOG          file that gets a line for each fault, and for each object that is
 *                            still alive when its device is destroyed or the process exits
 *   NIMBUS_FAKE_COUNTS       file that gets the number of each call when the process exits
 *   NIMBUS_FAKE_LABELS       file that gets a line for each begin and end of a label of commands
 *   NIMBUS_FAKE_DROP         FIRST:EVERY: the submission FIRST, from 1, and from there on each EVERY-th
 *                            one ends without having executed its commands
 *   NIMBUS_FAKE_TELLS        1: the device tells why it was lost (fault_info.h)
 *   NIMBUS_FAKE_SHOWN_MS     the device tells when pictures are visible: so long after they were
 *                            presented (shown.h)
 *
 * After DEVICE_LOST every call in the table CALLS fails with it. HANG stands for a device that
 * never finishes: vkWaitSemaphores returns VK_TIMEOUT at once and the log has the time that it
 * would have taken; the log also has each call that would never have returned.
 *
 * Compiled with -DSECOND, it is a driver of a discrete GPU named "second".
 *
 * No Vulkan header is needed. Parameters of the wrapped calls are integers and pointers, which the
 * calling conventions of x86-64 and AArch64 pass alike. The offsets of fields are the Vulkan ABI's.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define EXPORT __attribute__((visibility("default")))

typedef uintptr_t Word;
typedef void (*Function)(void);
typedef int32_t (*Call)(Word, Word, Word, Word, Word, Word);
typedef Function (*GetProcAddr)(void *, const char *);

enum { SUCCESS = 0, TIMEOUT = 2, DEVICE_LOST = -4, HANG = 100 };

static const struct {
    const char *name;
    int32_t value;
} RESULTS[] = {
    {"OUT_OF_HOST_MEMORY", -1},      {"OUT_OF_DEVICE_MEMORY", -2},
    {"INITIALIZATION_FAILED", -3},   {"DEVICE_LOST", DEVICE_LOST},
    {"HANG", HANG},
};

/* Calls that can fail. The second word is the kind of object that the call makes. */
#define CALLS(X)                                     \
    X(CreateInstance, None)                          \
    X(EnumeratePhysicalDevices, None)                \
    X(CreateDevice, Device)                          \
    X(CreateBuffer, Buffer)                          \
    X(AllocateMemory, Memory)                        \
    X(BindBufferMemory, None)                        \
    X(CreateBufferView, BufferView)                  \
    X(CreateImage, Image)                            \
    X(CreateImageView, ImageView)                    \
    X(BindImageMemory, None)                         \
    X(MapMemory, None)                               \
    X(CreateShaderModule, ShaderModule)              \
    X(CreateDescriptorSetLayout, DescriptorSetLayout) \
    X(CreatePipelineLayout, PipelineLayout)          \
    X(CreateComputePipelines, Pipeline)              \
    X(CreateGraphicsPipelines, Pipeline)             \
    X(CreateDescriptorPool, DescriptorPool)          \
    X(AllocateDescriptorSets, None)                  \
    X(ResetDescriptorPool, None)                     \
    X(CreateCommandPool, CommandPool)                \
    X(AllocateCommandBuffers, None)                  \
    X(BeginCommandBuffer, None)                      \
    X(EndCommandBuffer, None)                        \
    X(ResetCommandPool, None)                        \
    X(CreateQueryPool, QueryPool)                    \
    X(CreateSemaphore, Semaphore)                    \
    X(QueueSubmit2, None)                            \
    X(WaitSemaphores, None)                          \
    X(GetSemaphoreCounterValue, None)                \
    X(DeviceWaitIdle, None)                          \
    X(GetCalibratedTimestampsEXT, None)              \
    X(GetCalibratedTimestampsKHR, None)

/* Calls that end the life of an object of a kind. */
#define ENDS(X)                                              \
    X(DestroyDevice, Device)                                 \
    X(DestroyBuffer, Buffer)                                 \
    X(FreeMemory, Memory)                                    \
    X(DestroyBufferView, BufferView)                         \
    X(DestroyImage, Image)                                   \
    X(DestroyImageView, ImageView)                           \
    X(DestroyShaderModule, ShaderModule)                     \
    X(DestroyDescriptorSetLayout, DescriptorSetLayout)       \
    X(DestroyPipelineLayout, PipelineLayout)                 \
    X(DestroyPipeline, Pipeline)                             \
    X(DestroyDescriptorPool, DescriptorPool)                 \
    X(DestroyCommandPool, CommandPool)                       \
    X(DestroyQueryPool, QueryPool)                           \
    X(DestroySemaphore, Semaphore)

/* Other calls that this driver wraps. */
#define OTHERS(X)                       \
    X(GetDeviceProcAddr)                \
    X(EnumerateDeviceExtensionProperties) \
    X(CmdBeginDebugUtilsLabelEXT)       \
    X(CmdEndDebugUtilsLabelEXT)         \
    X(GetPhysicalDeviceFeatures2)       \
    X(QueuePresentKHR)                  \
    X(GetPhysicalDeviceProperties)      \
    X(GetPhysicalDeviceProperties2)     \
    X(GetPhysicalDeviceProperties2KHR)  \
    X(GetPhysicalDeviceQueueFamilyProperties)     \
    X(GetPhysicalDeviceQueueFamilyProperties2)    \
    X(GetPhysicalDeviceQueueFamilyProperties2KHR)

enum {
    KIND_None,
#define X(end, kind) KIND_##kind,
    ENDS(X)
#undef X
    N_KINDS
};
static const char *const KINDS[N_KINDS] = {
    "",
#define X(end, kind) #kind,
    ENDS(X)
#undef X
};

enum {
#define X(call, kind) CALL_##call,
    CALLS(X)
#undef X
    N_CALLS
};
static const char *const NAMES[N_CALLS] = {
#define X(call, kind) "vk" #call,
    CALLS(X)
#undef X
};
static const int MAKES[N_CALLS] = {
#define X(call, kind) KIND_##kind,
    CALLS(X)
#undef X
};

static pthread_once_t once = PTHREAD_ONCE_INIT;
/* Held while commands are submitted, and while a fault waits for all commands. */
static pthread_mutex_t submitting = PTHREAD_MUTEX_INITIALIZER;
static void *library;
static GetProcAddr real_instance_proc, real_physical_proc;
static int32_t (*real_negotiate)(uint32_t *);
static Call reals[N_CALLS];
static atomic_long n_calls[N_CALLS], n_alive[N_KINDS];
static _Atomic(Word) open_device;
static atomic_int is_lost, is_hung;
/* The fault that is asked for. */
static int fail_call = -1, fail_result;
static long fail_at;

static void add_line(const char *variable, const char *format, const char *name, long long n) {
    const char *path = getenv(variable);
    FILE *file = path ? fopen(path, "a") : NULL;
    if (!file) return;
    fprintf(file, format, name, n);
    fclose(file);
}

static void die(const char *what) {
    fprintf(stderr, "fake driver: %s\n", what);
    _exit(99);
}

static void load(void) {
    const char *path = getenv("NIMBUS_FAKE_REAL");
    library = path ? dlopen(path, RTLD_NOW | RTLD_LOCAL) : NULL;
    if (!library) die("NIMBUS_FAKE_REAL names no library");
    real_instance_proc = (GetProcAddr)dlsym(library, "vk_icdGetInstanceProcAddr");
    real_physical_proc = (GetProcAddr)dlsym(library, "vk_icdGetPhysicalDeviceProcAddr");
    real_negotiate =
        (int32_t(*)(uint32_t *))dlsym(library, "vk_icdNegotiateLoaderICDInterfaceVersion");
    if (!real_instance_proc) die("the real library is no Vulkan driver");
    const char *fail = getenv("NIMBUS_FAKE_FAIL");
    if (!fail) return;
    char call[64], result[64];
    if (sscanf(fail, "%63[^:]:%ld:%63s", call, &fail_at, result) != 3) die("NIMBUS_FAKE_FAIL");
    for (int i = 0; i < N_CALLS; i++)
        if (!strcmp(NAMES[i], call)) fail_call = i;
    for (size_t i = 0; i < sizeof RESULTS / sizeof *RESULTS; i++)
        if (!strcmp(RESULTS[i].name, result)) fail_result = RESULTS[i].value;
    if (fail_call < 0 || !fail_result) die("NIMBUS_FAKE_FAIL names no such call or result");
}

__attribute__((destructor)) static void at_exit(void) {
    for (int i = 0; i < N_CALLS; i++)
        if (n_calls[i]) add_line("NIMBUS_FAKE_COUNTS", "%s %lld\n", NAMES[i], n_calls[i]);
    if (n_alive[KIND_Device])
        add_line("NIMBUS_FAKE_LOG", "alive at exit: %s %lld\n", "Device", n_alive[KIND_Device]);
}

#include "extensions.h"
#include "fault_info.h"
#include "shown.h"

/* Waits for all commands, so that the program may free what a lost or hung device would use. */
static void finish_commands(void) {
    Word device = atomic_load(&open_device);
    pthread_mutex_lock(&submitting);
    if (device && reals[CALL_DeviceWaitIdle])
        reals[CALL_DeviceWaitIdle](device, 0, 0, 0, 0, 0);
    pthread_mutex_unlock(&submitting);
}

/* The result of a call that fails; SUCCESS of one that is passed on. */
static int32_t fault(int call, long n) {
    if (call == fail_call && n == fail_at) {
        add_line("NIMBUS_FAKE_LOG", "fault: %s %lld\n", NAMES[call], n);
        if (fail_result == DEVICE_LOST) atomic_store(&is_lost, 1);
        if (fail_result == HANG) atomic_store(&is_hung, 1);
        if (fail_result == DEVICE_LOST || fail_result == HANG) finish_commands();
        if (fail_result != HANG) return fail_result;
    }
    return atomic_load(&is_lost) ? DEVICE_LOST : SUCCESS;
}

/* The layout of VkSubmitInfo2: its size, and the place of the number of command buffers. */
#define SUBMIT_INFO_SIZE 64
#define SUBMIT_INFO_N_COMMANDS 32

/* Whether NIMBUS_FAKE_DROP=FIRST:EVERY asks that this submission, from 1, executes no commands. */
static int is_dropped(long long n) {
    const char *drop = getenv("NIMBUS_FAKE_DROP");
    long long first, every;
    if (!drop) return 0;
    if (sscanf(drop, "%lld:%lld", &first, &every) != 2) die("NIMBUS_FAKE_DROP");
    return n >= first && (n - first) % every == 0;
}

static int32_t answer(int call, Word a, Word b, Word c, Word d, Word e, Word f) {
    int32_t failed = fault(call, 1 + atomic_fetch_add(&n_calls[call], 1));
    if (failed) {
        /* Vulkan wants null handles of the pipelines that were not made. */
        if (MAKES[call] == KIND_Pipeline) memset((void *)f, 0, 8 * (uint32_t)c);
        return failed;
    }
    if (atomic_load(&is_hung)) {
        if (call == CALL_WaitSemaphores) {
            add_line("NIMBUS_FAKE_LOG", "%s: %lld ns\n", "waited", (long long)c);
            return TIMEOUT;
        }
        if (call == CALL_GetSemaphoreCounterValue) {
            *(uint64_t *)c = 0;
            return SUCCESS;
        }
        if (call == CALL_DeviceWaitIdle)
            add_line("NIMBUS_FAKE_LOG", "never returns: %s %lld\n", NAMES[call], n_calls[call]);
    }
    char info[72];
    const char *names[MOST_EXTENSIONS];
    if (call == CALL_CreateDevice) {
        without_extensions((char *)b, info, names);
        b = (Word)info;
    }
    int32_t result;
    if (call == CALL_QueueSubmit2) {
        pthread_mutex_lock(&submitting);
        char submit[SUBMIT_INFO_SIZE];
        if (b == 1 && is_dropped(n_calls[call])) {
            memcpy(submit, (void *)c, sizeof submit);
            memset(submit + SUBMIT_INFO_N_COMMANDS, 0, 4);
            c = (Word)submit;
        }
        result = atomic_load(&is_lost) ? DEVICE_LOST : reals[call](a, b, c, d, e, f);
        pthread_mutex_unlock(&submitting);
    } else {
        result = reals[call](a, b, c, d, e, f);
    }
    if (result == SUCCESS && MAKES[call] != KIND_None)
        atomic_fetch_add(&n_alive[MAKES[call]], MAKES[call] == KIND_Pipeline ? (uint32_t)c : 1);
    if (result == SUCCESS && call == CALL_CreateDevice) atomic_store(&open_device, *(Word *)d);
    return result;
}

#define X(call, kind)                                                              \
    static int32_t my##call(Word a, Word b, Word c, Word d, Word e, Word f) {      \
        return answer(CALL_##call, a, b, c, d, e, f);                              \
    }
CALLS(X)
#undef X

static void (*reals_end[N_KINDS])(Word, Word, Word);

static void end(int kind, Word a, Word b, Word c) {
    if (kind == KIND_Device && a) {
        atomic_store(&open_device, 0);
        for (int i = KIND_Device + 1; i < N_KINDS; i++)
            if (n_alive[i]) add_line("NIMBUS_FAKE_LOG", "leak: %s %lld\n", KINDS[i], n_alive[i]);
    }
    if (kind == KIND_Device ? a : b) atomic_fetch_sub(&n_alive[kind], 1);
    reals_end[kind](a, b, c);
}

#define X(call, kind)                                    \
    static void my##call(Word a, Word b, Word c) {       \
        end(KIND_##kind, a, b, c);                       \
    }
ENDS(X)
#undef X

#define X(call) static Function real##call;
OTHERS(X)
#undef X

/* Changes a VkPhysicalDeviceProperties. */
static void change_properties(char *properties) {
    unsigned major, minor;
    const char *api = getenv("NIMBUS_FAKE_API");
    if (api && sscanf(api, "%u.%u", &major, &minor) == 2) {
        uint32_t version = major << 22 | minor << 12;
        memcpy(properties, &version, sizeof version);
    }
#ifdef SECOND
    uint32_t discrete = 2;
    memcpy(properties + 16, &discrete, sizeof discrete);
    strcpy(properties + 20, "second");
#endif
}

static void myGetPhysicalDeviceProperties(Word device, char *properties) {
    ((void (*)(Word, char *))realGetPhysicalDeviceProperties)(device, properties);
    change_properties(properties);
}

/* The three structures with a chain have the others' fields after sType and pNext. */
#define CHAIN 16

static void myGetPhysicalDeviceProperties2(Word device, char *properties) {
    ((void (*)(Word, char *))realGetPhysicalDeviceProperties2)(device, properties);
    change_properties(properties + CHAIN);
}

static void myGetPhysicalDeviceProperties2KHR(Word device, char *properties) {
    ((void (*)(Word, char *))realGetPhysicalDeviceProperties2KHR)(device, properties);
    change_properties(properties + CHAIN);
}

/* Takes the graphics bit from queue families, whose flags are every `stride` bytes. */
static void change_families(const uint32_t *n, char *families, size_t stride) {
    if (!families || !getenv("NIMBUS_FAKE_NO_GRAPHICS")) return;
    for (uint32_t i = 0; i < *n; i++) {
        uint32_t flags;
        memcpy(&flags, families + i * stride, sizeof flags);
        flags &= ~1u;
        memcpy(families + i * stride, &flags, sizeof flags);
    }
}

typedef void (*GetFamilies)(Word, uint32_t *, char *);

static void myGetPhysicalDeviceQueueFamilyProperties(Word device, uint32_t *n, char *families) {
    ((GetFamilies)realGetPhysicalDeviceQueueFamilyProperties)(device, n, families);
    change_families(n, families, 24);
}

static void myGetPhysicalDeviceQueueFamilyProperties2(Word device, uint32_t *n, char *families) {
    ((GetFamilies)realGetPhysicalDeviceQueueFamilyProperties2)(device, n, families);
    change_families(n, families ? families + CHAIN : NULL, CHAIN + 24);
}

static void myGetPhysicalDeviceQueueFamilyProperties2KHR(Word device, uint32_t *n, char *families) {
    ((GetFamilies)realGetPhysicalDeviceQueueFamilyProperties2KHR)(device, n, families);
    change_families(n, families ? families + CHAIN : NULL, CHAIN + 24);
}

static void myCmdBeginDebugUtilsLabelEXT(Word commands, const char *info) {
    const char *name;
    memcpy(&name, info + CHAIN, sizeof name);
    add_line("NIMBUS_FAKE_LABELS", "begin %s\n", name, 0);
    ((void (*)(Word, const char *))realCmdBeginDebugUtilsLabelEXT)(commands, info);
}

static void myCmdEndDebugUtilsLabelEXT(Word commands) {
    add_line("NIMBUS_FAKE_LABELS", "end\n", "", 0);
    ((void (*)(Word))realCmdEndDebugUtilsLabelEXT)(commands);
}

static int32_t no_devices(Word instance, uint32_t *n, Word *devices) {
    (void)instance, (void)devices;
    *n = 0;
    return SUCCESS;
}

static Function wrap(const char *name, Function real);

static Function myGetDeviceProcAddr(void *device, const char *name) {
    return wrap(name, ((GetProcAddr)realGetDeviceProcAddr)(device, name));
}

/* Returns the wrapper of a function, or the function itself. */
static Function wrap(const char *name, Function real) {
    if (getenv("NIMBUS_FAKE_TELLS") && !strcmp(name, "vkGetDeviceFaultInfoEXT"))
        return (Function)myGetDeviceFaultInfoEXT;
    if (getenv("NIMBUS_FAKE_SHOWN_MS") && !strcmp(name, "vkWaitForPresentKHR"))
        return (Function)myWaitForPresentKHR;
    if (!real || strncmp(name, "vk", 2)) return real;
    const char *devices = getenv("NIMBUS_FAKE_DEVICES");
    if (devices && !strcmp(devices, "0") && !strcmp(name, "vkEnumeratePhysicalDevices"))
        return (Function)no_devices;
#define X(call, kind)                   \
    if (!strcmp(name + 2, #call)) {     \
        reals[CALL_##call] = (Call)real; \
        return (Function)my##call;      \
    }
    CALLS(X)
#undef X
#define X(call, kind)                                             \
    if (!strcmp(name + 2, #call)) {                               \
        reals_end[KIND_##kind] = (void (*)(Word, Word, Word))real; \
        return (Function)my##call;                                \
    }
    ENDS(X)
#undef X
#define X(call)                     \
    if (!strcmp(name + 2, #call)) { \
        real##call = real;          \
        return (Function)my##call;  \
    }
    OTHERS(X)
#undef X
    return real;
}

EXPORT Function vk_icdGetInstanceProcAddr(void *instance, const char *name) {
    pthread_once(&once, load);
    return wrap(name, real_instance_proc(instance, name));
}

EXPORT Function vk_icdGetPhysicalDeviceProcAddr(void *instance, const char *name) {
    pthread_once(&once, load);
    return real_physical_proc ? wrap(name, real_physical_proc(instance, name)) : NULL;
}

EXPORT int32_t vk_icdNegotiateLoaderICDInterfaceVersion(uint32_t *version) {
    pthread_once(&once, load);
    return real_negotiate ? real_negotiate(version) : SUCCESS;
}
