//! The swept path kernels at every instruction-set level, each checked against small time steps before it is timed.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use ttc_fast_benches::{CAR, Random, STRAIGHT, TURNING, plane, wall};
use ttc_fast_core::column::ColumnMut;
use ttc_fast_core::path::SweptPath;
use ttc_fast_core::real::Real;
use ttc_fast_core::simd::Level;
use ttc_fast_core::vehicle::Motion;

/// The numbers of points, and of the rooms that take turns: no branch predictor is to learn a small one by heart.
const SIZES: [(usize, usize); 2] = [(1080, 16), (65_536, 2)];
const HORIZON: f64 = 5.0;
const STEP: f64 = 1e-3;
const MOTIONS: [(&str, Motion); 3] = [
    ("straight", STRAIGHT),
    ("turning", TURNING),
    ("in place", Motion { speed: 0.0, yaw_rate: 1.5, lateral_speed: 0.0 }),
];

/// Points on the walls of rooms, with noise on them.
fn rooms(points: usize, count: usize) -> Vec<[Vec<f32>; 2]> {
    let mut random = Random(2026);
    let mut place = |i: usize| {
        let angle = 4.0 * i as f64 / points as f64 - 2.0;
        let range = wall(angle) + 0.02 * random.uniform();
        (f32::from_f64(range * angle.cos()), f32::from_f64(range * angle.sin()))
    };
    let room = |_| {
        let (x, y) = (0..points).map(&mut place).unzip();
        [x, y]
    };
    (0..count).map(room).collect()
}

/// Small steps, of a car through a room that stands still.
fn stepped([x, y]: &[Vec<f32>; 2], motion: Motion) -> f64 {
    let (mut at, mut heading, mut moment) = ([0.0, 0.0], 0.0_f64, 0.0);
    while moment < HORIZON {
        let (sin, cos) = heading.sin_cos();
        let inside = x.iter().zip(y).any(|(x, y)| {
            let (dx, dy) = (f64::from(*x) - at[0], f64::from(*y) - at[1]);
            let (x, y) = (cos * dx + sin * dy, cos * dy - sin * dx);
            (CAR.x_rear..=CAR.x_front).contains(&x) && (CAR.y_right..=CAR.y_left).contains(&y)
        });
        if inside {
            return moment;
        }
        let (sin, cos) = (heading + motion.yaw_rate * STEP / 2.0).sin_cos();
        at = [at[0] + motion.speed * STEP * cos, at[1] + motion.speed * STEP * sin];
        heading += motion.yaw_rate * STEP;
        moment += STEP;
    }
    f64::INFINITY
}

fn path(c: &mut Criterion) {
    let mut group = c.benchmark_group("swept path");
    for (points, count) in SIZES {
        let rooms = rooms(points, count);
        let clouds: Vec<_> = rooms.iter().map(plane).collect();
        let mut out = vec![0.0_f32; points];
        group.throughput(Throughput::Elements(points as u64));
        for (name, motion) in MOTIONS {
            let expected: Vec<f64> = rooms.iter().map(|room| stepped(room, motion)).collect();
            for level in Level::all() {
                let path = SweptPath::new(CAR, HORIZON, level).expect("the horizon makes sense");
                for (cloud, expected) in clouds.iter().zip(&expected) {
                    let ttc =
                        path.min(cloud, 0, motion.into()).expect("the motion makes sense").expect("the room is seen");
                    let close = ttc == *expected || (ttc <= *expected && *expected < ttc + 2.0 * STEP);
                    assert!(close, "the kernel gives {ttc}, small steps {expected}");
                }
                let mut turns = clouds.iter().cycle();
                let mut next = || black_box(turns.next().expect("endless"));
                group.bench_function(BenchmarkId::new(format!("min, {name}, {level}"), points), |b| {
                    b.iter(|| path.min(next(), 0, motion.into()));
                });
                group.bench_function(BenchmarkId::new(format!("per_point, {name}, {level}"), points), |b| {
                    b.iter(|| path.per_point(next(), 0, motion.into(), &mut ColumnMut::new(&mut out), None));
                });
            }
        }
    }
    group.finish();
}

criterion_group!(benches, path);
criterion_main!(benches);
