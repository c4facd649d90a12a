//! SIGINT, SIGTERM and SIGHUP: the first ends the render in order, the second ends the program.

use upbp_core::Canceller;

/// The exit code of a program that a signal ended, as shells have it for SIGINT.
const AT_ONCE: i32 = 130;

/// Catches signals from now on: the first uses the canceller.
pub(crate) fn install() -> Result<Canceller, ctrlc::Error> {
    let canceller = Canceller::default();
    let render = canceller.clone();
    ctrlc::set_handler(move || {
        if render.is_cancelled() {
            // Whatever file is being written is written beside its place: nothing is lost but this.
            std::process::exit(AT_ONCE);
        }
        render.cancel();
    })?;
    Ok(canceller)
}
