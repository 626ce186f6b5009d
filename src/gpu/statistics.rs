//! Reports of the driver's compiler on its pipelines (VK_KHR_pipeline_executable_properties).

use std::sync::{Mutex, PoisonError};

use ash::{khr, vk};

use super::call::Call;
use crate::error::Result;

/// A pipeline as the driver compiled it.
#[derive(Debug, Clone, PartialEq)]
pub struct PipelineReport {
    /// Name of the pipeline, `room.thing`.
    pub pipeline: String,
    /// The macros that its variant sets, and their values.
    pub variant: Vec<(String, u32)>,
    /// Its programs; none where the driver does not describe them.
    pub programs: Vec<Program>,
}

/// A program of a pipeline in the device's machine code.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    /// The driver's name of it, such as "Compute Shader".
    pub name: String,
    /// Invocations of a subgroup; 0 where the driver does not say.
    pub subgroup_size: u32,
    /// The driver's statistics, in its words.
    pub statistics: Vec<(String, f64)>,
}

/// Names of registers of one invocation.
const REGISTERS: [&str; 4] = ["VGPRs", "Number of GPRs", "GPRs", "Registers"];
/// Names of registers that are kept in memory.
const SPILLED: [&str; 5] =
    ["Spilled VGPRs", "Spilled SGPRs", "Spills to memory", "Spill count", "Spill Count"];
/// Names of bytes of private memory.
const SCRATCH: [&str; 4] = ["Scratch size", "SLM Size", "Scratch Memory Size", "Private memory"];
/// Names of bytes of shared memory.
const SHARED: [&str; 3] = ["LDS size", "Shared Memory Size", "Shared memory"];
/// Names of subgroups that a processor runs at a time.
const OCCUPANCY: [&str; 3] = ["Subgroups per SIMD", "Max warps/SM", "Occupancy"];
/// Names of bytes of machine code.
const CODE: [&str; 3] = ["Code size", "Code Size", "Binary Size"];

impl Program {
    /// Returns the registers of an invocation.
    pub fn registers(&self) -> Option<f64> {
        self.first(&REGISTERS)
    }

    /// Returns the registers that are kept in memory.
    pub fn spilled(&self) -> Option<f64> {
        let all = self.statistics.iter().filter(|(name, _)| SPILLED.contains(&name.as_str()));
        all.map(|(_, value)| *value).reduce(|a, b| a + b)
    }

    /// Returns the bytes of private memory.
    pub fn scratch_bytes(&self) -> Option<f64> {
        self.first(&SCRATCH)
    }

    /// Returns the bytes of shared memory.
    pub fn shared_bytes(&self) -> Option<f64> {
        self.first(&SHARED)
    }

    /// Returns the subgroups that one processor runs at a time: a SIMD of AMD, an SM of NVIDIA.
    pub fn occupancy(&self) -> Option<f64> {
        self.first(&OCCUPANCY)
    }

    /// Returns the bytes of machine code.
    pub fn code_bytes(&self) -> Option<f64> {
        self.first(&CODE)
    }

    fn first(&self, names: &[&str]) -> Option<f64> {
        let value = |name: &&str| self.statistics.iter().find(|(of, _)| of == name);
        names.iter().find_map(value).map(|(_, value)| *value)
    }
}

/// The reports on all pipelines of a device.
pub(super) struct Reports {
    /// None on a device without the extension.
    loader: Option<khr::pipeline_executable_properties::Device>,
    made: Mutex<Vec<PipelineReport>>,
}

impl Reports {
    /// Returns an empty list for a device that does or does not describe its pipelines.
    pub fn new(loader: Option<khr::pipeline_executable_properties::Device>) -> Reports {
        Reports { loader, made: Mutex::default() }
    }

    /// Returns the flags with which a pipeline must be made.
    pub fn flags(&self) -> vk::PipelineCreateFlags {
        match self.loader {
            Some(_) => vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR,
            None => vk::PipelineCreateFlags::empty(),
        }
    }

