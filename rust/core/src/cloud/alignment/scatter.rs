//! How much whole frames scatter.
//!
//! A car that nods sees the body at other heights in each frame, and all cells are off together: more points do not
//! average that out. It shows in the positions themselves. Of four frames in a row, the part of the motion that no
//! parabola has (their third difference) should be no more than their points make it. Where somebody begins to brake only the
//! few differences across that moment are larger, so that the median of all is that of the scatter.

use super::median;
use super::weights::Weighed;
use super::witnesses::Witnesses;

/// Frames of a difference.
const RUN: usize = 4;
/// Median of the square of a normal number.
const MEDIAN_SQUARE: f64 = 0.4549;
/// How many differences the belief is worth that frames scatter no more than their points do.
const KNOWN: f64 = 2.0;
/// Less than any weight that matters.
const NOTHING: f64 = 1e-9;

/// By how much more frames scatter than their points do, as a ratio of variances; at least 1.
pub(super) fn scatter(seen: &Witnesses, time: &[f64], found: &Weighed) -> f64 {
    let totals: Vec<f64> = seen.by_frame().map(|range| found.weight[range].iter().sum()).collect();
    let runs = time.windows(RUN).zip(found.position.windows(RUN)).zip(totals.windows(RUN));
    let mut ratios: Vec<f64> =
        runs.filter_map(|((time, position), total)| ratio(time, position, total, found.noise)).collect();
    if ratios.is_empty() {
        return 1.0;
    }
    let differences = ratios.len() as f64;
    let typical = median(&mut ratios) / MEDIAN_SQUARE;
    ((KNOWN + differences * typical) / (KNOWN + differences)).max(1.0)
}

/// The square of a third difference, over what it would be on average; none where a frame says nothing.
fn ratio(time: &[f64], position: &[f64], total: &[f64], noise: f64) -> Option<f64> {
    if total.iter().any(|total| *total <= NOTHING) {
        return None;
    }
    let (mut difference, mut variance) = (0.0, 0.0);
    for i in 0..RUN {
        let apart: f64 = (0..RUN).filter(|j| *j != i).map(|j| time[i] - time[j]).product();
        difference += position[i] / apart;
        variance += noise / (apart * apart * total[i]);
    }
    let ratio = difference * difference / variance;
    ratio.is_finite().then_some(ratio) // stamps may be too near each other for their difference
}

#[cfg(test)]
mod tests {
    use super::ratio;

    #[test]
    fn a_parabola_does_not_scatter_and_what_no_parabola_has_does() {
        let (time, total) = ([-0.4, -0.3, -0.1, 0.0], [50.0; 4]);
        let parabola = time.map(|t: f64| 3.0 - 2.0 * t + 4.0 * t * t);
        assert!(ratio(&time, &parabola, &total, 4e-4).unwrap() < 1e-9);
        // One frame of equal ones that is off by as much as its points make it: its share of the variance.
        let even = [0.0, 0.1, 0.2, 0.3];
        let off = [0.0, (4e-4_f64 / 50.0).sqrt(), 0.0, 0.0];
        assert!((ratio(&even, &off, &total, 4e-4).unwrap() - 9.0 / 20.0).abs() < 1e-9);
    }

    #[test]
    fn what_cannot_be_said_is_not() {
        assert_eq!(ratio(&[0.0, 0.1, 0.2, 0.3], &[0.0; 4], &[50.0, 50.0, 0.0, 50.0], 4e-4), None);
        assert_eq!(ratio(&[0.0, 1e-300, 2e-300, 3e-300], &[0.0, 1.0, 0.0, 0.0], &[50.0; 4], 4e-4), None);
    }
}
