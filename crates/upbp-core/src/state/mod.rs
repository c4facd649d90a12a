//! The state of a render: enough to go on, and to put the work of several runs together.
//!
//! Iterations are independent given their index, and the sums of a film do not depend on the order of
//! additions. So there is one operation, [`State::merge`]: resuming is merging into a fresh render.

mod checksum;
mod format;
mod identity;
mod record;

use std::path::Path;

pub use identity::Identity;
pub(crate) use identity::SAMPLES;
pub use record::{ErrorPoint, ErrorSeries, PassSeconds};
pub(crate) use record::{PassTimes, Record};

use upbp_estimators::Counters;

use crate::error::{OutputError, StateError};
use crate::files::{open_file, write_whole};
use crate::film::{Film, Image, MAX_ITERATIONS};

pub(crate) use format::{MAGIC, fingerprint};

/// A render at some moment: what it is, what it has done, its film.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    pub(crate) identity: Identity,
    pub(crate) record: Record,
    pub(crate) film: Film,
}

impl State {
    /// Identity of the render.
    #[must_use]
    pub const fn identity(&self) -> &Identity {
        &self.identity
    }

    /// The film.
    #[must_use]
    pub const fn film(&self) -> &Film {
        &self.film
    }

    /// Counts over all iterations.
    #[must_use]
    pub const fn counters(&self) -> &Counters {
        &self.record.counters
    }

    /// Wall seconds of the passes of all iterations.
    #[must_use]
    pub fn seconds(&self) -> PassSeconds {
        self.record.times.seconds()
    }

    /// The error of what is on the film against a reference; not a number if it has another size, or pixels
    /// that are not finite.
    #[must_use]
    pub fn error_against(&self, reference: &Image) -> ErrorPoint {
        let image = self.film.image();
        ErrorPoint {
            seconds: self.seconds().total(),
            iterations: self.film.iterations(),
            relative_mse: image.relative_mse(reference),
            over_scales: image.relative_mse_over_scales(reference),
            rmse: image.rmse(reference),
        }
    }

    /// Adds what another run of the same render has done. The result has the same bits in whatever order
    /// states are merged. A series of errors belongs to one run: it is lost unless one of the two has no
    /// iterations.
    ///
    /// # Errors
    /// If the other state is of another render, or has iterations that this one has too. Then nothing has
    /// changed.
    pub fn merge(&mut self, other: Self) -> Result<(), StateError> {
        self.identity.check_same(&other.identity)?;
        if let Some(common) = self.film.overlap(&other.film) {
            return Err(StateError::Overlap { start: common.start, end: common.end });
        }
        let (none, others_none) = (self.film.is_empty(), other.film.is_empty());
        // What may differ is that of the state with the first iteration, so that the order does not matter.
        let first = |film: &Film| film.first().unwrap_or(MAX_ITERATIONS);
        if first(&other.film) < first(&self.film) {
            self.identity = other.identity;
        }
        let record = &mut self.record;
        record.times.add(&other.record.times);
        record.counters.add(&other.record.counters);
        record.map_bytes = record.map_bytes.max(other.record.map_bytes);
        record.expected_bytes = record.expected_bytes.max(other.record.expected_bytes);
        if none {
            record.series = other.record.series;
            self.film = other.film;
        } else if !others_none {
            record.series = ErrorSeries::default();
            self.film.merge(&other.film);
        }
        Ok(())
    }

    /// Writes a file as a whole or not at all: a crash at any moment leaves the file that was there or the
    /// new one.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn save(&self, path: &Path) -> Result<(), OutputError> {
        write_whole(path, |writer| {
            self.write(writer).map_err(|source| OutputError::Write { path: path.to_owned(), source })
        })
    }

    /// Reads a file that [`save`](Self::save) wrote.
    ///
    /// # Errors
    /// Those of [`read`](Self::read), with the file's name.
    pub fn load(path: &Path) -> Result<Self, OutputError> {
        let read = || Self::read(open_file(path, u64::MAX)?);
        read().map_err(|source| OutputError::State { path: path.to_owned(), source })
    }
}
