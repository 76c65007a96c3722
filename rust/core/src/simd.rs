//! One source, every instruction set.
//!
//! A kernel is written once, as plain loops over small arrays ("lanes"), and compiled three times: for the
//! processor family's baseline, for AVX2 and for AVX-512. [`Level::run`] picks the copy at run time. On other
//! processors than x86-64 the baseline is all there is; on aarch64 it includes NEON, and is called that.
//!
//! Where a loop over lanes does not become the one instruction that a processor has for it, the instruction is named in
//! [`Instructions`], beside the loop that says what it does and that every other processor runs.
//!
//! This is the one place that knows about instruction sets, and one of the crate's two files with `unsafe`.

use crate::lanes::{LANES, Lanes, each, lanes};
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
    /// The result of the work.
    type Output;
    /// Whether AVX-512 makes it so much quicker than AVX2 that it is worth a copy of its own in the library.
    const AVX512: bool = true;
    /// Does the work, with `simd` as the proof of what the processor has.
    fn run<I: Instructions>(self, simd: I) -> Self::Output;
}

/// Instructions that loops over lanes do not compile to. A value of such a type proves that the processor has them.
pub trait Instructions: Copy {
    /// Whether comparing lanes gives bits in one instruction, so that counting those is quicker than counting in lanes.
    const BITS: bool = false;

    /// Returns `a * b + c`, rounded once where the processor has an instruction for it, else twice.
    #[inline(always)]
    #[must_use]
    fn mul_add(a: f32, b: f32, c: f32) -> f32 {
        a * b + c
    }

    /// Returns a bit for each lane where `low <= x <= high`.
    #[inline(always)]
    fn within_f32(self, x: &Lanes<f32>, low: &Lanes<f32>, high: &Lanes<f32>) -> u16 {
        within(x, low, high)
    }

    /// Returns a bit for each lane where `low <= x <= high`.
    #[inline(always)]
    fn within_f64(self, x: &Lanes<f64>, low: &Lanes<f64>, high: &Lanes<f64>) -> u16 {
        within(x, low, high)
    }

    /// Returns a bit for each lane that is not above `limit`.
    #[inline(always)]
    fn at_most_f32(self, x: &Lanes<f32>, limit: f32) -> u16 {
        self.within_f32(x, &[f32::NEG_INFINITY; LANES], &[limit; LANES])
    }

    /// Returns those of some bits whose lane is not above `limit`.
    #[inline(always)]
    fn and_at_most_f32(self, those: u16, x: &Lanes<f32>, limit: f32) -> u16 {
        those & self.at_most_f32(x, limit)
    }

    /// Returns a bit for each lane that is not above `limit`.
    #[inline(always)]
    fn at_most_f64(self, x: &Lanes<f64>, limit: f64) -> u16 {
        self.within_f64(x, &[f64::NEG_INFINITY; LANES], &[limit; LANES])
    }

    /// Returns `1 / x` to a few units in the last place, where `x` and the result are normal numbers; any number elsewhere.
    #[inline(always)]
    fn reciprocal_f32(self, x: &Lanes<f32>) -> Lanes<f32> {
        each(*x, |x| 1.0 / x)
    }

    /// Whether any of 16 points passes the prefilter: no is certain, and yes where there is no quick way to tell.
    #[inline(always)]
    fn may_pass_f32(self, _points: &[Lanes<f32>; 4], _prefilter: &Prefilter<f32>) -> bool {
        true
    }

    /// Whether any of 16 points passes the prefilter: no is certain, and yes where there is no quick way to tell.
    #[inline(always)]
    fn may_pass_f64(self, _points: &[Lanes<f64>; 4], _prefilter: &Prefilter<f64>) -> bool {
        true
    }

    /// Keeps the smaller of each pair in `least`. A NaN in `x` is passed over.
    #[inline(always)]
    fn keep_least_f32(self, least: &mut Lanes<f32>, x: &Lanes<f32>) {
        keep_least(least, x);
    }

    /// Keeps the smaller of each pair in `least`. A NaN in `x` is passed over.
    #[inline(always)]
    fn keep_least_f64(self, least: &mut Lanes<f64>, x: &Lanes<f64>) {
        keep_least(least, x);
    }

