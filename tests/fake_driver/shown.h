/*
 * VK_KHR_present_id and VK_KHR_present_wait, which the device has if NIMBUS_FAKE_SHOWN_MS is set.
 * A picture is visible so many milliseconds after it was presented.
 */
enum { PRESENT_ID = 1000294000, MOST_PICTURES = 1024 };

static Function realQueuePresentKHR;
static pthread_mutex_t showing = PTHREAD_MUTEX_INITIALIZER;
/* By number, modulo the length. */
static struct {
    uint64_t id, due_ns;
} pictures[MOST_PICTURES];

static uint64_t now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

static int32_t myQueuePresentKHR(Word queue, char *info) {
    const char *delay = getenv("NIMBUS_FAKE_SHOWN_MS");
    int32_t result = ((int32_t(*)(Word, char *))realQueuePresentKHR)(queue, info);
    if (!delay || result < 0) return result;
    char *chain;
    memcpy(&chain, info + 8, sizeof chain);
    while (chain) {
        uint32_t type;
        memcpy(&type, chain, sizeof type);
        if (type == PRESENT_ID) {
            uint64_t *ids;
            memcpy(&ids, chain + 24, sizeof ids);
            pthread_mutex_lock(&showing);
            pictures[*ids % MOST_PICTURES].id = *ids;
            pictures[*ids % MOST_PICTURES].due_ns =
                now_ns() + (uint64_t)atoll(delay) * 1000000u;
            pthread_mutex_unlock(&showing);
        }
        memcpy(&chain, chain + 8, sizeof chain);
    }
    return result;
}

/* Of one swapchain at a time: a newer one counts from 1 again. */
static int32_t myWaitForPresentKHR(Word device, Word swapchain, uint64_t id, uint64_t timeout) {
    (void)device, (void)swapchain;
    pthread_mutex_lock(&showing);
    uint64_t known = pictures[id % MOST_PICTURES].id, due = pictures[id % MOST_PICTURES].due_ns;
    pthread_mutex_unlock(&showing);
    if (known != id) add_line("NIMBUS_FAKE_LOG", "%s %lld\n", "not presented:", (long long)id);
    uint64_t now = now_ns(), left = due > now ? due - now : 0;
    uint64_t sleep = left < timeout ? left : timeout;
    struct timespec time = {(time_t)(sleep / 1000000000u), (long)(sleep % 1000000000u)};
    nanosleep(&time, NULL);
    return left > timeout ? TIMEOUT : SUCCESS;
}
