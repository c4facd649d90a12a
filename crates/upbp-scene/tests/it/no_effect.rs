//! Notes about what is said of a scene and changes nothing in it.

use std::fmt::Write as _;
use std::fs;

use glam::Vec3;
use upbp_scene::ReadyScene;

/// The notes about a scene with a lens and shapes like these.
fn notes(lens: &str, shapes: &str) -> Vec<String> {
    let text = format!(
        "(version: 1, camera: Perspective(origin: (0, 0, 9), target: (0, 0, 0), fov_degrees: 30, {lens}),
          materials: {{ \"white\": Lambert(0.5), \"glass\": Dielectric(1.5) }},
          shapes: [{shapes}],
          lights: [Constant(1)])"
    );
    let scene = ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}"));
    scene.notes().iter().map(ToString::to_string).collect()
}

fn ball(x: i32, material: &str, rest: &str) -> String {
    format!("(geometry: Sphere(centre: ({x}, 0, 0), radius: 1), material: \"{material}\", {rest}),")
}

#[test]
fn what_has_no_effect_is_noted() {
    let both = ball(0, "white", "") + &ball(3, "glass", "priority: 1");
    assert!(notes("", &both).is_empty());
    assert!(notes("lens_radius: 0.1, focus_distance: 3", &both).is_empty());
    assert_eq!(
        notes("focus_distance: 3", &both),
        ["camera: has a `focus_distance`, which has no effect without a `lens_radius`"]
    );
    assert_eq!(notes("", &ball(0, "glass", "")), ["material `white`: is nowhere: no shape has it"]);
    let ranked = |x| ball(x, "white", &format!("name: \"ball {x}\", priority: -1"));
    let note = "shape `ball 6`: has a `priority`, which has no effect: its material `white` is opaque";
    assert_eq!(notes("", &(both.clone() + &ranked(6))), [note]);
    let others = notes("", &[both, ranked(6), ranked(9), ranked(12)].concat());
    assert_eq!(others, [format!("{note} (and so have 2 others)")]);
}

#[test]
fn light_from_below_is_noted() {
    let notes = |up: &str, lights: &str, shapes: &str| {
        let text = format!(
            "(version: 1, camera: Perspective(origin: (1, 2, 9), target: (0, 0, 0), fov_degrees: 30, up: {up}),
              materials: {{ \"white\": Lambert(0.5) }}, shapes: [{shapes}], lights: [{lights}])"
        );
        let scene = ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}"));
        scene.notes().iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let (down, ball) = ("Sun(direction: (1, -3, 1), irradiance: 3)", ball(0, "white", ""));
    let up = down.replace("-3", "0.1");
    assert!(notes("(0, 1, 0)", down, &ball).is_empty());
    assert_eq!(
        notes("(0.1, 1, 0)", &format!("Constant(1), {up}"), &ball),
        [
            "light 2 (Sun): comes from below: `direction` is that in which its light travels, not that towards it"
        ]
    );
    let directional = up.replace("Sun", "Directional");
    assert_eq!(notes("(0, 1, 0)", &directional, &ball).len(), 1);
    // In a pitched view what is below is along -y as well.
    let pitched = "Sun(direction: (0, -0.4, -0.92), irradiance: 3)";
    assert!(notes("(0, 0.87, -0.5)", pitched, &ball).is_empty());
    assert_eq!(notes("(0, 0.87, -0.5)", &pitched.replace("-0.4", "0.1"), &ball).len(), 1);
    // There +z may be up, or the view from above.
    assert!(notes("(0, 0.5, 1)", &up, &ball).is_empty());
    assert_eq!(notes("(0, -1, 0)", down, &ball).len(), 1);
}

#[test]
fn bodies_too_thin_to_be_seen_are_noted() {
    let pane = |x: f32, thickness: f32| {
        let end = x + 1.0;
        format!(
            "(name: \"pane {x}\", material: \"glass\",
              geometry: Box(min: ({x:?}, 0, 0), max: ({end:?}, 1, {thickness:?}))),"
        )
    };
    let ground = "(material: \"white\", geometry: Quad(origin: (-2000, 0, -2000), edge_u: (0, 0, 4000), edge_v: (4000, 0, 0))),";
    let with = |panes: &str| notes("", &format!("{ground}{panes}"));
    assert!(with(&(pane(0.0, 0.004) + &pane(1000.0, 0.01))).is_empty());
    let found = with(&(pane(0.0, 0.004) + &pane(1000.0, 0.004) + &pane(1500.0, 0.006)));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        found[0].starts_with("shape `pane 1000`: is 0.00") && found[0].contains("is not seen at coordinates"),
        "{found:?}"
    );
    assert!(
        found[0].contains("coordinates up to 1001") && found[0].ends_with("(and so is 1 other)"),
        "{found:?}"
    );
}

