//! The host's records, and the interface that it expects of every shader.

use nimbus::gpu::Field;
use nimbus::layout::cull::KeptRecord;
use nimbus::layout::disc::DiscRecord;
use nimbus::layout::facet::{
    FacetRecord, LitRecord, RegionBoundsRecord, RegionRecord, RunRecord, SlopeRecord,
};
use nimbus::layout::frame::{CameraRecord, GridRecord, LightRecord};
use nimbus::layout::medium::MediumRecord;
use nimbus::layout::particle::{
    BoxRecord, DrawnRecord, GroupRecord, ModeRecord, ParticleRecord, PlacedRecord, TexturedRecord,
};
use nimbus::layout::relief::ReliefNodeRecord;
use nimbus::layout::roof;
use nimbus::layout::second::{BlockRecord, NodeRecord, PackedRecord, PairingRecord, SourceRecord};
use nimbus::layout::sky::SkyRecord;
use nimbus::layout::tiles::{RoundRecord, SplatRecord, SplatTextureRecord};
use nimbus::passes::{
    blobs, chunks, contract, cull, diffusion, facets, first, generate, grid, harmonics, haze,
    impostors, live, lod, morton, place, present, relief, scatter, second, sort, sprites, surfaces,
    terrain, texture, tiles, transmit, upsample,
};

/// A host record: GLSL's name of it, its fields, its size.
pub type Record = (&'static str, &'static [Field], usize);

/// All records of the host.
pub const RECORDS: [Record; 29] = [
    ("Particle", ParticleRecord::FIELDS, size_of::<ParticleRecord>()),
    ("Box", BoxRecord::FIELDS, size_of::<BoxRecord>()),
    ("Disc", DiscRecord::FIELDS, size_of::<DiscRecord>()),
    ("Mode", ModeRecord::FIELDS, size_of::<ModeRecord>()),
    ("Placed", PlacedRecord::FIELDS, size_of::<PlacedRecord>()),
    ("Group", GroupRecord::FIELDS, size_of::<GroupRecord>()),
    ("Textured", TexturedRecord::FIELDS, size_of::<TexturedRecord>()),
    ("Drawn", DrawnRecord::FIELDS, size_of::<DrawnRecord>()),
    ("Facet", FacetRecord::FIELDS, size_of::<FacetRecord>()),
    ("RegionBounds", RegionBoundsRecord::FIELDS, size_of::<RegionBoundsRecord>()),
    ("Run", RunRecord::FIELDS, size_of::<RunRecord>()),
    ("Lit", LitRecord::FIELDS, size_of::<LitRecord>()),
    ("Region", RegionRecord::FIELDS, size_of::<RegionRecord>()),
    ("Source", SourceRecord::FIELDS, size_of::<SourceRecord>()),
    ("Packed", PackedRecord::FIELDS, size_of::<PackedRecord>()),
    ("Node", NodeRecord::FIELDS, size_of::<NodeRecord>()),
    ("Block", BlockRecord::FIELDS, size_of::<BlockRecord>()),
    ("Pairing", PairingRecord::FIELDS, size_of::<PairingRecord>()),
    ("ReliefNode", ReliefNodeRecord::FIELDS, size_of::<ReliefNodeRecord>()),
    ("Light", LightRecord::FIELDS, size_of::<LightRecord>()),
    ("Medium", MediumRecord::FIELDS, size_of::<MediumRecord>()),
    ("Grid", GridRecord::FIELDS, size_of::<GridRecord>()),
    ("Kept", KeptRecord::FIELDS, size_of::<KeptRecord>()),
    ("Slope", SlopeRecord::FIELDS, size_of::<SlopeRecord>()),
    ("SplatTexture", SplatTextureRecord::FIELDS, size_of::<SplatTextureRecord>()),
    ("Splat", SplatRecord::FIELDS, size_of::<SplatRecord>()),
    ("Round", RoundRecord::FIELDS, size_of::<RoundRecord>()),
    ("Camera", CameraRecord::FIELDS, size_of::<CameraRecord>()),
    ("Sky", SkyRecord::FIELDS, size_of::<SkyRecord>()),
];

