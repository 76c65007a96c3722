//! The camera kernel at every instruction-set level, each answer checked against a naive loop before it is timed.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use ttc_fast_benches::Random;
use ttc_fast_core::camera::{Estimator, KeypointTtc, Keypoints, ttc_from_keypoints};
use ttc_fast_core::column::Column;
use ttc_fast_core::simd::Level;

/// x and y before, x and y now.
type Matches = [Vec<f32>; 4];

const SIZES: [usize; 4] = [50, 200, 1000, 3000];
const MIN_DISTANCE: f64 = 100.0;

/// A car that grows by a hundredth, with a pixel of noise; rounded to pixels if `grid`. The same in every run.
fn car(count: usize, grid: bool) -> Matches {
    let mut random = Random(2026);
    let mut columns = Matches::default();
    for _ in 0..count {
        let (x, y) = (random.between(550.0, 700.0), random.between(180.0, 330.0));
        let numbers = [x, y, 1.01 * x + random.between(-0.5, 0.5), 1.01 * y + random.between(-0.5, 0.5)];
        for (column, number) in columns.iter_mut().zip(numbers) {
            column.push(if grid { number.round() } else { number });
        }
    }
    columns
}

/// The ratios of all pairs that count, in order: the definition.
fn ratios([x0, y0, x1, y1]: &Matches) -> Vec<f64> {
    let squared = |x: &[f32], y: &[f32], i: usize, j: usize| {
        let [x, y] = [f64::from(x[j]) - f64::from(x[i]), f64::from(y[j]) - f64::from(y[i])];
        x * x + y * y
    };
    let pairs = (0..x0.len()).flat_map(|i| (i + 1..x0.len()).map(move |j| (i, j)));
    let mut ratios: Vec<f64> = pairs
        .map(|(i, j)| (squared(x0, y0, i, j), squared(x1, y1, i, j)))
        .filter(|(before, now)| *before > 0.0 && *now >= MIN_DISTANCE * MIN_DISTANCE)
        .map(|(before, now)| (now / before).sqrt())
        .collect();
    ratios.sort_unstable_by(f64::total_cmp);
    ratios
}

fn run([x0, y0, x1, y1]: &Matches, estimator: Estimator, level: Level) -> KeypointTtc {
    let keypoints = Keypoints { previous: [x0, y0].map(|x| Column::new(x)), current: [x1, y1].map(|x| Column::new(x)) };
    ttc_from_keypoints(black_box(keypoints), 0.1, MIN_DISTANCE, estimator, level, 1).expect("the settings make sense")
}

fn check(matches: &Matches, level: Level) {
    let (answer, ratios) = (run(matches, Estimator::MedianRatio, level), ratios(matches));
    let middle = ratios.len() / 2;
    let median = if ratios.len() % 2 == 1 { ratios[middle] } else { f64::midpoint(ratios[middle - 1], ratios[middle]) };
    assert_eq!((answer.scale, answer.pairs), (median, ratios.len()));
}

fn median(c: &mut Criterion) {
    for (name, grid) in [("median of ratios", false), ("median of ratios, on pixels", true)] {
        let mut group = c.benchmark_group(name);
        for count in SIZES {
            let matches = car(count, grid);
            group.throughput(Throughput::Elements((count * (count - 1) / 2) as u64));
            for level in Level::all() {
                check(&matches, level);
                group.bench_function(BenchmarkId::new(level.to_string(), count), |b| {
                    b.iter(|| run(&matches, Estimator::MedianRatio, level));
                });
            }
        }
    }
}

fn consensus(c: &mut Criterion) {
    let mut group = c.benchmark_group("consensus");
    for count in SIZES {
        let matches = car(count, false);
        let lowest = run(&matches, Estimator::default(), Level::BASELINE);
        for level in Level::all() {
            assert_eq!(run(&matches, Estimator::default(), level), lowest);
            group.bench_function(BenchmarkId::new(level.to_string(), count), |b| {
                b.iter(|| run(&matches, Estimator::default(), level));
            });
        }
    }
}

criterion_group!(benches, median, consensus);
criterion_main!(benches);
