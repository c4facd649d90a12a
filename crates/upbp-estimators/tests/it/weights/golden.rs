//! The path of `docs/theory.md`, section 11, whose weights are known to many digits.

use std::f64::consts::PI;

use upbp_estimators::MediumId;
use upbp_estimators::mis::oracle::{Path, PathEdge, PathVertex, Strategy as Way, VertexKind};
use upbp_estimators::mis::{BeamExtent, Heuristic, MisPlan, VolumeMerge, VolumeMerges};

use super::recursion::Recursion;

/// The path of section 11.
fn golden_path() -> Path {
    let end = PathVertex {
        kind: VertexKind::End,
        rho_light: 0.0,
        rho_camera: 0.0,
        cos_light: 1.0,
        cos_camera: 1.0,
        sin_theta: 0.0,
        scale: 1.0,
    };
    let edge = |distance, t_light, t_camera, pass_probability| PathEdge {
        distance,
        t_light,
        t_camera,
        pass_probability,
    };
    let (first, second) = ((-0.6_f64).exp(), (-0.75_f64).exp());
    Path {
        vertices: vec![
            PathVertex { rho_light: 0.3, cos_camera: 0.7, ..end },
            PathVertex {
                kind: VertexKind::Medium(MediumId(0)),
                rho_light: 0.12,
                rho_camera: 0.09,
                sin_theta: 0.75,
                ..end
            },
            PathVertex {
                kind: VertexKind::Delta,
                rho_light: 0.95,
                rho_camera: 1.023,
                cos_light: 0.9,
                cos_camera: 0.8,
                ..end
            },
            PathVertex {
                kind: VertexKind::Surface,
                rho_light: 0.21,
                rho_camera: 0.17,
                cos_light: 0.6,
                cos_camera: 0.5,
                ..end
            },
            PathVertex { rho_camera: 900.0, ..end },
        ],
        edges: vec![
            edge(2.0, 0.5 * first, first, first),
            edge(1.5, second, 0.5 * second, second),
            edge(0.8, 1.0, 1.0, 1.0),
            edge(3.0, 1.0, 1.0, 1.0),
        ],
        pdf_position: 0.5,
        pdf_incident: 0.4,
        hittable: true,
    }
}

fn golden_plan(query_beams: BeamExtent) -> MisPlan {
    MisPlan {
        heuristic: Heuristic::Balance,
        hit: 1.0,
        nee: 1.0,
        connect: 1.0,
        light_tracing: 1e4,
        surf: 1e4 * PI * 1e-4,
        volume: vec![
            VolumeMerges {
                pp3d: 1e4 * 4.0 / 3.0 * PI * 8e-6,
                pb2d: 1e4 * 0.75 * PI * 1e-4,
                bp2d: 0.0,
                bb1d: 200.0 * 0.05 / 3.0,
            }
            .map(|count| VolumeMerge { count, ..VolumeMerge::NONE }),
        ],
        photon_beams: BeamExtent::Short,
        query_beams,
        lanes: [0.0; 3],
    }
}

/// Agreement to the last printed digit.
fn assert_close(found: f64, expected: f64, what: &str) {
    assert!((found / expected - 1.0).abs() < 1e-10, "{what}: {found}, expected {expected}");
}

#[test]
fn the_golden_vector() {
    let path = golden_path();
    let ways =
        [Way::Hit, Way::Nee, Way::LightTracing, Way::Pp3d(1), Way::Pb2d(1), Way::Bb1d(1), Way::Surf(3)];
    let columns = [
        (
            BeamExtent::Long,
            [
                3.347_129_370_500e-3,
                1.548_918_692_909e-1,
                7.052_405_460_405e-1,
                1.335_278_354_410e-3,
                3.975_165_419_721e-2,
                8.435_563_015_422e-2,
                1.107_789_259_227e-2,
            ],
        ),
        (
            BeamExtent::Short,
            [
                3.581_668_308_926e-3,
                1.657_454_009_513e-1,
                7.546_579_275_319e-1,
                1.428_843_536_116e-3,
                2.009_311_222_664e-2,
                4.263_890_843_959e-2,
                1.185_413_900_554e-2,
            ],
        ),
    ];
    for (query_beams, weights) in columns {
        let plan = golden_plan(query_beams);
        let recursion = Recursion::<f64>::new(&plan, &path);
        assert_eq!(path.weights(&plan).len(), ways.len());
        for (way, weight) in ways.into_iter().zip(weights) {
            assert_close(path.weight(&plan, way), weight, &format!("{way:?} enumerated"));
            assert_close(recursion.weight(way).value(), weight, &format!("{way:?} by recursion"));
        }
    }
}

#[test]
fn the_golden_densities_and_partial_sums() {
    let path = golden_path();
    let plan = golden_plan(BeamExtent::Long);
    let recursion = Recursion::<f64>::new(&plan, &path);
    for (i, density) in [(1, 0.020_580_436_353_5), (2, 0.022_673_594_531_6), (3, 0.890_625)] {
        assert_close(recursion.light_density(i), density, &format!("L_{i}"));
    }
    for (i, density) in [(0, 0.008_643_783_268_48), (1, 0.107_384_662_990), (2, 0.2125), (3, 50.0)] {
        assert_close(recursion.camera_density(i), density, &format!("C_{i}"));
    }
    assert_close(recursion.light[1].connect, 38.871_867_741_7, "light D_1");
    assert_close(recursion.light[1].below, 9.333_333_333_33, "light E_1");
    assert_close(recursion.light[2].below, 329.597_679_046, "light E_2");
    assert_close(recursion.light[3].below, 473.232_878_125, "light E_3");
    assert_close(recursion.camera[3].connect, 200.0, "camera D_3");
    assert_close(recursion.camera[2].below, 896.212_908_766, "camera E_2");
    assert_close(recursion.camera[1].below, 1_498.068_498_52, "camera E_1");
    assert_close(recursion.at_light.connect, 115.690_082_564, "camera D_0");
    assert_close(recursion.at_light.below, 1_676.582_942_50, "camera E_0");
    let zero = [
        recursion.light[2].connect,
        recursion.light[3].connect,
        recursion.camera[3].below,
        recursion.camera[2].connect,
        recursion.camera[1].connect,
    ];
    assert_eq!(zero, [0.0; 5], "no connection touches the Dirac vertex, no lens is hit");
}