/// Every shader, the push constants that its pass writes, and the element of each of its buffers.
/// An element is a record's name or the bytes of a plain element. `T` stands for texels of four
/// words, `S` for those that it stores, `F` for texels of one float, `-` for a buffer that only the
/// other shader reads.
#[rustfmt::skip]
pub const INTERFACES: &[(&str, &[Field], &str)] = &[
    ("chunks.frag", chunks::Push::FIELDS, "T"),
    ("chunks.vert", &[], ""),
    ("chunks_order.comp", chunks::OrderPush::FIELDS, "8 Kept 8 16"),
    ("contract.comp", contract::Push::FIELDS, "Facet Light T T F F 8 Lit"),
    ("cull_scan.comp", cull::ScanPush::FIELDS, "4 Kept"),
    ("cull_test.comp", cull::TestPush::FIELDS, "T T 4 Drawn 8 4"),
    ("cull_write.comp", blobs::KeyPush::FIELDS, "T 8 4 8"),
    ("diffusion_bounce.comp", diffusion::BouncePush::FIELDS, "Light T 16 16"),
    ("diffusion_coarsen.comp", diffusion::PairPush::FIELDS, "16"),
    ("diffusion_cycle.comp", diffusion::CyclePush::FIELDS, "S S S S"),
    ("diffusion_faces.comp", diffusion::FacesPush::FIELDS, "Light T 16"),
    ("diffusion_flux.comp", diffusion::FluxPush::FIELDS, "F T 16"),
    ("diffusion_merge.comp", diffusion::MergePush::FIELDS, "T T 4 16 16"),
    ("diffusion_patches.comp", diffusion::PatchesPush::FIELDS, "T 16"),
    ("diffusion_restrict.comp", diffusion::PairPush::FIELDS, "T 16 T 16"),
    ("diffusion_seen.comp", diffusion::SeenPush::FIELDS, "Light T 16"),
    ("diffusion_solids.comp", diffusion::SolidsPush::FIELDS, "Facet Light 4 T 16"),
    ("diffusion_sources.comp", diffusion::SourcesPush::FIELDS, "Light T F 16"),
    ("diffusion_spread.comp", diffusion::SpreadPush::FIELDS, "T T 16"),
    ("diffusion_sweep.comp", diffusion::SweepPush::FIELDS, "T T T 16"),
    ("diffusion_system.comp", diffusion::SystemPush::FIELDS, "Light F T 16 16 16"),
    ("diffusion_toward.comp", diffusion::TowardPush::FIELDS, "T T 16"),
    ("facets.comp", facets::Push::FIELDS, "T T 4 Group F Facet"),
    ("facets_groups.comp", facets::Push::FIELDS, "T T 4 Group F Facet 4 Run 4"),
    ("facets_surfaces.comp", facets::SurfacesPush::FIELDS, "T 4 Facet"),
    ("facets_terrain.comp", facets::TerrainPush::FIELDS, "T Facet Facet"),
    ("first.comp", first::Push::FIELDS, "Facet Light 4 T F Lit"),
    ("first_tensor.comp", first::TensorPush::FIELDS, "Facet Light 4 T F Lit 4"),
    ("generate.comp", generate::Push::FIELDS, "Box 4 S 4"),
    ("grid_blur.comp", grid::BlurPush::FIELDS, "8 4 4"),
    ("grid_deposit.comp", grid::DepositPush::FIELDS, "T T 4"),
    ("grid_narrow.comp", grid::NarrowPush::FIELDS, "T T 4"),
    ("grid_turned.comp", grid::DepositPush::FIELDS, "T T 4"),
    ("grid_resolve.comp", grid::ResolvePush::FIELDS, "8 4"),
    ("grid_spread.comp", grid::SpreadPush::FIELDS, "8 4"),
    ("harmonics.comp", harmonics::Push::FIELDS, "T T S"),
    ("haze.comp", haze::Push::FIELDS, "Facet Lit Slope Sky Lit Slope 4 4"),
    ("impostors.frag", impostors::Push::FIELDS, "T"),
    ("impostors.vert", impostors::Push::FIELDS, ""),
    ("impostors_part.comp", impostors::PartPush::FIELDS, "8 4 8 8 T"),
    ("live.comp", live::Push::FIELDS, "Disc S"),
    ("lod_key.comp", lod::KeyPush::FIELDS, "T T 4 Textured 8"),
    ("lod_merge.comp", lod::MergePush::FIELDS, "8 T T 4 Group S S"),
    ("morton_key.comp", morton::KeyPush::FIELDS, "Facet RegionBounds 8"),
    ("morton_order.comp", morton::OrderPush::FIELDS, "8 4"),
    ("place.comp", place::Push::FIELDS, "T 4 Group Mode S"),
    ("present.frag", present::Push::FIELDS, "T T Sky"),
    ("present.vert", &[], ""),
    ("relief.comp", relief::Push::FIELDS, "Facet Light T ReliefNode 4"),
    ("scatter.comp", scatter::Push::FIELDS, "Facet Light 4 T F Lit Medium"),
    (
        "second_gather.comp",
        second::GatherPush::FIELDS,
        "Block Pairing 4 4 Facet T Light T T F F Node Lit 4 T 4",
    ),
    ("roof_arithmetic.comp", roof::ArithmeticPush::FIELDS, "4"),
    ("roof_atomics.comp", roof::AtomicsPush::FIELDS, "4"),
    ("roof_memory.comp", roof::MemoryPush::FIELDS, "16 16"),
    ("second_merge.comp", second::MergePush::FIELDS, "4 Node Source 16"),
    ("second_sources.comp", second::SourcesPush::FIELDS, "Facet Light 4 4 T 4 4 Source 16 Packed"),
    (
        "second_tensor.comp",
        second::GatherPush::FIELDS,
        "Block Pairing 4 4 Facet T Light T T F F Lit 4 4 T 4",
    ),
    ("sort_bases.comp", sort::DigitPush::FIELDS, "4 4"),
    ("sort_count.comp", sort::DigitPush::FIELDS, "4 8 4"),
    ("sort_key.comp", blobs::KeyPush::FIELDS, "T 4 Drawn 8"),
    ("sort_scan.comp", sort::DigitPush::FIELDS, "4 4"),
    ("sort_scatter.comp", sort::DigitPush::FIELDS, "4 8 4 8"),
    ("sort_spread.comp", sort::DigitPush::FIELDS, "4 4 4"),
    ("sort_sums.comp", sort::DigitPush::FIELDS, "4 4 4"),
    ("sprites.frag", sprites::Push::FIELDS, "- - - - - - - - T -"),
    ("sprites.vert", sprites::Push::FIELDS, "8 T T Lit 4 4 Drawn Textured - Slope"),
    ("surfaces.frag", surfaces::Push::FIELDS, "Region Lit"),
    ("surfaces.vert", surfaces::Push::FIELDS, "Region"),
    ("terrain.frag", terrain::Push::FIELDS, ""),
    ("terrain.vert", terrain::Push::FIELDS, "Region Facet Lit"),
    ("texture_pack.comp", texture::PackPush::FIELDS, "F 16"),
    ("texture_transform.comp", texture::TransformPush::FIELDS, "8"),
    ("tiles.comp", tiles::Push::FIELDS, "T 8 Round 16 16 4"),
    ("tiles_clear.comp", tiles::ClearPush::FIELDS, "Round 16"),
    ("tiles_pairs.comp", tiles::PairsPush::FIELDS, "8 4 4 Round 8 T Kept"),
    ("tiles_ranges.comp", tiles::RangesPush::FIELDS, "8 Round 16"),
    ("tiles_rounds.comp", tiles::RoundsPush::FIELDS, "4 Round Kept"),
    (
        "tiles_splat.comp",
        tiles::SplatPush::FIELDS,
        "8 T T T 4 4 Drawn Textured S 8 4 4 S Kept S Slope S",
    ),
    ("transmit.comp", transmit::Push::FIELDS, "Facet Light T F 4 4 4"),
    ("upsample.comp", upsample::Push::FIELDS, "T 4"),
];
