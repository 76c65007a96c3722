//! The hot calls on pinned input at the AVX2 level, for `tools/instructions.py` to count their instructions.
//!
//! Without arguments it names them; with a name and a number it makes that call that number of times.

use std::env;
use std::f64::consts::PI;
use std::hint::black_box;
use ttc_fast_benches::{self as inputs, Random, STRAIGHT, TURNING, plane};
use ttc_fast_core::Status;
use ttc_fast_core::camera::{self, Keypoints, ttc_from_keypoints};
use ttc_fast_core::cloud::{Detection, Estimator, Gate, robust_min_x};
use ttc_fast_core::column::{Column, ColumnMut, Table};
use ttc_fast_core::ittc::{Rate, Speeds, ittc};
use ttc_fast_core::path::SweptPath;
use ttc_fast_core::points::Points;
use ttc_fast_core::range_rate::{Outputs, RangeRate, RateSettings};
use ttc_fast_core::real::Real;
use ttc_fast_core::scan::{Range, ScanSweptPath, ScanTtc};
use ttc_fast_core::simd::Level;
use ttc_fast_core::tracker::{self, DistanceTracker, Method};
use ttc_fast_core::vehicle::Motion;

/// A name, and what makes the call a number of times.
type Call = (&'static str, fn(usize));

const CALLS: [Call; 19] = [
    ("ScanTTC.min, straight", |times| min::<f32>(STRAIGHT, times)),
    ("ScanTTC.min, turning", |times| min::<f32>(TURNING, times)),
    ("ScanTTC.min, float64", |times| min::<f64>(STRAIGHT, times)),
    ("ScanTTC.nearest", nearest),
    ("ScanTTC.per_beam", per_beam),
    ("RangeRate.update", range_rate),
    ("ittc", ittc_of_beams),
    ("SweptPath.min", swept_points),
    ("SweptPath.per_point", every_swept_point),
    ("ScanSweptPath.nearest", swept_beams),
    ("KthSmallest", |times| nearest_ahead(KTH_SMALLEST, 16, times)),
    ("KthSmallest, packed records", |times| nearest_ahead(KTH_SMALLEST, 22, times)),
    ("Quantile", |times| nearest_ahead(Estimator::Quantile(0.05), 16, times)),
    ("Supported", |times| nearest_ahead(Estimator::Supported { points: 20, gap: 0.2 }, 16, times)),
    ("DistanceTracker.update", |times| track(tracker::Settings::default().method, times)),
    ("DistanceTracker.update, SlidingLine", |times| track(SLIDING_LINE, times)),
    ("MedianRatio", |times| growing(camera::Estimator::MedianRatio, times)),
    ("Consensus", |times| growing(camera::Estimator::default(), times)),
    ("Cluster", |times| nearest_ahead(Estimator::Cluster { tolerance: 0.5, min_points: 20 }, 16, times)),
];

/// Calls see frames in turn, so that the count rests on more than the luck of one.
const FRAMES: usize = 4;

/// More scans than a window has: from then on every call has as many to fit a line to.
const REMEMBERED: usize = 8;

const BEAMS: usize = 1080;

const RINGS: usize = 32;
const AZIMUTHS: usize = 640;
const MATCHES: usize = 500;
const SENSOR_HEIGHT: f64 = 1.7;
const SLIDING_LINE: Method = Method::SlidingLine { window: 0.5, acceleration: 1.0 };
const KTH_SMALLEST: Estimator = Estimator::KthSmallest(20);

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    match arguments.as_slice() {
        [] => CALLS.iter().for_each(|(name, _)| println!("{name}")),
        [name, times] => {
            let (_, call) = CALLS.iter().find(|(known, _)| known == name).expect("the name is one of those printed");
            call(times.parse().expect("times is a number"));
        }
        _ => panic!("usage: hot_calls [NAME TIMES]"),
    }
}

fn min<T: Range>(motion: Motion, times: usize) {
    let scan = scanner();
    in_turn(times, &rooms::<T>(&scan), |ranges| {
        let ttc = scan.min(Column::new(ranges), motion).expect("one range for each beam");
        assert!(ttc.expect("the room is seen").is_finite());
    });
}

fn nearest(times: usize) {
    let scan = scanner();
    in_turn(times, &rooms::<f32>(&scan), |ranges| {
        let nearest = scan.nearest(Column::new(ranges), TURNING).expect("one range for each beam");
        assert!(nearest.beam.is_some());
    });
}

