//! How far a point is from the outline, how fast that shrinks, and which way leads out of contact.

use super::entry::Sweep;

/// From the outline to a point, now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Approach {
    /// m; negative inside, where it is to the nearest edge.
    pub clearance: f64,
    /// How fast the clearance shrinks, m/s.
    pub closing_speed: f64,
}

impl Sweep {
    /// Clearance of a point and how fast it shrinks; NaN for a point that is none.
    pub(crate) fn approach(&self, [x, y]: [f64; 2]) -> Approach {
        if self.is_inside([x, y]) { self.in_it([x, y]) } else { self.out_of_it([x, y]) }
    }

    /// Whether a point in the outline goes deeper into it: it moves along a chord of the outline, and the end that it
    /// comes from is no farther than the one that it goes to. One that stands does not.
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

    /// From a point inside to each edge, m, and how fast that grows, m/s.
    fn edges(&self, [x, y]: [f64; 2]) -> [(f64, f64); 4] {
        let [vx, vy] = self.velocity([x, y]);
        let edge = self.outline;
        [(edge.x_front - x, 0.0 - vx), (x - edge.x_rear, vx), (edge.y_left - y, 0.0 - vy), (y - edge.y_right, vy)]
    }

    /// The nearest edge decides; of edges equally near, the one that recedes fastest.
    fn in_it(&self, point: [f64; 2]) -> Approach {
        let edges = self.edges(point);
        let depth =
            edges.into_iter().fold(f64::INFINITY, |least, (depth, _)| if depth < least { depth } else { least });
        let nearest = edges.into_iter().filter(|edge| edge.0 == depth);
        let closing_speed = nearest.fold(f64::NEG_INFINITY, |most, (_, rate)| if rate > most { rate } else { most });
        Approach { clearance: 0.0 - depth, closing_speed }
    }

    /// Straight to the nearest point of the outline. Scaled, so that the square of a tiny gap does not vanish.
    fn out_of_it(&self, [x, y]: [f64; 2]) -> Approach {
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
