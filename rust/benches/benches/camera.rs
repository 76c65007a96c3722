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

/// Pictures take turns, so that no branch predictor learns one by heart.
const PICTURES: usize = 4;

/// Where the matches are, and what their ratios are like.
#[derive(Clone, Copy, PartialEq)]
enum World {
    /// A car that grows by a hundredth, with a pixel of noise.
    Car,
    /// The same, rounded to pixels: many ratios are equal.
    OnPixels,
    /// All over a picture that grows by a twentieth, with six pixels of noise.
    Picture,
    /// All over a picture that grows by a twentieth: ratios differ by rounding alone.
    Exact,
}

/// Matches, the same in every run.
fn pictures(count: usize, world: World) -> [Matches; PICTURES] {
    let mut random = Random(2026);
    let (left, top, side, scale, noise) = match world {
        World::Car | World::OnPixels => (550.0, 180.0, 150.0, 1.01, 0.5),
        World::Picture => (0.0, 0.0, 1200.0, 1.05, 3.0),
        World::Exact => (0.0, 0.0, 1200.0, 1.05, 0.0),
    };
    std::array::from_fn(|_| {
        let mut columns = Matches::default();
        for _ in 0..count {
            let (x, y) = (random.between(left, left + side), random.between(top, top + side));
            let mut grown = |at: f32| scale * at + random.between(-noise, noise);
            for (column, number) in columns.iter_mut().zip([x, y, grown(x), grown(y)]) {
                column.push(if world == World::OnPixels { number.round() } else { number });
            }
        }
        columns
    })
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

/// Benchmarks an estimator on matches of every size, at every level; `check` looks at each answer first.
fn each_level(c: &mut Criterion, name: &str, world: World, estimator: Estimator, check: impl Fn(&Matches, Level)) {
    let mut group = c.benchmark_group(name);
    for count in SIZES {
        let pictures = pictures(count, world);
        group.throughput(Throughput::Elements((count * (count - 1) / 2) as u64));
        for level in Level::all() {
            for matches in &pictures {
                check(matches, level);
            }
            let mut turns = pictures.iter().cycle();
            group.bench_function(BenchmarkId::new(level.to_string(), count), |b| {
                b.iter(|| run(turns.next().expect("endless"), estimator, level));
            });
        }
    }
}

fn camera(c: &mut Criterion) {
    let worlds = [
        ("median of ratios", World::Car),
        ("median of ratios, on pixels", World::OnPixels),
        ("median of ratios, all over the picture", World::Picture),
        ("median of ratios, without noise", World::Exact),
    ];
    for (name, world) in worlds {
        each_level(c, name, world, Estimator::MedianRatio, check);
    }
    let others = [("consensus", Estimator::default()), ("trimmed mean", Estimator::TrimmedMeanRatio(0.1))];
    for (name, estimator) in others {
        each_level(c, name, World::Picture, estimator, |matches, level| {
            assert_eq!(run(matches, estimator, level), run(matches, estimator, Level::BASELINE));
        });
    }
}

criterion_group!(benches, camera);
criterion_main!(benches);
