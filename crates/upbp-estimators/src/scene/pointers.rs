//! Emitters and cameras behind a pointer, so that a scene may have some of several types: all methods are
//! passed on.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::{
    BoundingSphere, Camera, CameraConnection, CameraRay, Emission, EmissionCoordinates, Emitter,
    EmitterBounds, EmitterKind, EmitterPoint, HitDensities, Incident, LensConnection, PixelRect,
};

macro_rules! passed_on {
    ($trait:ident $methods:tt) => {
        passed_on! { $trait for &T: $methods }
        passed_on! { $trait for Box<T>: $methods }
        passed_on! { $trait for Arc<T>: $methods }
    };
    ($trait:ident for $pointer:ty:
        { $($name:ident($($argument:ident: $type:ty),* $(,)?) -> $result:ty;)* }
    ) => {
        impl<T: $trait + ?Sized> $trait for $pointer {
            $(
                #[inline]
                fn $name(&self, $($argument: $type),*) -> $result {
                    (**self).$name($($argument),*)
                }
            )*
        }
    };
}

passed_on! { Emitter {
    kind() -> EmitterKind;
    power(scene: &BoundingSphere) -> f32;
    bounds(scene: &BoundingSphere) -> Option<EmitterBounds>;
    sample_emission(sphere: &BoundingSphere, u_position: [f32; 2], u_direction: [f32; 2]) -> Option<Emission>;
    sample_incident(sphere: &BoundingSphere, receiver: Vec3, u: [f32; 2]) -> Option<Incident>;
    hit(
        sphere: &BoundingSphere, point: &EmitterPoint, direction: Vec3, receiver: Vec3,
    ) -> Option<HitDensities>;
    pdf_passage(point: &EmitterPoint) -> f32;
    emission_coordinates(
        sphere: &BoundingSphere, point: &EmitterPoint, direction: Vec3, on_ray: Vec3,
    ) -> Option<EmissionCoordinates>;
    pdf_incident(
        sphere: &BoundingSphere, point: &EmitterPoint, direction: Vec3, receiver: Vec3, pdf_position: f32,
    ) -> f32;
} }

passed_on! { Camera {
    resolution() -> (u32, u32);
    crop() -> PixelRect;
    ray(film: Vec2, u_lens: [f32; 2]) -> Option<CameraRay>;
    connect(point: Vec3, u_lens: [f32; 2]) -> Option<CameraConnection>;
    connect_at(point: Vec3, film: Vec2) -> Option<LensConnection>;
    is_pinhole() -> bool;
} }
