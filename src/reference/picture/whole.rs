//! A whole frame's picture in f64, from the scene alone: by the thin sprites that nimbus draws, or
//! by the volume that they stand for.

use glam::{DVec2, DVec3};

use crate::error::{Error, Result};
use crate::model::cloud::Group;
use crate::model::count::MIN_DRAWN;
use crate::model::scene::{LightingMode, Scene};
use crate::model::surface::Surface;
use crate::model::terrain::Terrain;
use crate::reference::area::mean::each;
use crate::reference::picture::pixels::{Pixels, Tile};
use crate::reference::picture::stages::FrameReference;
use crate::reference::sprites::{Factor, OpaquePixel, Rounding, View};
use crate::reference::texture::{Pool, SplatTexture, Textured};
use crate::reference::threshold::{self, Omitted};
use crate::reference::volume::Volume;
use crate::reference::{Blob, count, place, sort, sprites, surfaces, terrain};

/// Which truth a picture is compared to (model.md §9).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drawing {
    /// Sorted thin sprites, as nimbus draws them.
    Thin,
    /// The integral over the overlapping blobs.
    Volume,
}

/// What takes time in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Work {
    /// The second reflection, facet by facet.
    Lighting,
    /// The volume, row by row.
    Drawing,
    /// Whole samples, of several.
    Sampling,
}

/// Hears how much of a piece of work there is each time that one more of it is done, from any
/// thread.
pub type Listener<'a> = &'a (dyn Fn(Work, usize) + Sync);

/// Premultiplied linear RGBA, row 0 the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    pub rgba: Vec<[f64; 4]>,
    /// Greatest error estimate of a pixel's radiance; of thin sprites none, whose only error is
    /// rounding.
    pub error: Option<f64>,
    /// Greatest magnitude of a particle's radiance: what the error is small against.
    pub brightest: f64,
    /// How many particles it shows, in view or not.
    pub n_particles: usize,
    /// Most that `draw.threshold` cuts of a pixel; of the volume, which knows none, nothing.
    pub cut: Omitted,
}

/// The scene at `time_s`.
pub fn picture(
    scene: &Scene,
    time_s: f64,
    drawing: Drawing,
    listener: Listener,
) -> Result<Picture> {
    check(scene, time_s, drawing)?;
    let truth = FrameReference::of_with_listener(scene, time_s, &|n| listener(Work::Lighting, n))?;
    Ok(draw(scene, &truth, drawing, listener))
}

/// `scene`, lit as `truth` has it.
pub(crate) fn draw(
    scene: &Scene,
    truth: &FrameReference,
    drawing: Drawing,
    listener: Listener,
) -> Picture {
    let radiance = truth.particle_radiance(scene);
    let view = view(scene, truth);
    let behind = behind(scene, truth, &view);
    let brightest = radiance.iter().map(|l| l.abs().max_element()).fold(0.0, f64::max);
    match drawing {
        Drawing::Thin => {
            let (blobs, order) = drawn(scene, truth);
            let (pool, sheets) = sheets(scene, truth, &view).unzip();
            let factor = |j: usize, delta: DVec2| match (&pool, &sheets) {
                (Some(pool), Some(sheets)) => sheets[j].factor(pool, delta),
                _ => 1.0,
            };
            let factor: Option<Factor> = if pool.is_some() { Some(&factor) } else { None };
            let none = Rounding::NONE;
            let (rgba, _) =
                sprites::render_textured(&view, &behind, &blobs, &radiance, &order, &none, factor);
            let cut = threshold::cut(&view, &behind, &blobs, factor)
                .into_iter()
                .fold(Omitted::default(), Omitted::most);
            Picture { rgba, error: None, brightest, n_particles: order.len(), cut }
        }
        Drawing::Volume => {
            let volume = Volume::new(&view, &truth.blobs, &radiance);
            let width = view.width as usize;
            let rows = each(view.height as usize, |j| {
                let row = volume.row(j as u32, &behind[j * width..][..width]);
                listener(Work::Drawing, view.height as usize);
                row
            });
            let pixels = rows.concat();
            let error = pixels.iter().map(|p| p.error).fold(0.0, f64::max);
            let rgba = pixels.into_iter().map(|p| p.color).collect();
            Picture {
                rgba,
                error: Some(error),
                brightest,
                n_particles: truth.blobs.len(),
                cut: Omitted::default(),
            }
        }
    }
}

