//! Oracles of the meshes, and the scenes as a reader finds them.

use std::sync::OnceLock;

use glam::{DVec3, dvec3};
use upbp_accel::TriangleMesh;
use upbp_scene::description::{Geometry, Material};
use upbp_scene::obj::{ObjFile, ObjMesh};
use upbp_scene::{ReadyScene, SceneDescription};

use crate::mesh::Mesh;
use crate::{Bed, write};

/// Made once for all tests: most of their time goes into it.
fn beds() -> &'static [Bed] {
    static BEDS: OnceLock<Vec<Bed>> = OnceLock::new();
    BEDS.get_or_init(|| crate::beds().into())
}

fn read(text: &str) -> TriangleMesh {
    let ObjMesh { positions, indices, normals } = ObjFile::parse(text).unwrap().mesh();
    TriangleMesh::new(positions, indices, normals).unwrap()
}

#[test]
fn every_scene_loads() {
    let folder = std::env::temp_dir().join(format!("upbp-beds-{}", std::process::id()));
    write(beds(), &folder).unwrap();
    let load = |bed: &Bed| ReadyScene::load(folder.join(format!("{}.ron", bed.name)));
    let loaded: Vec<_> = beds().iter().map(load).collect();
    std::fs::remove_dir_all(&folder).unwrap();
    for scene in loaded {
        let scene = scene.unwrap_or_else(|error| panic!("{error}"));
        assert!(scene.notes().is_empty(), "{:?}", scene.notes());
    }
}

#[test]
fn every_mesh_is_named_by_its_scene_and_every_body_is_closed_with_normals_outwards() {
    for bed in beds() {
        let scene = SceneDescription::from_ron(bed.scene).unwrap();
        for (name, mesh, crease) in &bed.meshes {
            let path = format!("{}/{name}.obj", bed.name);
            let shape = scene.shapes.iter().find(
                |shape| matches!(&shape.geometry, Geometry::Mesh { file: Some(file), .. } if *file == path),
            );
            let shape = shape.unwrap_or_else(|| panic!("{path} is in no scene"));
            let mesh = read(&mesh.to_obj(*crease));
            let material = scene.materials.get(&shape.material).unwrap();
            if matches!(
                material,
                Material::Dielectric { .. } | Material::RoughDielectric { .. } | Material::Null
            ) {
                assert!(mesh.is_closed(), "{path}");
                assert!(mesh.signed_volume() > 0.0, "{path}");
            }
        }
    }
}

#[test]
fn a_bathroom_has_a_hundred_thousand_triangles() {
    let bathroom = beds().iter().find(|bed| bed.name == "bathroom").unwrap();
    assert!(bathroom.meshes.iter().map(|(_, mesh, _)| mesh.triangles.len()).sum::<usize>() > 100_000);
}

#[test]
fn solids_enclose_their_volume() {
    let volume = |mesh: Mesh| f64::from(read(&mesh.to_obj(0.0)).signed_volume());
    let size = dvec3(1.0, 2.0, 3.0);
    let block = volume(Mesh::block(DVec3::ZERO, size, [4, 6], |_, _| 0.5));
    assert!((block - 7.5).abs() < 1e-4, "{block}");
    // A chamfer takes a triangular prism off each edge, and what three have in common off each corner once.
    let chamfered = volume(Mesh::chamfered(DVec3::ZERO, size, 0.1));
    assert!((chamfered - 6.0).abs() < 0.5 * 0.01 * 24.0 && chamfered < 6.0, "{chamfered}");
    let cylinder = [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]];
    let turned = volume(Mesh::revolve(&cylinder.map(Into::into), 1000));
    assert!((turned - 2.0 * std::f64::consts::PI).abs() < 1e-3, "{turned}");
    let tube = volume(Mesh::tube(&[DVec3::ZERO, DVec3::Y, 2.0 * DVec3::Y], 1.0, 1000));
    assert!((tube - 2.0 * std::f64::consts::PI).abs() < 1e-3, "{tube}");
}
