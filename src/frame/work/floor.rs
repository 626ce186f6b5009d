//! The table of floors: bytes and operations of each pass, from the amounts of a frame.
//!
//! *Bytes* are the fields of records that the pass's law reads, once each, and the fields that it
//! writes, once each: what any implementation with this input and output moves. Padding, scratch
//! memory, records that only name a group, and data that is read again do not count. Colours of
//! clouds' particles are constant in most scenes and do not count either.
//!
//! *Operations* are those of the law in 32-bit floats, each of +, −, ×, ÷, √ and each function as
//! one, a multiply-add as two. Integers, comparisons and random numbers do not count. Where the
//! number of terms depends on data that the host does not know, the least possible number counts.
//!
//! Both are lower bounds, so that time at the roof is a lower bound, too.

use super::amounts::Amounts;
use crate::frame::plan::Pass;

/// The least work of a pass in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Work {
    /// Bytes that are read or written.
    pub bytes: f64,
    /// Operations on 32-bit floats.
    pub operations: f64,
}

/// A position, a normal or a colour.
const VECTOR: f64 = 12.0;
/// A number: σ, κ, an area, a transmittance, an index.
const NUMBER: f64 = 4.0;
/// A texel of the pool of textures.
const TEXEL: f64 = 16.0;

/// A position and its σ.
const PLACED: f64 = VECTOR + NUMBER;
/// A facet: position, normal and area.
const FACET: f64 = 2.0 * VECTOR + NUMBER;
/// Directions in which `facets` samples the density about a particle.
const SHELL: f64 = 14.0;
/// Operations of a trilinear sample: seven interpolations of a multiply-add.
const TRILINEAR: f64 = 14.0;

/// Returns the least work of a pass in a frame with the given amounts; `None` where nothing is
/// known of it.
pub fn floor(pass: Pass, of: &Amounts) -> Option<Work> {
    let work = |bytes: f64, operations: f64| Some(Work { bytes, operations });
    let n = of.particles;
    match pass {
        // Writes position and σ. Three offsets and the radius are scaled and shifted.
        Pass::Generate => work(of.box_particles * PLACED, of.box_particles * 8.0),
        // Writes position, σ and κ. By the host: they are copied. Else the position is a sum of a
        // drift, two places on discs and a rise (14), σ takes 4 and κ 4.
        Pass::Live if of.is_moved_by_host => work(2.0 * of.live_particles * (PLACED + NUMBER), 0.0),
        Pass::Live => work(of.live_particles * (PLACED + NUMBER), of.live_particles * 22.0),
        // Reads and writes position and σ. The offset takes 3; each wave of a gust a dot product
        // (5), its phase and sine (2), and three multiply-adds (6).
        Pass::Place if of.is_moved_by_host => work(2.0 * n * PLACED, 0.0),
        Pass::Place => work(2.0 * n * PLACED, 3.0 * n + 13.0 * of.waves),
        // Reads position, κ and coefficients, writes a colour. A direction takes 8, a harmonic's
        // value 2 at least, and its three channels a multiply-add each.
        Pass::Harmonics => {
            let of_coefficients = 3.0 * of.harmonics * NUMBER;
            let n = of.colored_particles;
            work(n * (2.0 * VECTOR + NUMBER) + of_coefficients, 8.0 * n + 8.0 * of.harmonics)
        }
        // Reads and writes position, σ, κ and colour. A mean takes a multiply-add for each of eight
        // numbers, and mass and spread 9.
        Pass::Lod => work(2.0 * n * (PLACED + NUMBER + VECTOR), 25.0 * n),
        // Reads position, σ and κ, writes the cells. Each cell that a blob reaches is the sum of
        // the products of a row's weight and its own: a multiply-add.
        Pass::Grid => work(n * (PLACED + NUMBER) + of.cells * NUMBER, 2.0 * of.deposits),
        // Reads positions, writes the order. Three coordinates are shifted and scaled.
        Pass::Morton => work(n * (VECTOR + NUMBER), 6.0 * n),
        Pass::Facets => Some(facets(of)),
        Pass::Transmit => Some(transmit(of)),
        Pass::First => Some(first(of)),
        // Reads the density, writes φ and the flux along each axis. A cycle solves each cell's
        // equation three times and forms what is left once: six neighbours of three channels, a
        // multiply-add each, and a quotient. A way of a bounce takes a depth, an
        // exponent and a share (6 operations) in each cell, and three multiply-adds.
        Pass::Diffusion => {
            let of_cycle = 4.0 * (6.0 * 3.0 * 2.0 + 3.0);
            let sums = of.cells * of.cycles * of_cycle + 12.0 * of.gathered;
            work(of.cells * (NUMBER + 4.0 * VECTOR), sums)
        }
        // As "first"; a light takes three exponents and a phase function (8), too.
        Pass::Scatter => work(
            of.facets * (VECTOR + NUMBER * of.lights + 2.0 * VECTOR),
            of.facets * (19.0 * of.lights + 6.0),
        ),
        // With lobes, a frame in which only the eye moves gathers for some receivers alone.
        Pass::Second if of.is_glossy => None,
        Pass::Second => Some(second(of)),
        // Reads the tensors, writes both reflections. A number times a colour is added up.
        Pass::Contract => of
            .tensor_numbers
            .and_then(|numbers| work(numbers * NUMBER + of.facets * 2.0 * VECTOR, 6.0 * numbers)),
        // Reads position and light, writes the light. The way through two layers of air takes an
        // exponent and a quotient each (6), and a channel of the dome three exponents, a root and
        // 12 more operations, and of the air 6.
        Pass::Haze => work(of.facets * 3.0 * VECTOR, of.facets * (20.0 + 3.0 * 24.0)),
        // Reads position, σ and κ of the drawn particles, writes key and index of the kept ones.
        // Three dot products with the camera's axes.
        Pass::Cull => {
            let bytes = of.drawn * (PLACED + NUMBER) + of.kept * (NUMBER + of.key_bytes);
            work(bytes, 15.0 * of.drawn)
        }
        // Writes the order. Reads the entries of `cull`, or positions, whose depth is a dot
        // product.
        Pass::Sort if of.culls => work(of.kept * (of.key_bytes + 2.0 * NUMBER), 0.0),
        Pass::Sort => work(of.kept * (VECTOR + NUMBER), 5.0 * of.kept),
        // Writes the pool. The transforms that fill it do not count.
        Pass::Texture => work(of.texels * TEXEL, 0.0),
        // The pixels that solids cover are known to the device alone, and so are the triangles that
        // ways pass.
        Pass::Surfaces | Pass::Terrain | Pass::Impostors | Pass::Relief => None,
        Pass::Sprites | Pass::Tiles => of.blobs.map(|blobs| Work {
            // Reads index, position, σ, κ and radiance of each blob, writes the pixels. Over solids
            // sprites write those alone that blobs cover.
            bytes: of.kept * (NUMBER + PLACED + NUMBER + VECTOR)
                + match pass == Pass::Sprites && of.has_solids {
                    true => 0.0,
                    false => blobs.pixels * of.pixel_bytes,
                },
            // A layer's exponent is a quadratic of two slopes over the ray's length (6). Then
            // follow a power of two, the optical depth, 1 − e^−τ (2), the product with what passes
            // (1), alpha (1), three channels (6) and what passes on (1).
            operations: LAYER * blobs.layers,
        }),
        // Reads the smaller picture, writes the full one: four channels from four pixels.
        Pass::Upsample => of.blobs.and_then(|blobs| {
            let pixels = blobs.pixels + of.film_pixels;
            work(pixels * of.pixel_bytes, 24.0 * of.film_pixels)
        }),
    }
}

