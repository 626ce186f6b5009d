//! Air before facets, the mirror of a sea, and shadows of ground, at the ends of their ranges.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use glam::DVec3;

use super::case::{Case, Comparison};
use super::context::StressContext;
use crate::error::{Error, Result};
use crate::layout::facet::{FacetRecord, LitRecord, NO_LOBE, RegionRecord, SlopeRecord};
use crate::layout::frame::{CameraRecord, LightRecord};
use crate::layout::relief::ReliefNodeRecord;
use crate::layout::sky::SkyRecord;
use crate::model::cover::Sea;
use crate::model::light::Light;
use crate::model::material::Brdf;
use crate::model::sky::{Sky, SkySettings, SkyView};
use crate::model::terrain::Terrain;
use crate::passes::haze::{self, HazeBuffers, HazePass, HazeVariant};
use crate::passes::relief::{self, Relief, ReliefBuffers};
use crate::reference::haze::{rounding, seen};
use crate::reference::relief::Ground;

/// The cases of this file, in the order in which they run.
pub const CASES: &[Case] = &[
    Case {
        name: "skies/air",
        what: "air before facets 1 mm to 1000 km away, from the sea and from 10 km, in units of \
            1 um to 1000 km",
        bound: "1e-5 of what is added up",
        check: air,
    },
    Case {
        name: "skies/sea",
        what: "a calm and a stormy sea, sun and eye from the horizon to the zenith",
        bound: "that of the dome, 2.4e-7 over the height of the wave's vector",
        check: sea,
    },
    Case {
        name: "skies/ground",
        what: "shadows of hills with all lengths times 2^-40 to 2^40",
        bound: "exact, but for ways within 1e-3 of a triangle's side",
        check: ground,
    },
];

/// Returns a sky without its sun's disc, and the view of an eye.
fn view(settings: SkySettings, toward: DVec3, height_m: f64) -> Result<SkyView> {
    // The device has it in f32.
    let toward = toward.normalize().as_vec3().as_dvec3();
    let sky = Sky::new(settings, toward).map_err(|what| Error::Fault { what })?;
    let sun = Light::Directional { direction: -toward, irradiance: DVec3::new(3.0, 2.5, 2.0) };
    let eye = DVec3::Y * (settings.sea_level + height_m / settings.metres_per_unit);
    Ok(SkyView::new(&sky, eye, &[sun], &[], 0.0))
}

/// Returns the light of facets at places relative to the eye as the device sees it; `sea`: of what
/// slopes all of them are.
fn seen_by_device(
    ctx: &mut StressContext,
    view: &SkyView,
    places: &[[f32; 3]],
    slopes: Option<f32>,
) -> Result<Vec<[f32; 3]>> {
    let n = places.len();
    let has_sea = slopes.is_some();
    let variant = HazeVariant { has_slopes: false, has_sea, has_depths: false };
    let pass = HazePass::new(ctx.device(), ctx.compiler(), variant)?;
    let facet = |position: &[f32; 3]| FacetRecord { position: *position, ..Default::default() };
    let facets = ctx.upload(&places.iter().map(facet).collect::<Vec<_>>())?;
    let lit = ctx.upload(&vec![LitRecord { first: LIGHT, ..Default::default() }; n])?;
    let none = ctx.upload(&[SlopeRecord::default()])?;
    let sky = ctx.upload(&[SkyRecord::new(view, CameraRecord::default())])?;
    let hazed = ctx.buffer::<LitRecord>(n)?;
    let arriving = ctx.upload(&vec![1.0f32; n])?;
    let seas = ctx.upload(&[slopes.unwrap_or(0.0)])?;
    let buffers = HazeBuffers {
        facets: &facets,
        lit: &lit,
        slopes: &none,
        sky: &sky,
        hazed: &hazed,
        hazed_slopes: &none,
        arriving: &arriving,
        seas: &seas,
    };
    let push = haze::Push { n_facets: n as u32, n_lights: 1, i_sun: 0, n_solids: 1, backward: 1.0 };
    ctx.run(|rec| pass.record(rec, &buffers, &push))?;
    Ok(ctx.download::<LitRecord>(&hazed, n)?.iter().map(|l| l.first).collect())
}

