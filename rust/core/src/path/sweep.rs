//! When a point first enters the outline, in closed form; and how far from it the point is now, and how fast that
//! shrinks.
//!
//! Let omega be the yaw rate and tau = 2 tan(omega t / 2) / omega, which is t itself when omega is 0. As the vehicle
//! turns, the coordinates of a static point in the vehicle frame are sums of 1, sin(omega t) and cos(omega t). Times 1
//! + (omega tau / 2)^2 they are polynomials:
//!
//! ```text
//! (1 + (omega tau / 2)^2) (x(t) - X) = (x - X) + (omega y - vx) tau - omega/2 (vy + omega/2 (x + X)) tau^2
//! (1 + (omega tau / 2)^2) (y(t) - Y) = (y - Y) - (omega x + vy) tau + omega/2 (vx - omega/2 (y + Y)) tau^2
//! ```
//!
//! So the line of each edge is crossed at the roots of a quadratic, with nothing singular as omega goes to 0: straight
//! driving is not another case but the same quadratic without its square. Of its two roots one goes in. A root is kept
//! as a pair (n, d) with tau = n / d, so that half a turn, where tau is infinite, is a root like any other.

use crate::error::Error;
use crate::vehicle::{LIGHT_SPEED, Motion, Mount, Outline};

/// Slower than this, m/s or rad/s, is standing still: in the longest horizon it moves nothing by the width of an atom,
/// and its square would lose digits.
const SLOWEST: f64 = 1e-30;

/// A point that passes the outline this close, as a share of how far points may come from, touches it.
const TOUCH: f64 = 1e-11;

/// An outline in motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sweep {
    /// The outline.
    pub outline: Outline,
    /// How far ahead it looks, s.
    pub horizon: f64,
    /// The speed of the vehicle's origin forward, m/s.
    pub vx: f64,
    /// The speed of the vehicle's origin to the left, m/s.
    pub vy: f64,
    /// The yaw rate, rad/s.
    pub omega: f64,
    /// Half the yaw rate, rad/s.
    half: f64,
    /// Points farther away than this, in x or y, cannot enter within the horizon, m.
    pub reach: f64,
    /// A point that passes the outline this close touches it, m.
    pub touch: f64,
}

/// How far a point is from the outline now, and how fast that shrinks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Approach {
    /// The distance from the outline, m; inside it is that to the nearest edge, negated.
    pub clearance: f64,
    /// How fast the clearance shrinks, m/s.
    pub closing_speed: f64,
}

/// The polynomial c + b tau + a tau^2 that x - X or y - Y is, times 1 + (omega tau / 2)^2.
#[derive(Clone, Copy)]
struct Quadratic {
    c: f64,
    b: f64,
    a: f64,
}

/// A time as tau = n / d, with n at least 0.
#[derive(Clone, Copy)]
struct Root {
    n: f64,
    d: f64,
}

impl Sweep {
    pub(super) fn new(outline: Outline, horizon: f64, motion: Motion) -> Result<Self, Error> {
        motion.sensor_velocity(Mount::default())?;
        let moves = |value: f64| if value.abs() < SLOWEST { 0.0 } else { value };
        let (vx, vy, omega) = (moves(motion.speed), moves(motion.lateral_speed), moves(motion.yaw_rate));
        if !(fastest(outline, vx, vy, omega) < LIGHT_SPEED && omega.abs() < LIGHT_SPEED) {
            let got = motion.yaw_rate;
            return Err(Error::new("yaw_rate", format!("turns the outline faster than light, at {got:?} rad/s")));
        }
        Ok(Sweep::unchecked(outline, horizon, vx, vy, omega))
    }

    /// Makes the sweep of a motion that makes sense.
    pub(super) fn unchecked(outline: Outline, horizon: f64, vx: f64, vy: f64, omega: f64) -> Self {
        // The way of a point is no longer than its speed allows, and no farther than across its circle.
        let turn = if omega == 0.0 { horizon } else { horizon.min(2.0 / omega.abs()) };
        let Outline { x_rear, x_front, y_right, y_left } = outline;
        let extent = [x_rear, x_front, y_right, y_left].into_iter().map(f64::abs).fold(0.0, f64::max);
        let reach = extent + fastest(outline, vx, vy, omega) * turn;
        Sweep { outline, horizon, vx, vy, omega, half: omega / 2.0, reach, touch: TOUCH * reach }
    }

    /// Whether a point lies in the outline, its edges included.
    #[inline(always)]
    pub(crate) fn is_inside(&self, [x, y]: [f64; 2]) -> bool {
        let Outline { x_rear, x_front, y_right, y_left } = self.outline;
        x_rear <= x && x <= x_front && y_right <= y && y <= y_left
    }

