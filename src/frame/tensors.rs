//! The light tensors of a scene whose materials are edited: pipelines, buffers and push constants.

use super::constants::FrameConstants;
use super::features::Tensors;
use super::gather_lists::gather_variant;
use super::packet::Packet;
use super::staging::{StagedBuffer, upload};
use super::tensor_shape::{Shape, basis_of, is_edited};
use crate::error::Result;
use crate::gpu::{Buffer, Commands, Compiler, Device, buffers};
use crate::layout::frame::LightRecord;
use crate::model::scene::Scene;
use crate::passes::contract::{self, Contract};
use crate::passes::first::{self, FirstTensor};
use crate::passes::second::{GatherPush, SecondTensor};

buffers! {
    /// The tensors and what sums them.
    pub(super) struct TensorBuffers(shape: &Shape, n_spans: u64) {
        t1: Buffer => f32, shape.n_first(), "first.t1";
        t2: Buffer => f32, shape.n_second().unwrap_or(u64::MAX), "second.t2";
        spans: Buffer => [u32; 2], n_spans, "contract.spans";
        coefficients: StagedBuffer => [f32; 4], shape.n_columns.into(), "contract.coefficients";
    }
}

/// The light tensors.
pub(super) struct LightTensors {
    pub first: FirstTensor,
    pub second: Option<SecondTensor>,
    pub contract: Contract,
    pub buffers: TensorBuffers,
    shape: Shape,
    /// First row of the basis' vectors in the table.
    i_vectors: u32,
}

impl LightTensors {
    /// Creates the tensors if materials are edited and the tensors fit into `free` bytes.
    pub fn new(
        device: &Device,
        compiler: &Compiler,
        commands: &mut Commands,
        scene: &Scene,
        free: u64,
    ) -> Result<(Tensors, Option<LightTensors>)> {
        if !is_edited(scene) {
            return Ok((Tensors::Needless, None));
        }
        let shape = Shape::new(scene, basis_of(scene).map_or(1, |b| b.n_bases()));
        let fit = shape.fits(device.limits(), free);
        if fit != Tensors::Kept {
            return Ok((fit, None));
        }
        let (n_bases, spans) = (shape.n_bases, shape.spans(scene));
        let buffers = TensorBuffers::new(device, &shape, spans.len() as u64)?;
        upload(device, commands, &spans, &buffers.spans)?;
        let variant = gather_variant(scene, device, false);
        let second = || SecondTensor::new(device, compiler, &variant, n_bases);
        let tensors = LightTensors {
            first: FirstTensor::new(device, compiler)?,
            second: shape.has_second.then(second).transpose()?,
            contract: Contract::new(device, compiler, n_bases, &scene.lighting.sums.into())?,
            buffers,
            shape,
            i_vectors: scene.materials.len() as u32,
        };
        Ok((fit, Some(tensors)))
    }

    /// Returns the push constants of T1.
    pub fn first_push(&self, packet: &Packet, c: &FrameConstants) -> first::TensorPush {
        first::TensorPush {
            eye: packet.camera.eye,
            n_facets: c.march.n_facets,
            n_lights: c.march.n_lights,
            n_bases: self.shape.n_bases,
            n_rows: self.shape.n_rows as u32,
            i_vectors: self.i_vectors,
        }
    }

    /// Returns the push constants of T2 for the light `i_light`, from those of a gather at once.
    pub fn second_push(&self, of: &GatherPush, i_light: u32, is_first_light: bool) -> GatherPush {
        GatherPush {
            i_light,
            i_vectors: self.i_vectors,
            n_rows: self.shape.n_rows as u32,
            n_columns: self.shape.n_columns,
            is_first_light: u32::from(is_first_light),
            ..*of
        }
    }

    /// Returns the push constants of the sums.
    pub fn contract_push(&self, c: &FrameConstants) -> contract::Push {
        contract::Push {
            n_facets: c.march.n_facets,
            n_lights: c.march.n_lights,
            n_rows: self.shape.n_rows as u32,
            n_columns: self.shape.n_columns,
        }
    }
}

/// Returns the indices of lights with energy: a dark light is not gathered.
pub(super) fn bright_lights(lights: &[LightRecord]) -> impl Iterator<Item = u32> {
    (0..).zip(lights).filter(|(_, light)| light.energy != [0.0; 3]).map(|(i, _)| i)
}
