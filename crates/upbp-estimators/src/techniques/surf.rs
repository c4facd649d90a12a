//! Surface merging: photons on surfaces around a surface vertex (`docs/theory.md`, section 2.2).

use upbp_media::Lanes;

use super::merge::merge;
use crate::camera_output::Output;
use crate::light_map::LightMap;
use crate::mis::Densities;
use crate::observer::Observer;
use crate::path::{CameraVertex, Context, Interaction, LightVertex, SurfaceInteraction};
use crate::scene::Scene;
use crate::technique::Technique;

/// Photons whose surface faces away by more than this do not lie on the query's surface: cosine of the angle
/// between the two normals.
const MIN_NORMAL_COSINE: f32 = 0.7;

/// Photons farther than this from the tangent plane, relative to the kernel's radius, lie on another surface.
const MAX_PLANE_DISTANCE: f32 = 0.3;

/// Merges the photons around `vertex`, which lies on `surface`.
pub(super) fn surf<S: Scene, L: Lanes, O: Observer<S::Bsdf> + ?Sized>(
    context: &Context<'_, S>,
    map: &LightMap<S::Bsdf, O::Densities, L>,
    vertex: &CameraVertex<S::Bsdf, O::Densities, L>,
    surface: &SurfaceInteraction<S::Bsdf>,
    out: &mut Output<'_, O>,
) {
    let plan = context.plan;
    let kernel = plan.kernels.surf.scaled(vertex.scale);
    let ahead = |index| map.read_ahead(index);
    let tests = map.surface.in_ball_ahead(vertex.position, kernel.radius(), ahead, |index, distance2| {
        let photon = &map.vertices[index as usize];
        if plan.lengths.contains(vertex.depth + photon.depth)
            && lies_on(surface, vertex, photon, kernel.radius())
        {
            merge(context, Technique::Surf, photon, vertex, kernel.value(distance2), out);
        }
    });
    out.observer.call(Technique::Surf, tests);
}

/// Keeps light from leaking around edges and through thin walls. What it cuts off the kernel vanishes with
/// the radius.
fn lies_on<B, D: Densities, L: Lanes>(
    surface: &SurfaceInteraction<B>,
    vertex: &CameraVertex<B, D, L>,
    photon: &LightVertex<B, D, L>,
    radius: f32,
) -> bool {
    let Interaction::Surface(other) = &photon.interaction else { return false };
    let normal = surface.geometric_normal;
    let (mut other_normal, mut interface) = (other.geometric_normal, other.interface);
    // Facets of one surface may be wound either way, in a mesh or as two quads. The far side of a plate of
    // glass is told by its indices; that of an opaque one reflects nothing to this side.
    let is_turned = normal.dot(other_normal) < 0.0;
    if is_turned {
        (other_normal, interface) = (-other_normal, interface.turned());
    }
    // Light that falls on the other side of the photon's facet does not reach this one.
    let from_same_side = normal.dot(photon.towards_light) * other_normal.dot(photon.towards_light) > 0.0;
    from_same_side
        && normal.dot(other_normal) > MIN_NORMAL_COSINE
        && (!is_turned || interface == surface.interface)
        && (photon.position - vertex.position).dot(normal).abs() < MAX_PLANE_DISTANCE * radius
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use upbp_media::Spectrum;

    use super::*;
    use crate::mis::VertexMis;
    use crate::scene::Interface;

    /// Whether a photon counts for a query in the origin, on a floor, with a radius of one.
    fn counts(position: Vec3, normal: Vec3, towards_light: Vec3) -> bool {
        counts_on(Interface::MATCHED, position, normal, towards_light)
    }

    /// The same, on bodies with such indices out of them and in them.
    fn counts_on(interface: Interface, position: Vec3, normal: Vec3, towards_light: Vec3) -> bool {
        let surface = |normal| SurfaceInteraction {
            bsdf: (),
            geometric_normal: normal,
            shading_normal: normal,
            interface,
        };
        let mis = VertexMis::<f64> { connect: 0.0, below: 0.0, distance_factor: 0.0, shares: () };
        let (throughput, scale, depth) = (Spectrum::ONE, 1.0, 1);
        let floor = surface(Vec3::Y);
        let vertex = CameraVertex {
            position: Vec3::ZERO,
            towards_camera: Vec3::Y,
            throughput,
            mis,
            scale,
            depth,
            interaction: Interaction::Surface(floor),
        };
        let interaction = Interaction::Surface(surface(normal));
        let photon =
            LightVertex { position, towards_light, throughput, mis, scale, depth, path: 0, interaction };
        lies_on(&floor, &vertex, &photon, 1.0)
    }

    #[test]
    fn light_leaks_neither_around_edges_nor_through_thin_walls() {
        let slant = Vec3::new(1.0, 1.0, 0.0).normalize();
        let beside = Vec3::new(0.5, 0.0, 0.4);
        assert!(counts(beside, Vec3::Y, slant));
        assert!(counts(beside - 0.1 * Vec3::Y, Vec3::new(0.5, 1.0, 0.0).normalize(), slant), "a bend");
        // Light that falls on both sides of the edge alike.
        assert!(!counts(Vec3::new(0.0, -0.1, 0.4), Vec3::X, slant), "the side of a step");
        assert!(!counts(beside - 0.4 * Vec3::Y, Vec3::Y, slant), "the next floor below");
        let glass = Interface { above: 1.0, below: 1.5 };
        let below = beside - 0.01 * Vec3::Y;
        assert!(!counts_on(glass, below, Vec3::NEG_Y, -slant), "the other side of a plate, outside");
        assert!(!counts_on(glass, below, Vec3::NEG_Y, slant), "the same, from inside");
    }

    #[test]
    fn facets_count_whichever_way_they_are_wound() {
        let slant = Vec3::new(1.0, 1.0, 0.0).normalize();
        let beside = Vec3::new(0.5, 0.0, 0.4);
        let bend = Vec3::new(0.5, 1.0, 0.0).normalize();
        for side in [1.0, -1.0] {
            for normal in [Vec3::Y, bend] {
                assert!(counts(beside, side * normal, slant) && counts(beside, side * normal, -slant));
            }
            assert!(!counts(beside, side * Vec3::X, slant), "the side of a step");
        }
    }
}
