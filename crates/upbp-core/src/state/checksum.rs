//! A checksum for files: no guard against malice, but against disks, cables and half-written copies.

/// A running checksum of 64 bits. A change within eight neighbouring bytes never goes unseen, any other with
/// probability 2⁻⁶⁴.
#[derive(Clone, Debug)]
pub(super) struct Checksum(u64);

impl Checksum {
    pub(super) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Adds some bytes, and their number.
    pub(super) fn add(&mut self, bytes: &[u8]) {
        let (words, rest) = bytes.as_chunks();
        for word in words {
            self.add_word(u64::from_le_bytes(*word));
        }
        let mut last = [0; 8];
        last[..rest.len()].copy_from_slice(rest);
        self.add_word(u64::from_le_bytes(last));
        self.add_word(bytes.len() as u64);
    }

    /// Both steps can be undone: states that differ stay different.
    fn add_word(&mut self, word: u64) {
        let product = (self.0 ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.0 = product ^ product >> 32;
    }

    pub(super) fn value(&self) -> u64 {
        self.0
    }
}
