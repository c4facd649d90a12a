//! Renders of ready-made scenes.
//!
//! The renderer is compiled for every type of scene that it is given, in the crate that gives it one. For [`ReadyScene`]
//! that is this one: programs that ask here need not compile the walks again, which takes minutes.

use upbp_core::{CheckedSettings, RenderError, RenderPlan, Renderer};

use crate::scene::ReadyScene;

impl ReadyScene {
    /// A render of this scene, as [`Renderer::new`], but compiled already.
    ///
    /// # Errors
    /// As there.
    #[inline(never)]
    pub fn renderer(&self, settings: CheckedSettings) -> Result<Renderer<'_>, RenderError> {
        Renderer::new(self, settings)
    }

    /// A render of this scene by a given plan, as [`Renderer::with_plan`], but compiled already.
    ///
    /// # Errors
    /// As there.
    #[inline(never)]
    pub fn renderer_with_plan(
        &self,
        settings: CheckedSettings,
        plan: RenderPlan,
    ) -> Result<Renderer<'_>, RenderError> {
        Renderer::with_plan(self, settings, plan)
    }
}