    /// The velocity of a static point in the vehicle frame, m/s.
    #[inline(always)]
    pub(super) fn velocity(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.omega * y - self.vx, 0.0 - (self.omega * x + self.vy)]
    }

    /// Returns the time until a point hits the vehicle, s: until it first enters, infinite where that is not within the
    /// horizon.
    ///
    /// A point in the outline is in contact, and so is one that `touches` by another measure. Its time is 0, unless it
    /// stands or is on its way out; then it is infinite.
    pub(crate) fn ttc(&self, point: [f64; 2], touches: bool) -> f64 {
        let inside = self.is_inside(point);
        if inside || touches {
            let deeper = if inside { self.deepens(point) } else { self.approach(point).closing_speed > 0.0 };
            return if deeper { 0.0 } else { f64::INFINITY };
        }
        let t = self.entry(point);
        if t <= self.horizon { t } else { f64::INFINITY }
    }

    /// Returns when a point outside first enters, s; infinite if it never does.
    pub(super) fn entry(&self, [x, y]: [f64; 2]) -> f64 {
        if !(x.abs() <= self.reach && y.abs() <= self.reach) {
            return f64::INFINITY;
        }
        let Outline { x_rear, x_front, y_right, y_left } = self.outline;
        let [bx, by] = self.velocity([x, y]);
        let to_x =
            |edge: f64| Quadratic { c: x - edge, b: bx, a: 0.0 - self.half * (self.vy + self.half * (x + edge)) };
        let to_y = |edge: f64| Quadratic { c: y - edge, b: by, a: self.half * (self.vx - self.half * (y + edge)) };
        let (along_x, along_y) = (to_x(0.0), to_y(0.0));

        let crossings = [
            self.crossing(to_x(x_front), along_y, y_right, y_left),
            self.crossing(to_x(x_rear).mirrored(), along_y, y_right, y_left),
            self.crossing(to_y(y_left), along_x, x_rear, x_front),
            self.crossing(to_y(y_right).mirrored(), along_x, x_rear, x_front),
        ];
        crossings.into_iter().flatten().fold(f64::INFINITY, |first, root| first.min(self.time(root)))
    }

    /// Returns when the distance to an edge's line, positive outside, falls to 0 while the other coordinate is between
    /// the ends of the edge.
    #[inline(always)]
    fn crossing(&self, distance: Quadratic, other: Quadratic, low: f64, high: f64) -> Option<Root> {
        let distance = if distance.discriminant() >= 0.0 { distance } else { self.nearer(distance) };
        let Quadratic { c, b, a } = distance;
        let discriminant = distance.discriminant();
        let h = b.abs() + discriminant.max(0.0).sqrt();
        let (n, d) = if b < 0.0 || (b == 0.0 && a == 0.0) { (2.0 * c, h) } else { (0.0 - h, 2.0 * a) };
        let (n, d) = if n < 0.0 { (0.0 - n, 0.0 - d) } else { (n, d) };
        let scale = d * d + (self.half * n) * (self.half * n);
        let place = (other.c * d + other.b * n) * d + other.a * n * n;
        let on_edge = (low - self.touch) * scale <= place && place <= (high + self.touch) * scale && scale > 0.0;
        (discriminant >= 0.0 && on_edge).then_some(Root { n, d })
    }

    /// Returns the distance to a line that is nearer by `touch`: a circle that misses an edge may come as close as
    /// that.
    fn nearer(&self, Quadratic { c, b, a }: Quadratic) -> Quadratic {
        Quadratic { c: c - self.touch, b, a: a - self.half * self.half * self.touch }
    }

    /// Returns the time at a root, s.
    fn time(&self, Root { n, d }: Root) -> f64 {
        if n == 0.0 {
            0.0
        } else if self.omega == 0.0 {
            if d > 0.0 { n / d } else { f64::INFINITY }
        } else {
            2.0 * (self.omega.abs() * n).atan2(2.0 * d) / self.omega.abs()
        }
    }
}

/// Returns the speed of the outline's fastest point, m/s. A point keeps its speed on its way, and the points of a
/// rectangle that move fastest are corners.
fn fastest(outline: Outline, vx: f64, vy: f64, omega: f64) -> f64 {
    let Outline { x_rear, x_front, y_right, y_left } = outline;
    let corners = [(x_rear, y_right), (x_rear, y_left), (x_front, y_right), (x_front, y_left)];
    let square = |(x, y): (f64, f64)| {
        let (sx, sy) = (vx - omega * y, vy + omega * x);
        sx * sx + sy * sy
    };
    corners.into_iter().map(square).fold(0.0, f64::max).sqrt()
}

impl Quadratic {
    fn discriminant(&self) -> f64 {
        self.b * self.b - 4.0 * self.a * self.c
    }

    /// The same edge seen from its other side.
    fn mirrored(self) -> Self {
        Quadratic { c: 0.0 - self.c, b: 0.0 - self.b, a: 0.0 - self.a }
    }
}

impl Sweep {
    /// Returns the clearance of a point and how fast it shrinks; NaN for a point whose coordinates are NaN.
    pub(crate) fn approach(&self, [x, y]: [f64; 2]) -> Approach {
        if self.is_inside([x, y]) { self.approach_inside([x, y]) } else { self.approach_outside([x, y]) }
    }

