//! The error of constructors.

use crate::Spectrum;

/// A value that a medium or a phase function cannot be built from.
///
/// Every variant names the quantity, the offending value and what was expected, so that a scene reader
/// can add the position in its file and print the rest as it is.
#[derive(Copy, Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MediaError {
    /// A number outside its range, or not a number.
    #[error("{what} is {value}, expected {expected}")]
    OutOfRange {
        /// The quantity, as the documentation names it.
        what: &'static str,
        /// The value that was given.
        value: f32,
        /// The accepted range, in words.
        expected: &'static str,
    },
    /// One channel of a spectrum outside its range, or not a number.
    #[error("channel {channel} of {what} is {value}, expected {expected}")]
    ChannelOutOfRange {
        /// The quantity, as the documentation names it.
        what: &'static str,
        /// The channel: 0 red, 1 green, 2 blue.
        channel: usize,
        /// The value of that channel.
        value: f32,
        /// The accepted range, in words.
        expected: &'static str,
    },
    /// One entry of a list outside its range, or not a number.
    #[error("{what} {index} is {value}, expected {expected}")]
    EntryOutOfRange {
        /// The quantity, as the documentation names it.
        what: &'static str,
        /// Position in the list, from 0.
        index: usize,
        /// The value of that entry.
        value: f32,
        /// The accepted range, in words.
        expected: &'static str,
    },
    /// A list without entries.
    #[error("{what} is empty, expected {expected}")]
    Empty {
        /// The list, as the documentation names it.
        what: &'static str,
        /// The required contents, in words.
        expected: &'static str,
    },
}

/// Accepts a spectrum whose channels are all finite and not negative.
pub(crate) fn check_non_negative(what: &'static str, value: Spectrum) -> Result<Spectrum, MediaError> {
    for (channel, value) in value.to_array().into_iter().enumerate() {
        if !(value.is_finite() && value >= 0.0) {
            let expected = "a finite number of at least zero";
            return Err(MediaError::ChannelOutOfRange { what, channel, value, expected });
        }
    }
    Ok(value)
}
