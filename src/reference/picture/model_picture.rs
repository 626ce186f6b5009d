//! Pictures in the model's own light ([`crate::reference::picture::model_light`]), sample by sample.

use glam::DVec3;

use crate::error::Result;
use crate::model::scene::{LightingMode, Scene};
use crate::model::surface::Surface;
use crate::reference::area::mean::each;
use crate::reference::picture::kind::{Drawn, Sample, of_scene_light, volume};
use crate::reference::picture::model_light::{Doubt, Lit, Met, ModelLight};
use crate::reference::picture::pixels::Pixels;
use crate::reference::picture::stages::FrameReference;
use crate::reference::picture::whole::{self, Drawing, Listener, Work};
use crate::reference::sprites::{OpaquePixel, View};
use crate::reference::surfaces;
use crate::reference::volume::{Pixel, Volume};

/// One picture of `scene`, through the centres of `pixels`. `n`: reflections, where they are not
/// the scene's. `by_facet`: surfaces are lit where the scene has facets, and between them as it is
/// drawn; else at every pixel.
pub(crate) fn of_model(
    scene: &Scene,
    time_s: f64,
    n: Option<u32>,
    by_facet: bool,
    pixels: &Pixels,
    listener: Listener,
) -> Result<Drawn> {
    let truth = FrameReference::unlit(scene, time_s)?;
    if scene.lighting.mode == LightingMode::None {
        return Ok(of_scene_light(
            scene,
            &truth,
            Drawing::Volume,
            pixels,
            Sample::CENTER,
            listener,
        ));
    }
    let met = Met::of(scene, &truth);
    let model = Model {
        scene,
        truth: &truth,
        met: &met,
        light: ModelLight::new(scene, &met, &truth, n),
        by_facet,
    };
    let discs = model.discs(0, pixels, listener);
    Ok(model.draw(&discs, pixels, Sample::CENTER, listener))
}

/// A scene, and the light in it.
pub(crate) struct Model<'a> {
    pub scene: &'a Scene,
    pub truth: &'a FrameReference,
    pub met: &'a Met,
    pub light: ModelLight<'a>,
    /// See [`of_model`].
    pub by_facet: bool,
}

