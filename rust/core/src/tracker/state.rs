//! The memory of a tracker as a list of numbers, to be kept and taken up again.
//!
//! Stamps are finite and in order, and counts are whole. Every other number may be infinite or NaN, because squares of
//! large distances overflow: a tracker takes up every state that it gave.

use super::answer::TrackedTtc;
use super::filter::Filter;
use super::noise::Whiteness;
use super::posterior::Measured;
use super::recursive::{Recursive, State};
use super::settings::Settings;
use super::targets::DistanceTracker;
use super::track::Track;
use super::window::MOST;
use crate::error::Error;
use crate::status::Status;

impl DistanceTracker {
    /// All that it remembers, the settings aside. [`from_numbers`](Self::from_numbers) goes on from there, bit for bit.
    #[must_use]
    pub fn numbers(&self) -> Vec<f64> {
        let mut out = vec![self.origin.unwrap_or(f64::NAN), self.newest, self.noise.sum, self.noise.weight];
        let TrackedTtc { ttc, ttc_interval, distance, closing_speed, closing_speed_interval, status } = self.answer;
        out.extend([ttc, distance, closing_speed, f64::from(status as u8)]);
        out.extend([ttc_interval, closing_speed_interval].into_iter().flat_map(|ends| ends.unwrap_or([f64::NAN; 2])));
        for track in [&self.present, &self.rival] {
            out.push(f64::from(u8::from(track.is_some())));
            if let Some(track) = track {
                write_track(&mut out, track);
            }
        }
        out
    }

    /// A tracker that goes on where [`numbers`](Self::numbers) were taken of one with the same settings.
    ///
    /// # Errors
    /// When a setting is out of its domain, or the numbers are not such ones.
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
        let [ttc, distance, closing_speed] = reader.many(Reader::any)?;
        let status = Status::ALL.get(reader.count(Status::ALL.len() - 1)?).copied()?;
        let mut ends = || {
            let [low, high] = reader.many(Reader::any)?;
            Some((!low.is_nan()).then_some([low, high]))
        };
        let (ttc_interval, closing_speed_interval) = (ends()?, ends()?);
        self.answer = TrackedTtc { ttc, ttc_interval, distance, closing_speed, closing_speed_interval, status };
        let negative = |time: f64| time.is_nan() || time < 0.0;
        if negative(ttc) || ttc_interval.is_some_and(|ends| ends.into_iter().any(negative)) {
            return None;
        }
        for track in [&mut self.present, &mut self.rival] {
            if reader.count(1)? == 1 {
                let mut read = Track::empty(self.settings.method);
                read_track(&mut reader, &mut read)?;
                *track = Some(read);
            }
        }
        reader.left.is_empty().then_some(())
    }
}

fn write_track(out: &mut Vec<f64>, track: &Track) {
    out.push(f64::from(track.run));
    write_whiteness(out, &track.whiteness);
    write_measured(out, &track.last);
    out.extend([track.standing.last, track.standing.spread]);
    write_recursive(out, &track.standing.line);
    match &track.filter {
        Filter::Recursive(filter) => write_recursive(out, filter),
        Filter::Window(filter) => {
            out.push(filter.frames.len() as f64);
            filter.frames.iter().for_each(|frame| write_measured(out, frame));
        }
    }
}

fn read_track(reader: &mut Reader<'_>, track: &mut Track) -> Option<()> {
    track.run = u32::try_from(reader.count(u32::MAX as usize)?).ok()?;
    track.whiteness = read_whiteness(reader)?;
    track.last = read_measured(reader)?;
    [track.standing.last, track.standing.spread] = reader.many(Reader::any)?;
    read_recursive(reader, &mut track.standing.line)?;
    match &mut track.filter {
        Filter::Recursive(filter) => read_recursive(reader, filter),
        Filter::Window(filter) => {
            let frames = reader.count(MOST)?;
            filter.frames = (0..frames).map(|_| read_measured(reader)).collect::<Option<_>>()?;
            filter.frames.is_sorted_by(|a, b| a.stamp < b.stamp).then_some(())
        }
    }
}

fn write_whiteness(out: &mut Vec<f64>, whiteness: &Whiteness) {
    out.extend([whiteness.last, whiteness.products, whiteness.squares]);
}

fn read_whiteness(reader: &mut Reader<'_>) -> Option<Whiteness> {
    let [last, products, squares] = reader.many(Reader::any)?;
    Some(Whiteness { last, products, squares })
}

fn write_measured(out: &mut Vec<f64>, measured: &Measured) {
    out.extend([measured.stamp, measured.distance, measured.variance, f64::from(u8::from(measured.own))]);
}

fn read_measured(reader: &mut Reader<'_>) -> Option<Measured> {
    let stamp = reader.finite()?;
    let [distance, variance] = reader.many(Reader::any)?;
    Some(Measured { stamp, distance, variance, own: reader.count(1)? == 1 })
}

fn write_recursive(out: &mut Vec<f64>, filter: &Recursive) {
    out.extend([f64::from(filter.frames), filter.stamp]);
    out.extend(filter.state.mean.into_iter().chain(filter.state.covariance));
}

fn read_recursive(reader: &mut Reader<'_>, filter: &mut Recursive) -> Option<()> {
    filter.frames = u32::try_from(reader.count(u32::MAX as usize)?).ok()?;
    filter.stamp = reader.finite()?;
    filter.state = State { mean: reader.many(Reader::any)?, covariance: reader.many(Reader::any)? };
    Some(())
}

/// Numbers that came from outside.
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

    /// A whole number up to `most`.
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
