//! The scan kernels at every instruction-set level, each checked against a naive loop before it is timed.

use criterion::{Bencher, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::f64::consts::PI;
use std::hint::black_box;
use ttc_fast_core::column::{Column, ColumnMut};
use ttc_fast_core::real::Real;
use ttc_fast_core::scan::{ScanTtc, Settings};
use ttc_fast_core::simd::Level;
use ttc_fast_core::vehicle::{Motion, Mount, Outline};

const SIZES: [usize; 2] = [1080, 65_536];
/// Scans take turns, so that no branch predictor learns one by heart; together they stay in the cache.
const SCANS: usize = 4;

const CAR: Outline = Outline { x_rear: -0.1, x_front: 0.45, y_right: -0.15, y_left: 0.15 };
const MOUNT: Mount = Mount { x: 0.27, y: 0.0, yaw: 0.0 };
const STRAIGHT: Motion = Motion { speed: 5.0, yaw_rate: 0.0, lateral_speed: 0.0 };
const TURNING: Motion = Motion { speed: 5.0, yaw_rate: 0.8, lateral_speed: 0.0 };

/// A scanner that looks 240 degrees around.
fn settings(beams: usize) -> Settings {
    Settings {
        range_min: 0.06,
        range_max: 30.0,
        mount: MOUNT,
        outline: Some(CAR),
        ..Settings::new(-2.0 * PI / 3.0, 4.0 * PI / 3.0 / (beams - 1) as f64, beams)
    }
}

/// Scans of a room: noise on its walls, and NaN, +inf and error codes in between. The same in every run.
fn room(settings: &Settings) -> Vec<Vec<f32>> {
    let mut state = 2026_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1_u32 << 24) as f32
    };
    let mut reading = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        let along = if cos > 0.0 { 9.0 } else { 3.0 } / cos.abs();
        match random() {
            chance if chance < 0.02 => f32::NAN,
            chance if chance < 0.04 => f32::INFINITY,
            chance if chance < 0.05 => 0.005,
            _ => f32::from_f64(along.min(2.5 / sin.abs())) + 0.02 * random(),
        }
    };
    (0..SCANS).map(|_| settings.angles().map(&mut reading).collect()).collect()
}

/// The definition: every beam by itself.
fn naive(settings: &Settings, ranges: &[f32], motion: Motion) -> Vec<f64> {
    let ttc = |(angle, range): (f64, &f32)| {
        let (sin, cos) = angle.sin_cos();
        let closing = motion.speed * cos + motion.yaw_rate * MOUNT.x * sin;
        if !(0.06..=30.0).contains(range) || closing <= settings.min_closing_speed {
            return f64::INFINITY;
        }
        let to_end = (if cos > 0.0 { CAR.x_front } else { CAR.x_rear } - MOUNT.x) / cos;
        let to_side = if sin > 0.0 { CAR.y_left } else { CAR.y_right } / sin;
        (f64::from(*range) - to_end.min(to_side)).max(0.0) / closing
    };
    settings.angles().zip(ranges).map(ttc).collect()
}

fn assert_close(got: f64, expected: f64, tolerance: f64) {
    let close = got == expected || (got - expected).abs() <= tolerance * expected;
    assert!(close, "the kernel gives {got}, the naive loop {expected}");
}

/// Benchmarks `bench` at every size and level. It checks its answer, then times.
fn each_level(c: &mut Criterion, name: &str, bench: impl Fn(&mut Bencher<'_>, &ScanTtc, &[Vec<f32>])) {
    let mut group = c.benchmark_group(name);
    for beams in SIZES {
        let scans = room(&settings(beams));
        group.throughput(Throughput::Bytes(size_of_val(scans[0].as_slice()) as u64));
        for level in Level::all() {
            let scan = ScanTtc::new(settings(beams), level).expect("the settings make sense");
            group.bench_function(BenchmarkId::new(level.to_string(), beams), |b| bench(b, &scan, &scans));
        }
    }
    group.finish();
}

fn min(b: &mut Bencher<'_>, scan: &ScanTtc, scans: &[Vec<f32>], motion: Motion) {
    let run = |ranges: &[f32]| scan.min(Column::new(ranges), motion).expect("one range for each beam");
    for ranges in scans {
        let expected = naive(scan.settings(), ranges, motion).into_iter().fold(f64::INFINITY, f64::min);
        assert_close(run(ranges).expect("the scan shows something"), expected, 1e-12);
    }
    let mut turns = scans.iter().cycle();
    b.iter(|| run(black_box(turns.next().expect("endless"))));
}

fn nearest(b: &mut Bencher<'_>, scan: &ScanTtc, scans: &[Vec<f32>]) {
    let run = |ranges: &[f32]| scan.nearest(Column::new(ranges), STRAIGHT).expect("one range for each beam");
    for ranges in scans {
        let (answer, ttc) = (run(ranges), naive(scan.settings(), ranges, STRAIGHT));
        assert_close(answer.ttc, ttc.iter().copied().fold(f64::INFINITY, f64::min), 1e-12);
        assert_close(ttc[answer.beam.expect("something closes")], answer.ttc, 1e-12);
        assert_eq!(answer.counts.valid as usize, ranges.iter().filter(|r| (0.06..=30.0).contains(*r)).count());
    }
    let mut turns = scans.iter().cycle();
    b.iter(|| run(black_box(turns.next().expect("endless"))));
}

fn per_beam(b: &mut Bencher<'_>, scan: &ScanTtc, scans: &[Vec<f32>]) {
    let mut out = vec![0.0_f32; scans[0].len()];
    let run = |ranges: &[f32], out: &mut [f32]| {
        scan.per_beam(Column::new(ranges), STRAIGHT, &mut ColumnMut::new(out), None).expect("lengths agree");
    };
    for ranges in scans {
        run(ranges, &mut out);
        for (got, expected) in out.iter().zip(naive(scan.settings(), ranges, STRAIGHT)) {
            assert_close(f64::from(*got), expected, 1e-4);
        }
    }
    let mut turns = scans.iter().cycle();
    b.iter(|| run(black_box(turns.next().expect("endless")), black_box(&mut out)));
}

fn scan(c: &mut Criterion) {
    each_level(c, "min, straight", |b, scan, scans| min(b, scan, scans, STRAIGHT));
    each_level(c, "min, turning", |b, scan, scans| min(b, scan, scans, TURNING));
    each_level(c, "nearest", nearest);
    each_level(c, "per_beam", per_beam);
}

criterion_group!(benches, scan);
criterion_main!(benches);
