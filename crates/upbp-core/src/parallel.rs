//! Pieces of work on all threads of the current pool.
//!
//! Iterators of rayon are compiled for each kind of piece, thus for each type of scene, and take the compiler
//! long. Of this only a loop is.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// Does `pieces` of work on all threads; each thread takes the next one when it is done with its last, and
/// has a scratch of its own. Whether all were done: none is begun after one that has returned `false`.
///
/// Which thread does which piece is a matter of chance: the caller puts what they leave in their order.
pub(crate) fn do_all<T, S: Default>(
    pieces: impl Iterator<Item = T> + Send,
    work: impl Fn(&mut S, T) -> bool + Sync,
) -> bool {
    /// Halts the other threads if its own panics.
    struct HaltOnPanic<'a>(&'a AtomicBool);
    impl Drop for HaltOnPanic<'_> {
        fn drop(&mut self) {
            if std::thread::panicking() {
                self.0.store(true, Ordering::Relaxed);
            }
        }
    }
    let (pieces, is_halted) = (Mutex::new(pieces), AtomicBool::new(false));
    let next = || pieces.lock().unwrap_or_else(PoisonError::into_inner).next();
    on_all_threads(&|| {
        let _guard = HaltOnPanic(&is_halted);
        let mut scratch = S::default();
        while !is_halted.load(Ordering::Relaxed)
            && let Some(piece) = next()
        {
            if !work(&mut scratch, piece) {
                is_halted.store(true, Ordering::Relaxed);
            }
        }
    });
    !is_halted.into_inner()
}

/// Runs the same on each thread of the pool that is free.
fn on_all_threads(run: &(dyn Fn() + Sync)) {
    rayon::scope(|scope| {
        for _ in 0..rayon::current_num_threads() {
            scope.spawn(|_| run());
        }
    });
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU64;

    use super::*;

    #[test]
    fn each_piece_is_done_once() {
        for threads in [1, 2, 5] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut counts = vec![0; 1000];
            let done = pool.install(|| {
                do_all(counts.iter_mut().enumerate(), |before: &mut usize, (index, count)| {
                    *count += 1;
                    *before <= std::mem::replace(before, index + 1)
                })
            });
            assert!(done && counts.iter().all(|count| *count == 1));
        }
    }

    #[test]
    fn not_all_are_begun_after_one_that_panics() {
        // Minutes of work, so that it does not matter how long a panic takes to be told.
        const PIECES: u64 = 1 << 32;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let begun = AtomicU64::new(0);
        let run = || {
            do_all(0..PIECES, |(): &mut (), piece| {
                begun.fetch_add(1, Ordering::Relaxed);
                assert!(piece != 30, "a piece that fails");
                true
            })
        };
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| pool.install(run)));
        assert!(result.is_err() && begun.into_inner() < PIECES);
    }

    #[test]
    fn none_is_begun_after_one_that_broke_off() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let mut counts = vec![0; 100];
        let done = pool.install(|| {
            do_all(counts.iter_mut().enumerate(), |(): &mut (), (index, count)| {
                *count += 1;
                index < 30
            })
        });
        assert!(!done && counts.iter().sum::<i32>() == 31);
    }
}
