//! Which target a distance belongs to, and what is said when there is none.
//!
//! There is a confirmed track, which answers, and sometimes a tentative one: the target that was followed before a
//! nearer one came, or distances that do not fit the confirmed track and have not been seen often enough. A distance
//! whose innovation is in the gate of one of them goes to that one, and to one only, so that no answer is a mean of two
//! cars.

use super::answer::TrackedTtc;
use super::filter::Measurement;
use super::repeats::{Reading, Repeats};
use super::settings::Settings;
use super::track::{Innovation, NORMAL, NoiseLevel, Track};
use crate::error::{Error, positive};
use crate::status::Status;

/// Follows the distance of the nearest target over several frames.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceTracker {
    pub(super) settings: Settings,
    pub(super) noise: NoiseLevel,
    /// The first stamp. Times are counted from it, so that none of their digits go to the year.
    pub(super) origin: Option<f64>,
    /// The newest stamp, s since the origin.
    pub(super) newest: f64,
    pub(super) repeats: Repeats,
    pub(super) confirmed: Option<Track>,
    pub(super) tentative: Option<Track>,
    pub(super) answer: TrackedTtc,
}

/// Where the confirmed target is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// Predicted distance, m.
    pub distance: f64,
    /// Variance of the predicted distance, m^2, without that of a measurement.
    pub variance: f64,
}

impl DistanceTracker {
    /// A tracker that has seen nothing.
    ///
    /// # Errors
    /// When a setting is out of its domain.
    pub fn new(settings: Settings) -> Result<Self, Error> {
        let settings = settings.checked()?;
        Ok(DistanceTracker {
            settings,
            noise: NoiseLevel::new(settings.noise),
            origin: None,
            newest: 0.0,
            repeats: Repeats::new(),
            confirmed: None,
            tentative: None,
            answer: TrackedTtc::nothing(Status::NoData, f64::NAN),
        })
    }

    /// The settings of the tracker.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The answer after one more frame, taken at `stamp` (s). NaN and +inf say that the target is not in the frame. A
    /// distance that is repeated to the bit is predicted through, as [`super::repeats`] says.
    ///
    /// `noise` is the standard deviation of this distance, m, in the place of that of the settings.
    ///
    /// # Errors
    /// When `noise` is not above 0.
    pub fn update(&mut self, distance: f64, stamp: f64, noise: Option<f64>) -> Result<TrackedTtc, Error> {
        let noise = noise.map(|noise| positive("noise", noise)).transpose()?;
        let seconds = stamp - self.origin.unwrap_or(stamp);
        let out_of_order = self.origin.is_some() && seconds <= self.newest;
        if !seconds.is_finite() || out_of_order || distance == f64::NEG_INFINITY {
            return Ok(self.answer.with(Status::Invalid));
        }
        self.origin.get_or_insert(stamp);
        let interval = seconds - self.newest;
        self.newest = seconds;
        self.answer = if distance.is_finite() {
            let variance = noise.map_or_else(|| self.noise.variance(), |noise| noise * noise);
            let row = Measurement { stamp: seconds, distance, variance, has_own_variance: noise.is_some() };
            let predicted = self.confirmed.as_mut().and_then(|track| {
                track.filter.predict(seconds);
                track.posterior(seconds, &self.noise)
            });
            match self.repeats.read(row, predicted, interval) {
                Reading::New(measurement) => self.associate(measurement, noise.is_none()),
                reading => self.repeat(reading),
            }
        } else {
            self.coast(distance)
        };
        self.answer.age = self.repeats.age(seconds);
        Ok(self.answer)
    }

    /// Where the confirmed target is expected at `stamp`, once it has warmed up.
    #[must_use]
    pub fn predict(&self, stamp: f64) -> Option<Prediction> {
        let seconds = stamp - self.origin?;
        let posterior = self.confirmed.as_ref()?.posterior(seconds, &self.noise)?;
        Some(Prediction { distance: posterior.distance, variance: posterior.dd })
    }

