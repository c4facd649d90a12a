//! Every material against the contract, and its energy.

use upbp_estimators::check::check_bsdf;

use super::*;

const INTERFACES: [Interface; 4] = [
    Interface::MATCHED,
    Interface { above: 1.0, below: 1.5 },
    Interface { above: 1.33, below: 1.0 },
    Interface { above: 1.5, below: 1.5004 },
];

/// The interfaces that make a difference to a material.
fn interfaces(material: &Material) -> &'static [Interface] {
    match material {
        Material::Lambert(_) | Material::Phong(_) | Material::Mirror(_) => &INTERFACES[..1],
        _ => &INTERFACES,
    }
}

/// The complex index of gold.
const GOLD: [Spectrum; 2] = [Spectrum::new(0.143, 0.375, 1.442), Spectrum::new(3.983, 2.386, 1.603)];

fn materials() -> Vec<(&'static str, Material)> {
    let grey = |value| Spectrum::splat(value);
    let rough = |alpha| TrowbridgeReitz { alpha };
    let [eta, k] = GOLD;
    let gold = MetalFresnel::Indices { eta, k };
    let phong = |diffuse, specular, exponent| {
        Material::Phong(Phong { diffuse: grey(diffuse), specular: grey(specular), exponent })
    };
    vec![
        ("lambert", Material::Lambert(Lambert { reflectance: Spectrum::new(0.7, 0.2, 0.0) })),
        ("black", Material::Lambert(Lambert { reflectance: Spectrum::ZERO })),
        ("phong", phong(0.5, 0.4, 20.0)),
        ("phong, flat lobe", phong(0.2, 0.8, 0.0)),
        ("phong, lobe only", phong(0.0, 1.0, 300.0)),
        ("phong, black", phong(0.0, 0.0, 5.0)),
        ("mirror", Material::Mirror(Mirror { reflectance: Spectrum::new(0.9, 0.8, 0.7) })),
        ("black mirror", Material::Mirror(Mirror { reflectance: Spectrum::ZERO })),
        ("glass", Material::Dielectric(Dielectric)),
        ("gold 0.1", Material::Conductor(Conductor { normals: rough(0.1), fresnel: gold })),
        ("gold 0.5", Material::Conductor(Conductor { normals: rough(0.5), fresnel: gold })),
        (
            "metal 1",
            Material::Conductor(Conductor { normals: rough(1.0), fresnel: MetalFresnel::Schlick(grey(0.8)) }),
        ),
        ("frosted 0.1", Material::RoughDielectric(RoughDielectric { normals: rough(0.1) })),
        ("frosted 0.4", Material::RoughDielectric(RoughDielectric { normals: rough(0.4) })),
        ("frosted 1", Material::RoughDielectric(RoughDielectric { normals: rough(1.0) })),
    ]
}

/// A fixed sequence that fills the unit cube evenly: multiples of powers of the plastic number's cousin
/// (Roberts 2018).
fn points(count: u32) -> impl Iterator<Item = (f32, [f32; 2])> {
    let step = |i: u32, alpha: f64| ((0.5 + f64::from(i) * alpha).fract() as f32).min(1.0 - f32::EPSILON);
    (0..count).map(move |i| {
        (
            step(i, 0.819_172_513_396_164_4),
            [step(i, 0.671_043_606_703_789_2), step(i, 0.549_700_477_901_970_3)],
        )
    })
}

fn directions() -> impl Iterator<Item = Vec3> {
    [0.0_f32, 30.0, 60.0, 80.0, 89.0, 91.0, 100.0, 135.0, 180.0].into_iter().map(|degrees| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Vec3::new(sin * 0.6, sin * 0.8, cos)
    })
}

/// Mean weight of `count` samples of light: the share that is scattered.
fn albedo(material: &Material, from: Vec3, interface: Interface, count: u32) -> Spectrum {
    points(count)
        .filter_map(|(u_lobe, u)| material.sample(from, Walk::Light, interface, u_lobe, u))
        .map(|sample| sample.weight)
        .sum::<Spectrum>()
        / count as f32
}

