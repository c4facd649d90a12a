//! Renders of ready-made scenes.
//!
//! The renderer is compiled for every type of scene that it is given, in the crate that gives it one. For
//! [`ReadyScene`] that is this one: programs that ask here need not compile the walks again, which takes
//! longer than all else of them.

use upbp_core::{CheckedSettings, RenderError, Renderer, Start};

use crate::scene::ReadyScene;

impl ReadyScene {
    /// Starts a render of this scene, as [`Renderer::new`], but compiled already.
    ///
    /// # Errors
    /// Those of [`Renderer::new`].
    #[inline(never)]
    pub fn renderer(&self, settings: CheckedSettings) -> Result<Renderer<'_>, RenderError> {
        Renderer::new(self, settings)
    }

    /// Starts a render of this scene with more choices, as [`Renderer::start`], but compiled already.
    ///
    /// # Errors
    /// Those of [`Renderer::start`].
    #[inline(never)]
    pub fn start_renderer(
        &self,
        settings: CheckedSettings,
        start: Start<'_>,
    ) -> Result<Renderer<'_>, RenderError> {
        Renderer::start(self, settings, start)
    }
}