/// Near the origin they are as coarse as they were at their old place, across it.
#[test]
fn panes_that_were_too_thin_before_they_were_moved_are_noted() {
    let pane = |x: f32, size: [f32; 3], place: &str| {
        let corner = |i: u32| {
            Vec3::new(x, 0.0, 0.0)
                + Vec3::from([i & 1, i >> 1 & 1, i >> 2].map(|i| i as f32)) * Vec3::from(size)
        };
        let position = |Vec3 { x, y, z }: Vec3| format!("({x:?}, {y:?}, {z:?}),");
        let positions: String = (0..8).map(corner).map(position).collect();
        format!(
            "(name: \"pane\", material: \"glass\", geometry: Mesh(positions: [{positions}],
              indices: [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3),
                (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)] {place})),"
        ) + &ball(3, "white", "")
    };
    let moved = |size| notes("", &pane(1e4, size, ", translate: (-10000, 0, 0)"));
    let [note] = &moved([0.006, 1.0, 1.0])[..] else { panic!("one note") };
    assert!(note.starts_with("shape `pane`: is 0.0057"), "{note}");
    assert!(note.contains("surfaces nearer to each other than 0.0095"), "{note}");
    // Thick enough, or seen from another side.
    assert!(moved([0.011, 1.0, 1.0]).is_empty());
    assert!(moved([1.0, 1.0, 0.006]).is_empty());
}

#[test]
fn copies_of_a_mesh_too_thin_to_be_seen_where_they_are_are_noted() {
    let folder = std::env::temp_dir().join(format!("upbp-thin-copies-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let corner = |i: u32| [i & 1, i >> 1 & 1, i >> 2].map(f64::from);
    let mut pane = String::new();
    (0..8).map(corner).for_each(|[x, y, z]| writeln!(pane, "v {x} {y} {}", 0.004 * z).unwrap());
    pane += "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    fs::write(folder.join("pane.obj"), pane).unwrap();
    let pane = |place: &str| {
        format!("(name: \"{place}\", material: \"glass\", geometry: Mesh(file: \"pane.obj\", {place})),")
    };
    let with = |panes: &[&str]| {
        let panes: String = panes.iter().map(|place| pane(place)).collect();
        let text = format!(
            "(version: 1, camera: Perspective(origin: (0, 0, 9), target: (0, 0, 0), fov_degrees: 30),
              materials: {{ \"glass\": Dielectric(1.5) }}, shapes: [{panes}], lights: [Constant(1)])"
        );
        let scene = ReadyScene::from_ron_str(&text, &folder).unwrap_or_else(|error| panic!("{error}"));
        scene.notes().iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let [near, far] = ["translate: (3, 0, 0)", "translate: (1000, 0, 0)"];
    assert!(with(&[near, "scale: 3, translate: (1000, 0, 0)"]).is_empty());
    for panes in [[near, far], [far, near]] {
        let found = with(&panes);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].starts_with(&format!("shape `{far}`: is 0.00")), "{found:?}");
    }
    fs::remove_dir_all(folder).unwrap();
}
