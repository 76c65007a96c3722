//! Tells a new measurement from the last one handed over again.
//!
//! A radar measures ten times a second and its log has fifty rows, each with the newest value: four rows of five say
//! nothing new. Were they measurements, they would prove that nothing moves. So a value that is repeated to the bit is
//! no measurement, and the track is predicted through it.
//!
//! Some repeats are measurements all the same. A sensor that rounds to `quantum` repeats a value for as long as the
//! target stays in one cell of that width. When the value steps by one quantum, the target has just crossed the edge
//! between two cells: that is where it is measured, and not at the centre of the new cell. A target that stays in a
//! cell for longer than its track predicts is at the near edge at best. And a target that stands, seen without noise,
//! is repeated for ever: after `PATIENCE` the repeats count. Only where the sensor has shown noise before, repeats for
//! so long say that it is frozen.

use super::filter::{Measurement, Posterior};

/// What a row says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Reading {
    /// A measurement, with the resolution of the sensor taken into account.
    New(Measurement),
    /// The last measurement again: the track is predicted.
    Repeat,
    /// The last measurement again, for longer than a noisy sensor can repeat itself.
    Frozen,
}

/// The newest distinct values of a sensor: how far they step, and for how long they are repeated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Repeats {
    /// The last value, m; NaN before the first.
    pub(super) value: f64,
    /// The stamp of its first row, s.
    pub(super) since: f64,
    /// The sizes of the newest steps from value to value, m; 0 where there was none yet.
    pub(super) steps: [f64; 12],
    /// The times between the newest steps, s; 0 where there was none yet.
    pub(super) dwells: [f64; 4],
}

impl Repeats {
    /// The time for which a value may be repeated before it counts as measured again, s. Sensors measure more often
    /// than this.
    const PATIENCE: f64 = 0.5;
    /// A value that is repeated for up to this multiple of the usual time says nothing.
    const USUAL: f64 = 1.5;
    /// Steps that tell a quantum.
    const STEPS: usize = 4;
    /// Steps that turn from growing to shrinking, or back, that show noise.
    const TURNS: usize = 3;
    /// A smaller quantum does not matter, m.
    const SMALLEST: f64 = 1e-3;
    /// Steps are multiples of a quantum to within this, m: numbers that were written as text or as float32 are rounded.
    const ROUNDING: f64 = 1e-4;
    /// Where in a cell a target was when its value stepped is not known better than to this part of the cell.
    const EDGE: f64 = 0.4;

    pub(super) fn new() -> Self {
        Repeats { value: f64::NAN, since: 0.0, steps: [0.0; 12], dwells: [0.0; 4] }
    }

    /// Reads a row. `predicted` is the track at its stamp, and `interval` the time since the row before, s.
    pub(super) fn read(&mut self, row: Measurement, predicted: Option<Posterior>, interval: f64) -> Reading {
        if row.distance == self.value {
            return self.repeated(row, predicted);
        }
        let step = row.distance - self.value; // NaN for the first row
        if step.is_finite() {
            self.steps.rotate_right(1);
            self.steps[0] = step.abs();
            self.dwells.rotate_right(1);
            self.dwells[0] = (row.stamp - self.since).min(Self::PATIENCE); // the target may have been away
        }
        (self.value, self.since) = (row.distance, row.stamp);
        let quantum = self.quantum();
        if quantum == 0.0 {
            return Reading::New(row);
        }
        let Some(track) = predicted.filter(|_| step.abs() < 1.5 * quantum) else {
            return Reading::New(at_least_uniform(row, quantum));
        };
        // The target crossed the edge within the newest row: what is uncertain is how far it went since.
        let travelled = (track.closing_speed.abs() * interval).min(quantum);
        let distance = row.distance - step.signum() * (quantum - travelled) / 2.0;
        Reading::New(at_least_uniform(Measurement { distance, ..row }, travelled.max(Self::EDGE * quantum)))
    }

    /// The time since a value that was new, s; infinite before the first.
    pub(super) fn age(&self, stamp: f64) -> f64 {
        if self.value.is_nan() { f64::INFINITY } else { stamp - self.since }
    }