    /// Takes the reports since the last call.
    pub fn take(&self) -> Vec<PipelineReport> {
        std::mem::take(&mut self.made.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Keeps a report on a new pipeline.
    ///
    /// # Errors
    /// The driver does not describe the pipeline.
    pub fn add(&self, pipeline: vk::Pipeline, name: &str, variant: &[(&str, u32)]) -> Result<()> {
        let report = PipelineReport {
            pipeline: name.to_owned(),
            variant: variant.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect(),
            programs: self.programs(pipeline, name)?,
        };
        self.made.lock().unwrap_or_else(PoisonError::into_inner).push(report);
        Ok(())
    }

    fn programs(&self, pipeline: vk::Pipeline, name: &str) -> Result<Vec<Program>> {
        let Some(loader) = &self.loader else { return Ok(vec![]) };
        let info = vk::PipelineInfoKHR::default().pipeline(pipeline);
        let programs = unsafe { loader.get_pipeline_executable_properties(&info) }
            .of_call("vkGetPipelineExecutablePropertiesKHR", name)?;
        let program = |(i, found): (u32, &vk::PipelineExecutablePropertiesKHR<'_>)| {
            let info = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline);
            let info = info.executable_index(i);
            let all = unsafe { loader.get_pipeline_executable_statistics(&info) }
                .of_call("vkGetPipelineExecutableStatisticsKHR", name)?;
            let text = |chars: std::result::Result<&std::ffi::CStr, _>| {
                chars.map_or_else(
                    |_: std::ffi::FromBytesUntilNulError| String::new(),
                    |text| text.to_string_lossy().into_owned(),
                )
            };
            Ok(Program {
                name: text(found.name_as_c_str()),
                subgroup_size: found.subgroup_size,
                statistics: all.iter().map(|s| (text(s.name_as_c_str()), number(s))).collect(),
            })
        };
        (0..).zip(&programs).map(program).collect()
    }
}

/// Returns the value of a statistic.
fn number(statistic: &vk::PipelineExecutableStatisticKHR<'_>) -> f64 {
    use vk::PipelineExecutableStatisticFormatKHR as Format;
    // SAFETY: the format says which member of the union the driver has written.
    unsafe {
        match statistic.format {
            Format::BOOL32 => f64::from(statistic.value.b32),
            Format::INT64 => statistic.value.i64 as f64,
            Format::UINT64 => statistic.value.u64 as f64,
            Format::FLOAT64 => statistic.value.f64,
            _ => f64::NAN,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_words_of_drivers_are_known() {
        let program = |all: &[(&str, f64)]| Program {
            name: "Compute Shader".to_owned(),
            subgroup_size: 64,
            statistics: all.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect(),
        };
        let amd = program(&[
            ("SGPRs", 128.0),
            ("VGPRs", 256.0),
            ("Spilled SGPRs", 2.0),
            ("Spilled VGPRs", 11.0),
            ("Code size", 47_000.0),
            ("LDS size", 512.0),
            ("Scratch size", 3072.0),
            ("Subgroups per SIMD", 4.0),
        ]);
        assert_eq!((amd.registers(), amd.spilled()), (Some(256.0), Some(13.0)));
        assert_eq!((amd.scratch_bytes(), amd.shared_bytes()), (Some(3072.0), Some(512.0)));
        assert_eq!((amd.occupancy(), amd.code_bytes()), (Some(4.0), Some(47_000.0)));
        let nvidia = program(&[("Number of GPRs", 40.0), ("SLM Size", 16.0), ("Code Size", 8.0)]);
        assert_eq!((nvidia.registers(), nvidia.spilled()), (Some(40.0), None));
        assert_eq!((nvidia.scratch_bytes(), nvidia.code_bytes()), (Some(16.0), Some(8.0)));
    }

    #[test]
    fn a_statistic_has_the_type_that_its_format_says() {
        use vk::PipelineExecutableStatisticFormatKHR as Format;
        let of = |format, value| {
            let all = vk::PipelineExecutableStatisticKHR::default();
            number(&vk::PipelineExecutableStatisticKHR { format, value, ..all })
        };
        let value = vk::PipelineExecutableStatisticValueKHR { i64: -3 };
        assert_eq!(of(Format::INT64, value), -3.0);
        assert_eq!(of(Format::UINT64, vk::PipelineExecutableStatisticValueKHR { u64: 7 }), 7.0);
        assert_eq!(of(Format::BOOL32, vk::PipelineExecutableStatisticValueKHR { b32: 1 }), 1.0);
        assert_eq!(of(Format::FLOAT64, vk::PipelineExecutableStatisticValueKHR { f64: 0.5 }), 0.5);
    }
}