    /// Gives a distance to the track that it belongs to. `learns` says whether the noise is learnt from it.
    fn associate(&mut self, new: Measurement, learns: bool) -> TrackedTtc {
        let had_track = self.confirmed.is_some();
        self.drop_stale_tracks();
        let Some(mut confirmed) = self.confirmed.take() else {
            self.confirmed = Some(Track::new(self.settings.method, new));
            return TrackedTtc::only_where(if had_track { Status::Stale } else { Status::WarmingUp }, new.distance);
        };
        let innovation = confirmed.innovation(new, &self.settings, &self.noise);
        if let Some(normalized) = innovation.normalized.filter(|_| learns) {
            self.noise.learn(normalized, new.variance);
        }
        let is_farther = innovation.value > self.settings.jump;
        let tentative = self.tentative.take();
        let other = tentative.as_ref().map(|track| track.innovation(new, &self.settings, &self.noise));
        let mut went_elsewhere = false;
        match (tentative, other) {
            (Some(tentative), Some(other)) if other.in_gate && prefers_tentative(&confirmed, &innovation, &other) => {
                self.update_tentative(confirmed, tentative, new, &other);
                went_elsewhere = true;
            }
            (tentative, _) if innovation.in_gate => {
                confirmed.update(new, &innovation);
                let is_sure = confirmed.consecutive_hits >= self.settings.confirm;
                self.tentative = tentative.filter(|_| !is_sure).map(without_hit);
                self.confirmed = Some(confirmed);
            }
            (tentative, _) => went_elsewhere = self.begin_track(confirmed, tentative, new, &innovation),
        }
        let track = self.confirmed.as_ref().expect("each case sets one");
        let answer = self.answer_of(track);
        let is_lost = went_elsewhere && is_farther && track.last.stamp < new.stamp;
        if is_lost { answer.with(Status::Lost) } else { answer }
    }

    /// Gives a distance to the tentative track. It becomes the confirmed one after enough hits in a row, or if the
    /// confirmed one was but a flicker.
    fn update_tentative(&mut self, confirmed: Track, mut tentative: Track, new: Measurement, innovation: &Innovation) {
        tentative.update(new, innovation);
        let flicker = confirmed.is_warming_up() && tentative.filter.frames() > confirmed.filter.frames();
        let confirmed = without_hit(confirmed);
        if tentative.consecutive_hits >= self.settings.confirm {
            (self.confirmed, self.tentative) = (Some(tentative), None);
        } else if flicker {
            (self.confirmed, self.tentative) = (Some(tentative), Some(confirmed));
        } else {
            (self.confirmed, self.tentative) = (Some(confirmed), Some(tentative));
        }
    }

    /// Begins a track with a distance that is in no gate. A nearer target is confirmed at once, because it is the more
    /// dangerous one; any other is tentative. Says whether the confirmed track stays.
    fn begin_track(
        &mut self,
        confirmed: Track,
        tentative: Option<Track>,
        new: Measurement,
        innovation: &Innovation,
    ) -> bool {
        let begun = Track::new(self.settings.method, new);
        let is_nearer = innovation.value < -self.settings.jump;
        let confirmed = without_hit(confirmed);
        match tentative {
            Some(tentative) if confirmed.is_warming_up() && !tentative.is_warming_up() => {
                (self.confirmed, self.tentative) = (Some(begun), Some(without_hit(tentative)));
            }
            _ if is_nearer => (self.confirmed, self.tentative) = (Some(begun), Some(confirmed)),
            _ => {
                (self.confirmed, self.tentative) = (Some(confirmed), Some(begun));
                return true;
            }
        }
        false
    }

    /// The answer to a frame without the target, which is expected to go on for a while.
    fn coast(&mut self, distance: f64) -> TrackedTtc {
        self.drop_stale_tracks();
        match &self.confirmed {
            Some(track) => self.answer_of(track).with(Status::Lost),
            None if distance.is_nan() => TrackedTtc::nothing(Status::NoData, f64::NAN),
            None => TrackedTtc::nothing(Status::Clear, f64::INFINITY),
        }
    }

    /// The answer to a frame that hands over the last measurement again: the track is predicted. A frozen sensor has
    /// lost it.
    fn repeat(&mut self, reading: Reading) -> TrackedTtc {
        self.drop_stale_tracks();
        match &self.confirmed {
            Some(track) if reading == Reading::Frozen => self.answer_of(track).with(Status::Lost),
            Some(track) => self.answer_of(track),
            None => TrackedTtc::nothing(Status::Stale, f64::NAN),
        }
    }

    fn drop_stale_tracks(&mut self) {
        let fresh = |track: &Track| self.newest - track.last.stamp <= self.settings.max_gap;
        self.tentative = self.tentative.take().filter(fresh);
        self.confirmed = self.confirmed.take().filter(fresh);
        if self.confirmed.is_none() {
            self.confirmed = self.tentative.take();
        }
    }

