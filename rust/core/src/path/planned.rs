//! The outline along a planned path: points that the vehicle's origin will follow, instead of a motion that stays.
//!
//! From the points a pose is made for each: its place, and the direction in which the path leads there. Between two
//! poses the vehicle moves by a constant twist, which is what [`Sweep`] is about, with the way in the place of time: the
//! outline turns steadily from one heading to the next, and no corner of it jumps. A static point enters in the first
//! piece in which it meets the outline. Its way is that along the points, and its time is that way over the speed.
//! Beyond the end the vehicle goes straight on along its last heading.
//!
//! Pieces are many and points are many, but few of them meet. Pieces are taken together in blocks, and around what the
//! outline covers in a block there is a box along its chord. In lanes, with slack for every rounding, each point is
//! compared with the box around all blocks, and only those in it with each block. What is left is computed exactly,
//! nearest block first, and a block with a hit ends the search.

use super::frame::Frame;
use super::sweep::Sweep;
use crate::column::ColumnMut;
use crate::error::Error;
use crate::hit::Hit;
use crate::lanes::{LANES, Lanes};
use crate::real::Real;
use crate::simd::{Instructions, Kernel, Level};
use crate::status::Status;
use crate::vehicle::{LARGEST, Motion, Outline};

/// The path may begin this far from the vehicle's origin, in lengths of the vehicle.
const NEAR: f64 = 1.0;
/// What the path begins off the vehicle's origin fades over this way, in lengths of the vehicle.
const FADE: f64 = 2.0;
/// Points nearer to the one before than this, in lengths of the vehicle, are left out.
const SHORTEST: f64 = 1e-3;
/// Pieces longer than this, in lengths of the vehicle, are straight in their middle.
const LONGEST: f64 = 3.0;
/// How many blocks there are at most, without the way beyond the end.
const BLOCKS: usize = 8;

/// A path that a vehicle will follow, from where it is now.
#[derive(Clone, Debug)]
pub struct PlannedPath {
    outline: Outline,
    poses: Vec<Pose>,
    /// The way along the points to each pose, m.
    ways: Vec<f64>,
    blocks: Vec<Block>,
}

/// A place, m, and a heading as its cosine and sine.
#[derive(Clone, Copy, Debug)]
struct Pose {
    x: f64,
    y: f64,
    cos: f64,
    sin: f64,
}

/// A point of the path, and the way to it from the one before, m.
#[derive(Clone, Copy)]
struct Step {
    place: [f64; 2],
    way: f64,
}

/// Some pieces of a path, and the box around what the outline covers in them: along their chord, m.
#[derive(Clone, Debug)]
struct Block {
    pieces: std::ops::Range<usize>,
    cos: f64,
    sin: f64,
    low: [f64; 2],
    high: [f64; 2],
}

impl Pose {
    /// Returns a point as it is seen from here.
    #[inline(always)]
    fn seen(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (dx, dy) = (x - self.x, y - self.y);
        [dx * self.cos + dy * self.sin, dy * self.cos - dx * self.sin]
    }
}