    /// Returns the lanes whose bit is set, in order, and any numbers behind them.
    #[inline(always)]
    fn compress_f32(self, x: &Lanes<f32>, keep: u16) -> Lanes<f32> {
        compress(x, keep)
    }

    /// Returns the lanes whose bit is set, in order, and any numbers behind them.
    #[inline(always)]
    fn compress_f64(self, x: &Lanes<f64>, keep: u16) -> Lanes<f64> {
        compress(x, keep)
    }

    /// Returns the lanes whose bit is set, in order, and any numbers behind them.
    #[inline(always)]
    fn compress_u32(self, x: &Lanes<u32>, keep: u16) -> Lanes<u32> {
        compress(x, keep)
    }
}

#[inline(always)]
fn compress<T: Copy>(x: &Lanes<T>, keep: u16) -> Lanes<T> {
    let (mut kept, mut count) = (*x, 0);
    let mut left = keep;
    while left != 0 {
        kept[count % LANES] = x[left.trailing_zeros() as usize % LANES];
        left &= left - 1;
        count += 1;
    }
    kept
}

#[inline(always)]
fn keep_least<T: Copy + PartialOrd>(least: &mut Lanes<T>, x: &Lanes<T>) {
    for lane in 0..LANES {
        least[lane] = if x[lane] < least[lane] { x[lane] } else { least[lane] };
    }
}

/// Bounds on points of four numbers, the same for each of four points, that cost an addition and a comparison a number.
///
/// A number passes if the bits of `x + shift` are at most the bits of `width`. Whatever is within the bounds passes,
/// for rounding keeps the order; what lies outside by less than a rounding may pass too.
#[derive(Clone, Copy, Debug)]
pub struct Prefilter<T> {
    /// The lower bounds, negated: what is below them becomes negative, and the bits of that are large.
    pub shift: Lanes<T>,
    /// The upper bounds, shifted; all bits set where anything passes.
    pub width: Lanes<T>,
}

/// Returns the last of the four bits of each of 16 points, where all four are set.
#[inline(always)]
fn whole_points(bits: u64) -> u64 {
    // Adding 1 to three set bits carries into the fourth.
    const LAST: u64 = 0x8888_8888_8888_8888;
    ((bits & !LAST) + (LAST >> 3)) & bits & LAST
}

/// Returns a bit for each of 16 points whose four bits are all set.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, reason = "the bits left are the low ones")]
pub(crate) fn bit_of_each_point(bits: u64) -> u16 {
    // Pairs of bits, then fours, then eights move together.
    let bits = whole_points(bits) >> 3;
    let bits = (bits | bits >> 3) & 0x0303_0303_0303_0303;
    let bits = (bits | bits >> 6) & 0x000F_000F_000F_000F;
    let bits = (bits | bits >> 12) & 0x0000_00FF_0000_00FF;
    (bits | bits >> 24) as u16
}

/// Returns the same number, of which the compiler then knows nothing. It moves sums of counted bits into vectors, where
/// each costs several times as much.
#[inline(always)]
pub(crate) fn alone(count: u32) -> u32 {
    #[cfg(target_arch = "x86_64")]
    let count = {
        let same: u32;
        // SAFETY: no instruction at all.
        unsafe {
            std::arch::asm!("/* {0:e} */", inout(reg) count => same, options(pure, nomem, nostack, preserves_flags));
        }
        same
    };
    count
}

/// Returns reciprocals to a few units in the last place, from ones that are right to 11 bits: a step of Newton's method
/// doubles the bits.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn refined<I: Instructions>(x: &Lanes<f32>, rough: &Lanes<f32>) -> Lanes<f32> {
    lanes(|lane| rough[lane] * I::mul_add(-x[lane], rough[lane], 2.0))
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

    #[inline(always)]
    fn may_pass_f32(self, points: &[Lanes<f32>; 4], prefilter: &Prefilter<f32>) -> bool {
        x86::may_pass_sse2_f32(points, prefilter)
    }

    #[inline(always)]
    fn keep_least_f32(self, least: &mut Lanes<f32>, x: &Lanes<f32>) {
        // SAFETY: every x86-64 processor has SSE2.
        unsafe { x86::keep_least_sse2_f32(least, x) }
    }

    #[inline(always)]
    fn keep_least_f64(self, least: &mut Lanes<f64>, x: &Lanes<f64>) {
        // SAFETY: every x86-64 processor has SSE2.
        unsafe { x86::keep_least_sse2_f64(least, x) }
    }
}

