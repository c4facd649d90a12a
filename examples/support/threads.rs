//! The number of threads that work.

use std::num::NonZeroUsize;

/// The most threads per core. More only wait for each other, and each takes memory.
const PER_CORE: usize = 16;

/// A number of threads that makes sense on this machine.
pub(crate) fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let most = PER_CORE.saturating_mul(cores);
    match text.parse::<NonZeroUsize>() {
        Ok(threads) if threads.get() <= most => Ok(threads),
        _ => Err(format!("expected a number from 1 to {most}, {PER_CORE} per core")),
    }
}
