//! SIGINT, SIGTERM and SIGHUP: the first ends the render in order, the second ends the program.

use upbp_core::{Canceller, abandon_files};

use crate::exit::AT_ONCE;

/// Catches signals from now on and returns the canceller that the first one uses.
pub(crate) fn install() -> Result<Canceller, ctrlc::Error> {
    let canceller = Canceller::default();
    let render = canceller.clone();
    ctrlc::set_handler(move || {
        if render.is_cancelled() {
            // A file in hand is written beside its place: the file that was there stays whole.
            abandon_files();
            std::process::exit(AT_ONCE.into());
        }
        render.cancel();
    })?;
    Ok(canceller)
}
