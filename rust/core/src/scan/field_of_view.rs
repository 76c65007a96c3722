//! Which part of the path no beam looks at.
//!
//! A scanner at the front sees nothing of where its vehicle goes when it reverses. That is known from where the beams
//! point: [`FieldOfView`] is the gaps between them. A beam looks at its own direction and one increment to either side,
//! so that the spacing of beams is no gap, nor is a single beam that is ignored.
//!
//! The edge of the outline that the vehicle moves towards is divided into [`STRIPS`]. Each of them moves along the arc
//! of the vehicle. A strip is seen if a beam looks at the place where it will be at the time `ahead`, which is when a
//! brake has to begin to stop there. What is nearer has been seen on the way. A slow vehicle needs hardly any time, so
//! it is enough as well if a beam looks at the place one or two lengths of the edge ahead: a narrow view from the bumper
//! opens up until there. No look goes beyond a quarter of a turn, where the path comes back to the vehicle. What moves
//! backwards, as one corner of a vehicle that turns on the spot does, enters nothing and needs not be seen; nor are the
//! other edges looked at, which swing out a little in a turn.

use super::settings::Settings;
use super::tables::Beams;
use crate::vehicle::{Motion, Outline};
use std::f64::consts::{FRAC_PI_2, TAU};

/// An edge is divided into this many strips.
pub(super) const STRIPS: u32 = u32::BITS;

/// A gap that is wider than a quarter of a circle is kept in parts, which are no wider.
const WIDEST_PART: f64 = FRAC_PI_2;

/// A gap narrower than this is rounding, rad.
const ROUNDING: f64 = 1e-9;

/// It is enough if a beam looks at one of the places that are this many lengths of the edge ahead, or farther where
/// `ahead` is.
const LOOKS: [f64; 3] = [0.0, 1.0, 2.0];

/// No look is farther ahead than this, s: it keeps every product finite.
const FARTHEST: f64 = 1e6;

/// Below this angle, sine and cosine are replaced by their first terms, rad.
const STRAIGHT: f64 = 1e-6;

/// Where a scanner sits, and where it does not look.
#[derive(Clone, Debug)]
pub(super) struct FieldOfView {
    mount: (f64, f64),
    gaps: Vec<[(f64, f64); 2]>,
}

/// The edge of an outline that leads: its middle, half of it, and its outward normal.
struct Edge {
    middle: (f64, f64),
    half: (f64, f64),
    normal: (f64, f64),
}

impl FieldOfView {
    pub(super) fn new(settings: &Settings, beams: &Beams) -> Self {
        let usable = settings.angles().enumerate().filter(|(beam, _)| !beams.ignores(*beam));
        let mut angles: Vec<f64> = usable.map(|(_, angle)| (angle + settings.mount.yaw).rem_euclid(TAU)).collect();
        angles.sort_unstable_by(f64::total_cmp);
        let looks = settings.angle_increment.abs();
        let next = angles.iter().skip(1).copied().chain(angles.first().map(|first| first + TAU));
        let mut gaps = vec![];
        for (from, to) in angles.iter().zip(next) {
            gap(from + looks, to - looks, &mut gaps);
        }
        if angles.is_empty() {
            gap(0.0, TAU, &mut gaps);
        }
        FieldOfView { mount: (settings.mount.x, settings.mount.y), gaps }
    }

    /// Returns a bit for each strip of the leading edge that is not seen.
    pub(super) fn unseen(&self, outline: Outline, motion: Motion, ahead: f64) -> u32 {
        let Some(edge) = Edge::leading(outline, motion) else { return 0 };
        let farthest = (FRAC_PI_2 / motion.yaw_rate.abs()).min(FARTHEST);
        let length = edge.length() / motion.speed.hypot(motion.lateral_speed);
        let mut unseen = edge.advancing(motion);
        for lengths in LOOKS {
            if unseen != 0 {
                unseen &= self.unseen_after(&edge, motion, (lengths * length).max(ahead).min(farthest));
            }
        }
        unseen
    }

