//! Processor time, which does not pass while other processes have the processor.

use std::fs;
use std::path::Path;

/// Processor seconds of a process or a thread, by its folder in `/proc`. `None` for what has ended, or where
/// there is no such folder.
pub fn seconds(folder: &Path) -> Option<f64> {
    let text = fs::read_to_string(folder.join("stat")).ok()?;
    // In ticks of 10 ms: the 14th and the 15th field, of which the second is a name in parentheses.
    let mut fields = text.rsplit_once(')')?.1.split_ascii_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<f64>().ok();
    Some(0.01 * (ticks()? + ticks()?))
}
