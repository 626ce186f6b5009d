//! The record of a sky as the eye of a frame sees it.

use super::frame::CameraRecord;
use super::record;
use crate::model::sky::{SCALE_HEIGHTS_M, SUN_RADIUS, SkyView};

record! {
    /// A sky (model.md §19): colours are linear RGB, lengths metres. A to I are the dome's
    /// coefficients by channel.
    pub struct SkyRecord {
        /// The camera.
        camera: CameraRecord,
        /// A.
        a: [f32; 3],
        /// Height of the eye over the sea.
        height: f32,
        /// B.
        b: [f32; 3],
        /// Metres of a scene unit.
        unit: f32,
        /// C.
        c: [f32; 3],
        /// 1/factor of the scene's heights.
        flatness: f32,
        /// D.
        d: [f32; 3],
        /// Factor of the air's depth before things of the scene.
        haze: f32,
        /// E.
        e: [f32; 3],
        /// 1 with a plane at sea level.
        has_ground: u32,
        /// F.
        f: [f32; 3],
        /// 1/height over which molecules thin out.
        inv_molecules: f32,
        /// G.
        g: [f32; 3],
        /// 1/height over which the aerosol thins out.
        inv_aerosol: f32,
        /// H.
        h: [f32; 3],
        /// 1/angular radius of the sun.
        inv_sun: f32,
        /// I.
        i: [f32; 3],
        /// Padding.
        unused: f32,
        /// Factor of the dome's radiance.
        scale: [f32; 3],
        /// Padding.
        unused_a: f32,
        /// Unit vector toward the sun.
        toward_sun: [f32; 3],
        /// Padding.
        unused_b: f32,
        /// Radiance of the sun's disc.
        disc: [f32; 3],
        /// Padding.
        unused_c: f32,
        /// Vertical optical depth of the molecules.
        molecules: [f32; 3],
        /// Padding.
        unused_d: f32,
        /// Vertical optical depth of the aerosol.
        aerosol: [f32; 3],
        /// Padding.
        unused_e: f32,
        /// Radiance of the plane at sea level.
        ground: [f32; 3],
        /// Mean square of the slopes of the sea that it is; 0 of none.
        slopes: f32,
        /// Irradiance of the suns across their light.
        sun: [f32; 3],
        /// Padding.
        unused_f: f32,
    }
}

impl SkyRecord {
    /// Returns the record of a view and its camera.
    pub fn new(view: &SkyView, camera: CameraRecord) -> SkyRecord {
        let rgb = |v: glam::DVec3| v.as_vec3().to_array();
        let [a, b, c, d, e, f, g, h, i] = view.coefficients().map(rgb);
        let [molecules, aerosol] = view.vertical_depths().map(rgb);
        let [inv_molecules, inv_aerosol] = SCALE_HEIGHTS_M.map(|height| (1.0 / height) as f32);
        let settings = view.sky.settings();
        SkyRecord {
            camera,
            a,
            b,
            c,
            d,
            e,
            f,
            g,
            h,
            i,
            height: view.height_m as f32,
            unit: settings.metres_per_unit as f32,
            flatness: (1.0 / settings.exaggeration) as f32,
            haze: settings.haze as f32,
            has_ground: u32::from(view.ground.is_some()),
            inv_molecules,
            inv_aerosol,
            inv_sun: (1.0 / SUN_RADIUS) as f32,
            scale: rgb(view.scale()),
            toward_sun: rgb(view.toward_sun()),
            disc: rgb(view.disc),
            molecules,
            aerosol,
            ground: rgb(view.ground.unwrap_or_default()),
            slopes: view.sea.map_or(0.0, |sea| sea.slopes as f32),
            sun: rgb(view.sun),
            ..SkyRecord::default()
        }
    }
}
