//! The cloud kernel at every instruction-set level, each answer checked against a naive loop before it is timed.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use ttc_fast_benches::Random;
use ttc_fast_core::cloud::{CheckedGate, Estimator, Gate, MinX, robust_min_x};
use ttc_fast_core::column::{Column, Table};
use ttc_fast_core::points::{Intensity, Points};
use ttc_fast_core::simd::Level;

type Row = [f32; 4];

const SIZES: [usize; 3] = [20_000, 114_000, 1_000_000];
const FRAME: usize = 114_000;
const K: usize = 10;
/// Clouds take turns, so that no branch predictor learns one by heart.
const CLOUDS: usize = 4;

/// Low things in the own lane that reflect.
fn gate() -> CheckedGate {
    let gate = Gate { x: (2.0, 20.0), z: Some((-1.5, -0.9)), intensity: Some((0.1, 1.0)), ..Gate::default() };
    gate.checked().expect("the gate makes sense")
}

/// Things all around, a few of a thousand of them inside the gate. The same in every run.
fn streets(points: usize) -> [Vec<Row>; CLOUDS] {
    let mut random = Random(2026);
    let mut point = || {
        [random.between(-60.0, 60.0), random.between(-30.0, 30.0), random.between(-2.0, 3.0), random.between(0.0, 1.0)]
    };
    std::array::from_fn(|_| (0..points).map(|_| point()).collect())
}

fn points(rows: &[Row]) -> Points<'_, f32> {
    let column = |at: usize| {
        // SAFETY: number `at` of four of every row, as long as the rows are borrowed.
        let column = unsafe { Column::from_raw(rows.as_ptr().cast::<f32>().add(at).cast(), rows.len(), 16) };
        // SAFETY: a single row is the column itself.
        unsafe { Table::from_raw(column, 1, 0) }
    };
    Points::new([column(0), column(1), column(2)], Some(Intensity::F32(column(3)))).expect("columns of equal shape")
}

/// The distances inside the gate, nearest first: the definition.
fn inside(rows: &[Row]) -> Vec<f32> {
    let is_inside = |&&[x, y, z, intensity]: &&Row| {
        (2.0..=20.0).contains(&x)
            && (-2.0..=2.0).contains(&y)
            && (-1.5..=-0.9).contains(&z)
            && (0.1..=1.0).contains(&intensity)
    };
    let mut distances: Vec<f32> = rows.iter().filter(is_inside).map(|row| row[0]).collect();
    distances.sort_unstable_by(f32::total_cmp);
    distances
}

fn run(rows: &[Row], estimator: Estimator, level: Level) -> MinX {
    robust_min_x(&points(black_box(rows)), &gate(), estimator, level, 1).expect("the settings make sense")
}

fn check(rows: &[Row], estimator: Estimator, level: Level) {
    let (answer, inside) = (run(rows, estimator, level), inside(rows));
    assert_eq!(answer.candidates, inside.len());
    assert_eq!(answer.nearest_x, f64::from(inside[0]));
    if let Estimator::KthSmallest(k) = estimator {
        assert_eq!(answer.x, f64::from(inside[k - 1]));
    }
}

/// Benchmarks an estimator over clouds at every level, after a look at its answers.
fn each_level(c: &mut Criterion, name: &str, clouds: &[Vec<Row>; CLOUDS], estimator: Estimator) {
    let mut group = c.benchmark_group(name);
    group.throughput(Throughput::Bytes(size_of_val(clouds[0].as_slice()) as u64));
    for level in Level::all() {
        for rows in clouds {
            check(rows, estimator, level);
        }
        group.bench_function(BenchmarkId::new(level.to_string(), clouds[0].len()), |b| {
            let mut turns = clouds.iter().cycle();
            b.iter(|| run(turns.next().expect("endless"), estimator, level));
        });
    }
    group.finish();
}

fn cloud(c: &mut Criterion) {
    for points in SIZES {
        each_level(c, "k-th smallest", &streets(points), Estimator::KthSmallest(K));
    }
    let frames = streets(FRAME);
    for (name, estimator) in [
        ("minimum", Estimator::Minimum),
        ("median", Estimator::Quantile(0.5)),
        ("mean of lowest", Estimator::MeanOfLowest(K)),
        ("fence", Estimator::InterquartileFence(1.5)),
        ("supported", Estimator::Supported { points: 3, gap: 0.5 }),
        ("cluster", Estimator::Cluster { tolerance: 0.5, min_points: 3 }),
    ] {
        each_level(c, name, &frames, estimator);
    }
    let mut sorted = streets(SIZES[2]);
    for rows in &mut sorted {
        rows.sort_unstable_by(|a, b| b[0].total_cmp(&a[0]));
    }
    each_level(c, "k-th smallest, descending", &sorted, Estimator::KthSmallest(K));
}

criterion_group!(benches, cloud);
criterion_main!(benches);
