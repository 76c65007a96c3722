//! Long calls that end early when somebody waits no longer, as after Ctrl-C.
//!
//! A kernel that may run for seconds counts what it does with [`worked`]. Inside of [`until`] the count asks now and
//! then whether to end. If so, the call is unwound up to there, and its result never exists; elsewhere a call runs to
//! its end. A thread that helps another ends when that one does.

use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The time between two questions.
const PAUSE: Duration = Duration::from_millis(50);
/// The numbers between two looks at the clock, which take a tenth of a millisecond.
const STEP: usize = 1 << 16;

/// A call ended before it was done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interrupted;

/// What a thread watches while it works.
#[derive(Clone)]
pub(crate) struct Watch {
    /// The question, which only the thread that calls asks.
    ask: Option<fn() -> bool>,
    asked: Instant,
    ended: Arc<AtomicBool>,
}

thread_local! {
    /// The numbers until the next look at the clock.
    static LEFT: Cell<usize> = const { Cell::new(usize::MAX) };
    static WATCH: RefCell<Option<Watch>> = const { RefCell::new(None) };
}

/// Returns the result of `work`, which ends early when `ask` returns true.
///
/// # Errors
/// When it ended early.
pub fn until<R>(ask: fn() -> bool, work: impl FnOnce() -> R) -> Result<R, Interrupted> {
    watching(Some(Watch { ask: Some(ask), asked: Instant::now(), ended: Arc::default() }), work)
}

/// Counts work on `numbers` numbers, and ends the call by unwinding if it is to end.
#[inline(always)]
pub fn worked(numbers: usize) {
    match LEFT.get().checked_sub(numbers) {
        Some(left) => LEFT.set(left),
        None => look(),
    }
}

#[cold]
#[inline(never)]
fn look() {
    LEFT.set(STEP);
    let Some(Watch { ask, asked, ended }) = WATCH.with_borrow(Clone::clone) else { return };
    // The question may make calls of its own, so that nothing is borrowed meanwhile.
    if let Some(ask) = ask
        && asked.elapsed() >= PAUSE
    {
        ended.fetch_or(ask(), Ordering::Relaxed);
        WATCH.set(Some(Watch { ask: Some(ask), asked: Instant::now(), ended: Arc::clone(&ended) }));
    }
    if ended.load(Ordering::Relaxed) {
        resume_unwind(Box::new(Interrupted));
    }
}

/// What a thread is to watch that helps this one.
pub(crate) fn for_helpers() -> Option<Watch> {
    WATCH.with_borrow(|watch| watch.clone().map(|watch| Watch { ask: None, ..watch }))
}

/// Returns the result of `work` unless the watch ends it.
pub(crate) fn watching<R>(watch: Option<Watch>, work: impl FnOnce() -> R) -> Result<R, Interrupted> {
    let before = (LEFT.replace(STEP), WATCH.replace(watch));
    let done = catch_unwind(AssertUnwindSafe(work));
    LEFT.set(before.0);
    WATCH.set(before.1);
    done.map_err(|panic| match panic.downcast::<Interrupted>() {
        Ok(interrupted) => *interrupted,
        Err(panic) => resume_unwind(panic),
    })
}

#[cfg(test)]
mod tests {
    use super::{Interrupted, until, worked};
    use crate::threads::pieces;

    #[test]
    fn endless_work_ends_on_every_thread() {
        for threads in [1, 4] {
            let endless = || {
                pieces(threads, 64, 1, |_| -> () {
                    loop {
                        worked(1000);
                    }
                })
            };
            assert_eq!(until(|| true, endless), Err(Interrupted));
            assert_eq!(until(|| true, || pieces(threads, 64, 1, |range| range.len()).iter().sum()), Ok(64));
        }
    }

    #[test]
    fn a_question_may_make_calls_of_its_own() {
        fn ask() -> bool {
            until(|| false, || (0..1000).for_each(|_| worked(1000))).is_err()
        }
        assert_eq!(until(ask, || (0..1_000_000).for_each(|_| worked(1000))), Ok(()));
    }

    #[test]
    fn nobody_ends_a_call_that_nobody_watches() {
        (0..1000).for_each(|_| worked(usize::MAX / 2));
    }

    #[test]
    #[should_panic(expected = "of another kind")]
    fn another_panic_goes_on() {
        let _ = until(|| true, || panic!("of another kind"));
    }
}
