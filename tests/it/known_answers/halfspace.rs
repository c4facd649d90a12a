//! A thick slab under a directional light: the emergent radiance of a half-space.

use upbp_testing::analytic::{Table, cases, medium, narrow_camera, scene, settings, vector};
use upbp_testing::render;

#[test]
fn halfspace_isotropic() {
    let mut table = Table::new(0.01);
    for case in cases("halfspace_isotropic") {
        let albedo = case.input("albedo");
        if albedo >= 1.0 {
            continue;
        }
        let thickness = if albedo > 0.99 { 400.0 } else { 60.0 };
        let mu0 = case.input("mu0");
        let directions = case.inputs("mu").into_iter().zip(case.expected_list("emergent_radiance"));
        // Upright, oblique, and grazing.
        for (mu, expected) in directions.step_by(2) {
            // Independent of the azimuth between the two.
            let eye = [(1.0 - mu * mu).sqrt(), 0.0, mu];
            let scene = scene(&format!(
                "{} media: {{\"m\": {}}}, materials: {{\"null\": Null}},
                shapes: [(geometry: Box(min: (-500.0, -500.0, {:?}), max: (500.0, 500.0, 0.0)), material: \"null\", interior: \"m\")],
                lights: [Directional(direction: {}, irradiance: 1.0)],",
                narrow_camera(eye, [0.0; 3], 32),
                medium(1.0 - albedo, albedo, 0.0),
                -thickness,
                vector([0.0, (1.0 - mu0 * mu0).sqrt(), -mu0]),
            ));
            let (result, _) = render(&scene, &settings("nee", None), 16);
            table.check(&format!("{} mu = {mu}", case.id), result, expected, case.accuracy);
        }
    }
    table.finish();
}
