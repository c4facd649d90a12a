//! Fresnel's equations: the share of unpolarised light that a smooth interface reflects.
//!
//! Source: Born and Wolf, "Principles of Optics", sections 1.5 and 14.2; Schlick, "An Inexpensive BRDF Model
//! for Physically-based Rendering", Computer Graphics Forum 13(3), 1994.

/// Reflection and refraction at a dielectric interface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Refraction {
    /// Share that is reflected, in `[0, 1]`; the same for the reversed path.
    pub(super) reflectance: f32,
    /// Cosine of the refracted direction with the normal on its side; 0 at total reflection.
    pub(super) cos_transmitted: f32,
}

/// Reflection and refraction on the way from index `eta_from`, at `cos_incident` in `[0, 1]`, to index
/// `eta_to`.
pub(super) fn refraction(cos_incident: f32, eta_from: f32, eta_to: f32) -> Refraction {
    if eta_from == eta_to {
        return Refraction { reflectance: 0.0, cos_transmitted: cos_incident };
    }
    // In double precision: near the critical angle the cosine beyond has few digits.
    let [cos_incident, eta_from, eta_to] = [cos_incident, eta_from, eta_to].map(f64::from);
    let ratio = eta_from / eta_to;
    let cos2_transmitted = 1.0 - ratio * ratio * (1.0 - cos_incident * cos_incident).max(0.0);
    if cos2_transmitted <= 0.0 {
        return Refraction { reflectance: 1.0, cos_transmitted: 0.0 };
    }
    let cos_transmitted = cos2_transmitted.sqrt();
    let amplitude = |a: f64, b: f64| (a - b) / (a + b);
    let perpendicular = amplitude(eta_from * cos_incident, eta_to * cos_transmitted);
    let parallel = amplitude(eta_to * cos_incident, eta_from * cos_transmitted);
    let reflectance = 0.5 * (perpendicular * perpendicular + parallel * parallel);
    Refraction { reflectance: reflectance.min(1.0) as f32, cos_transmitted: cos_transmitted as f32 }
}

/// Reflectance of a metal with complex index `eta + i k`, relative to the medium in front of it.
pub(super) fn metal(cos_incident: f32, eta: f32, k: f32) -> f32 {
    let cos2 = cos_incident * cos_incident;
    let sin2 = (1.0 - cos2).max(0.0);
    let difference = eta * eta - k * k - sin2;
    // a² + b² and a of the refracted wave, Born and Wolf (14.2.16).
    let norm = (difference * difference + 4.0 * eta * eta * k * k).sqrt();
    let a = (0.5 * (norm + difference)).max(0.0).sqrt();
    let perpendicular = (norm + cos2 - 2.0 * a * cos_incident) / (norm + cos2 + 2.0 * a * cos_incident);
    let parallel = perpendicular * (cos2 * norm + sin2 * sin2 - 2.0 * a * cos_incident * sin2)
        / (cos2 * norm + sin2 * sin2 + 2.0 * a * cos_incident * sin2);
    let reflectance = 0.5 * (perpendicular + parallel);
    if reflectance.is_finite() { reflectance.clamp(0.0, 1.0) } else { 1.0 }
}

/// Schlick's approximation from the reflectance `normal` at normal incidence.
pub(super) fn schlick(cos_incident: f32, normal: f32) -> f32 {
    normal + (1.0 - normal) * (1.0 - cos_incident).clamp(0.0, 1.0).powi(5)
}

#[cfg(test)]
mod tests {
    use super::{metal, refraction, schlick};

    #[test]
    fn glass_at_normal_incidence_reflects_four_per_cent() {
        assert!((refraction(1.0, 1.0, 1.5).reflectance - 0.04).abs() < 1e-6);
        assert!((refraction(1.0, 1.5, 1.0).reflectance - 0.04).abs() < 1e-6);
        assert_eq!(refraction(0.3, 1.2, 1.2).reflectance, 0.0);
    }

    #[test]
    fn reflectance_is_the_same_for_the_reversed_path() {
        for step in 1..100 {
            let cos = step as f32 / 100.0;
            let forward = refraction(cos, 1.0, 1.5);
            let back = refraction(forward.cos_transmitted, 1.5, 1.0);
            // The rounding of the refracted cosine, as seen at grazing incidence.
            let rounding = 1e-6 / cos;
            assert!((forward.reflectance - back.reflectance).abs() < 5.0 * rounding, "cos {cos}");
            assert!((back.cos_transmitted - cos).abs() < rounding, "cos {cos}");
        }
    }

    #[test]
    fn beyond_the_critical_angle_everything_is_reflected() {
        let critical = (1.0 - (1.0_f32 / 1.5).powi(2)).sqrt();
        assert_eq!(refraction(critical - 1e-3, 1.5, 1.0).reflectance, 1.0);
        assert!(refraction(critical + 1e-3, 1.5, 1.0).reflectance < 1.0);
    }

    #[test]
    fn a_metal_without_absorption_is_a_dielectric() {
        for step in 1..=100 {
            let cos = step as f32 / 100.0;
            assert!((metal(cos, 1.5, 0.0) - refraction(cos, 1.0, 1.5).reflectance).abs() < 1e-4, "cos {cos}");
        }
    }

    #[test]
    fn schlick_runs_from_the_given_value_to_one() {
        assert_eq!(schlick(1.0, 0.3), 0.3);
        assert_eq!(schlick(0.0, 0.3), 1.0);
        // At 60 degrees: 0.04 + 0.96 / 2⁵.
        assert!((schlick(0.5, 0.04) - 0.07).abs() < 1e-6);
    }
}