#[test]
fn all_satisfy_the_contract() {
    for (name, material) in materials() {
        for &interface in interfaces(&material) {
            check_bsdf(&material, interface)
                .unwrap_or_else(|violation| panic!("{name} {interface:?}: {violation}"));
        }
    }
}

#[test]
fn none_creates_energy() {
    for (name, material) in materials() {
        for &interface in interfaces(&material) {
            for from in directions() {
                let albedo = albedo(&material, from, interface, 40_000);
                assert!(albedo.max_component() < 1.003, "{name} {from} {interface:?}: {albedo:?}");
            }
        }
    }
}

#[test]
fn smooth_glass_loses_none_either() {
    for (from, interface) in directions().flat_map(|from| INTERFACES.map(|interface| (from, interface))) {
        let albedo = albedo(&Material::Dielectric(Dielectric), from, interface, 5000);
        assert!((albedo.r() - 1.0).abs() < 1e-6, "{from} {interface:?}: {albedo:?}");
    }
}

/// Light that facets send to each other is interpolated from tables, worst at the horizon.
#[test]
fn rough_glass_loses_nothing() {
    for alpha in [0.003, 0.02, 0.05, 0.1, 0.17, 0.3, 0.4, 0.6, 0.85, 1.0] {
        let glass = Material::RoughDielectric(RoughDielectric { normals: TrowbridgeReitz { alpha } });
        for (above, below) in [(1.0, 1.5), (1.33, 1.0), (1.5, 1.33), (1.0, 1.05), (2.4, 1.0), (9.0, 0.2)] {
            for from in directions() {
                let albedo = albedo(&glass, from, Interface { above, below }, 5000).r();
                let allowed = if from.z.abs() < 0.1 { 0.04 } else { 0.012 };
                assert!((albedo - 1.0).abs() < allowed, "{alpha}, {above} : {below}, {from}: {albedo}");
            }
        }
    }
}

#[test]
fn radiance_is_compressed_where_flux_is_not() {
    let smooth = Material::Dielectric(Dielectric);
    let rough = Material::RoughDielectric(RoughDielectric { normals: TrowbridgeReitz { alpha: 0.2 } });
    for (above, below) in [(1.0, 1.5), (1.4986, 1.5)] {
        for material in [smooth, rough] {
            let interface = Interface { above, below };
            let weights = |walk| material.sample(Vec3::Z, walk, interface, 0.9, [0.3, 0.4]).unwrap();
            let (light, camera) = (weights(Walk::Light), weights(Walk::Camera));
            assert!(light.to.z < 0.0);
            let compressed = camera.weight.r() / light.weight.r() * (below / above).powi(2);
            assert!((compressed - 1.0).abs() < 1e-5, "{material:?} {above} : {below}: {compressed}");
        }
    }
}

/// At normal incidence from an index n: |(η + ik − n) / (η + ik + n)|².
#[test]
fn metals_reflect_by_their_index_and_that_of_what_is_outside() {
    let [eta, k] = GOLD;
    let normals = TrowbridgeReitz { alpha: 0.1 };
    let gold = Material::Conductor(Conductor { normals, fresnel: MetalFresnel::Indices { eta, k } });
    for n in [1.0, 1.33] {
        let interface = Interface { above: n, below: 1.0 };
        // The middle of the distribution of normals.
        let sample = gold.sample(Vec3::Z, Walk::Light, interface, 0.5, [0.5, 0.0]).unwrap();
        let albedo = gold.albedo(Vec3::Z);
        for c in 0..3 {
            let power = |sign: f32| (eta[c] + sign * n).powi(2) + k[c] * k[c];
            let expected = power(-1.0) / power(1.0);
            assert!((sample.weight[c] - expected).abs() < 1e-5, "{n}: {sample:?}, expected {expected}");
            // That of a denoiser is in vacuum.
            assert!(n > 1.0 || (albedo[c] - expected).abs() < 1e-5, "{albedo:?}, expected {expected}");
        }
    }
}

