//! Work on several threads, for those who ask for it.
//!
//! Threads come from rayon's pool, which is started when first asked for and sleeps in between. One thread is the
//! default everywhere and touches no pool.
//!
//! Whoever asks works too, and takes whatever nobody has begun: a helper that wakes late finds less left, or nothing, and
//! is not waited for. One that is interrupted within a piece is.

use rayon::ThreadPoolBuilder;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, Once, OnceLock, PoisonError};

/// Pieces for each thread, so that one that begins late or is held up leaves some of its own to the others.
const PIECES: usize = 4;

/// Whether the pool is there.
static STARTED: Once = Once::new();

/// `work` on the range `0 .. n`, cut into pieces, in order, by at most `threads` threads with at least `least` each.
pub fn pieces<R: Send>(threads: usize, n: usize, least: usize, work: impl Fn(Range<usize>) -> R + Sync) -> Vec<R> {
    let threads = threads.min(n / least.max(1)).max(1);
    if threads == 1 || is_forked() {
        return vec![work(0..n)];
    }
    // The thread that asks first becomes one of the pool: what it gave away and nobody has begun, it can take back.
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
        (1..threads).for_each(|_| scope.spawn(|_| take_all()));
        take_all();
    });
    results.into_iter().filter_map(|result| result.into_inner().unwrap_or_else(PoisonError::into_inner)).collect()
}

/// Whether this process was forked from one that had used threads. They were not copied, and work given to them would
/// never be done.
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
