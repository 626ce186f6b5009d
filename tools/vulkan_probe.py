#!/usr/bin/env python3
"""Asks the Vulkan loader for its devices and prints them, without any other Vulkan package.

The lines are "devices N", "device NAME" for each device, and "validation yes" or "validation no"
for the Khronos validation layer. Without a loader the only line is "loader no". The exit code is 0
if there is at least one device, else 1.

Installed files do not show whether a device exists: Mesa installs the drivers of many devices on
every machine, and a driver finds no device if its hardware is missing.
"""
import ctypes
import sys


class InstanceCreateInfo(ctypes.Structure):
    """VkInstanceCreateInfo.

    A null application info asks for Vulkan 1.0, which every driver supports.
    """

    _fields_ = [
        ("s_type", ctypes.c_int32),
        ("p_next", ctypes.c_void_p),
        ("flags", ctypes.c_uint32),
        ("p_application_info", ctypes.c_void_p),
        ("n_layers", ctypes.c_uint32),
        ("layer_names", ctypes.c_void_p),
        ("n_extensions", ctypes.c_uint32),
        ("extension_names", ctypes.c_void_p),
    ]


VK_SUCCESS = 0
VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO = 1
# VkLayerProperties: layerName[256], specVersion, implementationVersion, description[256].
LAYER_SIZE = 256 + 4 + 4 + 256
# VkPhysicalDeviceProperties has 824 bytes and begins with five 32-bit numbers and deviceName[256].
# The buffer is larger than needed.
PROPERTIES_SIZE, NAME_AT, NAME_SIZE = 4096, 20, 256


def text(data):
    return data.split(b"\0", 1)[0].decode("utf-8", "replace")


def has_validation(vulkan):
    count = ctypes.c_uint32(0)
    if vulkan.vkEnumerateInstanceLayerProperties(ctypes.byref(count), None) != VK_SUCCESS:
        return False
    layers = ctypes.create_string_buffer(LAYER_SIZE * max(count.value, 1))
    vulkan.vkEnumerateInstanceLayerProperties(ctypes.byref(count), layers)
    names = [text(layers.raw[i * LAYER_SIZE : i * LAYER_SIZE + 256]) for i in range(count.value)]
    return "VK_LAYER_KHRONOS_validation" in names


def device_names(vulkan):
    instance = ctypes.c_void_p()
    info = InstanceCreateInfo(s_type=VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO)
    # Without any driver the result is VK_ERROR_INCOMPATIBLE_DRIVER.
    if vulkan.vkCreateInstance(ctypes.byref(info), None, ctypes.byref(instance)) != VK_SUCCESS:
        return []
    count = ctypes.c_uint32(0)
    names = []
    result = vulkan.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), None)
    if result == VK_SUCCESS and count.value > 0:
        devices = (ctypes.c_void_p * count.value)()
        vulkan.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), devices)
        for i in range(count.value):
            properties = ctypes.create_string_buffer(PROPERTIES_SIZE)
            vulkan.vkGetPhysicalDeviceProperties(ctypes.c_void_p(devices[i]), properties)
            names.append(text(properties.raw[NAME_AT : NAME_AT + NAME_SIZE]))
    vulkan.vkDestroyInstance(instance, None)
    return names


def main():
    try:
        vulkan = ctypes.CDLL("libvulkan.so.1")
    except OSError:
        print("loader no")
        return 1
    names = device_names(vulkan)
    print("devices", len(names))
    for name in names:
        print("device", name)
    print("validation", "yes" if has_validation(vulkan) else "no")
    return 0 if names else 1


if __name__ == "__main__":
    sys.exit(main())