fn length([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

impl PlannedPath {
    /// Makes the path of a vehicle from points in its present frame.
    pub(super) fn new(outline: Outline, points: &[[f64; 2]]) -> Result<Self, Error> {
        let size = (outline.x_front - outline.x_rear).max(outline.y_left - outline.y_right);
        let steps = split(led_from_origin(points, size)?, size);
        let mut ways = Vec::with_capacity(steps.len());
        let mut way = 0.0;
        for step in &steps {
            way += step.way;
            ways.push(way);
        }
        let mut path = PlannedPath { outline, poses: poses(&steps)?, ways, blocks: Vec::with_capacity(BLOCKS) };
        let pieces = path.poses.len() - 1;
        let each = pieces.div_ceil(BLOCKS);
        for first in (0..pieces).step_by(each) {
            path.blocks.push(path.block(first..(first + each).min(pieces)));
        }
        Ok(path)
    }

    /// Whether it leads backwards.
    fn reverses(&self) -> bool {
        self.poses[0].seen([self.poses[1].x, self.poses[1].y])[0] < 0.0
    }

    /// Returns how the vehicle moves now, if it follows the path at a speed.
    pub(super) fn motion(&self, speed: f64) -> Result<Motion, Error> {
        if !speed.is_finite() {
            return Err(Error::new("speed", format!("must be a finite number, got {speed:?}")));
        }
        if speed != 0.0 && (speed < 0.0) != self.reverses() {
            let leads = if self.reverses() { "backwards" } else { "forward" };
            return Err(Error::new(
                "path",
                format!("leads {leads}, and speed is {speed:?}: give the way that is driven"),
            ));
        }
        let (vx, vy, omega) = self.twist(0);
        let pace = speed.abs();
        Ok(Motion { speed: pace * vx, lateral_speed: pace * vy, yaw_rate: pace * omega })
    }

    /// Returns how the vehicle moves in a piece, for each m along the points. The last piece is that beyond the end.
    fn twist(&self, piece: usize) -> (f64, f64, f64) {
        let from = self.poses[piece];
        let Some(to) = self.poses.get(piece + 1) else {
            return (if self.reverses() { -1.0 } else { 1.0 }, 0.0, 0.0);
        };
        let [dx, dy] = from.seen([to.x, to.y]);
        let (c, w) = (from.cos * to.cos + from.sin * to.sin, from.cos * to.sin - from.sin * to.cos);
        let angle = w.atan2(c);
        let half = angle / 2.0;
        let along = if w.abs() > 1e-3 { half * (1.0 + c) / w } else { 1.0 - angle * angle / 12.0 };
        let way = self.ways[piece + 1] - self.ways[piece];
        ((along * dx + half * dy) / way, (along * dy - half * dx) / way, angle / way)
    }

    /// Returns the sweep of a piece, in ways instead of times; that beyond the end goes on for `rest`.
    fn sweep(&self, piece: usize, rest: f64) -> Sweep {
        let (vx, vy, omega) = self.twist(piece);
        let way = self.ways.get(piece + 1).map_or(rest, |end| end - self.ways[piece]);
        Sweep::unchecked(self.outline, way, vx, vy, omega)
    }

    /// Returns the way until a point enters in a piece, if it does.
    #[inline(always)]
    fn entry(&self, piece: usize, sweep: &Sweep, point: [f64; 2]) -> Option<f64> {
        let seen = self.poses[piece].seen(point);
        if piece > 0 && sweep.is_inside(seen) {
            return Some(self.ways[piece]);
        }
        let way = sweep.entry(seen);
        (way <= sweep.horizon).then(|| self.ways[piece] + way)
    }

    /// Returns some pieces as a block.
    fn block(&self, pieces: std::ops::Range<usize>) -> Block {
        let (first, last) = (self.poses[pieces.start], self.poses[pieces.end]);
        let chord = [last.x - first.x, last.y - first.y];
        let way = length(chord);
        let (cos, sin) = if way > 0.0 { (chord[0] / way, chord[1] / way) } else { (1.0, 0.0) };
        let Outline { x_rear, x_front, y_right, y_left } = self.outline;
        let extent = length([x_rear.abs().max(x_front.abs()), y_right.abs().max(y_left.abs())]);
        let (mut low, mut high, mut bulge) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], 0.0_f64);
        for index in pieces.start..=pieces.end {
            let pose = self.poses[index];
            let (u, v) = (pose.x * cos + pose.y * sin, pose.y * cos - pose.x * sin);
            let (c, s) = (pose.cos * cos + pose.sin * sin, pose.sin * cos - pose.cos * sin);
            let (across, along) = ([-y_right * s, -y_left * s], [y_right * c, y_left * c]);
            low[0] = low[0].min(u + (x_rear * c).min(x_front * c) + across[0].min(across[1]));
            high[0] = high[0].max(u + (x_rear * c).max(x_front * c) + across[0].max(across[1]));
            low[1] = low[1].min(v + (x_rear * s).min(x_front * s) + along[0].min(along[1]));
            high[1] = high[1].max(v + (x_rear * s).max(x_front * s) + along[0].max(along[1]));
            if index < pieces.end {
                // A corner goes on an arc, which bulges from its chord by a quarter of the tangent of a quarter turn.
                let (next, way) = (self.poses[index + 1], self.ways[index + 1] - self.ways[index]);
                let turn = (pose.cos * next.sin - pose.sin * next.cos).abs();
                let ahead = pose.cos * next.cos + pose.sin * next.sin > 0.0;
                let most = if ahead { 0.3 * turn * (way + 1.6 * extent * turn) } else { 2.0 * way + 2.0 * extent };
                bulge = bulge.max(most);
            }
        }
        Block { pieces, cos, sin, low: low.map(|each| each - bulge), high: high.map(|each| each + bulge) }
    }

    /// Returns the blocks that are reached in a way, with that beyond the end if it is.
    fn within(&self, reach: f64) -> Vec<Block> {
        let mut blocks: Vec<_> =
            self.blocks.iter().take_while(|block| self.ways[block.pieces.start] <= reach).cloned().collect();
        let (end, rest) = (self.poses.len() - 1, reach - self.ways[self.poses.len() - 1]);
        if rest > 0.0 {
            let Pose { x, y, cos, sin } = self.poses[end];
            let (u, v) = (x * cos + y * sin, y * cos - x * sin);
            let Outline { x_rear, x_front, y_right, y_left } = self.outline;
            let (back, on) = if self.reverses() { (rest, 0.0) } else { (0.0, rest) };
            let (low, high) = ([u + x_rear - back, v + y_right], [u + x_front + on, v + y_left]);
            blocks.push(Block { pieces: end..end + 1, cos, sin, low, high });
        }
        blocks
    }
}

