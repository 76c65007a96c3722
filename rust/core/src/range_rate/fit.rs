//! A line through the readings of each beam, as far back as they belong to one surface.
//!
//! From the newest reading backwards, a reading belongs to the same surface as the one after it if the step between the
//! two is one that noise and the largest speed explain, and if the speed of the step differs from that of the step
//! after it by no more than noise and the largest acceleration explain. The range rate is the slope of the line of
//! least squares through these readings.

use super::history::{GROUP, Group, Past, group};
use super::settings::RateSettings;

/// What is fitted to a group of beams.
pub(super) struct Rates {
    /// The range rates, m/s; NaN where unknown.
    pub range_rate: Group,
    /// The standard errors of the range rates, m/s; NaN where unknown.
    pub standard_error: Group,
}

/// Fits lines, by the bounds on readings of one surface.
#[derive(Clone, Copy)]
pub(super) struct LineFit {
    /// How far noise may put two readings of one surface apart, m.
    jump: f64,
    /// The largest speed, m/s.
    max_speed: f64,
    /// Half of the largest acceleration, m/s^2.
    half_acceleration: f64,
    /// The least number of readings.
    min_scans: f64,
    /// The variance of a reading, m^2.
    variance: f64,
    /// The largest variance about a line, m^2.
    most_scatter: f64,
}

/// Sums over the readings of each beam of a group that belong to one surface. The newest reading is among them, with
/// age and change 0.
struct Sums {
    count: Group,
    age: Group,
    age_squares: Group,
    change: Group,
    change_squares: Group,
    products: Group,
}

/// The reading of each beam of a group that was looked at last, going backwards.
struct Last {
    /// How much older than the newest reading it is, s.
    age: Group,
    /// How much larger than the newest reading it is, m.
    change: Group,
    /// How much larger than the reading looked at before it is, m; 0 without one.
    step: Group,
    /// How much older than the reading looked at before it is, s; 0 without one.
    gap: Group,
    /// 1 if all readings up to this one belong to one surface, else 0. Numbers stay together in lanes where bools do
    /// not.
    same: Group,
}

impl LineFit {
    pub(super) fn new(settings: &RateSettings) -> Self {
        let scatter = settings.gate * settings.noise;
        LineFit {
            jump: settings.gate * std::f64::consts::SQRT_2 * settings.noise,
            max_speed: settings.max_speed,
            half_acceleration: 0.5 * settings.max_acceleration,
            min_scans: settings.min_scans as f64,
            variance: settings.noise * settings.noise,
            most_scatter: scatter * scatter,
        }
    }

    /// Fits lines to the group of beams `at ..`.
    ///
    /// Ages and changes are relative to the newest scan, so that a large stamp loses no digits.
    #[inline(always)]
    pub(super) fn fit(&self, newest: &[f64], past: &[Past<'_>], at: usize) -> Rates {
        let newest = group(newest, at);
        let zero = [0.0; GROUP];
        let mut last = Last { age: zero, change: zero, step: zero, gap: zero, same: [1.0; GROUP] };
        let mut sums = Sums {
            count: [1.0; GROUP],
            age: zero,
            age_squares: zero,
            change: zero,
            change_squares: zero,
            products: zero,
        };
        for scan in past {
            self.add(scan.age, group(scan.readings, at), newest, &mut last, &mut sums);
        }
        self.lines(newest, &sums)
    }

    /// Adds the readings of the next older scan.
    ///
    /// Each reading is compared with the last one, whether that belonged to the surface or not: once one does not, no
    /// older one counts anyway, and so no scan has to wait for the result of the one before.
    #[inline(always)]
    fn add(&self, age: f64, readings: &Group, newest: &Group, last: &mut Last, sums: &mut Sums) {
        for i in 0..GROUP {
            let change = readings[i] - newest[i];
            let seen = !change.is_nan();
            let (step, gap) = (change - last.change[i], age - last.age[i]);
            let (last_step, last_gap) = (last.step[i], last.gap[i]);
            let steady = step.abs() <= self.jump + self.max_speed * gap;
            let bend = (step * last_gap - last_step * gap).abs();
            let straight = bend <= (last_gap + gap) * (self.jump + self.half_acceleration * (gap * last_gap));
            let goes_on = if steady & straight { last.same[i] } else { 0.0 };
            let kept = if seen { goes_on } else { 0.0 };
            let kept_age = age * kept;
            let kept_change = if kept > 0.0 { change } else { 0.0 };
            sums.count[i] += kept;
            sums.age[i] += kept_age;
            sums.age_squares[i] += kept_age * kept_age;
            sums.change[i] += kept_change;
            sums.change_squares[i] += kept_change * kept_change;
            sums.products[i] += kept_age * kept_change;
            last.same[i] = if seen { goes_on } else { last.same[i] };
            last.age[i] = if seen { age } else { last.age[i] };
            last.change[i] = if seen { change } else { last.change[i] };
            last.step[i] = if seen { step } else { last_step };
            last.gap[i] = if seen { gap } else { last_gap };
        }
    }

    /// Returns the slopes of the lines, and their standard errors.
    #[inline(always)]
    fn lines(&self, newest: &Group, sums: &Sums) -> Rates {
        let mut rates = Rates { range_rate: [f64::NAN; GROUP], standard_error: [f64::NAN; GROUP] };
        for i in 0..GROUP {
            let (count, age, change) = (sums.count[i], sums.age[i], sums.change[i]);
            let each = 1.0 / count;
            let spread = sums.age_squares[i] - age * age * each;
            let slope = (sums.products[i] - age * change * each) / spread;
            let unexplained = sums.change_squares[i] - change * change * each - slope * slope * spread;
            let spare = count - 2.0;
            let least = self.variance * spare;
            let scatter = if unexplained > least { unexplained } else { least };
            let error = (scatter / (spare * spread)).sqrt();
            let on_a_line = unexplained <= self.most_scatter * spare;
            let known = (count >= self.min_scans) & on_a_line & !newest[i].is_nan();
            rates.range_rate[i] = if known { -slope } else { f64::NAN };
            rates.standard_error[i] = if known { error } else { f64::NAN };
        }
        rates
    }
}