impl Level {
    /// The level that every processor of the family has.
    pub const BASELINE: Level = Level(Set::Baseline);

    /// What [`Level::at_most`] knows, the lowest first. Names of other families' levels mean the best one below.
    pub const NAMES: [&str; 4] = ["baseline", "neon", "avx2", "avx512"];

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

    /// Returns the level called `name`, or the best one below it that this processor has; `None` for an unknown name.
    #[must_use]
    pub fn at_most(name: &str) -> Option<Level> {
        match name {
            #[cfg(target_arch = "x86_64")]
            "avx2" => Some(Level(Set::Avx2).min(Level::best())),
            #[cfg(target_arch = "x86_64")]
            "avx512" => Some(Level(Set::Avx512).min(Level::best())),
            _ => Level::NAMES.contains(&name).then_some(Level::BASELINE),
        }
    }

    /// Every level of this processor, the lowest first.
    #[must_use]
    pub fn all() -> Vec<Level> {
        let mut levels: Vec<Level> = Level::NAMES.into_iter().filter_map(Level::at_most).collect();
        levels.dedup();
        levels
    }

    /// Runs `kernel`, compiled for this level.
    #[inline(always)]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            Set::Baseline => run_baseline(kernel),
            // SAFETY: a `Level` holding `Avx2` is only made by `best` and `at_most`, after `has_avx2` said yes.
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => unsafe { run_avx2(kernel) },
            // SAFETY: a `Level` holding `Avx512` is only made after `best` detected each enabled feature.
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 if K::AVX512 => unsafe { run_avx512(kernel) },
            // SAFETY: `best` says AVX-512 only where `has_avx2` says yes as well.
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => unsafe { run_avx2(kernel) },
        }
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            Set::Baseline if cfg!(target_arch = "aarch64") => "neon",
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
        && is_x86_feature_detected!("fma")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
}

// Never inlined, so that a kernel that runs another is compiled as if it were alone, with all registers for its own
// loop; and so that it is in the library once, however many functions run it.
#[inline(never)]
fn run_baseline<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(Baseline)
}

#[cfg(target_arch = "x86_64")]
#[inline(never)]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(x86::Avx2::new())
}