    fn answer_of(&self, track: &Track) -> TrackedTtc {
        let Some(posterior) = track.posterior(self.newest, &self.noise) else {
            return TrackedTtc::only_where(Status::WarmingUp, track.last.distance);
        };
        let quantile = if track.last.has_own_variance { NORMAL } else { self.noise.quantile() };
        let closes = posterior.closing_speed > self.settings.min_closing_speed
            && track.stationary.closes(&posterior, quantile, track.correlation.variance_factor());
        let answer = TrackedTtc::new(posterior, quantile, closes);
        let surely_closes = answer.closing_speed_interval.is_some_and(|[low, _]| low > self.settings.min_closing_speed);
        if answer.status == Status::NotClosing && surely_closes && track.stationary.is_young() {
            answer.with(Status::WarmingUp) // the line proves nothing yet, and the filter contradicts it
        } else {
            answer
        }
    }
}

/// Whether the tentative track gets a distance that is in its gate. A distance in the gate of the confirmed track too
/// goes to the tentative one only while the confirmed one warms up and predicts it less well.
fn prefers_tentative(confirmed: &Track, innovation: &Innovation, tentative: &Innovation) -> bool {
    !innovation.in_gate || (confirmed.is_warming_up() && tentative.value.abs() < innovation.value.abs())
}

/// The track after a frame that did not belong to it.
fn without_hit(track: Track) -> Track {
    Track { consecutive_hits: 0, ..track }
}

#[cfg(test)]
mod tests {
    use super::DistanceTracker;
    use crate::status::Status;
    use crate::tracker::{Method, Noise, Settings, TrackedTtc};

    const METHODS: [Method; 7] = [
        Method::MotionMixture { memory: 2.0, scale: 1.0 },
        Method::SlidingLine { window: 0.5, acceleration: 0.5 },
        Method::SlidingParabola { window: 1.0, jerk: 1.0 },
        Method::TheilSen { window: 0.5, acceleration: 0.5 },
        Method::AlphaBeta { memory: 0.2, acceleration: 0.5 },
        Method::KalmanCv { acceleration: 1.0 },
        Method::KalmanCa { jerk: 1.5, acceleration: 3.0 },
    ];

    fn tracker(method: Method) -> DistanceTracker {
        DistanceTracker::new(Settings { method, noise: Noise::Given(0.03), ..Settings::default() }).unwrap()
    }

    /// Feeds the tracker distances every tenth of a second from `frame` on.
    fn feed(tracker: &mut DistanceTracker, frame: u32, distances: impl IntoIterator<Item = f64>) -> Vec<TrackedTtc> {
        let stamps = (frame..).map(|frame| 1.7e9 + 0.1 * f64::from(frame));
        distances.into_iter().zip(stamps).map(|(d, stamp)| tracker.update(d, stamp, None).unwrap()).collect()
    }

    #[test]
    fn a_steady_approach() {
        for method in METHODS {
            let answers = feed(&mut tracker(method), 0, (0..20).map(|i| 30.0 - 0.5 * f64::from(i)));
            assert_eq!(answers[0].status, Status::WarmingUp, "{method:?}");
            let last = answers[19];
            assert_eq!(last.status, Status::Closing, "{method:?}");
            assert!((last.closing_speed - 5.0).abs() < 1e-5, "{method:?}: {last:?}");
            assert!((last.ttc - 20.5 / 5.0).abs() < 1e-5, "{method:?}: {last:?}");
            let [low, high] = last.ttc_interval.unwrap();
            assert!(low > 3.0 && low < last.ttc && last.ttc < high && high < 6.0, "{method:?}: {last:?}");
        }
    }

    #[test]
    fn a_nearer_car_leads_at_once_and_no_answer_lies_between() {
        for method in METHODS {
            let mut tracker = tracker(method);
            feed(&mut tracker, 0, (0..10).map(|i| 30.0 - 0.1 * f64::from(i)));
            let answers = feed(&mut tracker, 10, (0..10).map(|i| 12.0 - 0.1 * f64::from(i)));
            assert_eq!(answers[0].status, Status::WarmingUp, "{method:?}");
            for (i, answer) in answers.iter().enumerate() {
                assert!((answer.distance - (12.0 - 0.1 * i as f64)).abs() < 0.2, "{method:?}: {answer:?}");
                assert!(answer.ttc == f64::INFINITY || (answer.closing_speed - 1.0).abs() < 0.3, "{method:?}");
            }
            assert_eq!(answers[9].status, Status::Closing);
        }
    }

