/*
 * VK_EXT_device_fault, which the real driver lacks. The device has it if NIMBUS_FAKE_TELLS is set.
 * What it tells of a loss has an escape sequence, which must not reach a terminal.
 */
enum { FAULT_FEATURES = 1000341000, INCOMPLETE = 5, EXTENSION_BYTES = 260, BINARY_BYTES = 64 };

static const char FAULT_EXTENSION[] = "VK_EXT_device_fault";
static Function realEnumerateDeviceExtensionProperties, realGetPhysicalDeviceFeatures2;

static int tells(void) { return getenv("NIMBUS_FAKE_TELLS") != NULL; }

static void put_32(char *at, uint32_t value) { memcpy(at, &value, sizeof value); }
static void put_64(char *at, uint64_t value) { memcpy(at, &value, sizeof value); }

typedef int32_t (*ListExtensions)(Word, const char *, uint32_t *, char *);

static int32_t myEnumerateDeviceExtensionProperties(Word device, const char *layer, uint32_t *n,
                                                    char *all) {
    ListExtensions real = (ListExtensions)realEnumerateDeviceExtensionProperties;
    if (!tells() || layer) return real(device, layer, n, all);
    uint32_t room = *n;
    if (all) *n = room ? room - 1 : 0;
    int32_t result = real(device, layer, n, all);
    if (all && *n < room) {
        memset(all + *n * EXTENSION_BYTES, 0, EXTENSION_BYTES);
        strcpy(all + *n * EXTENSION_BYTES, FAULT_EXTENSION);
        put_32(all + *n * EXTENSION_BYTES + 256, 2);
    }
    if (!all || *n < room) ++*n;
    return result;
}

/* Sets the feature in a chain of structures. */
static void set_feature(char *chain, uint32_t value) {
    while (chain) {
        uint32_t type;
        memcpy(&type, chain, sizeof type);
        if (type == FAULT_FEATURES) put_32(chain + 16, value);
        memcpy(&chain, chain + 8, sizeof chain);
    }
}

static void myGetPhysicalDeviceFeatures2(Word device, char *features) {
    ((void (*)(Word, char *))realGetPhysicalDeviceFeatures2)(device, features);
    if (tells()) set_feature(features, 1);
}

/* Copies a VkDeviceCreateInfo without extension and feature, which the real driver would refuse. */
static void without_extension(char *info, char copy[72], const char *names[64]) {
    uint32_t n, n_kept = 0;
    const char *const *all;
    memcpy(copy, info, 72);
    memcpy(&n, info + 48, sizeof n);
    memcpy(&all, info + 56, sizeof all);
    for (uint32_t i = 0; i < n && n_kept < 64; i++)
        if (strcmp(all[i], FAULT_EXTENSION)) names[n_kept++] = all[i];
    set_feature(info, 0);
    put_32(copy + 48, n_kept);
    put_64(copy + 56, (uintptr_t)names);
}

static int32_t myGetDeviceFaultInfoEXT(Word device, char *counts, char *info) {
    (void)device;
    if (!atomic_load(&is_lost))
        add_line("NIMBUS_FAKE_LOG", "%s %lld\n", "asked of a device that is not lost:", 1);
    uint64_t n_bytes;
    memcpy(&n_bytes, counts + 24, sizeof n_bytes);
    put_32(counts + 16, 1);
    put_32(counts + 20, 1);
    put_64(counts + 24, info ? 0 : BINARY_BYTES);
    if (!info) return SUCCESS;
    char *address, *vendor;
    memcpy(&address, info + 272, sizeof address);
    memcpy(&vendor, info + 280, sizeof vendor);
    strcpy(info + 16, "a page fault");
    put_32(address, 2);
    put_64(address + 8, 0x12345678);
    put_64(address + 16, 0x1000);
    strcpy(vendor, "\033[31mring 3\n");
    put_64(vendor + 256, 7);
    put_64(vendor + 264, 9);
    return n_bytes < BINARY_BYTES ? INCOMPLETE : SUCCESS;
}