    /// Returns a bit for each strip of an edge that no beam looks at where it will be after a time, s.
    fn unseen_after(&self, edge: &Edge, motion: Motion, time: f64) -> u32 {
        let (sin, cos, along, across) = arc(motion.yaw_rate, time);
        let (vx, vy) = (motion.speed, motion.lateral_speed);
        let moved = (vx * along - vy * across - self.mount.0, vx * across + vy * along - self.mount.1);
        let place = |share| {
            let (x, y) = edge.at(share);
            (cos * x - sin * y + moved.0, sin * x + cos * y + moved.1)
        };
        let after = |from: &(f64, f64), (x, y): (f64, f64)| from.0 * y - from.1 * x > 0.0;
        let before = |to: &(f64, f64), (x, y): (f64, f64)| x * to.1 - y * to.0 > 0.0;
        // The edge is straight: what holds at neither of its ends holds nowhere.
        let ends = [place(-1.0), place(1.0)];
        let reaches = |[from, to]: &&[(f64, f64); 2]| {
            ends.iter().any(|end| after(from, *end)) && ends.iter().any(|end| before(to, *end))
        };
        self.gaps.iter().filter(reaches).fold(0, |unseen, [from, to]| {
            unseen | strips(|share| after(from, place(share)) && before(to, place(share)))
        })
    }
}

/// Adds the gap between two directions, in parts, if there is one.
fn gap(from: f64, to: f64, gaps: &mut Vec<[(f64, f64); 2]>) {
    let width = to - from;
    if width > ROUNDING {
        let parts = (width / WIDEST_PART).ceil();
        let direction = |part: f64| {
            let (sin, cos) = (from + width * part / parts).sin_cos();
            (cos, sin)
        };
        let starts = std::iter::successors(Some(0.0), |part| Some(part + 1.0)).take_while(|part| *part < parts);
        gaps.extend(starts.map(|part| [direction(part), direction(part + 1.0)]));
    }
}

/// Returns sine and cosine of the angle by which a vehicle turns in a time, and the integrals of cosine and sine until
/// then, s.
fn arc(yaw_rate: f64, time: f64) -> (f64, f64, f64, f64) {
    let angle = yaw_rate * time;
    if angle.abs() < STRAIGHT {
        return (angle, 1.0, time, time * angle / 2.0);
    }
    let (sin, cos) = angle.sin_cos();
    (sin, cos, sin / yaw_rate, (1.0 - cos) / yaw_rate)
}

/// Returns a bit for each strip for which something holds. A strip is known by its middle, from -1 to 1 along the edge.
fn strips(holds: impl Fn(f64) -> bool) -> u32 {
    let middle = |strip: u32| (f64::from(2 * strip) + 1.0) / f64::from(STRIPS) - 1.0;
    (0..STRIPS).fold(0, |bits, strip| bits | u32::from(holds(middle(strip))) << strip)
}

/// Returns the length of the longest run of strips, m.
pub(super) fn widest(strips: u32, outline: Outline, motion: Motion) -> f64 {
    let Some(edge) = Edge::leading(outline, motion) else { return 0.0 };
    let (mut run, mut left) = (0, strips);
    while left != 0 {
        left &= left << 1;
        run += 1;
    }
    edge.length() * f64::from(run) / f64::from(STRIPS)
}

impl Edge {
    /// The edge that the vehicle's origin moves towards, forward and back before sideways; `None` if it does not move.
    fn leading(outline: Outline, motion: Motion) -> Option<Edge> {
        let Outline { x_rear, x_front, y_right, y_left } = outline;
        let (x, y) = (x_rear.midpoint(x_front), y_right.midpoint(y_left));
        let (vx, vy) = (motion.speed, motion.lateral_speed);
        if vx == 0.0 && vy == 0.0 {
            return None;
        }
        let across = (0.0, (y_left - y_right) / 2.0);
        let along = ((x_front - x_rear) / 2.0, 0.0);
        let [middle, half, normal] = match (vx.abs() >= vy.abs(), vx > 0.0, vy > 0.0) {
            (true, true, _) => [(x_front, y), across, (1.0, 0.0)],
            (true, false, _) => [(x_rear, y), across, (-1.0, 0.0)],
            (false, _, true) => [(x, y_left), along, (0.0, 1.0)],
            (false, _, false) => [(x, y_right), along, (0.0, -1.0)],
        };
        Some(Edge { middle, half, normal })
    }

    fn length(&self) -> f64 {
        2.0 * (self.half.0 + self.half.1)
    }

    /// A place on the edge, from -1 to 1.
    fn at(&self, share: f64) -> (f64, f64) {
        (self.middle.0 + share * self.half.0, self.middle.1 + share * self.half.1)
    }

    /// Returns a bit for each strip that moves outwards.
    fn advancing(&self, motion: Motion) -> u32 {
        strips(|share| {
            let (x, y) = self.at(share);
            let velocity = (motion.speed - motion.yaw_rate * y, motion.lateral_speed + motion.yaw_rate * x);
            velocity.0 * self.normal.0 + velocity.1 * self.normal.1 > 0.0
        })
    }
}
