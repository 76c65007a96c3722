//! The scan kernels at every instruction-set level, each checked against a naive loop before it is timed.

use criterion::{Bencher, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use ttc_fast_benches::{CAR, MOUNT, STRAIGHT, TURNING, rooms, scanner};
use ttc_fast_core::column::{Column, ColumnMut};
use ttc_fast_core::scan::{ScanTtc, Settings};
use ttc_fast_core::simd::Level;
use ttc_fast_core::vehicle::Motion;

const SIZES: [usize; 4] = [271, 1080, 4096, 65_536];
/// Scans take turns, so that no branch predictor learns one by heart.
const SCANS: usize = 64;
/// Large ones are fewer, so that together they stay in the cache.
const MOST_BEAMS: usize = SCANS * 4096;

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
        let scans: [Vec<f32>; SCANS] = rooms(&scanner(beams));
        let scans = &scans[..SCANS.min(MOST_BEAMS / beams)];
        group.throughput(Throughput::Bytes(size_of_val(scans[0].as_slice()) as u64));
        for level in Level::all() {
            let scan = ScanTtc::new(scanner(beams), level).expect("the settings make sense");
            group.bench_function(BenchmarkId::new(level.to_string(), beams), |b| bench(b, &scan, scans));
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