    #[test]
    fn a_flicker_costs_one_frame() {
        for method in METHODS {
            let mut tracker = tracker(method);
            feed(&mut tracker, 0, (0..10).map(|i| 30.0 - 0.5 * f64::from(i)));
            assert_eq!(feed(&mut tracker, 10, [3.0])[0].status, Status::WarmingUp, "{method:?}");
            let after = feed(&mut tracker, 11, [24.5, 24.0]);
            assert_eq!(after.map_statuses(), [Status::Closing; 2], "{method:?}: {after:?}");
            assert!((after[0].closing_speed - 5.0).abs() < 0.01, "{method:?}: {after:?}");
        }
    }

    #[test]
    fn a_car_that_leaves_is_lost_then_the_one_behind_it_is_followed() {
        for method in METHODS {
            let mut tracker = tracker(method);
            feed(&mut tracker, 0, (0..10).map(|i| 12.0 - 0.1 * f64::from(i)));
            let answers = feed(&mut tracker, 10, (0..5).map(|i| 40.0 - 0.5 * f64::from(i)));
            let statuses = answers.map_statuses();
            assert_eq!(statuses[..2], [Status::Lost; 2], "{method:?}");
            assert!(answers[1].distance < 12.0);
            assert!(answers[4].distance > 37.0, "{method:?}: {answers:?}");
        }
    }

    #[test]
    fn missing_repeated_late_and_senseless_frames() {
        let mut tracker = tracker(METHODS[6]);
        assert_eq!(tracker.update(f64::NAN, 5.0, None).unwrap().status, Status::NoData);
        assert_eq!(tracker.update(f64::INFINITY, 5.1, None).unwrap().status, Status::Clear);
        let answers = feed(&mut tracker, 0, (0..10).map(|i| 30.0 - 0.5 * f64::from(i)));
        let before = tracker.clone();
        for (distance, stamp) in [(1.0, 1.7e9 + 0.9), (1.0, 3.0), (1.0, f64::NAN), (f64::NEG_INFINITY, 1.8e9)] {
            assert_eq!(tracker.update(distance, stamp, None).unwrap(), answers[9].with(Status::Invalid));
            assert_eq!(tracker, before);
        }
        let lost = tracker.update(f64::NAN, 1.7e9 + 1.0, None).unwrap();
        assert_eq!(lost.status, Status::Lost);
        assert!((lost.distance - 25.0).abs() < 0.01);
        assert_eq!(tracker.update(9.0, 1.7e9 + 10.0, None).unwrap().status, Status::Stale);
        assert!(tracker.update(9.0, 1.7e9 + 11.0, Some(0.0)).is_err());
    }

    #[test]
    fn noise_far_above_the_start_is_learnt() {
        let noisy = |i: u32| 40.0 - 0.3 * f64::from(i) + if i.is_multiple_of(2) { 0.6 } else { -0.6 };
        for method in METHODS {
            let mut tracker = DistanceTracker::new(Settings { method, ..Settings::default() }).unwrap();
            let answers = feed(&mut tracker, 0, (0..100).map(noisy));
            assert!(answers[60..].iter().all(|answer| answer.ttc_interval.is_some()), "{method:?}");
        }
    }

    #[test]
    fn a_tracker_goes_on_from_its_numbers() {
        let distances = |from: u32| (from..from + 12).map(|i| 30.0 - 0.4 * f64::from(i) + f64::from(i * 7 % 5) * 0.01);
        for method in METHODS {
            let mut tracker = tracker(method);
            feed(&mut tracker, 0, distances(0));
            feed(&mut tracker, 12, [3.0, f64::NAN]);
            let numbers = tracker.numbers();
            let mut copy = DistanceTracker::from_numbers(*tracker.settings(), &numbers).unwrap();
            assert_eq!(feed(&mut copy, 14, distances(14)), feed(&mut tracker, 14, distances(14)));
            for cut in 0..numbers.len() {
                assert!(DistanceTracker::from_numbers(*tracker.settings(), &numbers[..cut]).is_err());
            }
        }
    }

    trait Statuses {
        fn map_statuses(&self) -> Vec<Status>;
    }

    impl Statuses for Vec<TrackedTtc> {
        fn map_statuses(&self) -> Vec<Status> {
            self.iter().map(|answer| answer.status).collect()
        }
    }
}
