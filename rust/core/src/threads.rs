//! Work on several threads, where a caller asks for it.
//!
//! The threads come from rayon's pool, which starts with the first such call and sleeps between calls. One thread is
//! the default everywhere, and needs no pool.
//!
//! The calling thread works too, and takes any piece that no thread has begun. A thread that wakes late finds fewer
//! pieces left, or none, and the call does not wait for it. The call waits for a thread that is interrupted within a
//! piece.

use crate::interrupt::{for_helpers, watching};
use rayon::ThreadPoolBuilder;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, Once, OnceLock, PoisonError};

/// The number of pieces for each thread. A thread that begins late or is held up leaves some of its own to the others.
const PIECES: usize = 4;

/// Starts the pool once.
static STARTED: Once = Once::new();

/// Returns the results of `work` on the pieces of the range `0 .. n`, in order, computed by at most `threads` threads
/// with at least `least` numbers each.
pub fn pieces<R: Send>(threads: usize, n: usize, least: usize, work: impl Fn(Range<usize>) -> R + Sync) -> Vec<R> {
    let threads = threads.min(n / least.max(1)).max(1);
    if threads == 1 || is_forked() {
        return vec![work(0..n)];
    }
    // The first thread to call becomes one of the pool, so that it can take back pieces that no other has begun.
    STARTED.call_once(|| drop(ThreadPoolBuilder::new().use_current_thread().build_global()));

    let count = n.min(threads * PIECES);
    let results: Vec<Mutex<Option<R>>> = (0..count).map(|_| Mutex::new(None)).collect();
    let next = AtomicUsize::new(0);
    let take_all = || {
        while let i = next.fetch_add(1, Ordering::Relaxed)
            && let Some(result) = results.get(i)
        {
            let done = work((n * i / count)..(n * (i + 1) / count));
            *result.lock().unwrap_or_else(PoisonError::into_inner) = Some(done);
        }
    };
    rayon::in_place_scope(|scope| {
        let watch = for_helpers();
        (1..threads).for_each(|_| {
            let watch = watch.clone();
            scope.spawn(|_| {
                let _ = watching(watch, take_all); // one that ends early has no results to give, and nobody to ask
            });
        });
        take_all();
    });
    results.into_iter().filter_map(|result| result.into_inner().unwrap_or_else(PoisonError::into_inner)).collect()
}

/// Whether this process was forked from one that had used threads. A fork does not copy threads, so that work given to
/// the pool would never be done.
fn is_forked() -> bool {
    static FIRST: OnceLock<u32> = OnceLock::new();
    *FIRST.get_or_init(std::process::id) != std::process::id()
}

#[cfg(test)]
mod tests {
    use super::pieces;

    #[test]
    fn pieces_cover_the_range_in_order() {
        for (threads, n, least) in [(1, 10, 1), (3, 10, 1), (7, 3, 1), (2, 100, 60), (4, 0, 5), (2, 5, 0)] {
            let all: Vec<usize> = pieces(threads, n, least, Iterator::collect::<Vec<_>>).concat();
            assert_eq!(all, (0..n).collect::<Vec<_>>());
        }
    }
}
