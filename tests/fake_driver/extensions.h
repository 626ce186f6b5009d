/*
 * Extensions that the real driver lacks. The device has one if its variable is set.
 */
enum { EXTENSION_BYTES = 260, MOST_EXTENSIONS = 64 };

static const struct {
    const char *name, *variable;
    /* The type of the structure with its feature. */
    uint32_t features;
} FAKED[] = {
    {"VK_EXT_device_fault", "NIMBUS_FAKE_TELLS", 1000341000},
    {"VK_KHR_present_id", "NIMBUS_FAKE_SHOWN_MS", 1000294001},
    {"VK_KHR_present_wait", "NIMBUS_FAKE_SHOWN_MS", 1000248000},
};
enum { N_FAKED = sizeof FAKED / sizeof *FAKED };

static Function realEnumerateDeviceExtensionProperties, realGetPhysicalDeviceFeatures2;

static int is_faked(int i) { return getenv(FAKED[i].variable) != NULL; }

static void put_32(char *at, uint32_t value) { memcpy(at, &value, sizeof value); }
static void put_64(char *at, uint64_t value) { memcpy(at, &value, sizeof value); }

typedef int32_t (*ListExtensions)(Word, const char *, uint32_t *, char *);

static int32_t myEnumerateDeviceExtensionProperties(Word device, const char *layer, uint32_t *n,
                                                    char *all) {
    ListExtensions real = (ListExtensions)realEnumerateDeviceExtensionProperties;
    uint32_t room = *n, n_faked = 0;
    if (layer) return real(device, layer, n, all);
    for (int i = 0; i < N_FAKED; i++) n_faked += is_faked(i);
    if (all) *n = room > n_faked ? room - n_faked : 0;
    int32_t result = real(device, layer, n, all);
    for (int i = 0; i < N_FAKED; i++) {
        if (!is_faked(i) || (all && *n >= room)) continue;
        if (all) {
            char *entry = all + *n * EXTENSION_BYTES;
            memset(entry, 0, EXTENSION_BYTES);
            strcpy(entry, FAKED[i].name);
            put_32(entry + 256, 1);
        }
        ++*n;
    }
    return result;
}

/* Sets the features of the extensions in a chain of structures. */
static void set_features(char *chain, uint32_t value) {
    while (chain) {
        uint32_t type;
        memcpy(&type, chain, sizeof type);
        for (int i = 0; i < N_FAKED; i++)
            if (is_faked(i) && type == FAKED[i].features) put_32(chain + 16, value);
        memcpy(&chain, chain + 8, sizeof chain);
    }
}

static void myGetPhysicalDeviceFeatures2(Word device, char *features) {
    ((void (*)(Word, char *))realGetPhysicalDeviceFeatures2)(device, features);
    set_features(features, 1);
}

/*
 * Copies a VkDeviceCreateInfo without the extensions and their features, which the real driver
 * would refuse.
 */
static void without_extensions(char *info, char copy[72], const char *names[MOST_EXTENSIONS]) {
    uint32_t n, n_kept = 0;
    const char *const *all;
    memcpy(copy, info, 72);
    memcpy(&n, info + 48, sizeof n);
    memcpy(&all, info + 56, sizeof all);
    for (uint32_t k = 0; k < n && n_kept < MOST_EXTENSIONS; k++) {
        int i = 0;
        while (i < N_FAKED && !(is_faked(i) && !strcmp(all[k], FAKED[i].name))) i++;
        if (i == N_FAKED) names[n_kept++] = all[k];
    }
    set_features(info, 0);
    put_32(copy + 48, n_kept);
    put_64(copy + 56, (uintptr_t)names);
}
