//! The scene that a cloud is edited in: that of scenes/cubes-554.toml around a box file alone, or
//! any that has a cloud made from boxes.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use super::document::{Document, Touched};
use crate::error::{Error, Result};
use crate::io::{box_file, scene_file};
use crate::model::boxes::CloudBox;
use crate::model::cloud::{Cloud, CloudSource};
use crate::model::scene::Scene;

/// Film, light, sky, material, and how P's boxes are read.
const AROUND_A_FILE: &str = include_str!("../../../scenes/cubes-554.toml");

#[derive(Debug, Clone)]
pub struct Scenery {
    scene: Scene,
    /// The cloud that is edited.
    i_cloud: usize,
    /// Groups of the clouds before it.
    i_first_group: usize,
}

impl Scenery {
    /// For a box file alone, or none.
    pub fn plain() -> Result<Scenery> {
        let no_boxes = |_: &Path, _: &str| Ok(box_file::format(&[]));
        let loaded = scene_file::parse_beside(
            AROUND_A_FILE.to_owned(),
            Path::new("edited"),
            &[],
            None,
            &no_boxes,
        )?;
        Scenery::of(Scene { title: String::new(), ..loaded.scene })
    }

    /// Of a scene, the first of whose clouds that are made from boxes is edited.
    pub fn of(mut scene: Scene) -> Result<Scenery> {
        let is_of_boxes = |c: &Cloud| matches!(c.source, CloudSource::Boxes { .. });
        let i_cloud = scene.clouds.iter().position(is_of_boxes);
        let i_cloud =
            i_cloud.ok_or_else(|| Error::usage("the scene has no cloud made from boxes"))?;
        // Counts are what is edited: nothing deals them out anew.
        scene.draw.n_particles = 0;
        let i_first_group = scene.clouds[..i_cloud].iter().map(|c| c.n_groups() as usize).sum();
        Ok(Scenery { scene, i_cloud, i_first_group })
    }

    fn cloud(&self) -> &Cloud {
        &self.scene.clouds[self.i_cloud]
    }

    /// The scene's own boxes and seed.
    pub fn document(&self) -> Document {
        let boxes = match &self.cloud().source {
            CloudSource::Boxes { boxes, .. } => boxes.clone(),
            CloudSource::Particles(_) | CloudSource::Disc(_) | CloudSource::Animated(_) => vec![],
        };
        Document { boxes, seed: self.cloud().seed }
    }

    /// With the document's boxes and seed: what differs from that of another document is no more
    /// than these.
    pub fn scene(&self, document: &Document) -> Arc<Scene> {
        let mut scene = self.scene.clone();
        let cloud = &mut scene.clouds[self.i_cloud];
        if let CloudSource::Boxes { boxes, .. } = &mut cloud.source {
            boxes.clone_from(&document.boxes);
        }
        cloud.seed = document.seed;
        Arc::new(scene)
    }

    /// Numbers of the scene's groups whose particles are to be generated, as `Player::reshape` asks
    /// for them.
    pub fn groups(&self, touched: &Touched) -> Vec<usize> {
        touched.generate.iter().map(|i| self.i_first_group + i).collect()
    }

    /// Statuses of the edited cloud's particles, of those of all, in order.
    pub fn statuses<'a>(&self, boxes: &[CloudBox], all: &'a [u32]) -> &'a [u32] {
        let before: u64 = self.scene.clouds[..self.i_cloud].iter().map(Cloud::n_particles).sum();
        let n: u64 = boxes.iter().map(|b| u64::from(b.n_particles)).sum();
        all.get(before as usize..(before + n) as usize).unwrap_or_default()
    }

    /// Where the boxes' origin lies in the scene as it begins: what the editor shows of it lies
    /// around 0.
    pub fn origin(&self) -> DVec3 {
        self.cloud().origin_at(self.scene.time.start_s)
    }

    pub fn metres_per_unit(&self) -> f64 {
        self.scene.air.metres_per_unit
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::document;
    use super::*;
    use crate::model::scene::LightingMode;

    #[test]
    fn a_file_alone_is_drawn_as_the_papers_cloud_is() {
        let scenery = Scenery::plain().unwrap();
        assert!(scenery.document().boxes.is_empty());
        let boxes = box_file::read(Path::new("scenes/cubes-554.dat")).unwrap();
        let scene = scenery.scene(&Document { boxes, seed: 9 });
        let whole = scene_file::load(Path::new("scenes/cubes-554.toml"), &[], None).unwrap().scene;
        assert_eq!(*scene, Scene { title: String::new(), ..whole });
    }

    #[test]
    fn a_scene_without_boxes_or_particles_is_a_scene() {
        let scenery = Scenery::plain().unwrap();
        let empty = scenery.scene(&document(0));
        assert_eq!((empty.n_particles(), empty.groups().len()), (0, 0));
        assert_ne!(empty.lighting.mode, LightingMode::None);
    }

    #[test]
    fn the_first_cloud_of_boxes_is_edited_and_all_else_stays() {
        let text = "[[cloud]]\nfrom = 'disc'\nparticles = 7\n[[cloud]]\nfrom = 'boxes'\nfile = \
            'a.dat'\nposition = [1, 2, 3]\n\
                    form = 'printed'\n[[cloud]]\nfrom = 'boxes'\nfile = 'a.dat'\n";
        let files = |_: &Path, _: &str| Ok(box_file::format(&document(2).boxes));
        let loaded =
            scene_file::parse_beside(text.to_owned(), Path::new("s.toml"), &[], Some(5), &files)
                .unwrap();
        let scenery = Scenery::of(loaded.scene.clone()).unwrap();
        assert_eq!((scenery.document().boxes, scenery.document().seed), (document(2).boxes, 6));
        assert_eq!(scenery.origin(), DVec3::new(1.0, 2.0, 3.0));
        let (old, new) = (scenery.document(), Document { seed: 6, ..document(4) });
        let scene = scenery.scene(&new);
        assert_eq!(scene.clouds[1].n_groups(), 4);
        assert_eq!(
            (&scene.clouds[0], &scene.clouds[2]),
            (&loaded.scene.clouds[0], &loaded.scene.clouds[2])
        );
        // One group of the disc before.
        assert_eq!(scenery.groups(&Touched::between(&old, &new)), [3, 4]);
        let all: Vec<u32> = (0..200).collect();
        assert_eq!(
            scenery.statuses(&new.boxes, &all),
            (7..7 + 10 + 11 + 12 + 13).collect::<Vec<u32>>()
        );
        assert!(scenery.statuses(&new.boxes, &all[..20]).is_empty());
        let without = Scene { clouds: loaded.scene.clouds[..1].to_vec(), ..loaded.scene };
        assert!(Scenery::of(without).is_err());
    }
}
