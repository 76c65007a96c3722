//! The memory of a tracker as a list of numbers, to be saved and restored.
//!
//! Stamps are finite and in order, and counts are whole. Every other number may be infinite or NaN, because squares of
//! large distances overflow: a tracker takes up every state that it gave.

use super::answer::TrackedTtc;
use super::association::DistanceTracker;
use super::filter::{KalmanFilter, Measurement, State};
use super::repeats::Repeats;
use super::scale::{ScaleSettings, ScaleTracker, Target};
use super::settings::Settings;
use super::track::{Filter, InnovationCorrelation, Track};
use super::window::MOST;
use crate::error::Error;
use crate::status::Status;

impl DistanceTracker {
    /// Everything that the tracker remembers, without its settings. A tracker made by
    /// [`from_numbers`](Self::from_numbers) goes on from there, bit for bit.
    #[must_use]
    pub fn numbers(&self) -> Vec<f64> {
        let mut out = vec![self.origin.unwrap_or(f64::NAN), self.newest, self.noise.sum, self.noise.weight];
        write_answer(&mut out, &self.answer);
        out.extend([self.repeats.value, self.repeats.since]);
        out.extend(self.repeats.steps.into_iter().chain(self.repeats.dwells));
        for track in [&self.confirmed, &self.tentative] {
            out.push(f64::from(u8::from(track.is_some())));
            if let Some(track) = track {
                write_track(&mut out, track);
            }
        }
        out
    }

    /// A tracker that goes on from the [`numbers`](Self::numbers) of one with the same settings.
    ///
    /// # Errors
    /// When a setting is out of its domain, or the numbers are not those of such a tracker.
    pub fn from_numbers(settings: Settings, numbers: &[f64]) -> Result<Self, Error> {
        let mut tracker = DistanceTracker::new(settings)?;
        tracker.read(Reader { left: numbers }).ok_or_else(|| {
            Error::new("state", "must be what state() gave of a tracker with the same method; its numbers are not such")
        })?;
        Ok(tracker)
    }

    fn read(&mut self, mut reader: Reader<'_>) -> Option<()> {
        let origin = reader.any()?;
        self.origin = origin.is_finite().then_some(origin);
        self.newest = reader.finite()?;
        (self.noise.sum, self.noise.weight) = (reader.not_negative()?, reader.not_negative()?);
        self.answer = read_answer(&mut reader)?;
        self.repeats = Repeats {
            value: reader.any()?,
            since: reader.finite()?,
            steps: reader.many(Reader::not_negative)?,
            dwells: reader.many(Reader::not_negative)?,
        };
        for track in [&mut self.confirmed, &mut self.tentative] {
            if reader.count(1)? == 1 {
                let mut read = Track::empty(self.settings.method);
                read_track(&mut reader, &mut read)?;
                *track = Some(read);
            }
        }
        reader.left.is_empty().then_some(())
    }
}

impl ScaleTracker {
    /// Everything that the tracker remembers, without its settings. A tracker made by
    /// [`from_numbers`](Self::from_numbers) goes on from there, bit for bit.
    #[must_use]
    pub fn numbers(&self) -> Vec<f64> {
        let Target { members, is_metric, speeds, distances, too_far, spread, measured } = &self.target;
        let mut out = vec![self.origin.unwrap_or(f64::NAN), self.newest, *measured, *spread];
        out.extend([f64::from(u8::from(*is_metric)), f64::from(*speeds), f64::from(*distances), f64::from(*too_far)]);
        write_answer(&mut out, &self.answer);
        for member in members {
            out.push(member.evidence);
            write_kalman(&mut out, &member.filter);
        }
        out
    }

    /// A tracker that goes on from the [`numbers`](Self::numbers) of one with the same settings.
    ///
    /// # Errors
    /// When a setting is out of its domain, or the numbers are not those of such a tracker.
    pub fn from_numbers(settings: ScaleSettings, numbers: &[f64]) -> Result<Self, Error> {
        let mut tracker = ScaleTracker::new(settings)?;
        tracker.read(Reader { left: numbers }).ok_or_else(|| {
            Error::new("state", "must be what state() gave of a ScaleTracker; its numbers are not such")
        })?;
        Ok(tracker)
    }

    fn read(&mut self, mut reader: Reader<'_>) -> Option<()> {
        let origin = reader.any()?;
        self.origin = origin.is_finite().then_some(origin);
        self.newest = reader.finite()?;
        self.target.measured = reader.finite()?;
        self.target.spread = reader.not_negative()?;
        self.target.is_metric = reader.count(1)? == 1;
        let mut whole = || u32::try_from(reader.count(u32::MAX as usize)?).ok();
        (self.target.speeds, self.target.distances, self.target.too_far) = (whole()?, whole()?, whole()?);
        self.answer = read_answer(&mut reader)?;
        for member in &mut self.target.members {
            member.evidence = reader.finite()?;
            read_kalman(&mut reader, &mut member.filter)?;
        }
        (reader.left.is_empty() && self.target.is_finite()).then_some(())
    }
}

fn write_answer(out: &mut Vec<f64>, answer: &TrackedTtc) {
    let TrackedTtc { ttc, ttc_interval, distance, closing_speed, closing_speed_interval, status, age } = *answer;
    out.extend([ttc, distance, closing_speed, age, f64::from(status as u8)]);
    out.extend([ttc_interval, closing_speed_interval].into_iter().flat_map(|ends| ends.unwrap_or([f64::NAN; 2])));
}

