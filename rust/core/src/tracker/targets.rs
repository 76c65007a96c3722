//! Which target a distance belongs to, and what is said when there is none.
//!
//! There is a present target, and sometimes a rival: the target before a nearer one came, or distances that do not fit
//! the present one and have not been confirmed yet. A distance goes to one of them, never to both, so that no answer is
//! a mean of two cars.

use super::answer::TrackedTtc;
use super::noise::NoiseLevel;
use super::posterior::Measured;
use super::settings::{Settings, above_zero};
use super::track::{Surprise, Track};
use crate::error::Error;
use crate::status::Status;

/// Follows the distance of the nearest target over several frames.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceTracker {
    pub(super) settings: Settings,
    pub(super) noise: NoiseLevel,
    /// The first stamp: times are counted from it, so that none of their digits go to the year.
    pub(super) origin: Option<f64>,
    /// The newest, s since the origin.
    pub(super) newest: f64,
    pub(super) present: Option<Track>,
    pub(super) rival: Option<Track>,
    pub(super) answer: TrackedTtc,
}

/// Where the present target is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// m
    pub distance: f64,
    /// Its variance, m^2, without that of a measurement.
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
            present: None,
            rival: None,
            answer: TrackedTtc::nothing(Status::NoData, f64::NAN),
        })
    }

    /// What it was told.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The answer after one more frame, taken at `stamp` (s). NaN and +inf say that the target is not in it.
    ///
    /// `noise` is the standard deviation of this distance, m, in the place of what the settings say.
    ///
    /// # Errors
    /// When `noise` is not above 0.
    pub fn update(&mut self, distance: f64, stamp: f64, noise: Option<f64>) -> Result<TrackedTtc, Error> {
        let noise = noise.map(|noise| above_zero("noise", noise)).transpose()?;
        let seconds = stamp - self.origin.unwrap_or(stamp);
        let out_of_order = self.origin.is_some() && seconds <= self.newest;
        if !seconds.is_finite() || out_of_order || distance == f64::NEG_INFINITY {
            return Ok(self.answer.with(Status::Invalid));
        }
        self.origin.get_or_insert(stamp);
        self.newest = seconds;
        self.answer = if distance.is_finite() {
            let variance = noise.map_or_else(|| self.noise.variance(), |noise| noise * noise);
            self.seen(Measured { stamp: seconds, distance, variance, own: noise.is_some() })
        } else {
            self.missed(distance)
        };
        Ok(self.answer)
    }

    /// Where the present target is expected at `stamp`, if there is one that is known well enough.
    #[must_use]
    pub fn predict(&self, stamp: f64) -> Option<Prediction> {
        let seconds = stamp - self.origin?;
        let posterior = self.present.as_ref()?.at(seconds, &self.noise)?;
        Some(Prediction { distance: posterior.distance, variance: posterior.dd })
    }

    /// A frame without the target: it is expected to go on for a while.
    fn missed(&mut self, distance: f64) -> TrackedTtc {
        self.forget_what_is_old();
        match &self.present {
            Some(track) => self.about(track).with(Status::Lost),
            None if distance.is_nan() => TrackedTtc::nothing(Status::NoData, f64::NAN),
            None => TrackedTtc::nothing(Status::Clear, f64::INFINITY),
        }
    }

    fn seen(&mut self, new: Measured) -> TrackedTtc {
        let had = self.present.is_some();
        self.forget_what_is_old();
        let Some(mut present) = self.present.take() else {
            self.present = Some(Track::new(self.settings.method, new));
            return TrackedTtc::only_where(if had { Status::Stale } else { Status::WarmingUp }, new.distance);
        };
        let surprise = present.surprise(new, &self.settings, &self.noise);
        if let Some(deviations) = surprise.deviations.filter(|_| !new.own) {
            self.noise.learn(deviations);
        }
        let is_far = surprise.miss > self.settings.jump;
        let rival = self.rival.take();
        let claim = rival.as_ref().map(|rival| rival.surprise(new, &self.settings, &self.noise));
        let mut astray = false;
        match (rival, claim) {
            (Some(rival), Some(claim)) if claim.fits && prefers(&present, &surprise, &claim) => {
                self.given_to_rival(present, rival, new, &claim);
                astray = true;
            }
            (rival, _) if surprise.fits => {
                present.take(new, &surprise);
                let confirmed = present.run >= self.settings.confirm;
                self.rival = rival.filter(|_| !confirmed).map(interrupted);
                self.present = Some(present);
            }
            (rival, _) => astray = self.given_to_nobody(present, rival, new, &surprise),
        }
        let track = self.present.as_ref().expect("one was put back in each case");
        let answer = self.about(track);
        if astray && is_far && track.last.stamp < new.stamp { answer.with(Status::Lost) } else { answer }
    }

    /// The rival takes a distance, and the lead as soon as it is confirmed, or the present one was but a flicker.
    fn given_to_rival(&mut self, present: Track, mut rival: Track, new: Measured, claim: &Surprise) {
        rival.take(new, claim);
        let flicker = present.is_young() && rival.filter.frames() > present.filter.frames();
        let present = interrupted(present);
        if rival.run >= self.settings.confirm {
            (self.present, self.rival) = (Some(rival), None);
        } else if flicker {
            (self.present, self.rival) = (Some(rival), Some(present));
        } else {
            (self.present, self.rival) = (Some(present), Some(rival));
        }
    }

    /// A distance that fits no target begins one: a nearer one leads at once, others must be confirmed. Says whether
    /// the lead stays.
    fn given_to_nobody(&mut self, present: Track, rival: Option<Track>, new: Measured, surprise: &Surprise) -> bool {
        let begun = Track::new(self.settings.method, new);
        let nearer = surprise.miss < -self.settings.jump;
        let present = interrupted(present);
        match rival {
            Some(rival) if present.is_young() && !rival.is_young() => {
                (self.present, self.rival) = (Some(begun), Some(interrupted(rival)));
            }
            _ if nearer => (self.present, self.rival) = (Some(begun), Some(present)),
            _ => {
                (self.present, self.rival) = (Some(present), Some(begun));
                return true;
            }
        }
        false
    }

    fn forget_what_is_old(&mut self) {
        let fresh = |track: &Track| self.newest - track.last.stamp <= self.settings.max_gap;
        self.rival = self.rival.take().filter(fresh);
        self.present = self.present.take().filter(fresh);
        if self.present.is_none() {
            self.present = self.rival.take();
        }
    }

    fn about(&self, track: &Track) -> TrackedTtc {
        let Some(posterior) = track.at(self.newest, &self.noise) else {
            return TrackedTtc::only_where(Status::WarmingUp, track.last.distance);
        };
        let quantile = if track.last.own { super::noise::NORMAL } else { self.noise.quantile() };
        let closes = posterior.closing_speed > self.settings.min_closing_speed
            && track.standing.closes(&posterior, quantile, track.whiteness.factor());
        TrackedTtc::new(posterior, quantile, closes)
    }
}

/// Whether a rival that a distance fits gets it: what fits the present target too goes to the rival only while the present
/// one has hardly begun, and is farther away.
fn prefers(present: &Track, surprise: &Surprise, claim: &Surprise) -> bool {
    !surprise.fits || (present.is_young() && claim.miss.abs() < surprise.miss.abs())
}

/// A track that did not get a frame.
fn interrupted(track: Track) -> Track {
    Track { run: 0, ..track }
}

#[cfg(test)]
mod tests {
    use super::DistanceTracker;
    use crate::status::Status;
    use crate::tracker::{Method, Noise, Settings, TrackedTtc};

    const METHODS: [Method; 6] = [
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

    /// Feeds distances every tenth of a second from `frame` on.
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
        let mut tracker = tracker(METHODS[5]);
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
