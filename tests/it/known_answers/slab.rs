//! Reflectance and transmittance of slabs.
//!
//! Light paths can be reversed: a camera ray that falls on the slab in some direction sees, of a half-space
//! above that shines with radiance 1, what light from that direction would have returned. Above the slab
//! shines a red plane, below it a green one; the camera stands in the narrow gap above.

use upbp_testing::analytic::{Case, Table, cases, medium, narrow_camera, scene, settings};
use upbp_testing::render_channels;

/// Between slab and planes, in mean free paths, against a half-width of 1e4: what leaves sideways is
/// negligible.
const GAP: f64 = 0.01;

fn slab(case: &Case, material: &str, camera: &str, more: &str) -> upbp_scene::ReadyScene {
    let (albedo, tau) = (case.input("albedo"), case.input("tau"));
    scene(&format!(
        "{camera} media: {{\"m\": {}}},
        materials: {{\"boundary\": {material}, \"black\": Lambert(0.0), \"white\": Lambert(1.0)}},
        shapes: [
            (geometry: Box(min: (-1e4, -1e4, {:?}), max: (1e4, 1e4, 0.0)), material: \"boundary\", interior: \"m\"),
            (geometry: Quad(origin: (-1e4, -1e4, {GAP:?}), edge_u: (0.0, 2e4, 0.0), edge_v: (2e4, 0.0, 0.0)),
                material: \"black\", emission: (1.0, 0.0, 0.0)),
            (geometry: Quad(origin: (-1e4, -1e4, {:?}), edge_u: (2e4, 0.0, 0.0), edge_v: (0.0, 2e4, 0.0)),
                material: \"black\", emission: (0.0, 1.0, 0.0)),
            {more}
        ],",
        medium(1.0 - albedo, albedo, case.input("g")),
        -tau,
        -tau - GAP,
    ))
}

fn check(table: &mut Table, name: &str, scene: &upbp_scene::ReadyScene, expected: [f64; 2], accuracy: f64) {
    let [reflected, transmitted, _] = render_channels(scene, &settings("hit", None), 16);
    table.check(&format!("{name} R"), reflected, expected[0], accuracy);
    // Nobody gets through thick slabs, nor is anybody expected to.
    if expected[1] > 1e-3 {
        table.check(&format!("{name} T"), transmitted, expected[1], accuracy);
    } else {
        assert!(transmitted.mean < 1e-2, "{name}: T = {}", transmitted.mean);
    }
}

/// One case in five: the stress grid has more slabs (`cargo run --release --example stress`).
#[test]
fn slabs() {
    let mut table = Table::new(0.15);
    for case in cases("slab_RT").into_iter().step_by(5) {
        let expected = |at: &str| [case.expected(&[at, "R_total"]), case.expected(&[at, "T_total"])];
        for mu0 in case.inputs("mu0") {
            let camera = [0.5 * GAP * (1.0 - mu0 * mu0).sqrt() / mu0, 0.0, 0.5 * GAP];
            let scene = slab(&case, "Null", &narrow_camera(camera, [0.0; 3], 32), "");
            check(
                &mut table,
                &format!("{} mu0 = {mu0}", case.id),
                &scene,
                expected(&format!("mu0_{mu0}")),
                case.accuracy,
            );
        }
        // A white patch on the slab, seen from the slab's side, spreads camera rays as diffuse light is
        // spread. It is too small to shade what comes back.
        let patch = "(geometry: Quad(origin: (-1e-4, -1e-4, 1e-3), edge_u: (2e-4, 0.0, 0.0), edge_v: (0.0, 2e-4, 0.0)),
            material: \"white\")";
        let camera = narrow_camera([0.0, 0.0, 5e-4], [0.0, 0.0, 1e-3], 32);
        let scene = slab(&case, "Null", &camera, patch);
        check(
            &mut table,
            &format!("{} diffuse", case.id),
            &scene,
            expected("diffuse_incidence"),
            case.accuracy,
        );
    }
    table.finish();
}

#[test]
fn slabs_with_refracting_boundaries() {
    let mut table = Table::new(0.02);
    for case in cases("slab_RT_dielectric") {
        let material = format!("Dielectric(ior: {:?})", case.input("ior_inside"));
        let camera = narrow_camera([0.0, 0.0, 0.5 * GAP], [0.0; 3], 64);
        let scene = slab(&case, &material, &camera, "");
        let expected = [case.expected(&["R_total"]), case.expected(&["T_total"])];
        check(&mut table, &case.id, &scene, expected, case.accuracy);
    }
    table.finish();
}
