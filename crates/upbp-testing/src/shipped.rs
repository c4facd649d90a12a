//! The scenes that have a reference image.

use std::path::PathBuf;

use crate::root;

/// The renderer that made the reference of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Another renderer: what is measured against it says something about agreement, too.
    Reference,
    /// This renderer, in a long run: scenes for comparing techniques with each other.
    Suite,
}

/// A scene that comes with the repository.
#[derive(Clone, Copy, Debug)]
pub struct Shipped {
    /// Name of the files, without ending.
    pub name: &'static str,
    /// Renderer that made the reference.
    pub group: Group,
}

/// The scenes with references.
pub const SCENES: [Shipped; 18] = [
    reference("absorb_only"),
    reference("chromatic_sphere"),
    reference("emission_grey"),
    reference("fog_cornell"),
    reference("fog_two_spheres"),
    reference("forward_hg_box"),
    reference("glass_env"),
    reference("high_albedo_cube"),
    reference("mirror_fog"),
    reference("point_bubble_fog"),
    suite("bare_surfaces"),
    suite("bulb_in_glass"),
    suite("caustic_in_fog"),
    suite("dense_marble"),
    suite("haze_outdoors"),
    suite("laser_in_fog"),
    suite("many_lights"),
    suite("surface_caustic"),
];

const fn reference(name: &'static str) -> Shipped {
    Shipped { name, group: Group::Reference }
}

const fn suite(name: &'static str) -> Shipped {
    Shipped { name, group: Group::Suite }
}

impl Shipped {
    /// The scene of that name.
    pub fn find(name: &str) -> Option<Self> {
        SCENES.into_iter().find(|scene| scene.name == name)
    }

    /// The scene file.
    pub fn scene(&self) -> PathBuf {
        let folder = match self.group {
            Group::Reference => "reference",
            Group::Suite => "suite",
        };
        root().join(format!("examples/scenes/{folder}/{}.ron", self.name))
    }

    /// The image with its standard errors.
    pub fn reference(&self) -> PathBuf {
        let folder = match self.group {
            Group::Reference => "references",
            Group::Suite => "suite",
        };
        root().join(format!("tests/data/{folder}/{}.exr", self.name))
    }
}

/// The names of a group.
pub fn names(group: Group) -> impl Iterator<Item = &'static str> {
    SCENES.into_iter().filter(move |scene| scene.group == group).map(|scene| scene.name)
}
