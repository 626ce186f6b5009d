//! The base of every GPU test: a device with guard bands, validation and synchronization
//! validation, and the assertion that there are no messages when the test ends. Without a device or
//! a validation layer the test fails.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::sync::Arc;

use bytemuck::Pod;
use nimbus::gpu::{
    Buffer, Commands, Compiler, Device, DeviceOptions, Instance, LoweredLimits, MemoryUsage,
    Recorder,
};
use nimbus::passes;

/// The environment variable that names a file of lower limits for all tests.
const LIMITS: &str = "NIMBUS_TEST_LIMITS";

/// A device, and what a test needs to run kernels on it.
pub struct Gpu {
    pub commands: Commands,
    pub compiler: Compiler,
    pub device: Device,
    pub instance: Arc<Instance>,
}

impl Gpu {
    pub fn new() -> Gpu {
        Gpu::with_options(|_| {})
    }

    /// Opens the device with changed options.
    pub fn with_options(change: impl FnOnce(&mut DeviceOptions)) -> Gpu {
        let instance = Instance::new(true).expect("an instance with validation");
        let limits = std::env::var_os(LIMITS);
        let limits = limits.map(|path| LoweredLimits::read(path.as_ref()).expect("limits"));
        let mut options = DeviceOptions { limits, guard: true, ..DeviceOptions::default() };
        change(&mut options);
        let device = Device::with_options(&instance, None, &options).expect("a Vulkan 1.3 device");
        let compiler =
            Compiler::new(passes::sources(), Compiler::default_cache()).expect("shaderc");
        let commands = Commands::new(&device, "test").expect("commands");
        Gpu { commands, compiler, device, instance }
    }

    /// Uploads `data` to a device buffer.
    pub fn upload<T: Pod>(&mut self, data: &[T]) -> Buffer {
        let n = data.len() as u64;
        let mut staging = Buffer::new::<T>(&self.device, "test.staging", n, MemoryUsage::Upload)
            .expect("staging");
        staging.write(data).expect("write");
        let buffer = self.buffer::<T>(data.len());
        self.run(|rec| {
            rec.copy(&staging, &buffer);
            Ok(())
        });
        buffer
    }

    /// Allocates a device buffer of `n` records of undefined content.
    pub fn buffer<T: Pod>(&self, n: usize) -> Buffer {
        Buffer::new::<T>(&self.device, "test.buffer", n as u64, MemoryUsage::Device)
            .expect("buffer")
    }

    /// Reads the first `n` records of a device buffer.
    pub fn download<T: Pod>(&mut self, buffer: &Buffer, n: usize) -> Vec<T> {
        let readback =
            Buffer::new::<T>(&self.device, "test.readback", n as u64, MemoryUsage::Readback)
                .expect("readback");
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
    /// Closes the device and fails on any validation message.
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let messages = self.instance.messages().take();
            assert!(messages.is_empty(), "validation messages:\n{}", messages.join("\n"));
        }
    }
}

/// Asserts that no |value − truth| exceeds its bound; `what` names the quantity.
pub fn assert_within(what: &str, values: &[f64], truths: &[f64], bounds: &[f64]) {
    assert_eq!(values.len(), truths.len(), "{what}: lengths");
    let check = |i: usize| {
        let error = (values[i] - truths[i]).abs();
        // The comparison fails for NaN.
        if error <= bounds[i] { None } else { Some((i, error)) }
    };
    let bad: Vec<_> = (0..values.len()).filter_map(check).collect();
    if let Some((i, error)) = bad.first() {
        let (value, truth, bound) = (values[*i], truths[*i], bounds[*i]);
        panic!(
            "{what}: {} of {} out of bound; first [{i}] {value} against {truth}: error {error:e}, \
             bound {bound:e}",
            bad.len(),
            values.len()
        );
    }
}

impl Gpu {
    /// Compiles the test's own kernel `name`, which may include nimbus's shader files.
    pub fn test_kernel(
        &self,
        name: &str,
        text: &str,
        push: &[nimbus::gpu::Field],
    ) -> nimbus::gpu::Kernel {
        let file = format!("{name}.comp");
        let texts = [&[(file.as_str(), text)], passes::SHADERS].concat();
        let compiler =
            Compiler::new(nimbus::gpu::Sources::embedded(&texts), None).expect("shaderc");
        nimbus::gpu::Kernel::new(&self.device, &compiler, name, push).expect("the test's kernel")
    }

    /// Returns a compiler of nimbus's shaders with `from` replaced by `to` in `file`: a faulty
    /// variant that a test must detect.
    pub fn wrong_compiler(file: &str, from: &str, to: &str) -> Compiler {
        let mut sources = passes::sources();
        assert!(sources.replace(file, from, to), "{file} does not hold {from}");
        // The change leaves most shaders of a pass alone, and the cache holds their SPIR-V.
        Compiler::new(sources, Compiler::default_cache()).expect("shaderc")
    }
}

/// Returns the greatest error/bound, or the first element beyond its bound. [`assert_within`] is
/// for checks that must pass.
pub fn check_within(
    what: &str,
    values: &[f64],
    truths: &[f64],
    bounds: &[f64],
) -> Result<f64, String> {
    assert!(values.len() == truths.len() && values.len() == bounds.len(), "{what}: lengths");
    let error = |i: usize| (values[i] - truths[i]).abs();
    // Written so that NaN counts as beyond the bound.
    let bad: Vec<usize> =
        (0..values.len()).filter(|i| !matches!(error(*i), e if e <= bounds[*i])).collect();
    if let Some(&i) = bad.first() {
        let (value, truth, bound) = (values[i], truths[i], bounds[i]);
        let n = values.len();
        return Err(format!(
            "{what}: {} of {n} out of bound; [{i}] {value} against {truth} ± {bound:e}",
            bad.len()
        ));
    }
    Ok((0..values.len())
        .map(|i| if error(i) > 0.0 { error(i) / bounds[i] } else { 0.0 })
        .fold(0.0, f64::max))
}

/// Asserts that all elements are within their bounds and prints the largest error/bound. Verifies
/// that a single element slightly beyond its bound, wherever it is, or a single NaN would be
/// detected.
pub fn assert_within_and_say(what: &str, values: &[f64], truths: &[f64], bounds: &[f64]) {
    match check_within(what, values, truths, bounds) {
        Ok(ratio) => println!("{what}: {} elements, greatest error/bound {ratio:.3}", values.len()),
        Err(bad) => panic!("{bad}"),
    }
    for i in [0, values.len() / 2, values.len() - 1] {
        // Half a bound beyond the bound; if the bound is 0, any difference.
        let beyond = truths[i] + 1.5 * bounds[i] + 1e-30 + 1e-15 * truths[i].abs();
        for wrong in [beyond, f64::NAN] {
            let mut corrupted = values.to_vec();
            corrupted[i] = wrong;
            assert!(
                check_within(what, &corrupted, truths, bounds).is_err(),
                "{what}: {wrong} at {i} was not noticed"
            );
        }
    }
}
