//! The scenes that ship with the renderer load, and answer as the contracts say.

use std::path::{Path, PathBuf};

use upbp_estimators::check::check_scene;
use upbp_scene::{ReadyScene, SceneDescription};

fn shipped() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/scenes");
    let mut files: Vec<PathBuf> =
        [root.clone(), root.join("reference"), root.join("suite"), root.join("held_out")]
            .iter()
            .flat_map(|folder| std::fs::read_dir(folder).unwrap())
            .map(|entry| entry.unwrap().path())
            .filter(|path| path.extension().is_some_and(|extension| extension == "ron"))
            .collect();
    files.sort();
    files
}

#[test]
fn all_load_and_satisfy_the_contract() {
    assert!(shipped().len() >= 33);
    for path in shipped() {
        let scene = ReadyScene::load(&path).unwrap_or_else(|error| panic!("{error}"));
        assert!(scene.notes().is_empty(), "{}: {:?}", path.display(), scene.notes());
        check_scene(&scene).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    }
}

#[test]
fn all_survive_being_written_and_read_again() {
    for path in shipped() {
        let scene = SceneDescription::from_ron(&std::fs::read_to_string(&path).unwrap()).unwrap();
        let text = scene.to_ron().unwrap();
        let again = SceneDescription::from_ron(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        assert_eq!(scene, again, "{text}");
        assert_eq!(scene.hash(), again.hash());
    }
}
