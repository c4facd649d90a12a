//! The public interface as a host uses it that brings a medium of its own, or boxes one of this crate.

use upbp_media::glam::Vec3;
use upbp_media::{
    EdgeDensity, Homogeneous, MediaError, Medium, MediumStack, PhaseFunction, RaySegment, SegmentDensity,
    Spectrum,
};

/// Only the required methods, for a medium that stops every walk half way.
struct Halfway;

impl Medium for Halfway {
    fn scatters(&self) -> bool {
        true
    }

    fn segment(&self, _segment: &RaySegment) -> SegmentDensity {
        SegmentDensity { pass_probability: 0.0, ..SegmentDensity::VACUUM }
    }

    fn sample_distance(&self, segment: &RaySegment, _channel: f32, _distance: f32) -> Option<f32> {
        Some(segment.start + 0.5 * segment.length())
    }

    fn sigma_s(&self, _position: Vec3) -> Spectrum {
        Spectrum::ONE
    }

    fn sigma_t(&self, _position: Vec3) -> Spectrum {
        Spectrum::ONE
    }

    fn phase(&self) -> &PhaseFunction {
        &PhaseFunction::Isotropic
    }

    fn continuation(&self, _position: Vec3) -> f32 {
        1.0
    }

    fn mean_free_path(&self) -> f32 {
        1.0
    }
}

fn segment() -> RaySegment {
    RaySegment { origin: Vec3::ZERO, direction: Vec3::X, start: 1.0, end: 3.0 }
}

#[test]
fn media_mix_behind_a_trait_object_and_across_threads() -> Result<(), MediaError> {
    let fog = Homogeneous::new(Spectrum::ZERO, Spectrum::splat(0.5), PhaseFunction::Isotropic)?;
    let media: [Box<dyn Medium>; 2] = [Box::new(fog), Box::new(Halfway)];
    let pass_probability = std::thread::scope(|scope| {
        let walk = || {
            let mut edge = EdgeDensity::EMPTY;
            for medium in &media {
                edge.push(&medium.segment(&segment()));
            }
            edge.pass_probability
        };
        scope.spawn(walk).join().expect("a walk does not panic")
    });
    assert_eq!(pass_probability, 0.0);
    Ok(())
}

#[test]
fn a_medium_is_dark_unless_it_says_otherwise() {
    assert!(!Halfway.emits());
    assert_eq!(Halfway.emitted(&segment()), Spectrum::ZERO);
    assert_eq!(Halfway.sample_distance(&segment(), 0.0, 0.0), Some(2.0));
}

#[test]
fn what_is_copied_per_edge_is_small() {
    assert!(size_of::<MediumStack>() <= 128);
    assert!(size_of::<EdgeDensity>() <= 48);
    assert_eq!(size_of::<Spectrum>(), 12);
}
