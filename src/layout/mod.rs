//! The f32 records that shaders read, made from the f64 model. A test reflects every shader and
//! compares names, offsets and sizes with the declarations here.

pub mod cull;
pub mod diffusion;
pub mod disc;
pub mod facet;
pub mod frame;
pub mod harmonics;
pub mod medium;
pub mod particle;
pub mod relief;
pub mod roof;
pub mod second;
pub mod sky;
pub mod sums;
pub mod tiles;

/// Declares a `repr(C)` record and lists its fields as (name, offset, bytes), for comparison with
/// what the shaders declare.
#[macro_export]
#[doc(hidden)]
macro_rules! __record {
    (
        $(#[$about:meta])*
        $vis:vis struct $name:ident { $($(#[$doc:meta])* $field:ident: $type:ty),* $(,)? }
    ) => {
        $(#[$about])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Pod, bytemuck::Zeroable)]
        $vis struct $name { $($(#[$doc])* pub $field: $type),* }

        impl $name {
            /// (name, offset, bytes) of every field in order.
            pub const FIELDS: &'static [(&'static str, usize, usize)] = &[
                $((stringify!($field), std::mem::offset_of!($name, $field), size_of::<$type>())),*
            ];
        }
    };
}

pub use __record as record;
