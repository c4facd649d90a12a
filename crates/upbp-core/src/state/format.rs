//! State files.
//!
//! ```text
//! "UPBPSTAT"   8 bytes
//! version      u32, little-endian as all numbers
//! block        the header: RON text
//! block ...    one per row of the film: the sums of each layer, of the even iterations, of what is seen
//!              directly in even and in odd ones, of squares, of features if there are any
//! ```
//!
//! A block is its length (u32), its bytes, and the checksum (u64) of all blocks so far: each block is known
//! to be good, and in its place, before anything in it is believed. Memory for the film grows as blocks
//! arrive, so a file cannot ask for more than some fifty times its own length.

use std::io::{self, Read, Write};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::checksum::Checksum;
use super::{Identity, Record, State};
use crate::error::StateError;
use crate::film::Film;
use crate::film::exact_sum::{self, MAX_ENCODED, Sum3};
use crate::film::{IterationSet, MAX_ITERATIONS, Parts};

/// First bytes of every state file.
pub(crate) const MAGIC: [u8; 8] = *b"UPBPSTAT";

/// Version of the format.
const VERSION: u32 = 9;

/// The longest header, bytes: room for millions of emitters to choose from, and of ranges of iterations.
const MAX_HEADER: u64 = 1 << 28;

/// All but the film's sums.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    identity: Identity,
    iterations: IterationSet,
    /// Iterations that are there in part.
    begun: Parts,
    record: Record,
}

/// A short name for some bytes.
pub(crate) fn fingerprint(bytes: &[u8]) -> String {
    let mut checksum = Checksum::new();
    checksum.add(bytes);
    format!("{:016x}", checksum.value())
}

impl Film {
    /// A number of the film's bits, as text: equal for the same sums of the same iterations, however they
    /// came about.
    #[must_use]
    pub fn fingerprint(&self) -> String {
        let mut checksum = Checksum::new();
        let layers: Vec<_> = self.layers().collect();
        let what = format!("{:?}{:?}{layers:?}", self.iteration_set().ranges(), self.parts());
        checksum.add(what.as_bytes());
        let of_row = |bytes: &mut Vec<u8>, row| {
            self.encode_row(row, bytes);
            let mut checksum = Checksum::new();
            checksum.add(bytes);
            checksum.value()
        };
        let height = self.rect().height as usize;
        let rows: Vec<_> = (0..height).into_par_iter().map_init(Vec::new, of_row).collect();
        for row in rows {
            checksum.add(&row.to_le_bytes());
        }
        format!("{:016x}", checksum.value())
    }

    fn encode_row(&self, row: usize, bytes: &mut Vec<u8>) {
        bytes.clear();
        self.row(row).for_each(|sum| exact_sum::encode(sum, bytes));
    }
}

impl State {
    /// Writes the state, in blocks of one row of the film.
    ///
    /// # Errors
    /// Those of `to`; tens of millions of emitters, or of gaps in the set of iterations.
    pub fn write(&self, mut to: impl Write) -> io::Result<()> {
        let header = Header {
            identity: self.identity.clone(),
            iterations: self.film.iteration_set().clone(),
            begun: self.film.parts().clone(),
            record: self.record.clone(),
        };
        let text = ron::to_string(&header).map_err(io::Error::other)?;
        if text.len() as u64 > MAX_HEADER {
            let message = format!("its header has {} bytes, at most {MAX_HEADER} can be read", text.len());
            return Err(io::Error::other(message));
        }
        to.write_all(&MAGIC)?;
        to.write_all(&VERSION.to_le_bytes())?;
        let mut checksum = Checksum::new();
        write_block(&mut to, &mut checksum, text.as_bytes())?;
        let mut bytes = Vec::new();
        for row in 0..self.identity.crop.height as usize {
            self.film.encode_row(row, &mut bytes);
            write_block(&mut to, &mut checksum, &bytes)?;
        }
        to.flush()
    }

