//! SIGINT, SIGTERM and SIGHUP: the first ends the render in order, another SIGINT or SIGTERM ends the
//! program.

use std::io;

use upbp_core::{Canceller, abandon_files};

use crate::exit::AT_ONCE;

/// Catches signals from now on and returns the canceller that the first one uses.
pub(crate) fn install() -> io::Result<Canceller> {
    let canceller = Canceller::default();
    platform::listen(canceller.clone())?;
    Ok(canceller)
}

/// Ends the program. A file in hand is written beside its place: the file that was there stays whole.
fn end_at_once() -> ! {
    abandon_files();
    std::process::exit(AT_ONCE.into())
}

#[cfg(unix)]
mod platform {
    use std::{fs, io, thread};

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;
    use upbp_core::Canceller;

    pub(super) fn listen(render: Canceller) -> io::Result<()> {
        let mut caught = vec![SIGINT, SIGTERM];
        // `nohup` has it ignored, so that the render outlives its terminal.
        if !is_ignored(SIGHUP) {
            caught.push(SIGHUP);
        }
        let mut signals = Signals::new(caught)?;
        let each = move || {
            for signal in &mut signals {
                // A terminal that is closed may say so twice, while the state is being saved.
                if render.is_cancelled() && signal != SIGHUP {
                    super::end_at_once();
                }
                render.cancel();
            }
        };
        thread::Builder::new().name("signals".to_owned()).spawn(each).map(drop)
    }

    /// Whether the program was started with a signal ignored, as far as the system tells.
    fn is_ignored(signal: i32) -> bool {
        let mask = fs::read_to_string("/proc/self/status").ok().and_then(|status| {
            let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
            u64::from_str_radix(mask.trim(), 16).ok()
        });
        mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
    }
}

#[cfg(not(unix))]
mod platform {
    use std::io;

    use upbp_core::Canceller;

    pub(super) fn listen(render: Canceller) -> io::Result<()> {
        let each = move || {
            if render.is_cancelled() {
                super::end_at_once();
            }
            render.cancel();
        };
        ctrlc::set_handler(each).map_err(io::Error::other)
    }
}
