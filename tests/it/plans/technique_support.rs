//! Checks of a scene before it is rendered: techniques that can make no light, and light that is found
//! by chance.

use upbp_core::{RenderError, Settings, TechniqueSet};
use upbp_scene::ReadyScene;

/// A scene of shapes and lights, with these settings: what is known of its techniques, or why nothing is
/// rendered.
fn support_of(parts: &str, settings: &Settings) -> Result<String, RenderError> {
    // Media count whether or not something is made of them.
    let media: Vec<String> = [
        ("fog", "Homogeneous(sigma_s: 1)"),
        ("smoke", "Homogeneous(sigma_a: 1)"),
        ("fire", "Homogeneous(sigma_a: 1, emission: 1)"),
    ]
    .into_iter()
    .filter(|(name, _)| parts.contains(name))
    .map(|(name, medium)| format!("\"{name}\": {medium},"))
    .collect();
    let media = media.concat();
    let text = format!(
        "(version: 1, camera: Perspective(origin: (0, 0, 3), target: (0, 0, 0), fov_degrees: 40),
        film: (width: 4, height: 4), media: {{{media}}},
        materials: {{\"null\": Null, \"grey\": Lambert(0.5), \"mirror\": Mirror(0.9)}}, {parts})"
    );
    let scene = ReadyScene::from_ron_str(&text, "").unwrap_or_else(|error| panic!("{error}\n{text}"));
    let settings = settings.clone().validate().expect("valid settings");
    scene.renderer(settings).map(|renderer| renderer.support().to_string())
}

fn techniques(names: &str) -> Settings {
    Settings { techniques: names.parse().expect("technique names"), ..Settings::default() }
}

fn ball(material: &str, interior: Option<&str>) -> String {
    let interior = interior.map_or(String::new(), |name| format!(", interior: \"{name}\""));
    format!("shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"{material}\"{interior})],")
}

const POINT: &str = "lights: [Point(position: (2, 2, 2), intensity: 1)],";
const SKY: &str = "lights: [Constant(1)],";

#[test]
fn techniques_that_can_make_no_light_are_an_error() {
    for (parts, names, possible) in [
        // Only a sky: nothing to scatter.
        (SKY.to_owned(), "lt", "hit"),
        (SKY.to_owned(), "nee+connect+surf+bb1d", "hit"),
        (ball("mirror", None) + SKY, "surf", "hit"),
        (ball("mirror", None) + SKY, "nee", "hit"),
        (ball("grey", None) + SKY, "pp3d+bb1d", "bpt+surf"),
        (ball("grey", None) + POINT, "hit", "nee+connect+lt+surf"),
        (ball("null", Some("smoke")) + SKY, "bb1d", "hit"),
        (ball("null", Some("fog")) + POINT, "surf", "nee+connect+lt+pp3d+pb2d+bp2d+bb1d"),
        (ball("null", Some("fire")), "bpt+surf", ""),
        (ball("null", Some("fire")), "nee+lt", "hit"),
        // A lamp in the mirror, but no size.
        (ball("mirror", None) + POINT, "auto", "nothing"),
        (ball("mirror", None) + POINT, "all", "nothing"),
    ] {
        let found = support_of(&parts, &techniques(names));
        println!("{parts} {names}: {found:?}");
        match (found, possible) {
            (Ok(_), "") => {}
            (Err(error @ RenderError::NoLight { possible: found, .. }), _) => {
                let message = error.to_string();
                if possible == "nothing" {
                    assert!(
                        found.is_empty() && message.contains("expected a scene with a light"),
                        "{message}"
                    );
                } else {
                    assert_eq!(
                        found,
                        possible.parse::<TechniqueSet>().expect("technique names"),
                        "{message}"
                    );
                    assert!(message.contains(&format!("expected some of `{found}`")), "{message}");
                    assert!(message.contains(&format!("`{names}`")) || names.contains("bpt"), "{message}");
                }
            }
            (found, _) => panic!("{parts} {names}: {found:?}"),
        }
    }
    // Connections need three edges, next events two.
    let short = |names, max_length| {
        support_of(&(ball("grey", None) + POINT), &Settings { max_length, ..techniques(names) })
    };
    assert!(matches!(short("connect", 2), Err(RenderError::NoLight { .. })));
    assert!(matches!(short("nee", 1), Err(RenderError::NoLight { .. })));
    assert!(short("connect", 3).is_ok() && short("nee", 2).is_ok());
}

#[test]
fn light_of_media_that_camera_sub_paths_alone_find_is_named() {
    const SEEN: &str = "no light sub-path starts in: their light is found by camera sub-paths alone";
    let says = |parts: &str, names: &str| support_of(parts, &techniques(names)).expect("a scene with light");
    // Nothing to connect.
    let fire = ball("null", Some("fire")) + POINT;
    for names in ["auto", "all", "hit"] {
        assert!(says(&fire, names).contains(SEEN), "{names}: {}", says(&fire, names));
    }
    let with_floor = |radius: f32, more: &str| {
        format!(
            "shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: {radius}), material: \"null\", interior: \"fire\"),
            (geometry: Quad(origin: (-9, -1.5, -9), edge_u: (0, 0, 18), edge_v: (18, 0, 0)), material: \"grey\")],
            {more} {POINT}"
        )
    };
    // A spark on a floor is a light; what is all around is seen by camera sub-paths alone.
    for names in ["auto", "pt", "all", "nee+lt"] {
        assert!(!says(&with_floor(0.02, ""), names).contains("emit that"), "{names}");
    }
    assert!(says(&with_floor(0.02, ""), "hit").contains(SEEN));
    assert!(says(&with_floor(1e-6, ""), "auto").contains(SEEN), "too small for distances");
    let around = says(&with_floor(0.02, "outside: \"fire\","), "auto");
    assert!(around.contains(SEEN), "{around}");
    // Without emission hits that is not found at all.
    let around = says(&with_floor(0.02, "outside: \"fire\","), "nee+lt");
    assert!(around.contains("their light is not found"), "{around}");
    assert!(!says(&(ball("null", Some("fog")) + POINT), "auto").contains("emit that"));
}