/// Light of every facet.
const LIGHT: [f32; 3] = [0.5, 1.0, 2.0];

/// Compares the light of facets behind a sky's air.
fn compare(
    ctx: &mut StressContext,
    c: &mut Comparison,
    (view, places): (&SkyView, &[[f32; 3]]),
    sea: Option<Sea>,
    what: &str,
) -> Result<()> {
    let slopes = sea.map(|sea| sea.slopes as f32);
    let found = seen_by_device(ctx, view, places, slopes)?;
    let light = DVec3::from(LIGHT.map(f64::from));
    for (found, place) in found.iter().zip(places) {
        let offset = DVec3::from(place.map(f64::from));
        let sea = sea.map(|sea| (sea, 1.0));
        let (truth, _) = seen(view, offset, light, sea);
        let bound = rounding(view, offset, light, sea);
        for k in 0..3 {
            c.add(found[k], truth[k], bound[k], format_args!("{what}, {place:?}, channel {k}"));
        }
    }
    Ok(())
}

fn air(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let directions = [
        DVec3::Y,
        DVec3::NEG_Y,
        DVec3::X,
        DVec3::new(0.6, 1e-3, -0.8),
        DVec3::new(-0.6, -1e-3, 0.8),
        DVec3::new(-0.48, 0.6, 0.64),
    ];
    for (unit, turbidity, elevation, height_m, haze) in [
        (1.0, 2.0, 0.5, 0.0, 1.0),
        (1.0, 10.0, 0.0, 1e4, 1.0),
        (1e6, 1.0, 1.57, 0.0, 100.0),
        (1e-6, 3.0, 0.2, 2.0, 0.01),
    ] {
        let settings =
            SkySettings { metres_per_unit: unit, haze, ..SkySettings::of_turbidity(turbidity) };
        let (sin, cos) = f64::sin_cos(elevation);
        let view = view(settings, DVec3::new(0.28 * cos, sin, 0.96 * cos), height_m)?;
        let far = [1e-3, 1.0, 1e3, 1e6].map(|metres| metres / unit);
        let places: Vec<[f32; 3]> = directions
            .iter()
            .flat_map(|d| far.map(|far| (far * d.normalize()).as_vec3().to_array()))
            .collect();
        let what = format!("{unit:e} m a unit, turbidity {turbidity}");
        compare(ctx, c, (&view, &places), None, &what)?;
    }
    Ok(())
}

fn sea(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    for (slopes, elevation) in
        [(0.003f32, 1.2), (0.003, 0.02), (0.16, 0.02), (0.16, 1e-3), (0.03, FRAC_PI_2)]
    {
        let (sin, cos) = f64::sin_cos(elevation);
        let settings = SkySettings { haze: 0.0, ..SkySettings::of_turbidity(2.0) };
        let view = view(settings, DVec3::new(cos, sin, 0.0), 10.0)?;
        let places: Vec<[f32; 3]> = [1e-3, 0.02, 0.3, 1.2, FRAC_PI_2]
            .iter()
            .flat_map(|down: &f64| {
                let (sin, cos) = down.sin_cos();
                [0.0f64, 0.05, 1.5, 3.1].map(|azimuth| {
                    let level = DVec3::new(azimuth.cos(), 0.0, azimuth.sin());
                    (10.0 / sin * (cos * level - sin * DVec3::Y)).as_vec3().to_array()
                })
            })
            .collect();
        let sea = Sea { slopes: f64::from(slopes) };
        let what = format!("slopes {slopes}, sun at {elevation} rad");
        compare(ctx, c, (&view, &places), Some(sea), &what)?;
    }
    Ok(())
}