fn per_beam(times: usize) {
    let scan = scanner();
    let mut out = [0.0_f32; BEAMS];
    in_turn(times, &rooms::<f32>(&scan), |ranges| {
        scan.per_beam(Column::new(ranges), STRAIGHT, &mut ColumnMut::new(&mut out), None).expect("lengths agree");
        assert!(black_box(&out)[BEAMS / 2] > 0.0);
    });
}

fn range_rate(times: usize) {
    let mut rates = RangeRate::new(scanner(), RateSettings::default()).expect("the settings make sense");
    let rooms = rooms::<f32>(&scanner());
    let mut update = |scan: usize| {
        let (room, stamp) = (Column::new(&rooms[scan % rooms.len()]), 0.1 * scan as f64);
        rates.update(room, stamp, 0.0, &mut Outputs::default()).expect("one range for each beam")
    };
    for scan in 0..REMEMBERED + times {
        assert_eq!(black_box(update(scan)).rated > 0, scan > 2);
    }
}

fn ittc_of_beams(times: usize) {
    let scan = scanner();
    let speeds: Vec<f32> = scan.settings().angles().map(|angle| f32::from_f64(STRAIGHT.speed * angle.cos())).collect();
    let mut out = [0.0_f32; BEAMS];
    in_turn(times, &rooms::<f32>(&scan), |ranges| {
        let rate = Rate::ClosingSpeed(Speeds::Each(Column::new(&speeds)));
        ittc(avx2(), Column::new(ranges), rate, 0.0, &mut ColumnMut::new(&mut out), None).expect("lengths agree");
        assert!(black_box(&out)[BEAMS / 2] > 0.0);
    });
}

/// What the scanner sees of the rooms: columns x and y in the vehicle frame.
fn seen(scan: &ScanTtc) -> Vec<[Vec<f32>; 2]> {
    let place = |ranges: Vec<f32>| {
        let at = |part: fn(f64) -> f64, from: f64| {
            let angles = scan.settings().angles();
            angles.zip(&ranges).map(|(angle, range)| f32::from_f64(from + f64::from(*range) * part(angle))).collect()
        };
        [at(f64::cos, scan.settings().mount.x), at(f64::sin, scan.settings().mount.y)]
    };
    rooms::<f32>(scan).into_iter().map(place).collect()
}

fn path(scan: &ScanTtc) -> SweptPath {
    SweptPath::new(scan.settings().outline.expect("the car has one"), 5.0, avx2()).expect("the horizon makes sense")
}

fn swept_points(times: usize) {
    let scan = scanner();
    let path = path(&scan);
    in_turn(times, &seen(&scan), |points| {
        let ttc = path.min(&plane(points), 0, TURNING.into()).expect("the motion makes sense");
        assert!(ttc.expect("the room is seen").is_finite());
    });
}

fn every_swept_point(times: usize) {
    let scan = scanner();
    let path = path(&scan);
    let mut out = [0.0_f32; BEAMS];
    in_turn(times, &seen(&scan), |points| {
        path.per_point(&plane(points), 0, TURNING.into(), &mut ColumnMut::new(&mut out), None).expect("lengths agree");
        assert!(black_box(&out)[BEAMS / 2] > 0.0);
    });
}

fn swept_beams(times: usize) {
    let scan = scanner();
    let rooms = rooms::<f32>(&scan);
    let path = ScanSweptPath::new(scan, 5.0).expect("the car has an outline");
    in_turn(times, &rooms, |ranges| {
        let nearest = path.nearest(Column::new(ranges), TURNING.into()).expect("one range for each beam");
        assert!(nearest.beam.is_some());
    });
}

fn nearest_ahead(estimator: Estimator, record: usize, times: usize) {
    let z = Gate::height_band(SENSOR_HEIGHT, 0.3, 2.5).expect("the band is not empty");
    let gate = Gate { z: Some(z), ..Gate::default() }.checked().expect("the gate makes sense");
    in_turn(times, &streets(record), |records| {
        let found =
            robust_min_x(&points(records, record), &gate, estimator, avx2(), 1).expect("the points have what it takes");
        assert_eq!(found.detection, Detection::Found);
    });
}

fn track(method: Method, times: usize) {
    let mut tracker = DistanceTracker::new(tracker::Settings { method, ..Default::default() }).expect("defaults");
    let mut random = Random(2028);
    for frame in 0..times {
        let stamp = 0.1 * frame as f64;
        let distance = 30.0 + 10.0 * (0.2 * stamp).sin() + 0.05 * (random.uniform() - 0.5);
        let seen = tracker.update(black_box(distance), stamp, None).expect("there is no noise to be wrong");
        assert!(seen.distance > 19.0);
    }
}