    /// Reads a state to the end of `from`. It need not be buffered.
    ///
    /// # Errors
    /// Those of `from`; bytes that are not a state, or not a whole one, or not what was written.
    pub fn read(from: impl Read) -> Result<Self, StateError> {
        let mut from = io::BufReader::with_capacity(1 << 16, from);
        let mut mark = [0; 12];
        if !fills(&mut from, &mut mark)? || mark[..8] != MAGIC {
            return Err(StateError::NotAState);
        }
        let version = u32::from_le_bytes([mark[8], mark[9], mark[10], mark[11]]);
        if version != VERSION {
            return Err(StateError::Version { expected: VERSION, found: version });
        }
        let mut checksum = Checksum::new();
        let header = read_block(&mut from, &mut checksum, MAX_HEADER, "header")?;
        let text = str::from_utf8(&header).map_err(|error| damaged("header", &error))?;
        let Header { identity, iterations, begun, record } =
            ron::from_str(text).map_err(|error| damaged("header", &error))?;

        let rect = identity.crop;
        if !rect.is_part_of(identity.film) {
            return Err(damaged("header", &"the crop is not inside of the film"));
        }
        let numbers = iterations.len() + begun.len() as u64;
        for iteration in begun.keys() {
            if *iteration >= MAX_ITERATIONS || iterations.contains(*iteration) {
                return Err(damaged("header", &format!("no part of an iteration: {iteration}")));
            }
        }
        let mut film =
            Film::without_sums(rect, identity.plan.techniques, identity.settings.features, iterations, begun);
        let longest = u64::from(rect.width) * (film.all_mut().count() * MAX_ENCODED) as u64;
        for row in 0..rect.height {
            let what = || format!("row {row} of {}", rect.height);
            let block = read_block(&mut from, &mut checksum, longest, &what())?;
            let mut bytes = block.as_slice();
            for sums in film.all_mut() {
                decode(&mut bytes, rect.width as usize, numbers, sums)
                    .ok_or_else(|| damaged(&what(), &"no sums"))?;
            }
            if !bytes.is_empty() {
                return Err(damaged(&what(), &"too long"));
            }
        }
        if fills(&mut from, &mut [0])? {
            return Err(damaged("end", &"bytes follow"));
        }
        Ok(Self { identity, record, film })
    }
}

/// Takes `count` sums of `numbers` numbers from the front of `bytes`. `None` if they are not there.
fn decode(bytes: &mut &[u8], count: usize, numbers: u64, sums: &mut Vec<Sum3>) -> Option<()> {
    // An empty sum takes three bytes: no more memory than for what can be there.
    sums.try_reserve(count.min(bytes.len() / 3)).ok()?;
    for _ in 0..count {
        sums.push(exact_sum::decode(bytes, numbers)?);
    }
    Some(())
}

fn write_block(to: &mut impl Write, checksum: &mut Checksum, bytes: &[u8]) -> io::Result<()> {
    let length = u32::try_from(bytes.len()).map_err(io::Error::other)?;
    checksum.add(bytes);
    to.write_all(&length.to_le_bytes())?;
    to.write_all(bytes)?;
    to.write_all(&checksum.value().to_le_bytes())
}

fn read_block(
    from: &mut impl Read,
    checksum: &mut Checksum,
    longest: u64,
    what: &str,
) -> Result<Vec<u8>, StateError> {
    let cut = || damaged(what, &"the file ends here");
    let mut length = [0; 4];
    if !fills(from, &mut length)? {
        return Err(cut());
    }
    let length = u64::from(u32::from_le_bytes(length));
    if length > longest {
        return Err(damaged(what, &"too long"));
    }
    // Grows as bytes arrive, whatever the length says.
    let mut bytes = Vec::new();
    from.take(length).read_to_end(&mut bytes)?;
    let mut expected = [0; 8];
    if bytes.len() as u64 != length || !fills(from, &mut expected)? {
        return Err(cut());
    }
    checksum.add(&bytes);
    if checksum.value() != u64::from_le_bytes(expected) {
        return Err(damaged(what, &"its checksum is wrong"));
    }
    Ok(bytes)
}

/// Fills the buffer; `false` if there is not enough.
fn fills(from: &mut impl Read, buffer: &mut [u8]) -> io::Result<bool> {
    match from.read_exact(buffer) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

fn damaged(place: &str, reason: &dyn std::fmt::Display) -> StateError {
    StateError::Damaged { place: place.to_owned(), reason: reason.to_string() }
}
