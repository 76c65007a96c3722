//! One source, every instruction set.
//!
//! A kernel is written once, as plain loops over small arrays ("lanes"), and compiled three times: for the
//! processor family's baseline, for AVX2 and for AVX-512. [`Level::run`] picks the copy at run time. On other
//! processors than x86-64 the baseline is all there is (on aarch64 it includes NEON).
//!
//! This is the one place that knows about instruction sets, and one of the crate's two files with `unsafe`.

use std::fmt;

/// An instruction-set level that this processor is known to have.
///
/// The inner enum is private so that a `Level` can only come from detection: holding one is the proof
/// that [`Level::run`] may execute its instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Level(Set);

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Set {
    Baseline,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

/// Work that can be compiled for any level.
///
/// `run` has to be `#[inline(always)]`, and so has everything hot that it calls: only code inlined
/// into the level's own function is compiled with the level's instructions.
pub trait Kernel {
    /// What the work gives.
    type Output;
    /// Do the work.
    fn run(self) -> Self::Output;
}

impl Level {
    /// What every processor of the family has.
    pub const BASELINE: Level = Level(Set::Baseline);

    /// The highest level of this processor.
    #[must_use]
    pub fn best() -> Level {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl")
                && has_avx2()
            {
                return Level(Set::Avx512);
            }
            if has_avx2() {
                return Level(Set::Avx2);
            }
        }
        Level::BASELINE
    }

    /// The level called `name`, or the best one below it that this processor has; `None` for an unknown name.
    #[must_use]
    pub fn at_most(name: &str) -> Option<Level> {
        match name {
            "baseline" => Some(Level::BASELINE),
            #[cfg(target_arch = "x86_64")]
            "avx2" => Some(Level(Set::Avx2).min(Level::best())),
            #[cfg(target_arch = "x86_64")]
            "avx512" => Some(Level(Set::Avx512).min(Level::best())),
            #[cfg(not(target_arch = "x86_64"))]
            "avx2" | "avx512" => Some(Level::BASELINE),
            _ => None,
        }
    }

    /// Every level of this processor, the lowest first.
    #[must_use]
    pub fn all() -> Vec<Level> {
        let mut levels: Vec<Level> = ["baseline", "avx2", "avx512"].into_iter().filter_map(Level::at_most).collect();
        levels.dedup();
        levels
    }

    /// Run `kernel`, compiled for this level.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            Set::Baseline => kernel.run(),
            // SAFETY: a `Level` holding `Avx2` is only made by `best` and `at_most`, after `has_avx2` said yes.
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => unsafe { run_avx2(kernel) },
            // SAFETY: a `Level` holding `Avx512` is only made after `best` detected each enabled feature.
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => unsafe { run_avx512(kernel) },
        }
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            Set::Baseline => "baseline",
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => "avx512",
        })
    }
}

#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

#[cfg(test)]
mod tests {
    use super::Level;

    #[test]
    fn names_round_trip_and_only_lower() {
        for level in Level::all() {
            assert_eq!(Level::at_most(&level.to_string()), Some(level));
            assert!(level <= Level::best());
        }
        assert_eq!(Level::at_most("avx9000"), None);
        assert_eq!(Level::all()[0], Level::BASELINE);
    }
}
