//! The light of a glowing ball on a floor, through air that absorbs: paths of two edges on a fixed ray.
//!
//! The ball does not scatter, so that what a point of the floor receives is an integral over the cone in
//! which it sees the ball: of the chord's emission, attenuated on the way.

use std::f64::consts::TAU;

use upbp_core::Settings;
use upbp_testing::analytic::{Table, narrow_camera, scene, settings};
use upbp_testing::render;

/// A ball above the origin of the floor.
struct Ball {
    height: f64,
    radius: f64,
    sigma_a: f64,
    /// Radiance of an opaque stretch, and what is emitted per length without absorption.
    emission: [f64; 2],
}

const AIR: f64 = 0.3;
const REFLECTANCE: f64 = 0.7;
/// Distance of the camera from the point that it looks at.
const CAMERA: f64 = 1.5;

impl Ball {
    /// Radiance of the floor at a distance from the point below the ball, by the midpoint rule.
    fn seen_on_floor(&self, x: f64) -> f64 {
        let distance = x.hypot(self.height);
        let widest = (self.radius / distance).asin();
        let steps = 200_000;
        let step = widest / f64::from(steps);
        let sum: f64 = (0..steps)
            .map(|i| {
                let (sin, cos) = ((f64::from(i) + 0.5) * step).sin_cos();
                let half = (self.radius.powi(2) - (distance * sin).powi(2)).max(0.0).sqrt();
                let [opaque, glow] = self.emission;
                let source = self.sigma_a * opaque + glow;
                let chord = if self.sigma_a > 0.0 {
                    source / self.sigma_a * -f64::exp_m1(-self.sigma_a * 2.0 * half)
                } else {
                    source * 2.0 * half
                };
                chord * (-AIR * (distance * cos - half)).exp() * cos * sin * step
            })
            .sum();
        let irradiance = TAU * self.height / distance * sum;
        REFLECTANCE * std::f64::consts::FRAC_1_PI * irradiance * (-AIR * CAMERA).exp()
    }
}

#[test]
fn the_light_of_a_glowing_ball_on_a_floor() {
    let mut table = Table::new(0.01);
    let ball = |height, radius, sigma_a, emission| Ball { height, radius, sigma_a, emission };
    for (ball, x, by_hits) in [
        (ball(1.0, 0.6, 2.0, [3.0, 0.0]), 0.5, true),
        (ball(1.0, 0.6, 0.0, [0.0, 1.5]), 0.5, true),
        (ball(1.0, 0.6, 1e-6, [1e6, 0.5]), 0.5, true),
        (ball(1.0, 0.02, 50.0, [3e3, 0.0]), 0.5, false),
        (ball(1.0, 0.02, 1e3, [3e3, 100.0]), 0.0, false),
        (ball(0.3, 0.01, 0.0, [0.0, 1e6]), 2.0, false),
    ] {
        let camera = narrow_camera([x + 0.8 * CAMERA, 0.6 * CAMERA, 0.0], [x, 0.0, 0.0], 16);
        let Ball { height, radius, sigma_a, emission: [opaque, glow] } = ball;
        let scene = scene(&format!(
            "{camera} outside: \"air\",
            media: {{
                \"air\": Homogeneous(sigma_a: {AIR:?}),
                \"ball\": Homogeneous(sigma_a: {sigma_a:?}, emission: {opaque:?}, glow: {glow:?}),
            }},
            materials: {{\"null\": Null, \"floor\": Lambert({REFLECTANCE:?})}},
            shapes: [
                (geometry: Quad(origin: (-9, 0, -9), edge_u: (0, 0, 18), edge_v: (18, 0, 0)), material: \"floor\"),
                (geometry: Sphere(centre: (0, {height:?}, 0), radius: {radius:?}), material: \"null\", interior: \"ball\"),
            ]"
        ));
        let expected = ball.seen_on_floor(x);
        for techniques in ["nee", "hit+nee", "hit"] {
            if techniques == "hit" && !by_hits {
                continue;
            }
            let settings = Settings { min_length: 2, max_length: 2, ..settings(techniques, None) };
            let (result, _) = render(&scene, &settings, 60);
            let name = format!("radius {radius}, sigma_a {sigma_a}, at {x}: {techniques}");
            table.check(&name, result, expected, 2e-4 * expected);
            // From 15 360 samples.
            assert!(techniques == "hit" || result.error < 5e-3 * expected, "{name}: {result:?}");
        }
    }
    table.finish();
}
