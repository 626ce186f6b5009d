//! The state of a GPU of NVIDIA, from the driver's library NVML, which is loaded at run time.

#[cfg(any(target_os = "linux", windows))]
pub use library::open;

#[cfg(not(any(target_os = "linux", windows)))]
use super::device_source::DeviceSource;

/// Returns the reader of a GPU.
///
/// # Errors
/// Always: NVIDIA's drivers exist for Linux and Windows.
#[cfg(not(any(target_os = "linux", windows)))]
pub fn open(_: &str, _: Option<&str>) -> Result<Box<dyn DeviceSource>, String> {
    Err("NVML exists on Linux and Windows only".to_owned())
}

/// A GPU as NVML lists it.
#[cfg_attr(not(any(target_os = "linux", windows)), allow(dead_code))]
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listed {
    /// "GPU-" and the UUID that Vulkan has, too.
    pub uuid: String,
    /// Address on the PCI bus, whose domain has eight digits: "00000000:01:00.0".
    pub bus_id: String,
}

/// Returns the place in NVML's list of the GPU with this UUID of Vulkan or, failing that, at this
/// PCI address. Neither the name nor the order can tell two equal cards apart.
#[cfg_attr(not(any(target_os = "linux", windows)), allow(dead_code))]
pub fn place(all: &[Listed], uuid: &str, address: Option<&str>) -> Option<usize> {
    let digits = |uuid: &str| {
        let digits = uuid.strip_prefix("GPU-").unwrap_or(uuid).replace('-', "");
        digits.to_lowercase()
    };
    let short = |bus_id: &str| {
        let (domain, rest) = bus_id.split_once(':')?;
        let domain = u32::from_str_radix(domain, 16).ok()?;
        Some(format!("{domain:04x}:{}", rest.to_lowercase()))
    };
    let by_uuid = all.iter().position(|gpu| digits(&gpu.uuid) == digits(uuid));
    let by_address = || {
        let address = short(address?)?;
        all.iter().position(|gpu| short(&gpu.bus_id).is_some_and(|bus_id| bus_id == address))
    };
    by_uuid.or_else(by_address)
}

#[cfg(any(target_os = "linux", windows))]
mod library {
    use std::sync::OnceLock;

    use nvml_wrapper::bitmasks::device::ThrottleReasons;
    use nvml_wrapper::enum_wrappers::device::{Clock, TemperatureSensor};
    use nvml_wrapper::error::NvmlError;
    use nvml_wrapper::{Device, Nvml};

    use super::super::device_source::DeviceSource;
    use super::super::row::StateRow;
    use super::{Listed, place};

    /// The library, loaded once in a process.
    static NVML: OnceLock<Result<Nvml, String>> = OnceLock::new();

    /// The reasons of which NVML tells, but three: an idle GPU, and clocks that the user has set.
    const REASONS: [(ThrottleReasons, &str); 6] = [
        (ThrottleReasons::SW_POWER_CAP, "sw_power_cap"),
        (ThrottleReasons::HW_SLOWDOWN, "hw_slowdown"),
        (ThrottleReasons::SYNC_BOOST, "sync_boost"),
        (ThrottleReasons::SW_THERMAL_SLOWDOWN, "sw_thermal_slowdown"),
        (ThrottleReasons::HW_THERMAL_SLOWDOWN, "hw_thermal_slowdown"),
        (ThrottleReasons::HW_POWER_BRAKE_SLOWDOWN, "hw_power_brake_slowdown"),
    ];

    struct NvidiaCard {
        device: Device<'static>,
    }

    /// Returns the reader of the GPU with this UUID of Vulkan or this PCI address.
    ///
    /// # Errors
    /// The library is not there or fails, or lists no such GPU. The error is a phrase.
    pub fn open(uuid: &str, address: Option<&str>) -> Result<Box<dyn DeviceSource>, String> {
        let nvml = NVML.get_or_init(|| Nvml::init().map_err(|e| e.to_string()));
        let nvml = nvml.as_ref().map_err(|e| format!("NVML cannot be loaded: {e}"))?;
        let failed = |e: NvmlError| format!("NVML: {e}");
        let n = nvml.device_count().map_err(failed)?;
        // A GPU that NVML cannot describe is not the one that Vulkan has opened.
        let devices: Vec<Device<'static>> =
            (0..n).filter_map(|i| nvml.device_by_index(i).ok()).collect();
        let listed = |device: &Device<'static>| Listed {
            uuid: device.uuid().unwrap_or_default(),
            bus_id: device.pci_info().map(|pci| pci.bus_id).unwrap_or_default(),
        };
        let all: Vec<Listed> = devices.iter().map(listed).collect();
        let found = place(&all, uuid, address).and_then(|i| devices.into_iter().nth(i));
        let device = found.ok_or("NVML lists no GPU with the UUID or PCI address of the device")?;
        Ok(Box::new(NvidiaCard { device }))
    }

    impl DeviceSource for NvidiaCard {
        fn name(&self) -> &'static str {
            "NVML"
        }

        fn read(&mut self, _: f64, row: &mut StateRow) {
            let device = &self.device;
            let mhz = |clock| device.clock_info(clock).ok().map(f64::from);
            row.gpu_mhz = mhz(Clock::Graphics);
            row.gpu_memory_mhz = mhz(Clock::Memory);
            row.gpu_c = device.temperature(TemperatureSensor::Gpu).ok().map(f64::from);
            // Milliwatts.
            row.gpu_w = device.power_usage().ok().map(|mw| 1e-3 * f64::from(mw));
            row.gpu_busy_percent = device.utilization_rates().ok().map(|u| f64::from(u.gpu));
            if let Ok(active) = device.current_throttle_reasons() {
                let names = REASONS.iter().filter(|(reason, _)| active.contains(*reason));
                row.set_reasons(&names.map(|(_, name)| *name).collect::<Vec<_>>());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_equal_cards_are_told_apart_by_uuid_and_by_address() {
        let gpu = |uuid: &str, bus_id: &str| Listed {
            uuid: format!("GPU-{uuid}"),
            bus_id: bus_id.to_owned(),
        };
        // NVML's order need not be Vulkan's.
        let all = [
            gpu("8b6f2b1e-0000-1111-2222-333344445555", "00000000:41:00.0"),
            gpu("1c9e77aa-aaaa-bbbb-cccc-ddddeeeeffff", "00000001:01:00.0"),
        ];
        let second = "1c9e77aaaaaabbbbccccddddeeeeffff";
        assert_eq!(place(&all, second, None), Some(1));
        assert_eq!(place(&all, "8B6F2B1E000011112222333344445555", None), Some(0));
        // A driver whose UUIDs are its own: the address decides.
        assert_eq!(place(&all, "00", Some("0000:41:00.0")), Some(0));
        assert_eq!(place(&all, "00", Some("0001:01:00.0")), Some(1));
        // The same bus and device in another domain is another card.
        assert_eq!(place(&all, "00", Some("0000:01:00.0")), None);
        // The UUID is the better witness of the two.
        assert_eq!(place(&all, second, Some("0000:41:00.0")), Some(1));
        assert_eq!(place(&all, "00", None), None);
        assert_eq!(place(&[], second, Some("0000:41:00.0")), None);
        let nameless = [gpu("", ""), gpu("", "zz:1")];
        assert_eq!(place(&nameless, "00", Some("zz:1")), None);
    }
}
