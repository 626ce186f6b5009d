//! T1 of the pass first against its reference.

use super::*;

/// All inputs of T1, in f32 numbers on both sides: facets of a glossy and of a diffuse region, a
/// sun and the sky.
fn responses(gpu: &mut Gpu, compiler: Option<&Compiler>) -> [Vec<f64>; 3] {
    const N: u32 = 3000;
    let mut r = Random(9);
    let double = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let basis = Basis::new([1.0, 64.0], 6, Sampling::Log);
    let table: Vec<f32> = basis.vectors().iter().flatten().map(|v| *v as f32).collect();
    let tables: Vec<Vec<f64>> =
        table.chunks(N_NODES).map(|v| v.iter().map(|v| f64::from(*v)).collect()).collect();
    let toward = r.direction();
    let sky = Light::even_sky(DVec3::ONE, 0.25);
    let lights = [Light::Directional { direction: -double(toward), irradiance: DVec3::ONE }, sky];
    let eye = [0.5, 1.5, -0.25];
    let n_vectors = tables.len() as u32;
    let region = |i_lobe, i_first_facet, i_row| RegionRecord {
        i_lobe,
        i_first_facet,
        i_row,
        n_facets: N,
        ..RegionRecord::default()
    };
    let regions = [region(0, 0, 0), region(NO_LOBE, N, N * (1 + n_vectors))];
    let facets: Vec<FacetRecord> = (0..2 * N)
        .map(|j| FacetRecord {
            position: [0; 3].map(|_| r.within(-4.0, 4.0)),
            normal: r.direction(),
            i_region: j / N,
            ..FacetRecord::default()
        })
        .collect();
    let shares: Vec<f32> = (0..4 * N).map(|_| r.within(0.0, 1.0)).collect();
    let n_rows = N * (2 + n_vectors);
    let pass =
        FirstTensor::new(&gpu.device, compiler.unwrap_or(&gpu.compiler)).expect("first.tensor");
    let buffers = [
        gpu.upload(&facets),
        gpu.upload(&lights.map(|l| LightRecord::new(&l, DVec3::ZERO))),
        gpu.upload(&shares),
        gpu.upload(&regions),
        gpu.upload(&table),
        gpu.buffer::<f32>(2 * n_rows as usize),
        gpu.buffer::<LitRecord>(2 * N as usize),
    ];
    let push = TensorPush {
        eye,
        n_facets: 2 * N,
        n_lights: 2,
        n_bases: 1 + n_vectors,
        n_rows,
        i_vectors: 0,
    };
    let [facet_records, light_records, transmittance, region_records, table, t1, lit] =
        buffers.each_ref();
    let named = FirstBuffers {
        facets: facet_records,
        lights: light_records,
        transmittance,
        regions: region_records,
        table,
        lit,
    };
    gpu.run(|rec| pass.record(rec, &named, t1, &push));
    let values =
        gpu.download::<f32>(&buffers[5], 2 * n_rows as usize).into_iter().map(f64::from).collect();
    let (mut truths, mut bounds) = (vec![0.0; 2 * n_rows as usize], vec![0.0; 2 * n_rows as usize]);
    for (j, facet) in facets.iter().enumerate() {
        let (normal, region) = (double(facet.normal), regions[j / N as usize]);
        let outgoing = (double(eye) - double(facet.position)).normalize();
        // A few roundings could decide differently on which side the eye is.
        assert!(normal.dot(outgoing).abs() > 1e-6, "choose another seed");
        let of_region = &tables[..if region.i_lobe == NO_LOBE { 0 } else { tables.len() }];
        for (l, light) in lights.iter().enumerate() {
            let arrival = light.arrival(DVec3::ZERO);
            let g = light.share(normal, &arrival, f64::from(shares[2 * j + l]));
            let row = first::responses(light, g, normal, arrival.toward, outgoing, of_region);
            for (b, truth) in row.into_iter().enumerate() {
                let k = l * n_rows as usize
                    + (region.i_row + j as u32 - region.i_first_facet) as usize
                    + b * N as usize;
                // g: a cosine of three products, its share and sum, at most 1; then a product, or
                // the table's interpolation.
                let magnitude = if b == 0 { 1.0 } else { greatest(&tables[b - 1], RESPONSE) };
                (truths[k], bounds[k]) = (truth, RESPONSE * U * magnitude);
            }
        }
    }
    [values, truths, bounds]
}

/// Roundings of a number of T1.
const RESPONSE: f64 = 12.0;

#[test]
fn t1_is_what_the_reference_says() {
    let mut gpu = Gpu::new();
    let [values, truths, bounds] = responses(&mut gpu, None);
    assert_within_and_say("T1", &values, &truths, &bounds);
    for (from, to) in [
        ("shines && light.kind != LIGHT_SKY ? g : 0.0", "light.kind != LIGHT_SKY ? g : 0.0"),
        ("shines && light.kind != LIGHT_SKY ? g : 0.0", "shines ? g : 0.0"),
        ("row += region.n_facets", "row += 1u"),
        ("push.i_vectors + b", "push.i_vectors"),
        ("t1[row] = g * INV_PI", "t1[row] = g"),
        ("l * push.n_rows + region.i_row", "l * push.n_rows"),
    ] {
        let compiler = Gpu::wrong_compiler("first_tensor.comp", from, to);
        let [values, truths, bounds] = responses(&mut gpu, Some(&compiler));
        assert!(check_within(from, &values, &truths, &bounds).is_err(), "{from} as {to}");
    }
}