/// Returns the points that lead on from the origin, if they begin near it: what they begin off it fades on the way.
fn led_from_origin(points: &[[f64; 2]], size: f64) -> Result<Vec<Step>, Error> {
    if points.len() < 2 {
        return Err(Error::new("path", format!("must have two points or more, got {}", points.len())));
    }
    if let Some(at) = points.iter().position(|[x, y]| !(x.abs() <= LARGEST && y.abs() <= LARGEST)) {
        let [x, y] = points[at];
        let problem = format!("must be finite and lie within {LARGEST} m, got ({x:?}, {y:?}) at point {at}");
        return Err(Error::new("path", problem));
    }
    let off = points[0];
    if length(off) > NEAR * size {
        let problem = format!(
            "must start at the vehicle: its first point is {:.3} m from the vehicle's origin, and {:.3} m, a length of \
             the vehicle, is the most; points are in the vehicle's present frame",
            length(off),
            NEAR * size
        );
        return Err(Error::new("path", problem));
    }
    let mut led = Vec::with_capacity(points.len() + 4);
    led.push(Step { place: minus(off, off), way: 0.0 });
    let (mut share, mut way, mut last) = (1.0, 0.0, minus(off, off));
    for (index, point) in points.iter().enumerate().skip(1) {
        if share > 0.0 {
            way += length(minus(*point, points[index - 1]));
            share = (1.0 - way / (FADE * size)).max(0.0);
        }
        let place = [point[0] - off[0] * share, point[1] - off[1] * share];
        let step = length(minus(place, last));
        if step >= SHORTEST * size {
            led.push(Step { place, way: step });
            last = place;
        }
    }
    if led.len() < 2 {
        return Err(Error::new("path", "must lead somewhere: all of its points are in one place"));
    }
    Ok(led)
}

/// Returns the points with two more on each long piece, so that the vehicle turns near its ends.
fn split(steps: Vec<Step>, size: f64) -> Vec<Step> {
    if steps.iter().all(|step| step.way <= LONGEST * size) {
        return steps;
    }
    let mut split = vec![steps[0]];
    for pair in steps.windows(2) {
        let [Step { place: before, .. }, Step { place, way }] = [pair[0], pair[1]];
        if way > LONGEST * size {
            let ([dx, dy], share) = (minus(place, before), size / way);
            split.push(Step { place: [before[0] + dx * share, before[1] + dy * share], way: size });
            split.push(Step { place: [place[0] - dx * share, place[1] - dy * share], way: way - 2.0 * size });
            split.push(Step { place, way: size });
        } else {
            split.push(pair[1]);
        }
    }
    split
}