fn read_answer(reader: &mut Reader<'_>) -> Option<TrackedTtc> {
    let [ttc, distance, closing_speed, age] = reader.many(Reader::any)?;
    let status = Status::ALL.get(reader.count(Status::ALL.len() - 1)?).copied()?;
    let mut ends = || {
        let [low, high] = reader.many(Reader::any)?;
        Some((!low.is_nan()).then_some([low, high]))
    };
    let (ttc_interval, closing_speed_interval) = (ends()?, ends()?);
    let negative = |time: f64| time.is_nan() || time < 0.0;
    let wrong = negative(ttc) || ttc_interval.is_some_and(|ends| ends.into_iter().any(negative));
    (!wrong).then_some(TrackedTtc { ttc, ttc_interval, distance, closing_speed, closing_speed_interval, status, age })
}

fn write_track(out: &mut Vec<f64>, track: &Track) {
    out.push(f64::from(track.consecutive_hits));
    write_correlation(out, &track.correlation);
    write_measurement(out, &track.last);
    out.extend([track.stationary.last, track.stationary.spread]);
    write_kalman(out, &track.stationary.line);
    match &track.filter {
        Filter::Recursive(filter) => write_kalman(out, filter),
        Filter::Bank(bank) => bank.members.iter().for_each(|member| {
            out.push(member.evidence);
            write_kalman(out, &member.filter);
        }),
        Filter::Window(filter) => {
            out.push(filter.frames.len() as f64);
            filter.frames.iter().for_each(|frame| write_measurement(out, frame));
        }
    }
}

fn read_track(reader: &mut Reader<'_>, track: &mut Track) -> Option<()> {
    track.consecutive_hits = u32::try_from(reader.count(u32::MAX as usize)?).ok()?;
    track.correlation = read_correlation(reader)?;
    track.last = read_measurement(reader)?;
    [track.stationary.last, track.stationary.spread] = reader.many(Reader::any)?;
    read_kalman(reader, &mut track.stationary.line)?;
    match &mut track.filter {
        Filter::Recursive(filter) => read_kalman(reader, filter),
        Filter::Bank(bank) => bank.members.iter_mut().try_for_each(|member| {
            member.evidence = reader.any()?;
            read_kalman(reader, &mut member.filter)
        }),
        Filter::Window(filter) => {
            let frames = reader.count(MOST)?;
            filter.frames = (0..frames).map(|_| read_measurement(reader)).collect::<Option<_>>()?;
            filter.frames.is_sorted_by(|a, b| a.stamp < b.stamp).then_some(())
        }
    }
}

fn write_correlation(out: &mut Vec<f64>, correlation: &InnovationCorrelation) {
    out.extend([correlation.last, correlation.products, correlation.squares]);
}

fn read_correlation(reader: &mut Reader<'_>) -> Option<InnovationCorrelation> {
    let [last, products, squares] = reader.many(Reader::any)?;
    Some(InnovationCorrelation { last, products, squares })
}

fn write_measurement(out: &mut Vec<f64>, measurement: &Measurement) {
    out.extend([
        measurement.stamp,
        measurement.distance,
        measurement.variance,
        f64::from(u8::from(measurement.has_own_variance)),
    ]);
}

fn read_measurement(reader: &mut Reader<'_>) -> Option<Measurement> {
    let stamp = reader.finite()?;
    let [distance, variance] = reader.many(Reader::any)?;
    Some(Measurement { stamp, distance, variance, has_own_variance: reader.count(1)? == 1 })
}

fn write_kalman(out: &mut Vec<f64>, filter: &KalmanFilter) {
    out.extend([f64::from(filter.frames), filter.stamp]);
    out.extend(filter.state.mean.into_iter().chain(filter.state.covariance));
}

fn read_kalman(reader: &mut Reader<'_>, filter: &mut KalmanFilter) -> Option<()> {
    filter.frames = u32::try_from(reader.count(u32::MAX as usize)?).ok()?;
    filter.stamp = reader.finite()?;
    filter.state = State { mean: reader.many(Reader::any)?, covariance: reader.many(Reader::any)? };
    Some(())
}

/// Reads numbers that came from outside one after the other, and checks each.
struct Reader<'a> {
    left: &'a [f64],
}

impl Reader<'_> {
    fn any(&mut self) -> Option<f64> {
        let (first, left) = self.left.split_first()?;
        self.left = left;
        Some(*first)
    }

    fn finite(&mut self) -> Option<f64> {
        self.any().filter(|value| value.is_finite())
    }

    fn not_negative(&mut self) -> Option<f64> {
        self.any().filter(|value| value.is_nan() || *value >= 0.0)
    }

    /// Reads a whole number from 0 to `most`.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be whole and in range")]
    fn count(&mut self, most: usize) -> Option<usize> {
        self.finite()
            .filter(|value| *value >= 0.0 && value.fract() == 0.0 && *value <= most as f64)
            .map(|value| value as usize)
    }

    fn many<const N: usize>(&mut self, mut one: impl FnMut(&mut Self) -> Option<f64>) -> Option<[f64; N]> {
        let mut out = [0.0; N];
        for value in &mut out {
            *value = one(self)?;
        }
        Some(out)
    }
}