#[cfg(target_arch = "x86_64")]
#[inline(never)]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run(x86::Avx512::new())
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Instructions, LANES, Lanes, Prefilter, refined, whole_points};
    use std::arch::x86_64::{
        __m256i, _CMP_GE_OQ, _CMP_LE_OQ, _mm_add_ps, _mm_and_pd, _mm_and_ps, _mm_castps_si128, _mm_cmpeq_epi32,
        _mm_cmpge_pd, _mm_cmpge_ps, _mm_cmpgt_epi32, _mm_cmple_pd, _mm_cmple_ps, _mm_loadu_pd, _mm_loadu_ps,
        _mm_loadu_si128, _mm_min_pd, _mm_min_ps, _mm_movemask_epi8, _mm_movemask_pd, _mm_movemask_ps, _mm_or_si128,
        _mm_packs_epi16, _mm_packs_epi32, _mm_set1_epi32, _mm_setzero_si128, _mm_storeu_pd, _mm_storeu_ps,
        _mm_xor_si128, _mm256_add_ps, _mm256_and_pd, _mm256_and_ps, _mm256_castps_si256, _mm256_cmp_pd, _mm256_cmp_ps,
        _mm256_cmpeq_epi32, _mm256_loadu_pd, _mm256_loadu_ps, _mm256_loadu_si256, _mm256_min_epu32, _mm256_min_pd,
        _mm256_min_ps, _mm256_movemask_pd, _mm256_movemask_ps, _mm256_or_si256, _mm256_packs_epi16, _mm256_packs_epi32,
        _mm256_set1_epi32, _mm256_set1_ps, _mm256_storeu_pd, _mm256_storeu_ps, _mm256_testz_si256, _mm512_add_pd,
        _mm512_add_ps, _mm512_castpd_si512, _mm512_castps_si512, _mm512_cmp_pd_mask, _mm512_cmp_ps_mask,
        _mm512_cmple_epu32_mask, _mm512_cmple_epu64_mask, _mm512_loadu_pd, _mm512_loadu_ps, _mm512_loadu_si512,
        _mm512_mask_cmp_pd_mask, _mm512_mask_cmp_ps_mask, _mm512_maskz_compress_epi32, _mm512_maskz_compress_pd,
        _mm512_maskz_compress_ps, _mm512_min_pd, _mm512_min_ps, _mm512_rcp14_ps, _mm512_set1_ps, _mm512_storeu_pd,
        _mm512_storeu_ps, _mm512_storeu_si512,
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

    #[inline(always)]
    pub fn may_pass_sse2_f32(points: &[Lanes<f32>; 4], prefilter: &Prefilter<f32>) -> bool {
        // SAFETY: every x86-64 processor has SSE2; each array holds 4 numbers from 0, 4, 8 and 12.
        unsafe {
            let sign = _mm_set1_epi32(i32::MIN); // SSE2 compares signed numbers only
            let shift = _mm_loadu_ps(prefilter.shift.as_ptr());
            let width = _mm_xor_si128(_mm_loadu_si128(prefilter.width.as_ptr().cast()), sign);
            let mut any = _mm_setzero_si128();
            for four in points {
                let mut out = [_mm_setzero_si128(); 4];
                for (i, out) in out.iter_mut().enumerate() {
                    let shifted = _mm_castps_si128(_mm_add_ps(_mm_loadu_ps(four.as_ptr().add(4 * i)), shift));
                    *out = _mm_cmpgt_epi32(_mm_xor_si128(shifted, sign), width);
                }
                // A byte for each number, which makes each point one number of four bytes.
                let bytes = _mm_packs_epi16(_mm_packs_epi32(out[0], out[1]), _mm_packs_epi32(out[2], out[3]));
                any = _mm_or_si128(any, _mm_cmpeq_epi32(bytes, _mm_setzero_si128()));
            }
            _mm_movemask_epi8(any) != 0
        }
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

    /// For each of 8 numbers all bits if it passes the prefilter, or none.
    ///
    /// # Safety
    /// The processor must have AVX2, and each array hold 8 numbers from `at`.
    #[inline(always)]
    unsafe fn passing_8(at: usize, x: &Lanes<f32>, prefilter: &Prefilter<f32>) -> __m256i {
        // SAFETY: as the caller promises.
        unsafe {
            let shift = _mm256_loadu_ps(prefilter.shift.as_ptr().add(at));
            let width = _mm256_loadu_si256(prefilter.width.as_ptr().add(at).cast());
            let shifted = _mm256_castps_si256(_mm256_add_ps(_mm256_loadu_ps(x.as_ptr().add(at)), shift));
            _mm256_cmpeq_epi32(_mm256_min_epu32(shifted, width), shifted)
        }
    }

    /// For each of 8 points all bits if its four numbers pass the prefilter, or not all; the points in no order.
    ///
    /// # Safety
    /// The processor must have AVX2.
    #[inline(always)]
    unsafe fn passing_points(a: &Lanes<f32>, b: &Lanes<f32>, prefilter: &Prefilter<f32>) -> __m256i {
        // SAFETY: as the caller promises; 16 numbers are 8 from 0 and from 8.
        unsafe {
            // Saturation keeps all bits all bits: a byte for each number, which makes each point one of four bytes.
            let first = _mm256_packs_epi32(passing_8(0, a, prefilter), passing_8(8, a, prefilter));
            let second = _mm256_packs_epi32(passing_8(0, b, prefilter), passing_8(8, b, prefilter));
            _mm256_cmpeq_epi32(_mm256_packs_epi16(first, second), _mm256_set1_epi32(-1))
        }
    }

    /// For each of 16 numbers a bit, whether it passes the prefilter.
    ///
    /// # Safety
    /// The processor must have AVX-512 F.
    #[inline(always)]
    unsafe fn passing_16(x: &Lanes<f32>, prefilter: &Prefilter<f32>) -> u64 {
        // SAFETY: as the caller promises; each array is one register long.
        unsafe {
            let shifted = _mm512_add_ps(_mm512_loadu_ps(x.as_ptr()), _mm512_loadu_ps(prefilter.shift.as_ptr()));
            let width = _mm512_loadu_si512(prefilter.width.as_ptr().cast());
            _mm512_cmple_epu32_mask(_mm512_castps_si512(shifted), width).into()
        }
    }

    /// For each of 16 numbers a bit, whether it passes the prefilter.
    ///
    /// # Safety
    /// The processor must have AVX-512 F.
    #[inline(always)]
    unsafe fn passing_16_wide(x: &Lanes<f64>, prefilter: &Prefilter<f64>) -> u64 {
        // SAFETY: as the caller promises; each array is two registers long, and the prefilter's two are the same.
        unsafe {
            let shift = _mm512_loadu_pd(prefilter.shift.as_ptr());
            let width = _mm512_loadu_si512(prefilter.width.as_ptr().cast());
            let first = _mm512_castpd_si512(_mm512_add_pd(_mm512_loadu_pd(x.as_ptr()), shift));
            let second = _mm512_castpd_si512(_mm512_add_pd(_mm512_loadu_pd(x.as_ptr().add(8)), shift));
            u64::from(_mm512_cmple_epu64_mask(first, width)) | u64::from(_mm512_cmple_epu64_mask(second, width)) << 8
        }
    }

    macro_rules! keep_least {
        ($($name:ident $float:ident $step:literal $load:ident $least:ident $store:ident),* $(,)?) => {$(
            /// # Safety
            /// The processor must have the instructions.
            #[inline(always)]
            pub unsafe fn $name(least: &mut Lanes<$float>, x: &Lanes<$float>) {
                for at in (0..LANES).step_by($step) {
                    // SAFETY: the caller vouches for the processor; each array holds as many numbers as a register from
                    // `at`, a multiple of that below 16. With a NaN in `x`, the instruction gives its second operand.
                    unsafe {
                        let least = least.as_mut_ptr().add(at);
                        $store(least, $least($load(x.as_ptr().add(at)), $load(least)));
                    }
                }
            }
        )*};
    }

    keep_least! {
        keep_least_sse2_f32 f32 4 _mm_loadu_ps _mm_min_ps _mm_storeu_ps,
        keep_least_sse2_f64 f64 2 _mm_loadu_pd _mm_min_pd _mm_storeu_pd,
        keep_least_avx2_f32 f32 8 _mm256_loadu_ps _mm256_min_ps _mm256_storeu_ps,
        keep_least_avx2_f64 f64 4 _mm256_loadu_pd _mm256_min_pd _mm256_storeu_pd,
        keep_least_avx512_f32 f32 16 _mm512_loadu_ps _mm512_min_ps _mm512_storeu_ps,
        keep_least_avx512_f64 f64 8 _mm512_loadu_pd _mm512_min_pd _mm512_storeu_pd,
    }

    impl Instructions for Avx2 {
        #[inline(always)]
        fn mul_add(a: f32, b: f32, c: f32) -> f32 {
            a.mul_add(b, c)
        }

        #[inline(always)]
        fn at_most_f32(self, x: &Lanes<f32>, limit: f32) -> u16 {
            // SAFETY: `self` proves AVX2; the array holds 8 numbers from 0 and from 8.
            unsafe {
                let limit = _mm256_set1_ps(limit);
                let first = _mm256_cmp_ps::<_CMP_LE_OQ>(_mm256_loadu_ps(x.as_ptr()), limit);
                let second = _mm256_cmp_ps::<_CMP_LE_OQ>(_mm256_loadu_ps(x.as_ptr().add(8)), limit);
                low_bits(_mm256_movemask_ps(first)) | low_bits(_mm256_movemask_ps(second)) << 8
            }
        }

        #[inline(always)]
        fn keep_least_f32(self, least: &mut Lanes<f32>, x: &Lanes<f32>) {
            // SAFETY: `self` proves AVX2.
            unsafe { keep_least_avx2_f32(least, x) }
        }

        #[inline(always)]
        fn keep_least_f64(self, least: &mut Lanes<f64>, x: &Lanes<f64>) {
            // SAFETY: `self` proves AVX2.
            unsafe { keep_least_avx2_f64(least, x) }
        }

        #[inline(always)]
        fn may_pass_f32(self, [a, b, c, d]: &[Lanes<f32>; 4], prefilter: &Prefilter<f32>) -> bool {
            // SAFETY: `self` proves AVX2.
            unsafe {
                let any = _mm256_or_si256(passing_points(a, b, prefilter), passing_points(c, d, prefilter));
                _mm256_testz_si256(any, any) == 0
            }
        }

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
        const BITS: bool = true;

        #[inline(always)]
        fn mul_add(a: f32, b: f32, c: f32) -> f32 {
            a.mul_add(b, c)
        }

        #[inline(always)]
        fn at_most_f32(self, x: &Lanes<f32>, limit: f32) -> u16 {
            // SAFETY: `self` proves AVX-512 F; the array is one register long.
            unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(_mm512_loadu_ps(x.as_ptr()), _mm512_set1_ps(limit)) }
        }

        #[inline(always)]
        fn and_at_most_f32(self, those: u16, x: &Lanes<f32>, limit: f32) -> u16 {
            // SAFETY: `self` proves AVX-512 F; the array is one register long.
            unsafe {
                let (x, limit) = (_mm512_loadu_ps(x.as_ptr()), _mm512_set1_ps(limit));
                _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(those, x, limit)
            }
        }

        #[inline(always)]
        fn reciprocal_f32(self, x: &Lanes<f32>) -> Lanes<f32> {
            let mut rough = [0.0; LANES];
            // SAFETY: `self` proves AVX-512 F; each array is one register long.
            unsafe { _mm512_storeu_ps(rough.as_mut_ptr(), _mm512_rcp14_ps(_mm512_loadu_ps(x.as_ptr()))) };
            refined::<Self>(x, &rough)
        }

        #[inline(always)]
        fn compress_f32(self, x: &Lanes<f32>, keep: u16) -> Lanes<f32> {
            let mut kept = [0.0; LANES];
            // SAFETY: `self` proves AVX-512 F; each array is one register long.
            unsafe { _mm512_storeu_ps(kept.as_mut_ptr(), _mm512_maskz_compress_ps(keep, _mm512_loadu_ps(x.as_ptr()))) };
            kept
        }

        #[inline(always)]
        fn compress_f64(self, x: &Lanes<f64>, keep: u16) -> Lanes<f64> {
            let mut kept = [0.0; LANES];
            let [first, second] = keep.to_le_bytes();
            // SAFETY: `self` proves AVX-512 F; each array is two registers long, and at most 8 lanes are kept of the
            // first.
            unsafe {
                let [low, high] = [_mm512_loadu_pd(x.as_ptr()), _mm512_loadu_pd(x.as_ptr().add(8))];
                _mm512_storeu_pd(kept.as_mut_ptr(), _mm512_maskz_compress_pd(first, low));
                let behind = kept.as_mut_ptr().add(first.count_ones() as usize);
                _mm512_storeu_pd(behind, _mm512_maskz_compress_pd(second, high));
            }
            kept
        }

        #[inline(always)]
        fn compress_u32(self, x: &Lanes<u32>, keep: u16) -> Lanes<u32> {
            let mut kept = [0; LANES];
            // SAFETY: `self` proves AVX-512 F; each array is one register long.
            unsafe {
                let x = _mm512_loadu_si512(x.as_ptr().cast());
                _mm512_storeu_si512(kept.as_mut_ptr().cast(), _mm512_maskz_compress_epi32(keep, x));
            }
            kept
        }

        #[inline(always)]
        fn keep_least_f32(self, least: &mut Lanes<f32>, x: &Lanes<f32>) {
            // SAFETY: `self` proves AVX-512 F.
            unsafe { keep_least_avx512_f32(least, x) }
        }

        #[inline(always)]
        fn keep_least_f64(self, least: &mut Lanes<f64>, x: &Lanes<f64>) {
            // SAFETY: `self` proves AVX-512 F.
            unsafe { keep_least_avx512_f64(least, x) }
        }

        #[inline(always)]
        fn may_pass_f32(self, [a, b, c, d]: &[Lanes<f32>; 4], prefilter: &Prefilter<f32>) -> bool {
            // SAFETY: `self` proves AVX-512 F.
            let bits = unsafe {
                passing_16(a, prefilter)
                    | passing_16(b, prefilter) << 16
                    | passing_16(c, prefilter) << 32
                    | passing_16(d, prefilter) << 48
            };
            whole_points(bits) != 0
        }

        #[inline(always)]
        fn may_pass_f64(self, points: &[Lanes<f64>; 4], prefilter: &Prefilter<f64>) -> bool {
            // One after the other: a sum of eight shifted masks would be added up in a vector, at several times the cost.
            let mut bits = 0;
            for four in points.iter().rev() {
                // SAFETY: `self` proves AVX-512 F.
                bits = bits << 16 | unsafe { passing_16_wide(four, prefilter) };
            }
            whole_points(bits) != 0
        }

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
    use super::{Instructions, Kernel, Level, Prefilter, keep_least, within};
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

    struct AtMost<'a>(&'a Lanes<f32>, f32);

    impl Kernel for AtMost<'_> {
        type Output = (u16, u16);

        #[inline(always)]
        fn run<I: Instructions>(self, simd: I) -> (u16, u16) {
            (simd.at_most_f32(self.0, self.1), simd.at_most_f64(&self.0.map(f64::from), self.1.into()))
        }
    }

    #[test]
    fn at_most_is_its_comparison_at_every_level() {
        let odd = [0.0, -0.0, 1.0, -1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-45];
        for turn in 0..odd.len() {
            let x: Lanes<f32> = std::array::from_fn(|lane| odd[(3 * lane + turn * lane) % odd.len()]);
            for limit in odd {
                let expected = (0..16).map(|lane| u16::from(x[lane] <= limit) << lane).sum();
                for level in Level::all() {
                    assert_eq!(level.run(AtMost(&x, limit)), (expected, expected), "{level}: {limit}");
                }
            }
        }
    }

    struct Reciprocal<'a>(&'a Lanes<f32>);

    impl Kernel for Reciprocal<'_> {
        type Output = Lanes<f32>;

        #[inline(always)]
        fn run<I: Instructions>(self, simd: I) -> Lanes<f32> {
            simd.reciprocal_f32(self.0)
        }
    }

    #[test]
    fn reciprocals_are_right_to_a_few_units_in_the_last_place_at_every_level() {
        let mut x = f32::MIN_POSITIVE;
        while x < 1e30 {
            let each: Lanes<f32> = std::array::from_fn(|lane| x * (1.0 + 0.0625 * lane as f32));
            for level in Level::all() {
                for (x, reciprocal) in each.into_iter().zip(level.run(Reciprocal(&each))) {
                    let error = (f64::from(reciprocal) * f64::from(x) - 1.0).abs();
                    assert!(error < 3.0 * f64::from(f32::EPSILON), "{level}: 1 / {x:e} is {reciprocal:e}");
                }
            }
            x *= 1.37;
        }
    }

    struct MayPass<'a>(&'a [Lanes<f32>; 4], &'a Prefilter<f32>);

    impl Kernel for MayPass<'_> {
        type Output = (bool, bool);

        #[inline(always)]
        fn run<I: Instructions>(self, simd: I) -> (bool, bool) {
            // Wider, a number keeps its place among the others, and all bits set remain a NaN above them all.
            let wide = |x: &Lanes<f32>| x.map(|x| if x.to_bits() == !0 { f64::from_bits(!0) } else { f64::from(x) });
            let prefilter = Prefilter { shift: wide(&self.1.shift), width: wide(&self.1.width) };
            (simd.may_pass_f32(self.0, self.1), simd.may_pass_f64(&self.0.map(|x| wide(&x)), &prefilter))
        }
    }

    #[test]
    fn a_prefilter_lets_through_what_its_definition_does_at_every_level() {
        let everything = f32::from_bits(!0);
        let prefilter = |shift: [f32; 4], width: [f32; 4]| Prefilter {
            shift: std::array::from_fn(|lane| shift[lane % 4]),
            width: std::array::from_fn(|lane| width[lane % 4]),
        };
        // x in [2, 20], y in [-2, 2], z in [-1.5, -0.5], and 0 <= the fourth or not.
        let bounded = prefilter([-2.0, 2.0, 1.5, 0.0], [18.0, 4.0, 1.0, f32::INFINITY]);
        let open = prefilter([-2.0, 2.0, 1.5, 0.0], [18.0, 4.0, 1.0, everything]);
        let odd = [2.0, -0.0, 1.75, 20.5, -1.0, f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1e-45];
        for place in 0..16 {
            for (column, value) in (0..4).flat_map(|column| odd.map(|value| (column, value))) {
                let mut points = [[0.0; 16]; 4];
                let mut point = [5.0, 0.5, -1.0, 0.5];
                point[column] = value;
                points[place / 4][place % 4 * 4..][..4].copy_from_slice(&point);
                for (prefilter, is_open) in [(bounded, false), (open, true)] {
                    let passes = (0..4).all(|i| {
                        (is_open && i == 3) || (point[i] + prefilter.shift[i]).to_bits() <= prefilter.width[i].to_bits()
                    });
                    for level in Level::all() {
                        let (single, double) = level.run(MayPass(&points, &prefilter));
                        assert_eq!(single, passes, "{level}: {point:?}");
                        assert!(double || !passes, "{level}: {point:?} in float64");
                    }
                }
            }
        }
    }

    struct KeepLeast<'a>(&'a Lanes<f32>, &'a Lanes<f32>);

    impl Kernel for KeepLeast<'_> {
        type Output = (Lanes<f32>, Lanes<f64>);

        #[inline(always)]
        fn run<I: Instructions>(self, simd: I) -> Self::Output {
            let (mut single, mut double) = (*self.0, self.0.map(f64::from));
            simd.keep_least_f32(&mut single, self.1);
            simd.keep_least_f64(&mut double, &self.1.map(f64::from));
            (single, double)
        }
    }

    #[test]
    fn keeping_the_least_passes_nan_over_at_every_level() {
        let odd = [0.0, -0.0, 1.0, -1.0, f32::INFINITY, f32::NEG_INFINITY, 1e-45, f32::NAN];
        for turn in 0..odd.len() {
            let least: Lanes<f32> = std::array::from_fn(|lane| odd[(lane + turn) % 7]);
            let x: Lanes<f32> = std::array::from_fn(|lane| odd[(3 * lane + turn * lane) % 8]);
            let mut expected = least;
            keep_least(&mut expected, &x);
            assert!(expected.iter().all(|least| !least.is_nan()));
            for level in Level::all() {
                let (single, double) = level.run(KeepLeast(&least, &x));
                assert_eq!(single.map(f32::to_bits), expected.map(f32::to_bits), "{level}");
                assert_eq!(double.map(f64::to_bits), expected.map(|x| f64::from(x).to_bits()), "{level}");
            }
        }
    }

    struct Compress(u16);

    impl Kernel for Compress {
        type Output = (Lanes<f32>, Lanes<f64>, Lanes<u32>);

        #[inline(always)]
        fn run<I: Instructions>(self, simd: I) -> Self::Output {
            let lanes: Lanes<u16> = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
            let (single, double, lanes) = (lanes.map(f32::from), lanes.map(f64::from), lanes.map(u32::from));
            (simd.compress_f32(&single, self.0), simd.compress_f64(&double, self.0), simd.compress_u32(&lanes, self.0))
        }
    }

    #[test]
    fn compressing_keeps_the_lanes_of_the_bits_in_order_at_every_level() {
        for keep in (0..=u16::MAX).step_by(11).chain([u16::MAX]) {
            let expected: Vec<u32> = (0..16).filter(|lane| keep >> lane & 1 == 1).collect();
            for level in Level::all() {
                let (single, double, whole) = level.run(Compress(keep));
                assert_eq!(whole[..expected.len()], expected, "{level}, {keep:016b}");
                for (lane, place) in expected.iter().enumerate() {
                    let found = (f64::from(single[lane]), double[lane]);
                    assert_eq!(found, (f64::from(*place), f64::from(*place)), "{level}, {keep:016b}");
                }
            }
        }
    }

    #[test]
    fn points_have_a_bit_each_where_all_four_are_set() {
        for point in 0..16 {
            for four in 0..16_u64 {
                let others = 0x7777_7777_7777_7777 & !(0xf << (4 * point));
                let bits = others | four << (4 * point);
                assert_eq!(super::bit_of_each_point(bits), u16::from(four == 15) << point, "{bits:016x}");
            }
        }
        assert_eq!(super::bit_of_each_point(u64::MAX), u16::MAX);
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
