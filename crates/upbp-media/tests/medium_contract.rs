//! The public interface as a host uses it that brings a medium of its own, or boxes one of this crate.

use std::sync::Arc;

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

/// All that a medium answers, for one stretch.
fn answers<M: Medium>(medium: &M) -> String {
    let (stretch, place) = (segment(), Vec3::ONE);
    format!(
        "{:?}",
        (
            (medium.scatters(), medium.segment(&stretch), medium.sample_distance(&stretch, 0.4, 0.1)),
            (medium.lane_extinctions(), medium.mixture_growth(), medium.segment_lanes(&stretch)),
            (medium.sample_lane(&stretch, 2, [0.3, 0.1]), medium.sigma_s(place), medium.sigma_t(place)),
            (medium.phase(), medium.emits(), medium.emitted(&stretch), medium.source(place)),
            (medium.sample_emitted(&stretch, 0.3), medium.pdf_emitted(&stretch, 1.2)),
            (medium.continuation(place), medium.mean_free_path()),
        )
    )
}

#[test]
fn media_behind_pointers_answer_as_they_do_by_themselves() -> Result<(), MediaError> {
    let [sigma_a, sigma_s] = [Spectrum::new(0.1, 0.2, 0.3), Spectrum::new(0.5, 1.0, 4.0)];
    let phase = PhaseFunction::henyey_greenstein(0.4)?;
    let medium = Homogeneous::new(sigma_a, sigma_s, phase)?.with_emission(Spectrum::new(1.0, 2.0, 3.0))?;
    let expected = answers(&medium);
    let boxed: Box<dyn Medium> = Box::new(medium.clone());
    let shared: Arc<dyn Medium> = Arc::new(medium.clone());
    assert_eq!(answers::<Box<dyn Medium>>(&boxed), expected);
    assert_eq!(answers::<Arc<dyn Medium>>(&shared), expected);
    assert_eq!(answers::<&Homogeneous>(&&medium), expected);
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
