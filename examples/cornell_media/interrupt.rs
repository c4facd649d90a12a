//! SIGINT, SIGTERM and SIGHUP: the first ends the render in order, the second ends the program.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use upbp_core::Canceller;

/// The exit code of a program that a signal ended, as shells have it for SIGINT.
const AT_ONCE: i32 = 130;

/// What a signal does.
#[derive(Clone, Default)]
pub(crate) struct Interrupt {
    seen: Arc<AtomicBool>,
    render: Arc<OnceLock<Canceller>>,
}

impl Interrupt {
    /// Catches signals from now on.
    pub(crate) fn install() -> Result<Self, ctrlc::Error> {
        let interrupt = Self::default();
        let shared = interrupt.clone();
        ctrlc::set_handler(move || {
            if shared.seen.swap(true, Ordering::SeqCst) {
                // Whatever file is being written is written beside its place: nothing is lost but this.
                std::process::exit(AT_ONCE);
            }
            if let Some(render) = shared.render.get() {
                render.cancel();
            }
        })?;
        Ok(interrupt)
    }

    /// Says which render to stop, also if the signal was there before it.
    pub(crate) fn stops(&self, render: Canceller) {
        let render = self.render.get_or_init(|| render);
        if self.seen.load(Ordering::SeqCst) {
            render.cancel();
        }
    }
}
