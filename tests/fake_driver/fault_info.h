/*
 * VK_EXT_device_fault, which the device has if NIMBUS_FAKE_TELLS is set. What it tells of a loss has
 * an escape sequence, which must not reach a terminal.
 */
enum { INCOMPLETE = 5, BINARY_BYTES = 64 };

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
