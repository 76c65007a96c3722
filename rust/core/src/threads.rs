//! Work on several threads, for those who ask for it.
//!
//! Threads come from rayon's pool, which is started when first asked for and sleeps in between. One thread is the
//! default everywhere and touches no pool.

use std::ops::Range;
use std::sync::OnceLock;

/// `work` on the range `0 .. n`, cut into at most `threads` pieces of at least `least`, in order.
pub fn pieces<R: Send>(threads: usize, n: usize, least: usize, work: impl Fn(Range<usize>) -> R + Sync) -> Vec<R> {
    let count = threads.min(n / least.max(1)).max(1);
    if count == 1 || is_forked() {
        return vec![work(0..n)];
    }
    let piece = |i: usize| (n * i / count)..(n * (i + 1) / count);
    let mut results: Vec<Option<R>> = (0..count).map(|_| None).collect();
    rayon::in_place_scope(|scope| {
        let (own, others) = results.split_at_mut(1);
        for (i, result) in others.iter_mut().enumerate() {
            let work = &work;
            scope.spawn(move |_| *result = Some(work(piece(i + 1))));
        }
        own[0] = Some(work(piece(0)));
    });
    results.into_iter().flatten().collect()
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
