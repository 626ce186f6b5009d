//! Declarations of buffers: a buffer's name, record and count are written once, for its allocation
//! and for the check against the device's limits.

use bytemuck::Pod;

use super::buffer::{Buffer, MemoryUsage, storage_bytes, texel_bytes};
use super::device::Device;
use super::limits::Limits;
use super::reflect::BindingKind;
use crate::error::{Error, Result};

/// The declared size of a buffer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BufferSpec {
    /// Name, as `room.thing`.
    pub name: &'static str,
    /// Number of records.
    pub n: u64,
    /// Bytes of a record.
    pub record_bytes: u64,
    /// Buffers of this size that are allocated, staging included.
    pub n_copies: u64,
    /// The kind of texels that shaders read it by, if any; [`BindingKind::TexelStores`] if they
    /// read and store it by texels alone.
    pub texels: Option<BindingKind>,
}

impl BufferSpec {
    /// Returns the bytes of all copies.
    ///
    /// # Errors
    /// Fails if one of them exceeds a limit of the device.
    pub fn bytes(&self, limits: &Limits) -> Result<u64> {
        let BufferSpec { name, n, record_bytes, n_copies, texels } = *self;
        if texels == Some(BindingKind::TexelStores) {
            return Ok(texel_bytes(limits, name, n, record_bytes)? * n_copies);
        }
        let bytes = storage_bytes(limits, name, n, record_bytes)?;
        let each = texels.map_or(0, |kind| u64::from(kind.texel_bytes()));
        if each > 0 && n * record_bytes > limits.max_texel_buffer_bytes(each) {
            return Err(Error::limit(format!(
                "{name}: {} texels of {each} bytes are wanted, this device takes {} at most \
                 (maxTexelBufferElements)",
                n * record_bytes / each,
                limits.max_texels
            )));
        }
        Ok(bytes * n_copies)
    }
}

/// A kind of buffer that [`buffers!`](crate::gpu::buffers) can declare.
pub trait DeclaredBuffer: Sized {
    /// Buffers of the declared size that it consists of.
    const N_COPIES: u64;

    /// Allocates room for `n` records of type `T`, which shaders access by `texels`
    /// ([`BufferSpec::texels`]).
    ///
    /// # Errors
    /// Fails if the device cannot hold it.
    fn allocate<T: Pod>(
        device: &Device,
        name: &str,
        n: u64,
        texels: Option<BindingKind>,
    ) -> Result<Self>;
}

impl DeclaredBuffer for Buffer {
    const N_COPIES: u64 = 1;

    fn allocate<T: Pod>(
        device: &Device,
        name: &str,
        n: u64,
        texels: Option<BindingKind>,
    ) -> Result<Buffer> {
        match texels {
            Some(BindingKind::TexelStores) => {
                Buffer::of_texels::<T>(device, name, n, MemoryUsage::Device)
            }
            _ => Buffer::new::<T>(device, name, n, MemoryUsage::Device),
        }
    }
}

/// Declares a struct of buffers, each as `name: Kind => Record, count, "label";`.
///
/// The struct gets `new`, which allocates them, and `specs`, which lists their sizes. Both evaluate
/// the counts from the arguments that follow the struct's name. A fourth item, `Texels` or
/// `Floats`, names the kind of texels that shaders read a buffer by; `TexelStores` says that they
/// read and store it by texels alone.
#[macro_export]
#[doc(hidden)]
macro_rules! __buffers {
    ($(#[$about:meta])* $vis:vis struct $name:ident($($arg:ident: $Arg:ty),*) {
        $($(#[$doc:meta])*
        $field:ident: $Kind:ty => $Record:ty, $n:expr, $label:literal $(, $texels:ident)?;)*
    }) => {
        $(#[$about])*
        $vis struct $name { $($(#[$doc])* pub $field: $Kind),* }

        impl $name {
            /// Allocates the buffers.
            ///
            /// # Errors
            /// Fails if the device cannot hold one of them.
            #[allow(unused_variables)]
            pub fn new(
                device: &$crate::gpu::Device,
                $($arg: $Arg),*
            ) -> $crate::error::Result<$name> {
                use $crate::gpu::DeclaredBuffer;
                Ok($name {
                    $($field: <$Kind>::allocate::<$Record>(
                        device,
                        $label,
                        $n,
                        [$($crate::gpu::BindingKind::$texels)?].first().copied(),
                    )?),*
                })
            }

            /// Lists the sizes of the buffers.
            #[allow(dead_code, unused_variables)]
            pub fn specs($($arg: $Arg),*) -> Vec<$crate::gpu::BufferSpec> {
                vec![$($crate::gpu::BufferSpec {
                    name: $label,
                    n: $n,
                    record_bytes: size_of::<$Record>() as u64,
                    n_copies: <$Kind as $crate::gpu::DeclaredBuffer>::N_COPIES,
                    texels: [$($crate::gpu::BindingKind::$texels)?].first().copied(),
                }),*]
            }
        }
    };
}

pub use __buffers as buffers;