/// Refuses what the references do not know.
pub(crate) fn check(scene: &Scene, time_s: f64, drawing: Drawing) -> Result<()> {
    let textured = scene.clouds.iter().position(|c| !c.texture.is_none());
    if let Some(i) = textured.filter(|_| drawing == Drawing::Volume) {
        return Err(Error::usage(format!(
            "cloud {i} is textured, and the volume knows plain blobs alone; expected --set \
             'cloud.{i}.texture=\"none\"'"
        )));
    }
    if scene.lighting.mode == LightingMode::None {
        return Ok(());
    }
    for (i, cloud) in scene.clouds.iter().enumerate().filter(|(_, c)| c.n_particles() > 0) {
        let material = &scene.materials[cloud.i_material];
        if material.at(time_s).ks != DVec3::ZERO {
            return Err(Error::usage(format!(
                "cloud {i}: its material \"{}\" has a lobe, and the f64 reference knows clouds \
                 that reflect diffusely alone; \
                 expected ks = [0, 0, 0]",
                material.name
            )));
        }
    }
    Ok(())
}

pub(crate) fn view(scene: &Scene, truth: &FrameReference) -> View {
    let setting = &truth.setting;
    let mut pose = setting.pose;
    pose.position -= setting.light_origin;
    View {
        width: scene.film.width,
        height: scene.film.height,
        pose,
        fov_y_rad: scene.camera.fov_y_rad,
        near: scene.camera.near,
        cutoff: scene.draw.cutoff,
        threshold: scene.draw.threshold.bound(),
        smallest: scene.draw.smallest.bound(),
        shift: DVec2::ZERO,
    }
}

/// [`behind`] at some pixels.
pub(crate) fn behind_at(
    scene: &Scene,
    truth: &FrameReference,
    view: &View,
    pixels: &Pixels,
) -> Vec<OpaquePixel> {
    let (placed, facets) = facets(scene, truth);
    if scene.terrains.is_empty() {
        return surfaces::render_at(view, &placed, &facets, pixels.at.iter().copied());
    }
    pixels.pick_tile(&behind_from(scene, truth, view, pixels.tile, (&placed, &facets)))
}

/// Surfaces and ground, a pixel each.
pub(crate) fn behind(scene: &Scene, truth: &FrameReference, view: &View) -> Vec<OpaquePixel> {
    let (placed, facets) = facets(scene, truth);
    behind_from(scene, truth, view, Tile::whole(view.width, view.height), (&placed, &facets))
}

fn behind_from(
    scene: &Scene,
    truth: &FrameReference,
    view: &View,
    tile: Tile,
    (placed, facets): (&[Surface], &[DVec3]),
) -> Vec<OpaquePixel> {
    let (of_surfaces, of_terrains) = facets.split_at(scene.n_surface_facets() as usize);
    let mut picture = surfaces::render_at(view, placed, of_surfaces, tile.pixels());
    ground_over((&mut picture, tile), scene, truth.setting.light_origin, view, of_terrains);
    picture
}

/// The surfaces relative to the lighting origin, and the radiance of their facets and of the
/// ground's points; where nothing is lit they show their materials' K_d, as particles show their
/// colours.
fn facets(scene: &Scene, truth: &FrameReference) -> (Vec<Surface>, Vec<DVec3>) {
    let origin = truth.setting.light_origin;
    let at_origin = |s: &Surface| Surface { center: s.center - origin, ..*s };
    let placed: Vec<Surface> = scene.surfaces.iter().map(at_origin).collect();
    let kd = |i_material: usize| scene.materials[i_material].at(scene.time.start_s).kd;
    let all = |(i_material, n): (usize, u64)| std::iter::repeat_n(kd(i_material), n as usize);
    let of_terrains = scene.terrains.iter().map(|t| (t.i_material, t.n_facets()));
    let facets: Vec<DVec3> = match scene.lighting.mode {
        LightingMode::None => placed
            .iter()
            .map(|s| (s.i_material, s.n_facets()))
            .chain(of_terrains)
            .flat_map(all)
            .collect(),
        _ => (0..scene.n_solid_facets() as usize).map(|i| truth.facet_radiance(i)).collect(),
    };
    (placed, facets)
}