/// Operations of a blob in a pixel.
const LAYER: f64 = 19.0;

/// `facets`: a cloud's facet samples the density in [`SHELL`] directions. A sample is placed (6),
/// interpolated, and added to sum and gradient (4). The grid's cells do not count: how many are
/// read follows from the particles' places.
fn facets(of: &Amounts) -> Work {
    let solid = of.facets - of.cloud_facets;
    // A facet for several particles takes their weighted sums, and each learns its facet.
    let members = if of.is_grouped { of.particles * 2.0 * NUMBER } else { 0.0 };
    Work {
        bytes: of.lit_particles * (PLACED + NUMBER)
            + members
            + of.cloud_facets * FACET
            + solid * FACET,
        operations: match of.is_medium {
            // They lie at the particles' places.
            true => 0.0,
            false => of.cloud_facets * SHELL * (6.0 + TRILINEAR + 4.0),
        },
    }
}

/// `transmit`: reads positions, writes a number for each light, twice with a second reflection.
/// A sample of a march is a place (6), an interpolation, and a multiply-add.
fn transmit(of: &Amounts) -> Work {
    let written = if of.has_second { 2.0 * NUMBER } else { NUMBER };
    Work {
        bytes: of.facets * (VECTOR + written * of.lights),
        operations: of.march_samples * (6.0 + TRILINEAR + 2.0),
    }
}

/// `first`: reads normals and transmittances, writes irradiance and radiance. A light takes a
/// cosine (5) and three multiply-adds (6); the material three products twice.
fn first(of: &Amounts) -> Work {
    Work {
        bytes: of.facets * (VECTOR + NUMBER * of.lights + 2.0 * VECTOR),
        operations: of.facets * (11.0 * of.lights + 6.0),
    }
}

/// `second`: reads facets and the light that they got, writes irradiance and radiance. A pair is
/// an offset (3), its square (5), two cosines (10), a form factor (4) and three multiply-adds (6).
fn second(of: &Amounts) -> Work {
    Work {
        bytes: of.facets * (FACET + NUMBER * of.lights + 2.0 * VECTOR),
        operations: 28.0 * of.pairs,
    }
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