fn growing(estimator: camera::Estimator, times: usize) {
    in_turn(times, &pictures(), |[x0, y0, x1, y1]| {
        let keypoints =
            Keypoints { previous: [Column::new(x0), Column::new(y0)], current: [Column::new(x1), Column::new(y1)] };
        let seen = ttc_from_keypoints(keypoints, 0.1, 100.0, estimator, avx2(), 1).expect("as many as before");
        assert_eq!(seen.status, Status::Closing);
    });
}

/// Makes `call` on one frame after the other, `times` times in all.
fn in_turn<F>(times: usize, frames: &[F], mut call: impl FnMut(&F)) {
    frames.iter().cycle().take(times).for_each(|frame| call(black_box(frame)));
}

/// The level that every recent x86-64 processor has, and callgrind knows.
fn avx2() -> Level {
    let level = Level::at_most("avx2").expect("a known name");
    assert_eq!(level.to_string(), "avx2", "this processor has no AVX2");
    level
}

/// The scanner of the car.
fn scanner() -> ScanTtc {
    ScanTtc::new(inputs::scanner(BEAMS), avx2()).expect("the settings make sense")
}

/// Scans of a room.
fn rooms<T: Real>(scan: &ScanTtc) -> [Vec<T>; FRAMES] {
    inputs::rooms(scan.settings())
}

/// Frames of a lidar that looks 120 degrees ahead, between walls and behind a car: float32 x, y, z and intensity,
/// `record` bytes apart.
fn streets(record: usize) -> [Vec<u8>; FRAMES] {
    let mut random = Random(2027);
    let mut point = |ring: usize, azimuth: usize| {
        let slope = 0.05 - 0.4 * ring as f64 / RINGS as f64;
        let (left, forward) = (2.0 * PI / 3.0 * (azimuth as f64 / AZIMUTHS as f64 - 0.5)).sin_cos();
        let road = SENSOR_HEIGHT / (-slope).max(0.0);
        let car = 8.0 / forward;
        let is_car = (car * left).abs() < 0.9 && (-1.4..-0.2).contains(&(car * slope));
        let distance = (8.0 / left.abs()).min(road).min(if is_car { car } else { 80.0 }) + 0.05 * random.uniform();
        let returned = if random.uniform() < 0.03 { 0.0 } else { distance };
        [returned * forward, returned * left, returned * slope, random.uniform()].map(f32::from_f64)
    };
    let mut frame = || {
        let mut bytes = Vec::with_capacity(RINGS * AZIMUTHS * record);
        for ray in 0..RINGS * AZIMUTHS {
            let start = bytes.len();
            bytes.extend(point(ray / AZIMUTHS, ray % AZIMUTHS).into_iter().flat_map(f32::to_ne_bytes));
            bytes.resize(start + record, 0);
        }
        bytes
    };
    std::array::from_fn(|_| frame())
}

/// x and y before and now of a car's matched keypoints: it grows by a hundredth, with half a pixel of noise.
fn pictures() -> [[Vec<f32>; 4]; FRAMES] {
    let mut random = Random(2028);
    let mut frame = || {
        let mut columns: [Vec<f32>; 4] = Default::default();
        for _ in 0..MATCHES {
            let before = [550.0 + 150.0 * random.uniform(), 180.0 + 150.0 * random.uniform()];
            let now = before.map(|at| 1.01 * at + random.uniform() - 0.5);
            let numbers = [before[0], before[1], now[0], now[1]].map(f32::from_f64);
            columns.iter_mut().zip(numbers).for_each(|(column, number)| column.push(number));
        }
        columns
    };
    std::array::from_fn(|_| frame())
}

/// Records of `record` bytes that begin with x, y and z.
fn points(records: &[u8], record: usize) -> Points<'_, f32> {
    let len = records.len() / record;
    let xyz = std::array::from_fn(|axis| {
        let start = records[axis * size_of::<f32>()..].as_ptr();
        // SAFETY: float32 number `axis` of each of the `len` whole records in `records`; one row.
        unsafe { Table::from_raw(Column::from_raw(start, len, record.cast_signed()), 1, 0) }
    });
    Points::new(xyz, None).expect("columns of equal shape")
}