/// Lays over `picture` what is nearer of the scene's ground; `radiance` by the points of all of it.
pub(crate) fn ground_over(
    (picture, tile): (&mut [OpaquePixel], Tile),
    scene: &Scene,
    origin: DVec3,
    view: &View,
    radiance: &[DVec3],
) {
    let window = [(tile.left, tile.left + tile.width), (tile.top, tile.top + tile.height)];
    let mut rest = radiance;
    for terrain in &scene.terrains {
        let (of, others) = rest.split_at(terrain.n_facets() as usize);
        let placed = Terrain { origin: terrain.origin - origin, ..terrain.clone() };
        terrain::render_over((&mut *picture, window), view, &placed, of);
        rest = others;
    }
}

/// The pool, and what every particle shows of it; nothing where the scene is plain.
pub(crate) fn sheets(
    scene: &Scene,
    truth: &FrameReference,
    view: &View,
) -> Option<(Pool, Vec<SplatTexture>)> {
    if !scene.is_textured() {
        return None;
    }
    let of_box = |(g, i_box): (&Group, u32)| {
        let cloud = &scene.clouds[g.i_cloud];
        let (i_field, strength) = cloud.texture.of_box(i_box);
        let of = Textured { i_field, strength, seed: cloud.seed, i_box };
        let first = g.i_first as usize;
        let blobs = &truth.blobs[first..first + g.n_particles as usize];
        let sheet = |(b, i): (&Blob, u32)| {
            let z = (b.position - view.pose.position).dot(view.pose.forward);
            SplatTexture::new(&of, i, z / b.sigma, view.pixel())
        };
        blobs.iter().zip(0u32..).map(sheet).collect::<Vec<SplatTexture>>()
    };
    let boxes = truth.groups.chunk_by(|a, b| a.i_cloud == b.i_cloud);
    let sheets = boxes.flat_map(|boxes| boxes.iter().zip(0u32..).flat_map(of_box)).collect();
    // As the device keeps it.
    Some((Pool::new(scene.draw.texture_seed).rounded(), sheets))
}

/// The blobs with κ as their clouds' distance asks for, and in which order those that are drawn
/// are: far to near by exact view depth, ties by index.
pub(crate) fn drawn(scene: &Scene, truth: &FrameReference) -> (Vec<Blob>, Vec<u32>) {
    let weights = weights(scene, truth);
    let weighed = |(b, w): (&Blob, &f64)| Blob { kappa: b.kappa * w, ..*b };
    let blobs: Vec<Blob> = truth.blobs.iter().zip(&weights).map(weighed).collect();
    let positions: Vec<DVec3> = blobs.iter().map(|b| b.position).collect();
    let depths = sort::depths(truth.setting.pose.forward, &positions);
    let mut order: Vec<u32> =
        (0..blobs.len() as u32).filter(|&i| weights[i as usize] > 0.0).collect();
    order.sort_by(|&i, &j| depths[j as usize].total_cmp(&depths[i as usize]));
    (blobs, order)
}

/// Factor on every particle's κ, model.md §3.
fn weights(scene: &Scene, truth: &FrameReference) -> Vec<f64> {
    let Some(rule) = scene.draw.count else { return vec![1.0; truth.blobs.len()] };
    let (setting, clouds) = (&truth.setting, &scene.clouds);
    let centers = place::cloud_centers(clouds, setting.time_s, DVec3::ZERO);
    let of_cloud = |(cloud, center): (_, &DVec3)| {
        let distance = (setting.pose.position - *center).length();
        count::printed(
            distance / rule.d0,
            place::scale(cloud, setting.time_s),
            rule.a,
            rule.normalised,
        )
    };
    let shares: Vec<f64> = clouds.iter().zip(&centers).map(of_cloud).collect();
    let of_group = |g: &Group| {
        let (n, share) = (g.n_particles, shares[g.i_cloud].min(1.0));
        let is_drawn = f64::from(n) * share >= MIN_DRAWN;
        if is_drawn { count::weights(n, share, rule.conserve) } else { vec![0.0; n as usize] }
    };
    truth.groups.iter().flat_map(of_group).collect()
}