impl Model<'_> {
    /// The discs' light in a sample; in every sample the same where nothing of it is random.
    pub fn discs(&self, i_sample: u32, pixels: &Pixels, listener: Listener) -> Vec<Lit> {
        let n_parts = self.n_parts(pixels);
        each(self.met.n_discs(), |i| {
            let lit = self.light.of_disc(i, i_sample);
            listener(Work::Lighting, n_parts);
            lit
        })
    }

    /// Points of surfaces that are lit where they have facets.
    fn facets(&self) -> Vec<(usize, DVec3)> {
        if !self.by_facet {
            return Vec::new();
        }
        let of = |(i, s): (usize, &Surface)| {
            let centers: Vec<_> =
                (0..s.n_facets() as u32).map(|k| (i, s.facet_center(k))).collect();
            centers
        };
        self.met.surfaces.iter().enumerate().flat_map(of).collect()
    }

    /// What is lit, one by one.
    fn n_parts(&self, pixels: &Pixels) -> usize {
        let n_surfaces = if self.by_facet { self.facets().len() } else { pixels.at.len() };
        self.met.n_discs() + n_surfaces
    }

    /// The picture of one sample, whose discs are lit so.
    pub fn draw(
        &self,
        discs: &[Lit],
        pixels: &Pixels,
        sample: Sample,
        listener: Listener,
    ) -> Drawn {
        let view = View { shift: sample.shift, ..whole::view(self.scene, self.truth) };
        let (n_discs, n_parts) = (self.met.n_discs(), self.n_parts(pixels));
        let heard = |lit| {
            listener(Work::Lighting, n_parts);
            lit
        };
        let behind = match self.by_facet {
            true => {
                let facets = self.facets();
                let lit = |k: usize| {
                    self.light.of_surface(facets[k].0, facets[k].1, n_discs + k, sample.i)
                };
                let lit: Vec<Lit> = each(facets.len(), |k| heard(lit(k)));
                between(&view, &self.met.surfaces, &lit, pixels)
            }
            false => each(pixels.at.len(), |k| {
                let (behind, lit) =
                    self.seen(&view, pixels.at[k], n_discs + pixels.number(k), sample.i);
                (behind, heard(lit).doubt)
            }),
        };
        let (ground, discs) = discs.split_at(self.met.n_ground());
        let behind = self.over(behind, &view, ground, pixels);
        let radiance: Vec<DVec3> = discs.iter().map(|lit| lit.radiance).collect();
        let of_discs = Doubt::mean(discs.iter().map(|lit| lit.doubt));
        let places: Vec<OpaquePixel> = behind.iter().map(|(b, _)| *b).collect();
        let found =
            volume(&Volume::new(&view, &self.truth.blobs, &radiance), pixels, &places, listener);
        // Of a surface or ground all may show, of particles as much as they hold back.
        let doubt = |(p, (behind, doubt)): (&Pixel, &(OpaquePixel, Doubt))| {
            let through = if behind.color[3] > 0.0 { 1.0 } else { 0.0 };
            let of_volume = Doubt { quadrature: p.error, chance: 0.0 };
            of_volume + *doubt * through + of_discs * p.color[3]
        };
        let doubts = found.iter().zip(&behind).map(doubt).collect();
        Drawn { rgba: found.into_iter().map(|p| p.color).collect(), doubts }
    }

    /// The surface in a pixel and its light; black from behind.
    fn seen(
        &self,
        view: &View,
        [i, j]: [u32; 2],
        number: usize,
        i_sample: u32,
    ) -> (OpaquePixel, Lit) {
        const DARK: Lit =
            Lit { radiance: DVec3::ZERO, doubt: Doubt { quadrature: 0.0, chance: 0.0 } };
        let ray = view.ray(i, j);
        let Some((i_surface, hit)) = surfaces::seen(view, &self.met.surfaces, ray) else {
            return (OpaquePixel::EMPTY, DARK);
        };
        let lit = match hit.is_front {
            true => self.light.of_surface(
                i_surface,
                view.pose.position + hit.depth * ray,
                number,
                i_sample,
            ),
            false => DARK,
        };
        (
            OpaquePixel {
                color: lit.radiance.extend(1.0).to_array(),
                depth: hit.depth,
                ..OpaquePixel::EMPTY
            },
            lit,
        )
    }

    /// `behind`, and over it what is nearer of the ground, as it is drawn from the light of its
    /// points.
    fn over(
        &self,
        behind: Vec<(OpaquePixel, Doubt)>,
        view: &View,
        ground: &[Lit],
        pixels: &Pixels,
    ) -> Vec<(OpaquePixel, Doubt)> {
        if ground.is_empty() {
            return behind;
        }
        let radiance: Vec<DVec3> = ground.iter().map(|lit| lit.radiance).collect();
        let doubt = Doubt::mean(ground.iter().map(|lit| lit.doubt));
        let mut picture = vec![OpaquePixel::EMPTY; pixels.tile.n_pixels()];
        whole::ground_over(
            (&mut picture, pixels.tile),
            self.scene,
            self.truth.setting.light_origin,
            view,
            &radiance,
        );
        let nearer = |(other, seen): ((OpaquePixel, Doubt), OpaquePixel)| {
            if seen.depth < other.0.depth { (seen, doubt) } else { other }
        };
        behind.into_iter().zip(pixels.pick_tile(&picture)).map(nearer).collect()
    }
}

/// The surfaces in the pixels as they are drawn from the light of their facets.
fn between(
    view: &View,
    placed: &[Surface],
    facets: &[Lit],
    pixels: &Pixels,
) -> Vec<(OpaquePixel, Doubt)> {
    let radiance: Vec<DVec3> = facets.iter().map(|lit| lit.radiance).collect();
    let doubt = Doubt::mean(facets.iter().map(|lit| lit.doubt));
    let seen = surfaces::render_at(view, placed, &radiance, pixels.at.iter().copied());
    seen.into_iter().map(|behind| (behind, doubt)).collect()
}
