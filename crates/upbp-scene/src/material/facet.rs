//! Small smooth interfaces, of which a rough one is made.

use glam::Vec3;

use super::fresnel::refraction;

/// The direction into which a facet reflects or refracts light from `above`, which has a positive z; none if
/// that is not the side which such light has to leave to.
pub(super) fn scattered(
    above: Vec3,
    normal: Vec3,
    [eta_from, eta_to]: [f32; 2],
    reflects: bool,
) -> Option<Vec3> {
    let cos_from = above.dot(normal).clamp(0.0, 1.0);
    let to = if reflects {
        2.0 * cos_from * normal - above
    } else {
        let ratio = eta_from / eta_to;
        let cos_transmitted = refraction(cos_from, eta_from, eta_to).cos_transmitted;
        (ratio * cos_from - cos_transmitted) * normal - ratio * above
    };
    to.try_normalize().filter(|to| to.z != 0.0 && (to.z > 0.0) == reflects)
}
