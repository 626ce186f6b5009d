//! The scene around the edited boxes: scenes/cubes-554.toml by default, or any scene with a cloud
//! made from boxes.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use super::document::Document;
use crate::error::{Error, Result};
use crate::io::{box_file, scene_file};
use crate::model::boxes::CloudBox;
use crate::model::cloud::{Cloud, CloudSource};
use crate::model::scene::Scene;

/// The default scene: film, light, sky, material, and the form of P's boxes.
const DEFAULT_SCENE: &str = include_str!("../../../scenes/cubes-554.toml");

/// A scene with one cloud that is edited.
#[derive(Debug, Clone)]
pub struct EditedScene {
    scene: Scene,
    /// Index of the edited cloud.
    i_cloud: usize,
    /// Number of particle groups of the clouds before it.
    i_first_group: usize,
}

impl EditedScene {
    /// Returns the default scene.
    ///
    /// # Errors
    /// The embedded scene file is not valid.
    pub fn default_scene() -> Result<EditedScene> {
        let no_boxes = |_: &Path, _: &str| Ok(box_file::format(&[]));
        let loaded = scene_file::parse_beside(
            DEFAULT_SCENE.to_owned(),
            Path::new("edited"),
            &[],
            None,
            &no_boxes,
        )?;
        EditedScene::new(Scene { title: String::new(), ..loaded.scene })
    }

    /// Selects the first cloud of `scene` that is made from boxes.
    ///
    /// # Errors
    /// No cloud is made from boxes.
    pub fn new(mut scene: Scene) -> Result<EditedScene> {
        let is_of_boxes = |c: &Cloud| matches!(c.source, CloudSource::Boxes { .. });
        let i_cloud = scene.clouds.iter().position(is_of_boxes);
        let i_cloud =
            i_cloud.ok_or_else(|| Error::usage("the scene has no cloud made from boxes"))?;
        // The boxes' own counts are edited, so a total must not redistribute them.
        scene.draw.n_particles = 0;
        let i_first_group = scene.clouds[..i_cloud].iter().map(|c| c.n_groups() as usize).sum();
        Ok(EditedScene { scene, i_cloud, i_first_group })
    }

    fn cloud(&self) -> &Cloud {
        &self.scene.clouds[self.i_cloud]
    }

    /// Returns the boxes and the seed of the scene file.
    pub fn document(&self) -> Document {
        let boxes = match &self.cloud().source {
            CloudSource::Boxes { boxes, .. } => boxes.clone(),
            CloudSource::Particles(_) | CloudSource::Disc(_) | CloudSource::Animated(_) => vec![],
        };
        Document { boxes, seed: self.cloud().seed }
    }

    /// Returns the scene with the document's boxes and seed.
    pub fn scene(&self, document: &Document) -> Arc<Scene> {
        let mut scene = self.scene.clone();
        let cloud = &mut scene.clouds[self.i_cloud];
        if let CloudSource::Boxes { boxes, .. } = &mut cloud.source {
            boxes.clone_from(&document.boxes);
        }
        cloud.seed = document.seed;
        Arc::new(scene)
    }

    /// Returns the particle groups of the given boxes, as `Player::reshape` takes them.
    pub fn groups(&self, boxes: &[usize]) -> Vec<usize> {
        boxes.iter().map(|i| self.i_first_group + i).collect()
    }

    /// Returns the statuses of the edited cloud's particles, given those of all particles.
    pub fn statuses<'a>(&self, boxes: &[CloudBox], all: &'a [u32]) -> &'a [u32] {
        let before: u64 = self.scene.clouds[..self.i_cloud].iter().map(Cloud::n_particles).sum();
        let n: u64 = boxes.iter().map(|b| u64::from(b.n_particles)).sum();
        all.get(before as usize..(before + n) as usize).unwrap_or_default()
    }

    /// Returns the place of the boxes' origin in the scene at its start. The editor shows boxes
    /// relative to it.
    pub fn origin(&self) -> DVec3 {
        self.cloud().origin_at(self.scene.time.start_s)
    }

    /// Returns the length of a scene unit, m.
    pub fn metres_per_unit(&self) -> f64 {
        self.scene.air.metres_per_unit
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::document;
    use super::*;
    use crate::model::scene::LightingMode;

    #[test]
    fn the_default_scene_is_that_of_the_papers_cloud() {
        let edited = EditedScene::default_scene().unwrap();
        assert!(edited.document().boxes.is_empty());
        let boxes = box_file::read(Path::new("scenes/cubes-554.dat")).unwrap();
        let scene = edited.scene(&Document { boxes, seed: 9 });
        let whole = scene_file::load(Path::new("scenes/cubes-554.toml"), &[], None).unwrap().scene;
        assert_eq!(*scene, Scene { title: String::new(), ..whole });
    }

    #[test]
    fn a_scene_without_boxes_is_valid() {
        let edited = EditedScene::default_scene().unwrap();
        let empty = edited.scene(&document(0));
        assert_eq!((empty.n_particles(), empty.groups().len()), (0, 0));
        assert_ne!(empty.lighting.mode, LightingMode::None);
    }

    #[test]
    fn only_the_first_cloud_of_boxes_changes() {
        let text = "[[cloud]]\nfrom = 'disc'\nparticles = 7\n[[cloud]]\nfrom = 'boxes'\nfile = \
            'a.dat'\nposition = [1, 2, 3]\n\
                    form = 'printed'\n[[cloud]]\nfrom = 'boxes'\nfile = 'a.dat'\n";
        let files = |_: &Path, _: &str| Ok(box_file::format(&document(2).boxes));
        let loaded =
            scene_file::parse_beside(text.to_owned(), Path::new("s.toml"), &[], Some(5), &files)
                .unwrap();
        let edited = EditedScene::new(loaded.scene.clone()).unwrap();
        assert_eq!((edited.document().boxes, edited.document().seed), (document(2).boxes, 6));
        assert_eq!(edited.origin(), DVec3::new(1.0, 2.0, 3.0));
        let (old, new) = (edited.document(), Document { seed: 6, ..document(4) });
        let scene = edited.scene(&new);
        assert_eq!(scene.clouds[1].n_groups(), 4);
        assert_eq!(
            (&scene.clouds[0], &scene.clouds[2]),
            (&loaded.scene.clouds[0], &loaded.scene.clouds[2])
        );
        // The disc before has one group.
        assert_eq!(edited.groups(&new.regenerated_since(&old)), [3, 4]);
        let all: Vec<u32> = (0..200).collect();
        assert_eq!(
            edited.statuses(&new.boxes, &all),
            (7..7 + 10 + 11 + 12 + 13).collect::<Vec<u32>>()
        );
        assert!(edited.statuses(&new.boxes, &all[..20]).is_empty());
        let without = Scene { clouds: loaded.scene.clouds[..1].to_vec(), ..loaded.scene };
        assert!(EditedScene::new(without).is_err());
    }
}
