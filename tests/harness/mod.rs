//! What every GPU test starts from: a device with validation and synchronization validation on, and the promise that it
//! has said nothing when the test ends. No device, or no validation layer, is a failure.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::sync::Arc;

use bytemuck::Pod;
use nimbus::gpu::{Buffer, Commands, Compiler, Device, Instance, Place, Recorder};
use nimbus::passes;

pub struct Gpu {
    pub commands: Commands,
    pub compiler: Compiler,
    pub device: Device,
    pub instance: Arc<Instance>,
}

impl Gpu {
    pub fn new() -> Gpu {
        let instance = Instance::new(true).expect("an instance with validation");
        let device = Device::open(&instance, None).expect("a Vulkan 1.3 device");
        let compiler = Compiler::new(passes::sources(), Compiler::default_cache()).expect("shaderc");
        let commands = Commands::new(&device, "test").expect("commands");
        Gpu { commands, compiler, device, instance }
    }

    /// A device buffer that holds `data`.
    pub fn upload<T: Pod>(&mut self, data: &[T]) -> Buffer {
        let n = data.len() as u64;
        let mut staging = Buffer::new::<T>(&self.device, "test.staging", n, Place::Upload).expect("staging");
        staging.write(data).expect("write");
        let buffer = self.buffer::<T>(data.len());
        self.run(|rec| {
            rec.copy(&staging, &buffer);
            Ok(())
        });
        buffer
    }

    /// A device buffer of `n` records of unknown content.
    pub fn buffer<T: Pod>(&self, n: usize) -> Buffer {
        Buffer::new::<T>(&self.device, "test.buffer", n as u64, Place::Device).expect("buffer")
    }

    /// The first `n` records of a device buffer.
    pub fn download<T: Pod>(&mut self, buffer: &Buffer, n: usize) -> Vec<T> {
        let readback = Buffer::new::<T>(&self.device, "test.readback", n as u64, Place::Readback).expect("readback");
        self.run(|rec| {
            rec.copy(buffer, &readback);
            Ok(())
        });
        readback.read(n).expect("read")
    }

    pub fn run(&mut self, f: impl FnOnce(&mut Recorder<'_>) -> nimbus::error::Result<()>) {
        self.commands.run(f).expect("the commands run");
    }
}

impl Drop for Gpu {
    /// Fails the test on any validation message.
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let said = self.instance.messages().take();
            assert!(said.is_empty(), "validation messages:\n{}", said.join("\n"));
        }
    }
}

/// The greatest |value − truth| − bound over all elements, which must not be positive; `what` names the quantity.
pub fn assert_within(what: &str, values: &[f64], truths: &[f64], bounds: &[f64]) {
    assert_eq!(values.len(), truths.len(), "{what}: lengths");
    let check = |i: usize| {
        let error = (values[i] - truths[i]).abs();
        // Written so that NaN fails.
        if error <= bounds[i] { None } else { Some((i, error)) }
    };
    let bad: Vec<_> = (0..values.len()).filter_map(check).collect();
    if let Some((i, error)) = bad.first() {
        let (value, truth, bound) = (values[*i], truths[*i], bounds[*i]);
        panic!(
            "{what}: {} of {} out of bound; first [{i}] {value} against {truth}: error {error:e}, bound {bound:e}",
            bad.len(),
            values.len()
        );
    }
}