/// Hills a unit apart, in the unit's own digits.
fn hills() -> Vec<DVec3> {
    let height = |x: f64, z: f64| 2.0 * (0.7 * x).sin() * (0.5 * z + 0.3).cos();
    let place = |i: u32| {
        let (x, z) = (f64::from(i % 24) - 11.5, 8.5 - f64::from(i / 24));
        DVec3::new(x, height(x, z), z).as_vec3().as_dvec3()
    };
    (0..24 * 18).map(place).collect()
}

/// Share of a triangle's side within which rounding may decide.
const UNSURE: f64 = 1e-3;

fn ground(ctx: &mut StressContext, c: &mut Comparison) -> Result<()> {
    let light = |x: f64, y: f64, z: f64| {
        let direction = DVec3::new(x, y, z).normalize().as_vec3().as_dvec3();
        Light::Directional { direction, irradiance: DVec3::ONE }
    };
    let lights = [light(0.9, -0.25, 0.35), light(-0.5, -0.4, 0.8), light(0.1, -0.05, -1.0)];
    let one = Terrain { points: Arc::new(hills()), n: [24, 18], ..Terrain::default() };
    let truth = Ground::new(std::slice::from_ref(&one), DVec3::ZERO);
    let pass = Relief::new(ctx.device(), ctx.compiler())?;
    let brdf = Brdf { kd: DVec3::ONE, ks: DVec3::ZERO, ns: 1.0 };
    for power in [-40, -20, 0, 20, 40] {
        let by = 2f64.powi(power);
        let points = Arc::new(one.points.iter().map(|p| by * *p).collect());
        let terrain = Terrain { points, ..one.clone() };
        let n_points = terrain.n_facets() as u32;
        let region = RegionRecord::terrain(&terrain, DVec3::ZERO, &brdf, NO_LOBE, 0);
        let records: Vec<FacetRecord> =
            terrain.facets().map(|f| FacetRecord::terrain(&f, 0)).collect();
        let of_lights: Vec<LightRecord> =
            lights.iter().map(|l| LightRecord::new(l, DVec3::ZERO)).collect();
        let n_total = records.len() * lights.len();
        let (points, regions) = (ctx.upload(&records)?, ctx.upload(&[region])?);
        let of_lights = ctx.upload(&of_lights)?;
        let nodes = ctx.upload(&ReliefNodeRecord::of(std::slice::from_ref(&terrain)))?;
        let hidden = ctx.buffer::<u32>(n_total)?;
        let buffers = ReliefBuffers {
            ground: &points,
            lights: &of_lights,
            regions: &regions,
            nodes: &nodes,
            hidden: &hidden,
        };
        let push = relief::Push {
            n_points,
            n_lights: lights.len() as u32,
            n_grounds: 1,
            i_first_region: 0,
            i_first_ground: 0,
        };
        ctx.run(|rec| pass.record(rec, &buffers, &push))?;
        let found = ctx.download::<u32>(&hidden, n_total)?;
        let n_hidden = found.iter().filter(|found| **found == 1).count();
        let share = n_hidden as f64 / n_total as f64;
        c.holds((0.2..0.8).contains(&share), "some is hidden and some is not");
        let mut n_unsure = 0;
        for (k, found) in found.into_iter().enumerate() {
            let (i, light) = (k / lights.len(), &lights[k % lights.len()]);
            let hides = |slack| truth.hides(one.points[i], light, slack);
            let [must, may] = [-UNSURE, UNSURE].map(hides);
            n_unsure += usize::from(must != may);
            if must == may {
                let at = format_args!("lengths times 2^{power}, point {i}");
                c.exact(f64::from(found), if must { 1.0 } else { 0.0 }, at);
            }
        }
        c.holds(n_unsure * 20 < n_total, "few ways are left out");
    }
    Ok(())
}
