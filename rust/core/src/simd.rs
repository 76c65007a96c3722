//! One source, every instruction set.
//!
//! A kernel is written once, as plain loops over small arrays ("lanes"), and compiled three times: for the
//! processor family's baseline, for AVX2 and for AVX-512. [`Level::run`] picks the copy at run time. On other
//! processors than x86-64 the baseline is all there is (on aarch64 it includes NEON).
//!
//! Where a loop over lanes does not become the one instruction that a processor has for it, the instruction is named in
//! [`Instructions`], beside the loop that says what it does and that every other processor runs.
//!
//! This is the one place that knows about instruction sets, and one of the crate's two files with `unsafe`.

use crate::lanes::{LANES, Lanes};
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
    /// Do the work, with `simd` as the proof of what the processor has.
    fn run<I: Instructions>(self, simd: I) -> Self::Output;
}

/// What lanes alone do not compile well to. A value of such a type proves that the processor has the instructions.
pub trait Instructions: Copy {
    /// For each lane a bit, whether `low <= x <= high`.
    #[inline(always)]
    fn within_f32(self, x: &Lanes<f32>, low: &Lanes<f32>, high: &Lanes<f32>) -> u16 {
        within(x, low, high)
    }

    /// For each lane a bit, whether `low <= x <= high`.
    #[inline(always)]
    fn within_f64(self, x: &Lanes<f64>, low: &Lanes<f64>, high: &Lanes<f64>) -> u16 {
        within(x, low, high)
    }
}

#[inline(always)]
fn within<T: Copy + PartialOrd>(x: &Lanes<T>, low: &Lanes<T>, high: &Lanes<T>) -> u16 {
    (0..LANES).fold(0, |bits, lane| {
        let inside = (low[lane] <= x[lane]) & (x[lane] <= high[lane]);
        bits | (u16::from(inside) << lane)
    })
}

/// Proof of nothing beyond the baseline.
#[derive(Clone, Copy)]
struct Baseline;

#[cfg(not(target_arch = "x86_64"))]
impl Instructions for Baseline {}

/// Every x86-64 processor has SSE2.
#[cfg(target_arch = "x86_64")]
impl Instructions for Baseline {
    #[inline(always)]
    fn within_f32(self, x: &Lanes<f32>, low: &Lanes<f32>, high: &Lanes<f32>) -> u16 {
        x86::within_sse2_f32(x, low, high)
    }

