//! A line through the readings of each beam, as far back as they belong to one surface.

use super::RateSettings;
use super::history::{GROUP, Group, Past, group};

/// Range rates and their standard errors, m/s; NaN where unknown.
pub(super) struct Rates {
    pub range_rate: Group,
    pub standard_error: Group,
}

/// What decides whether two readings may belong to one surface, and whether they are on a line.
#[derive(Clone, Copy)]
pub(super) struct Rules {
    jump: f64,
    max_speed: f64,
    half_acceleration: f64,
    min_scans: f64,
    variance: f64,
    most_scatter: f64,
}

/// What is summed up over the scans of one group of beams, as far back as each sees the same surface. The newest reading is the
/// first, with age and change 0.
struct Sums {
    count: Group,
    age: Group,
    age_squares: Group,
    change: Group,
    change_squares: Group,
    products: Group,
}

/// The last reading that each beam of a group saw, and the step to it from the one before, with the time that it took: 0 when there
/// is none.
struct Last {
    age: Group,
    change: Group,
    step: Group,
    gap: Group,
    /// Whether all up to here belongs to one surface: 1, or 0. Numbers stay together in lanes where bools do not.
    same: Group,
}

impl Rules {
    pub(super) fn new(settings: &RateSettings) -> Self {
        let scatter = settings.gate * settings.noise;
        Rules {
            jump: settings.gate * std::f64::consts::SQRT_2 * settings.noise,
            max_speed: settings.max_speed,
            half_acceleration: 0.5 * settings.max_acceleration,
            min_scans: settings.min_scans as f64,
            variance: settings.noise * settings.noise,
            most_scatter: scatter * scatter,
        }
    }

    /// Fit beams `at ..`: from the newest reading back to the first that belongs to something else.
    ///
    /// Ages and changes are taken from the newest scan, so that nothing of a large stamp is lost.
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

    /// With the readings of one more scan.
    ///
    /// Each is compared with the last that was seen, whether that was kept or not: behind one that was not nothing counts anyway,
    /// and so no scan has to wait for the verdict on the one before.
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
