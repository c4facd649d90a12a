//! Faults of media.

use glam::Vec3;
use upbp_estimators::check::check_medium;
use upbp_estimators::scene::BoundingSphere;
use upbp_media::{Homogeneous, Medium, PhaseFunction, RaySegment, SegmentDensity, Spectrum};

/// A medium that errs in what `.1` says.
struct WrongMedium(Homogeneous, &'static str);

impl WrongMedium {
    fn errs(&self, what: &str) -> f64 {
        if self.1 == what { 0.8 } else { 1.0 }
    }
}

impl Medium for WrongMedium {
    fn scatters(&self) -> bool {
        self.0.scatters()
    }
    fn segment(&self, segment: &RaySegment) -> SegmentDensity {
        let density = self.0.segment(segment);
        if self.1 == "stops" {
            return SegmentDensity::passing(density.transmittance);
        }
        SegmentDensity {
            stop_at_end: self.errs("density") * density.stop_at_end,
            stop_at_start: self.errs("density the other way") * density.stop_at_start,
            ..density
        }
    }
    fn sample_distance(&self, segment: &RaySegment, u_channel: f32, u_distance: f32) -> Option<f32> {
        if self.1 == "stops" || self.1 == "infinite end" && segment.end == f32::INFINITY {
            return None;
        }
        let without_end = RaySegment { end: f32::INFINITY, ..*segment };
        let stop = self.0.sample_distance(&without_end, u_channel, u_distance)?;
        let stop = segment.start + self.errs("distances") as f32 * (stop - segment.start);
        (stop < segment.end).then_some(stop)
    }
    fn lane_extinctions(&self) -> Option<Spectrum> {
        let extinctions = self.0.lane_extinctions()?;
        Some(if self.1 == "equal lanes" { Spectrum::splat(extinctions.max_component()) } else { extinctions })
    }
    fn segment_lanes(&self, segment: &RaySegment) -> SegmentDensity<[f64; 3]> {
        let mut lanes = self.0.segment_lanes(segment);
        if self.1 == "stops of a lane" {
            lanes.pass_probability[2] = 1.0;
            (lanes.stop_at_start[2], lanes.stop_at_end[2]) = (0.0, 0.0);
        }
        lanes.stop_at_end[2] *= self.errs("density of a lane");
        lanes
    }
    fn sample_lane(&self, segment: &RaySegment, lane: usize, u: [f32; 2]) -> Option<f32> {
        let lane = if self.1 == "lane" { 0 } else { lane };
        let passes = self.1 == "stops of a lane" && lane == 2;
        self.0.sample_lane(segment, lane, u).filter(|_| !passes)
    }
    fn sigma_s(&self, position: Vec3) -> Spectrum {
        self.0.sigma_s(position)
    }
    fn sigma_t(&self, position: Vec3) -> Spectrum {
        self.0.sigma_t(position)
    }
    fn emits(&self) -> bool {
        self.0.emits()
    }
    fn emitted(&self, segment: &RaySegment) -> Spectrum {
        self.0.emitted(segment)
    }
    fn source(&self, position: Vec3) -> Spectrum {
        self.errs("source") as f32 * self.0.source(position)
    }
    fn sample_emitted(&self, segment: &RaySegment, u: f32) -> Option<f32> {
        self.0.sample_emitted(segment, u)
    }
    fn pdf_emitted(&self, segment: &RaySegment, distance: f32) -> f64 {
        self.0.pdf_emitted(segment, distance)
    }
    fn phase(&self) -> &PhaseFunction {
        self.0.phase()
    }
    fn continuation(&self, position: Vec3) -> f32 {
        self.0.continuation(position)
    }
    fn mean_free_path(&self) -> f32 {
        self.0.mean_free_path()
    }
}

#[test]
fn faults_of_a_medium_are_found() {
    let bounds = BoundingSphere { centre: Vec3::ONE, radius: 2.0 };
    let medium = |sigma_a, sigma_s| {
        let [sigma_a, sigma_s] = [sigma_a, sigma_s].map(|sigma: [f32; 3]| Spectrum::from_array(sigma));
        Homogeneous::new(sigma_a, sigma_s, PhaseFunction::Isotropic).unwrap()
    };
    // Clear, absorbing, thin, dense, and of channels that differ.
    for (sigma_a, sigma_s) in [
        ([0.0; 3], [0.0; 3]),
        ([1.0, 3.0, 0.0], [0.0; 3]),
        ([0.0; 3], [1e-3; 3]),
        ([0.1; 3], [300.0; 3]),
        ([0.0; 3], [0.1, 1.0, 10.0]),
        ([5.0, 0.0, 1.0], [0.0, 0.5, 200.0]),
    ] {
        check_medium(&medium(sigma_a, sigma_s), &bounds).unwrap();
    }
    let chromatic =
        medium([0.1, 0.2, 0.3], [0.5, 1.0, 4.0]).with_emission(Spectrum::new(1.0, 2.0, 3.0)).unwrap();
    check_medium(&WrongMedium(chromatic.clone(), "nothing"), &bounds).unwrap();
    for (fault, expected) in [
        ("density", "walks stop at the rate at which fewer pass"),
        ("distances", "walks stop where fewer pass"),
        ("density of a lane", "walks stop at the rate at which fewer pass"),
        ("lane", "walks stop where fewer pass"),
        ("density the other way", "a walk the other way stops with the density that is told of it"),
        ("stops", "a walk can stop where light is scattered"),
        ("stops of a lane", "a walk can stop where light is scattered"),
        ("infinite end", "where a walk stops does not depend on the end"),
        ("equal lanes", "lanes of equal extinctions are equal"),
        ("source", "points of light bring what is emitted"),
    ] {
        assert_eq!(check_medium(&WrongMedium(chromatic.clone(), fault), &bounds).unwrap_err().what, expected);
    }
}
