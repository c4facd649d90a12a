//! A ball that absorbs and emits but does not scatter.

use upbp_testing::analytic::{Table, cases, narrow_camera, scene, settings};
use upbp_testing::render;

#[test]
fn ball_nonscattering() {
    let mut table = Table::new(0.005);
    for case in cases("ball_nonscattering") {
        let radius = case.input("radius");
        let null = case.word("interface") == "null";
        let material =
            if null { "Null".to_owned() } else { format!("Dielectric(ior: {:?})", case.input("ior_inside")) };
        let environment = case.input("environment_radiance");
        let lights =
            if environment > 0.0 { format!("lights: [Constant({environment:?})],") } else { String::new() };
        let impacts = case.inputs("impact_parameter_over_radius");
        for (b, expected) in impacts.iter().zip(case.expected_list("L")) {
            let scene = scene(&format!(
                "{} media: {{\"m\": Homogeneous(sigma_a: {:?}, emission: {:?})}},
                materials: {{\"ball\": {material}}},
                shapes: [(geometry: Sphere(centre: (0.0, 0.0, 0.0), radius: {radius:?}), material: \"ball\", interior: \"m\")],
                {lights}",
                narrow_camera([b * radius, 0.0, 2.0 * radius], [b * radius, 0.0, 0.0], 32),
                case.input("sigma_a"),
                case.input("Le"),
            ));
            let (result, _) = render(&scene, &settings("bpt", None), 16);
            let name = format!("{} b = {b}", case.id);
            // Near the rim the small field of view shows.
            let slack = case.accuracy + 1e-4 * expected;
            table.check(&name, result, expected, slack);
            let most = if null { 1e-4 } else { 5e-3 };
            assert!(result.error < most, "{name}: too noisy; without refraction nothing is random");
        }
    }
    table.finish();
}