    fn repeated(&self, row: Measurement, predicted: Option<Posterior>) -> Reading {
        let held = row.stamp - self.since;
        let usual = self.dwells.into_iter().fold(0.0, f64::max);
        let quantum = self.quantum();
        if held <= Self::USUAL * usual {
            return Reading::Repeat;
        }
        if let Some(track) = predicted.filter(|_| quantum > 0.0) {
            let edge = track.distance.clamp(self.value - quantum / 2.0, self.value + quantum / 2.0);
            if edge != track.distance {
                return Reading::New(at_least_uniform(Measurement { distance: edge, ..row }, quantum));
            }
        }
        if held <= Self::PATIENCE.max(2.0 * Self::USUAL * usual) {
            Reading::Repeat
        } else if quantum == 0.0 && self.is_jagged() {
            Reading::Frozen
        } else {
            Reading::New(at_least_uniform(row, quantum))
        }
    }

    /// Whether steps grow and shrink in turns, as noise makes them and no motion does.
    fn is_jagged(&self) -> bool {
        let seen = self.steps.iter().take_while(|step| **step > 0.0).count();
        let turns = self.steps[..seen].windows(3).filter(|three| {
            let (before, after) = (three[1] - three[0], three[2] - three[1]);
            before * after < 0.0 && before.abs().min(after.abs()) > Self::ROUNDING
        });
        turns.count() >= Self::TURNS
    }

    /// The width to which the sensor rounds, m: the greatest common divisor of the newest steps. 0 where there is none.
    fn quantum(&self) -> f64 {
        let vary = |sizes: &[f64], alike: f64| sizes.iter().any(|size| *size > 0.0 && (size - sizes[0]).abs() > alike);
        let steady = !vary(&self.steps, 2.0 * Self::ROUNDING) && !vary(&self.dwells, self.dwells[0] / 2.0);
        if self.steps[Self::STEPS - 1] == 0.0 || steady {
            return 0.0; // steps that are all alike are those of a steady motion as well
        }
        let mut divisor = 0.0;
        for step in self.steps {
            let (mut larger, mut smaller) = (step.max(divisor), step.min(divisor));
            while smaller > Self::ROUNDING {
                let rest = larger % smaller;
                (larger, smaller) = (smaller, if smaller - rest < Self::ROUNDING { 0.0 } else { rest });
            }
            divisor = larger;
            if divisor <= Self::SMALLEST {
                return 0.0;
            }
        }
        divisor
    }
}

/// The measurement with at least the variance of a number that is rounded to `cell`, m.
fn at_least_uniform(new: Measurement, cell: f64) -> Measurement {
    let variance = cell * cell / 12.0;
    if variance > new.variance { Measurement { variance, has_own_variance: true, ..new } } else { new }
}

#[cfg(test)]
mod tests {
    use super::{Reading, Repeats};
    use crate::tracker::filter::Measurement;

    fn readings(values: impl IntoIterator<Item = f64>) -> Vec<Reading> {
        let mut repeats = Repeats::new();
        let rows = values.into_iter().zip(0..);
        rows.map(|(distance, row)| {
            let stamp = 0.05 * f64::from(row);
            let row = Measurement { stamp, distance, variance: 4e-4, has_own_variance: false };
            repeats.read(row, None, 0.05)
        })
        .collect()
    }

    #[test]
    fn held_values_say_nothing_new() {
        let values = [30.0, 29.513, 28.987, 28.52, 27.99, 27.51];
        let found = readings(values.into_iter().flat_map(|value| [value; 4]));
        for (row, reading) in found.iter().enumerate() {
            assert_eq!(matches!(reading, Reading::New(_)), row % 4 == 0, "row {row}: {reading:?}");
        }
    }

    #[test]
    fn a_target_that_stands_is_measured_again_after_half_a_second() {
        let found = readings([10.0; 20]);
        assert!(found[1..=10].iter().all(|reading| *reading == Reading::Repeat));
        assert!(found[11..].iter().all(|reading| matches!(reading, Reading::New(_))));
    }

    #[test]
    fn a_rounded_distance_has_the_variance_of_its_rounding() {
        let last = |values: [f64; 6]| match readings(values)[5] {
            Reading::New(last) => (last.distance, last.variance),
            other => panic!("{other:?}"),
        };
        assert_eq!(last([12.0, 11.5, 10.5, 10.0, 8.0, 7.5]), (7.5, 0.25 / 12.0));
        assert_eq!(last([12.0, 11.5, 11.0, 10.5, 10.0, 9.5]), (9.5, 4e-4)); // as steady a motion does without rounding
    }
}