    #[inline(always)]
    fn within_f64(self, x: &Lanes<f64>, low: &Lanes<f64>, high: &Lanes<f64>) -> u16 {
        x86::within_sse2_f64(x, low, high)
    }
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
            Set::Baseline => kernel.run(Baseline),
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
    kernel.run(x86::Avx2::new())
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(x86::Avx512::new())
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Instructions, LANES, Lanes};
    use std::arch::x86_64::{
        _CMP_GE_OQ, _CMP_LE_OQ, _mm_and_pd, _mm_and_ps, _mm_cmpge_pd, _mm_cmpge_ps, _mm_cmple_pd, _mm_cmple_ps,
        _mm_loadu_pd, _mm_loadu_ps, _mm_movemask_pd, _mm_movemask_ps, _mm256_and_pd, _mm256_and_ps, _mm256_cmp_pd,
        _mm256_cmp_ps, _mm256_loadu_pd, _mm256_loadu_ps, _mm256_movemask_pd, _mm256_movemask_ps, _mm512_cmp_pd_mask,
        _mm512_cmp_ps_mask, _mm512_loadu_pd, _mm512_loadu_ps, _mm512_mask_cmp_pd_mask, _mm512_mask_cmp_ps_mask,
    };

    #[inline(always)]
    pub fn within_sse2_f32(x: &Lanes<f32>, low: &Lanes<f32>, high: &Lanes<f32>) -> u16 {
        let mut bits = 0;
        for at in (0..LANES).step_by(4) {
            // SAFETY: every x86-64 processor has SSE2; each array holds 4 numbers from `at`, at most 12.
            bits |= unsafe {
                let x = _mm_loadu_ps(x.as_ptr().add(at));
                let above = _mm_cmpge_ps(x, _mm_loadu_ps(low.as_ptr().add(at)));
                let below = _mm_cmple_ps(x, _mm_loadu_ps(high.as_ptr().add(at)));
                low_bits(_mm_movemask_ps(_mm_and_ps(above, below))) << at
            };
        }
        bits
    }

    #[inline(always)]
    pub fn within_sse2_f64(x: &Lanes<f64>, low: &Lanes<f64>, high: &Lanes<f64>) -> u16 {
        let mut bits = 0;
        for at in (0..LANES).step_by(2) {
            // SAFETY: every x86-64 processor has SSE2; each array holds 2 numbers from `at`, at most 14.
            bits |= unsafe {
                let x = _mm_loadu_pd(x.as_ptr().add(at));
                let above = _mm_cmpge_pd(x, _mm_loadu_pd(low.as_ptr().add(at)));
                let below = _mm_cmple_pd(x, _mm_loadu_pd(high.as_ptr().add(at)));
                low_bits(_mm_movemask_pd(_mm_and_pd(above, below))) << at
            };
        }
        bits
    }

    /// A movemask of at most 8 lanes.
    #[inline(always)]
    #[allow(clippy::cast_possible_truncation, reason = "at most 8 bits are set")]
    fn low_bits(mask: i32) -> u16 {
        mask.cast_unsigned() as u16
    }

    /// Proof of AVX2.
    #[derive(Clone, Copy)]
    pub struct Avx2(());

    /// Proof of AVX-512 F, BW, DQ and VL.
    #[derive(Clone, Copy)]
    pub struct Avx512(());

    impl Avx2 {
        /// Only callable where the feature is enabled, which is what makes the value a proof.
        #[target_feature(enable = "avx2")]
        pub fn new() -> Self {
            Avx2(())
        }
    }

    impl Avx512 {
        /// Only callable where the features are enabled, which is what makes the value a proof.
        #[target_feature(enable = "avx512f,avx512dq")]
        pub fn new() -> Self {
            Avx512(())
        }
    }

    /// # Safety
    /// The processor must have AVX2, and each array hold 8 numbers from `at`.
    #[inline(always)]
    unsafe fn within_8(at: usize, x: &Lanes<f32>, low: &Lanes<f32>, high: &Lanes<f32>) -> u16 {
        // SAFETY: as the caller promises.
        unsafe {
            let x = _mm256_loadu_ps(x.as_ptr().add(at));
            let above = _mm256_cmp_ps::<_CMP_GE_OQ>(x, _mm256_loadu_ps(low.as_ptr().add(at)));
            let below = _mm256_cmp_ps::<_CMP_LE_OQ>(x, _mm256_loadu_ps(high.as_ptr().add(at)));
            low_bits(_mm256_movemask_ps(_mm256_and_ps(above, below))) << at
        }
    }

    /// # Safety
    /// The processor must have AVX2, and each array hold 4 numbers from `at`.
    #[inline(always)]
    unsafe fn within_4(at: usize, x: &Lanes<f64>, low: &Lanes<f64>, high: &Lanes<f64>) -> u16 {
        // SAFETY: as the caller promises.
        unsafe {
            let x = _mm256_loadu_pd(x.as_ptr().add(at));
            let above = _mm256_cmp_pd::<_CMP_GE_OQ>(x, _mm256_loadu_pd(low.as_ptr().add(at)));
            let below = _mm256_cmp_pd::<_CMP_LE_OQ>(x, _mm256_loadu_pd(high.as_ptr().add(at)));
            low_bits(_mm256_movemask_pd(_mm256_and_pd(above, below))) << at
        }
    }

    /// # Safety
    /// The processor must have AVX-512 F and DQ, and each array hold 8 numbers from `at`.
    #[inline(always)]
    unsafe fn within_8_wide(at: usize, x: &Lanes<f64>, low: &Lanes<f64>, high: &Lanes<f64>) -> u16 {
        // SAFETY: as the caller promises.
        unsafe {
            let x = _mm512_loadu_pd(x.as_ptr().add(at));
            let above = _mm512_cmp_pd_mask::<_CMP_GE_OQ>(x, _mm512_loadu_pd(low.as_ptr().add(at)));
            u16::from(_mm512_mask_cmp_pd_mask::<_CMP_LE_OQ>(above, x, _mm512_loadu_pd(high.as_ptr().add(at)))) << at
        }
    }

    impl Instructions for Avx2 {
        #[inline(always)]
        fn within_f32(self, x: &Lanes<f32>, low: &Lanes<f32>, high: &Lanes<f32>) -> u16 {
            // SAFETY: `self` proves AVX2; 16 numbers are 8 from 0 and from 8.
            unsafe { within_8(0, x, low, high) | within_8(8, x, low, high) }
        }

        #[inline(always)]
        fn within_f64(self, x: &Lanes<f64>, low: &Lanes<f64>, high: &Lanes<f64>) -> u16 {
            // SAFETY: `self` proves AVX2; 16 numbers are 4 from 0, 4, 8 and 12.
            unsafe {
                within_4(0, x, low, high)
                    | within_4(4, x, low, high)
                    | within_4(8, x, low, high)
                    | within_4(12, x, low, high)
            }
        }
    }

    impl Instructions for Avx512 {
        #[inline(always)]
        fn within_f32(self, x: &Lanes<f32>, low: &Lanes<f32>, high: &Lanes<f32>) -> u16 {
            // SAFETY: `self` proves AVX-512 F; each array is one register long.
            unsafe {
                let x = _mm512_loadu_ps(x.as_ptr());
                let above = _mm512_cmp_ps_mask::<_CMP_GE_OQ>(x, _mm512_loadu_ps(low.as_ptr()));
                _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(above, x, _mm512_loadu_ps(high.as_ptr()))
            }
        }

        #[inline(always)]
        fn within_f64(self, x: &Lanes<f64>, low: &Lanes<f64>, high: &Lanes<f64>) -> u16 {
            // SAFETY: `self` proves AVX-512 F and DQ; 16 numbers are 8 from 0 and from 8.
            unsafe { within_8_wide(0, x, low, high) | within_8_wide(8, x, low, high) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Instructions, Kernel, Level, within};
    use crate::lanes::Lanes;

    struct Within<'a>(&'a Lanes<f32>, &'a Lanes<f32>, &'a Lanes<f32>);

    impl Kernel for Within<'_> {
        type Output = (u16, u16);

        #[inline(always)]
        fn run<I: Instructions>(self, simd: I) -> (u16, u16) {
            let wide = |x: &Lanes<f32>| x.map(f64::from);
            (simd.within_f32(self.0, self.1, self.2), simd.within_f64(&wide(self.0), &wide(self.1), &wide(self.2)))
        }
    }

    #[test]
    fn within_is_its_loop_at_every_level() {
        let odd = [0.0, -0.0, 1.0, -1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-45];
        for turn in 0..odd.len() {
            let lanes = |step: usize| std::array::from_fn(|lane| odd[(lane * step + turn * lane + step) % odd.len()]);
            let (x, low, high): (Lanes<f32>, Lanes<f32>, Lanes<f32>) = (lanes(1), lanes(3), lanes(5));
            let expected = within(&x, &low, &high);
            for level in Level::all() {
                assert_eq!(level.run(Within(&x, &low, &high)), (expected, expected), "{level}");
            }
        }
    }
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
