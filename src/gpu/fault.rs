//! The reasons that a driver gives for the loss of its device (VK_EXT_device_fault).

use std::ffi::CStr;
use std::ptr;

use ash::ext::device_fault;
use ash::vk;

/// Whether a device that has the extension has its feature, too.
pub(super) fn is_told(instance: &ash::Instance, physical: vk::PhysicalDevice) -> bool {
    let mut feature = vk::PhysicalDeviceFaultFeaturesEXT::default();
    let mut all = vk::PhysicalDeviceFeatures2::default().push_next(&mut feature);
    unsafe { instance.get_physical_device_features2(physical, &mut all) };
    feature.device_fault == vk::TRUE
}

/// Returns what the driver says of the loss of a device; none where it says nothing. The device
/// must be lost.
pub(super) fn told(loader: &device_fault::Device) -> Option<String> {
    let (get, device) = (loader.fp().get_device_fault_info_ext, loader.device());
    let mut counts = vk::DeviceFaultCountsEXT::default();
    // SAFETY: without a place for infos the call writes the counts alone.
    unsafe { get(device, &mut counts, ptr::null_mut()) }.result().ok()?;
    // The binary data is for the vendor's own tools.
    counts.vendor_binary_size = 0;
    let mut addresses = vec![Default::default(); counts.address_info_count as usize];
    let mut vendor = vec![Default::default(); counts.vendor_info_count as usize];
    let mut info = vk::DeviceFaultInfoEXT {
        p_address_infos: addresses.as_mut_ptr(),
        p_vendor_infos: vendor.as_mut_ptr(),
        ..Default::default()
    };
    // SAFETY: the vectors have the lengths in `counts`, and the call writes no more.
    match unsafe { get(device, &mut counts, &mut info) } {
        // Incomplete: the binary data was left out.
        vk::Result::SUCCESS | vk::Result::INCOMPLETE => {}
        _ => return None,
    }
    addresses.truncate(counts.address_info_count as usize);
    vendor.truncate(counts.vendor_info_count as usize);
    let description = info.description_as_c_str().map_or_else(|_| String::new(), text);
    let mut says: Vec<String> = Some(description).into_iter().filter(|d| !d.is_empty()).collect();
    says.extend(addresses.iter().filter_map(address_text));
    says.extend(vendor.iter().map(vendor_text));
    (!says.is_empty()).then(|| format!("the driver says: {}", says.join("; ")))
}

/// Returns the text of an address; none where it has no kind.
fn address_text(info: &vk::DeviceFaultAddressInfoEXT) -> Option<String> {
    use vk::DeviceFaultAddressTypeEXT as Kind;
    let what = match info.address_type {
        Kind::READ_INVALID => "a read from an address that is none",
        Kind::WRITE_INVALID => "a write to an address that is none",
        Kind::EXECUTE_INVALID => "a jump to an address that is none",
        Kind::INSTRUCTION_POINTER_UNKNOWN
        | Kind::INSTRUCTION_POINTER_INVALID
        | Kind::INSTRUCTION_POINTER_FAULT => "an instruction",
        _ => return None,
    };
    // The address is known up to a power of two.
    let (at, precision) = (info.reported_address, info.address_precision.max(1));
    let first = at & !(precision - 1);
    Some(match precision {
        1 => format!("{what} at {at:#x}"),
        _ => format!("{what} from {first:#x} to {:#x}", first.saturating_add(precision - 1)),
    })
}

fn vendor_text(info: &vk::DeviceFaultVendorInfoEXT) -> String {
    let what = info.description_as_c_str().map_or_else(|_| String::new(), text);
    let (code, data) = (info.vendor_fault_code, info.vendor_fault_data);
    format!("{what} (code {code:#x}, data {data:#x})").trim_start().to_owned()
}

fn text(chars: &CStr) -> String {
    chars.to_string_lossy().trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_told_with_their_precision() {
        use vk::DeviceFaultAddressTypeEXT as Kind;
        let of = |address_type, reported_address, address_precision| {
            address_text(&vk::DeviceFaultAddressInfoEXT {
                address_type,
                reported_address,
                address_precision,
            })
        };
        // The example of the specification of VkDeviceFaultAddressInfoEXT: an address of 0x70c and
        // a precision of 16 mean 0x700 to 0x70f.
        let told = of(Kind::WRITE_INVALID, 0x70c, 16).expect("an address");
        assert!(told.ends_with("from 0x700 to 0x70f") && told.starts_with("a write"), "{told}");
        let told = of(Kind::INSTRUCTION_POINTER_FAULT, 0x70c, 1).expect("an address");
        assert_eq!(told, "an instruction at 0x70c");
        assert_eq!(of(Kind::NONE, 0, 0), None);
        assert!(of(Kind::READ_INVALID, u64::MAX, 0).is_some());
        assert!(of(Kind::READ_INVALID, u64::MAX, 1 << 63).is_some());
    }
}