/// Returns the poses at the points. The heading at one lies between those of its two pieces, as on a circle through it.
fn poses(steps: &[Step]) -> Result<Vec<Pose>, Error> {
    let side = if steps[1].place[0] < 0.0 { -1.0 } else { 1.0 };
    let mut poses = Vec::with_capacity(steps.len());
    let mut pose = Pose { x: steps[0].place[0], y: steps[0].place[1], cos: 1.0, sin: 0.0 };
    let (mut before, mut way_before) = ([1.0, 0.0], 0.0);
    for (index, Step { place, way }) in steps.iter().enumerate().skip(1) {
        let scale = side / way;
        let chord = [(place[0] - pose.x) * scale, (place[1] - pose.y) * scale];
        if chord[0] * before[0] + chord[1] * before[1] <= 0.0 {
            let problem = format!(
                "turns by 90 degrees or more at ({:.3}, {:.3}), where the vehicle would have to stop: end it there",
                pose.x, pose.y
            );
            return Err(Error::new("path", problem));
        }
        if index > 1 {
            let between = [before[0] * way + chord[0] * way_before, before[1] * way + chord[1] * way_before];
            let scale = 1.0 / length(between);
            (pose.cos, pose.sin) = (between[0] * scale, between[1] * scale);
        }
        poses.push(pose);
        // The last heading is as far beyond the chord as the one before it is short of it.
        let twice = 2.0 * (chord[0] * pose.cos + chord[1] * pose.sin);
        pose = Pose { x: place[0], y: place[1], cos: twice * chord[0] - pose.cos, sin: twice * chord[1] - pose.sin };
        (before, way_before) = (chord, *way);
    }
    poses.push(pose);
    Ok(poses)
}

/// A path that is followed at a speed.
pub(crate) struct Following<'a> {
    path: &'a PlannedPath,
    /// The present motion.
    pub(super) now: Sweep,
    /// The speed along the path, m/s, without sign.
    pace: f64,
}

impl<'a> Following<'a> {
    pub(super) fn new(path: &'a PlannedPath, now: Sweep, speed: f64) -> Self {
        Following { path, now, pace: speed.abs() }
    }

    /// Returns the point that is hit first.
    pub(super) fn least<T: Real>(&self, level: Level, frame: impl Frame<T>) -> Hit {
        let (blocks, mut candidates) = self.candidates(level, frame);
        candidates.sort_unstable();
        let (mut best, mut sweeps, mut swept) = (Hit::NONE, Vec::new(), u32::MAX);
        for (block, index) in candidates {
            if block != swept {
                if best.closes() {
                    break;
                }
                swept = block;
                sweeps = self.sweeps(&blocks[block as usize]);
            }
            best = self.decide(&frame, &blocks[block as usize], &sweeps, index as usize).or(best);
        }
        best
    }

    /// Returns every point that is hit.
    pub(super) fn entering<T: Real>(&self, level: Level, frame: impl Frame<T>) -> Vec<Hit> {
        let (blocks, mut candidates) = self.candidates(level, frame);
        candidates.sort_unstable_by_key(|(block, index)| (*index, *block));
        let sweeps: Vec<_> = blocks.iter().map(|block| self.sweeps(block)).collect();
        let mut hits: Vec<Hit> = Vec::new();
        for (block, index) in candidates {
            let (block, index) = (block as usize, index as usize);
            if hits.last().is_none_or(|last| last.index != index) {
                hits.extend(Some(self.decide(&frame, &blocks[block], &sweeps[block], index)).filter(Hit::closes));
            }
        }
        hits
    }