#[test]
fn no_channel_gains_by_the_roulette_of_a_matt_surface() {
    let red = Material::Lambert(Lambert { reflectance: Spectrum::new(0.9, 0.1, 0.1) });
    let sample = red.sample(Vec3::Z, Walk::Light, Interface::MATCHED, 0.5, [0.3, 0.4]).unwrap();
    assert_eq!(sample.weight.max_component() / red.continuation(Vec3::Z), 1.0);
}

#[test]
fn refraction_follows_snell() {
    let interface = Interface { above: 1.0, below: 1.5 };
    let from = Vec3::new(0.6, 0.0, 0.8);
    let sample =
        Material::Dielectric(Dielectric).sample(from, Walk::Light, interface, 0.9, [0.0; 2]).unwrap();
    assert!((sample.to.x + 0.4).abs() < 1e-6 && sample.to.z < 0.0);
    let back =
        Material::Dielectric(Dielectric).sample(sample.to, Walk::Light, interface, 0.9, [0.0; 2]).unwrap();
    assert!(back.to.distance(from) < 1e-6);
    assert!((back.pdf - sample.pdf).abs() < 1e-6);
}

#[test]
fn extreme_random_numbers_are_harmless() {
    let last = 1.0 - f32::EPSILON / 2.0;
    let numbers = [0.0, f32::MIN_POSITIVE, 0.5, last];
    for (name, material) in materials() {
        for from in directions() {
            for u in numbers.into_iter().flat_map(|a| numbers.map(|b| [a, b])) {
                for u_lobe in numbers {
                    let sample = material.sample(from, Walk::Camera, INTERFACES[1], u_lobe, u);
                    let fine = sample.is_none_or(|s| {
                        s.weight.is_finite() && s.to.is_normalized() && s.pdf.is_finite() && s.pdf > 0.0
                    });
                    assert!(fine, "{name} {from} {u_lobe} {u:?}: {sample:?}");
                }
            }
        }
    }
}

#[test]
fn a_material_is_small() {
    // It is copied into every light vertex.
    assert!(size_of::<Material>() <= 36);
}

/// Directions are as dense as the lobe says where its cosines are rounded to 1.
#[test]
fn narrow_lobes_keep_their_shape() {
    for exponent in [1.0, 1e3, 1e6, 1e8_f32] {
        let phong = Phong { diffuse: Spectrum::ZERO, specular: Spectrum::ONE, exponent };
        for (_, u) in points(1000) {
            let sample = phong.sample(Vec3::Z, Walk::Camera, Interface::MATCHED, 0.5, u).unwrap();
            // The cosine is (1 − u)^(1/(n + 1)).
            let expected =
                (exponent + 1.0) / std::f32::consts::TAU * (1.0 - u[0]).powf(exponent / (exponent + 1.0));
            let ratio = sample.pdf / expected;
            assert!((ratio - 1.0).abs() < 0.02, "{exponent} {u:?}: {ratio}");
        }
    }
}

#[test]
fn rough_glass_is_matched_from_both_sides_or_from_none() {
    let glass = RoughDielectric { normals: TrowbridgeReitz { alpha: 0.2 } };
    for below in [1.0, 1.0005, 1.001, 1.0011, 1.0 / 1.001, 0.9991] {
        let interface = Interface { above: 1.0, below };
        let from = Vec3::new(0.6, 0.0, 0.8);
        let is_straight = |from| {
            glass.sample(from, Walk::Camera, interface, 0.9, [0.3, 0.4]).is_some_and(|sample| sample.delta)
        };
        assert_eq!(is_straight(from), is_straight(-from), "{below}");
    }
}
