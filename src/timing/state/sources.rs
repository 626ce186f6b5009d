//! All that is read at one moment: the device, its memory, the host.

use std::path::PathBuf;

use super::amd::AmdCard;
use super::card::{AMD, INTEL, NVIDIA, card};
use super::device_source::DeviceSource;
use super::host::Host;
use super::intel::IntelCard;
use super::nvml;
use super::row::{Event, StateRow};
use crate::gpu::{Device, DeviceInfo, MemoryProbe};

/// The folders of the system, or those of a test.
#[derive(Debug, Clone)]
pub struct Folders {
    /// The folder /sys.
    pub sys: PathBuf,
    /// The folder /proc.
    pub proc: PathBuf,
}

impl Default for Folders {
    fn default() -> Folders {
        Folders { sys: PathBuf::from("/sys"), proc: PathBuf::from("/proc") }
    }
}

/// The sources of the state of one device and its host.
pub struct Sources {
    device: Option<Box<dyn DeviceSource>>,
    memory: Option<MemoryProbe>,
    host: Host,
}

/// The names of a device by which its sources are found.
#[derive(Debug, Clone, Default)]
pub struct DeviceNames {
    /// Number of the maker in PCI.
    pub vendor: u32,
    /// UUID of Vulkan in hexadecimal.
    pub uuid: String,
    /// Address on the PCI bus, such as 0000:03:00.0.
    pub pci_address: Option<String>,
    /// Numbers of its node in /dev/dri.
    pub drm_node: Option<[i64; 2]>,
}

impl DeviceNames {
    /// Returns the names of an open device.
    pub fn of(device: &Device) -> DeviceNames {
        let DeviceInfo { vendor, uuid, pci_address, .. } = device.info();
        DeviceNames {
            vendor: *vendor,
            uuid: uuid.clone(),
            pci_address: pci_address.clone(),
            drm_node: device.drm_node(),
        }
    }

    fn open(&self, folders: &Folders) -> Option<Result<Box<dyn DeviceSource>, String>> {
        let address = self.pci_address.as_deref();
        let card = || card(&folders.sys, address, self.drm_node);
        Some(match self.vendor {
            NVIDIA => nvml::open(&self.uuid, address),
            AMD => card().and_then(|card| Ok(Box::new(AmdCard::open(&card)?) as _)),
            INTEL => card().and_then(|card| Ok(Box::new(IntelCard::open(&card)?) as _)),
            _ => return None,
        })
    }
}

impl Sources {
    /// Opens the sources, and returns remarks on those that are missing.
    pub fn open(
        named: &DeviceNames,
        memory: Option<MemoryProbe>,
        folders: &Folders,
    ) -> (Sources, Vec<String>) {
        let host = Host::open(&folders.sys, &folders.proc);
        let (device, notes) = match named.open(folders) {
            Some(Ok(device)) => (Some(device), vec![]),
            Some(Err(why)) => (None, vec![format!("no clocks of the device: {why}")]),
            None => (None, vec![]),
        };
        (Sources { device, memory, host }, notes)
    }

    /// Returns the names of the sources that are there.
    pub fn names(&self) -> Vec<String> {
        let budget = self.memory.as_ref().filter(|memory| memory.has_budget());
        let device = self.device.as_ref().map(|device| device.name());
        let all = device.into_iter().chain(budget.map(|_| "VK_EXT_memory_budget"));
        all.chain(self.host.names()).map(str::to_owned).collect()
    }

    /// Reads everything at `time_s`, seconds since the start of the run. What changes slowly is not
    /// read at a tick.
    pub fn read(&mut self, time_s: f64, event: Event, block: Option<u32>) -> StateRow {
        let mut row = StateRow { time_s, event, block, ..StateRow::default() };
        if let Some(device) = &mut self.device {
            device.read(time_s, &mut row);
        }
        if let Some(memory) = self.memory.as_ref().map(MemoryProbe::read) {
            row.process_bytes = memory.process;
            row.own_bytes = Some(memory.own);
            row.own_peak_bytes = match event {
                Event::Tick => Some(memory.own_peak),
                // The end is read after the block, when other work may have allocated.
                Event::End => None,
                // Until the frames of a block begin, the peak may be that of the case before.
                Event::Start | Event::Begin => Some(memory.own),
            };
        }
        self.host.read_fast(&mut row);
        if event != Event::Tick {
            self.host.read_slow(&mut row);
        }
        row
    }
}