    /// Writes the times of all points into `out`, and what they mean into `status_out`.
    pub(super) fn each<'o, T: Real>(
        &self,
        level: Level,
        frame: impl Frame<T>,
        out: &mut ColumnMut<'o, T>,
        status_out: Option<&mut ColumnMut<'o, u8>>,
    ) {
        // All is read before anything is written: the points may be read from where `out` writes.
        let (hits, n) = (self.entering(level, frame), frame.len());
        if let Some(status_out) = status_out {
            for index in 0..n {
                status_out.set_lanes(index, [frame.status(index, &self.now) as u8]);
            }
            for hit in hits.iter().filter(|hit| frame.status(hit.index, &self.now) == Status::NotClosing) {
                status_out.set_lanes(hit.index, [Status::Closing as u8]);
            }
        }
        for index in 0..n {
            out.set_lanes(index, [T::INFINITY]);
        }
        for hit in hits {
            out.set_lanes(hit.index, [T::from_f64(hit.ttc)]);
        }
    }

    fn reach(&self) -> f64 {
        self.pace * self.now.horizon
    }

    fn sweeps(&self, block: &Block) -> Vec<Sweep> {
        block.pieces.clone().map(|piece| self.path.sweep(piece, self.reach())).collect()
    }

    /// Computes one point exactly, in the pieces of one block.
    fn decide<T: Real>(&self, frame: &impl Frame<T>, block: &Block, sweeps: &[Sweep], index: usize) -> Hit {
        let (point, touches) = (frame.point(index), frame.touches(index));
        if touches || self.now.is_inside(point) {
            let ttc = if block.pieces.start == 0 { self.now.ttc(point, touches) } else { f64::INFINITY };
            return Hit { ttc, index };
        }
        let entry = |(piece, sweep)| self.path.entry(piece, sweep, point);
        let ttc = block.pieces.clone().zip(sweeps).find_map(entry).map_or(f64::INFINITY, |way| way / self.pace);
        Hit { ttc: if ttc <= self.now.horizon { ttc } else { f64::INFINITY }, index }
    }

    /// Returns the blocks that are reached, and each with each point that may enter there.
    fn candidates<T: Real>(&self, level: Level, frame: impl Frame<T>) -> (Vec<Block>, Vec<(u32, u32)>) {
        if self.pace == 0.0 {
            return (Vec::new(), Vec::new());
        }
        let mut blocks = self.path.within(self.reach());
        let (mut least, mut most) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        // A reading of 0 touches the sensor, which may be outside the outline.
        let [x, y] = frame.origin();
        let Block { cos, sin, low, high, .. } = &mut blocks[0];
        let [u, v] = [x * *cos + y * *sin, y * *cos - x * *sin];
        (*low, *high) = ([low[0].min(u), low[1].min(v)], [high[0].max(u), high[1].max(v)]);
        for Block { cos, sin, low, high, .. } in &blocks {
            for [u, v] in [*low, [low[0], high[1]], [high[0], low[1]], *high] {
                let corner = [u * cos - v * sin, u * sin + v * cos];
                for axis in 0..2 {
                    (least[axis], most[axis]) = (least[axis].min(corner[axis]), most[axis].max(corner[axis]));
                }
            }
        }
        let far = [least, most].into_iter().flatten().fold(0.0, |far: f64, each| far.max(each.abs()));
        let off = frame.error(far) + 4.0 * T::SLACK.to_f64() * far;
        let widened = |[low, high]: [f64; 2]| [T::not_above(low - off), T::not_below(high + off)];
        let all = [widened([least[0], most[0]]), widened([least[1], most[1]])];
        let boxes: Vec<_> = blocks
            .iter()
            .map(|Block { cos, sin, low, high, .. }| Bounds {
                cos: T::from_f64(*cos),
                sin: T::from_f64(*sin),
                u: widened([low[0], high[0]]),
                v: widened([low[1], high[1]]),
            })
            .collect();
        (blocks, level.run(Gather { frame, all, boxes: &boxes }))
    }
}

/// The box of a block in the points' own type.
struct Bounds<T> {
    cos: T,
    sin: T,
    u: [T; 2],
    v: [T; 2],
}

/// Finds the points that may enter, and in which blocks.
struct Gather<'a, F, T> {
    frame: F,
    all: [[T; 2]; 2],
    boxes: &'a [Bounds<T>],
}

impl<T: Real, F: Frame<T>> Kernel for Gather<'_, F, T> {
    type Output = Vec<(u32, u32)>;

    #[inline(always)]
    fn run<I: Instructions>(self, simd: I) -> Vec<(u32, u32)> {
        let mut candidates = Vec::with_capacity(4 * LANES);
        let inside = |value: &Lanes<T>, [low, high]: [T; 2]| T::within(simd, value, &[low; LANES], &[high; LANES]);
        for at in (0..self.frame.len()).step_by(LANES) {
            let [x, y] = self.frame.lanes(at);
            let near = inside(&x, self.all[0]) & inside(&y, self.all[1]);
            if near == 0 {
                continue;
            }
            for (block, bounds) in self.boxes.iter().enumerate() {
                let u: Lanes<T> = std::array::from_fn(|lane| x[lane] * bounds.cos + y[lane] * bounds.sin);
                let v: Lanes<T> = std::array::from_fn(|lane| y[lane] * bounds.cos - x[lane] * bounds.sin);
                let mut bits = near & inside(&u, bounds.u) & inside(&v, bounds.v);
                while bits != 0 {
                    candidates.push((narrow(block), narrow(at + bits.trailing_zeros() as usize)));
                    bits &= bits - 1;
                }
            }
        }
        candidates
    }
}

#[inline(always)]
fn narrow(index: usize) -> u32 {
    u32::try_from(index).expect("there are fewer than 2^32 points")
}