    /// Whether a point in the outline goes deeper into it. It moves along a chord of the outline, and goes deeper if
    /// the end that it comes from is no farther than the one that it goes to. A point that stands does not.
    pub(super) fn deepens(&self, point: [f64; 2]) -> bool {
        let (mut came, mut leaves) = (f64::INFINITY, f64::INFINITY);
        for (depth, rate) in self.edges(point) {
            if rate > 0.0 {
                came = came.min(depth / rate);
            } else if rate < 0.0 {
                leaves = leaves.min(depth / (0.0 - rate));
            }
        }
        came < f64::INFINITY && came <= leaves
    }

    /// Returns the distance from a point inside to each edge, m, and how fast it grows, m/s.
    fn edges(&self, [x, y]: [f64; 2]) -> [(f64, f64); 4] {
        let [vx, vy] = self.velocity([x, y]);
        let edge = self.outline;
        [(edge.x_front - x, 0.0 - vx), (x - edge.x_rear, vx), (edge.y_left - y, 0.0 - vy), (y - edge.y_right, vy)]
    }

    /// Returns the approach of a point inside. The nearest edge decides; of edges equally near, the one that recedes
    /// fastest.
    fn approach_inside(&self, point: [f64; 2]) -> Approach {
        let edges = self.edges(point);
        let depth =
            edges.into_iter().fold(f64::INFINITY, |least, (depth, _)| if depth < least { depth } else { least });
        let nearest = edges.into_iter().filter(|edge| edge.0 == depth);
        let closing_speed = nearest.fold(f64::NEG_INFINITY, |most, (_, rate)| if rate > most { rate } else { most });
        Approach { clearance: 0.0 - depth, closing_speed }
    }

    /// Returns the approach of a point outside, straight to the nearest point of the outline. It is scaled, so that the
    /// square of a tiny gap does not vanish.
    fn approach_outside(&self, [x, y]: [f64; 2]) -> Approach {
        let [vx, vy] = self.velocity([x, y]);
        let (dx, dy) = (x - self.nearest_x(x), y - self.nearest_y(y));
        let longer = if dx.abs() > dy.abs() { dx.abs() } else { dy.abs() };
        let (ux, uy) = (dx / longer, dy / longer);
        let norm = (ux * ux + uy * uy).sqrt();
        Approach { clearance: longer * norm, closing_speed: 0.0 - (ux * vx + uy * vy) / norm }
    }

    fn nearest_x(&self, x: f64) -> f64 {
        x.max(self.outline.x_rear).min(self.outline.x_front)
    }

    fn nearest_y(&self, y: f64) -> f64 {
        y.max(self.outline.y_right).min(self.outline.y_left)
    }
}

#[cfg(test)]
mod tests {
    use super::Sweep;
    use crate::vehicle::{Motion, Outline};

    const CAR: Outline = Outline { x_rear: -0.1, x_front: 0.4, y_right: -0.15, y_left: 0.15 };

    #[test]
    fn straight_ahead_beside_and_inside() {
        let sweep = Sweep::new(CAR, 5.0, Motion { speed: 2.0, ..Motion::default() }).unwrap();
        let about = |point| {
            let approach = sweep.approach(point);
            ((approach.clearance * 1e9).round() / 1e9, (approach.closing_speed * 1e9).round() / 1e9)
        };
        assert_eq!(about([1.4, 0.0]), (1.0, 2.0));
        assert_eq!(about([-1.1, 0.0]), (1.0, -2.0));
        assert_eq!(about([0.0, 1.15]), (1.0, 0.0));
        assert_eq!(about([3.4, 4.15]), (5.0, 1.2));
        assert_eq!(about([0.39, 0.0]), (-0.01, 2.0));
        assert_eq!(about([-0.09, 0.0]), (-0.01, -2.0));
        assert_eq!(about([0.4, 0.15]), (0.0, 2.0), "at a corner, the edge that recedes decides");
        assert!(sweep.approach([f64::NAN; 2]).clearance.is_nan());
    }

    #[test]
    fn the_nearer_end_of_the_chord_is_the_way_out() {
        let about = |point, speed, yaw_rate| {
            let motion = Motion { speed, yaw_rate, ..Motion::default() };
            Sweep::new(CAR, 5.0, motion).unwrap().deepens(point)
        };
        let (front, rear) = ([0.3, 0.14], [0.0, 0.14]);
        assert_eq!([about(front, 2.0, 0.0), about(front, -2.0, 0.0)], [true, false], "nearest to the left edge");
        assert_eq!([about(rear, 2.0, 0.0), about(rear, -2.0, 0.0)], [false, true]);
        assert_eq!([about(front, 0.0, 1.0), about(front, 0.0, -1.0)], [true, false], "in place");
        assert!(about([0.15, 0.0], 2.0, 0.0) && about([0.15, 0.0], -2.0, 0.0), "in the middle no way leads out");
        assert!(!about(front, 0.0, 0.0), "standing");
    }
}
