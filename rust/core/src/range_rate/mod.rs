//! How fast the range of each beam changes from scan to scan, and the time-to-collision that follows.
//!
//! Where there is no odometry, or where things move by themselves, the closing speed of a beam has to come from the
//! ranges. [`history`] keeps what the last scans measured, and turns it into the directions in which the beams point
//! now. [`fit`] fits a line to the readings of each beam, as far back as they belong to one surface. [`classify`] says
//! which of the slopes mean that something closes, and when it arrives. The vote of the scanner's beams then elects the
//! one that decides.

mod classify;
mod fit;
mod history;
mod settings;

pub use classify::Outputs;
pub use settings::{MOST_SCANS, RateSettings};

use crate::column::Column;
use crate::error::{Error, finite};
use crate::hit::{Counts, Hit};
use crate::scan::{Range, ScanTtc, View};
use crate::simd::Level;
use crate::status::Status;
use crate::vehicle::Motion;
use classify::{Beams, Classify, Coverage, Least};
use fit::LineFit;
use history::{GROUP, History, Measure, Remembered, looks_like, past};

/// A scan that is repeated for longer than this part of the window shows a scene that stands. Scanners turn faster than
/// that.
const PATIENCE: f64 = 0.6;
/// Standard deviation of the acceleration of what is predicted, m/s^2.
const ACCELERATION: f64 = 1.6;
/// No vehicle turns faster, rad/s. This keeps headings far from overflow.
const FASTEST_TURN: f64 = 1e4;

/// The beam that comes nearest in time by its own range rate, and everything that says why.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RatedNearest {
    /// The least time-to-collision, s.
    pub ttc: f64,
    /// What that time means.
    pub status: Status,
    /// The beam that decided: the one of `ttc`, else the first in contact, else none.
    pub beam: Option<usize>,
    /// The direction of that beam in the sensor frame, rad. Without a beam it is NaN, as are
    /// `range`, `clearance`, `closing_speed` and `standard_error`.
    pub angle: f64,
    /// The reading of that beam, m.
    pub range: f64,
    /// What is left of the reading outside the outline, m.
    pub clearance: f64,
    /// How fast the range of the beam shrinks, m/s; NaN where unknown.
    pub closing_speed: f64,
    /// The standard error of that speed, m/s.
    pub standard_error: f64,
    /// How often each case of a reading occurred.
    pub counts: Counts,
    /// The number of beams whose range rate is known.
    pub rated: u32,
    /// The number of beams that see something whose range rate is unknown.
    pub unrated: u32,
    /// The least clearance of the latter, m; infinite without one.
    pub nearest_unrated: f64,
    /// The time since the newest scan that was not the one before handed over again, s; infinite before the first.
    pub age: f64,
}

/// What a [`RangeRate`] remembers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// When each scan was taken, s, the oldest first.
    pub stamps: Vec<f64>,
    /// How far the vehicle had turned by then, rad.
    pub headings: Vec<f64>,
    /// What was measured, m, one scan after the other; NaN where nothing was.
    pub readings: Vec<f64>,
}

/// The range rate of each beam of a scanner, from its last scans.
#[derive(Clone, Debug)]
pub struct RangeRate {
    scan: ScanTtc,
    settings: RateSettings,
    history: History,
    /// The distance from the sensor to the outline along each beam, m, in whole groups; NaN where a beam is ignored,
    /// and in the padding.
    offset: Vec<f64>,
    /// Memory for old scans in new directions.
    turned: Vec<f64>,
    beams: Beams,
}

impl RangeRate {
    /// Makes one that remembers no scan.
    ///
    /// # Errors
    /// When a setting makes no sense.
    pub fn new(scan: ScanTtc, settings: RateSettings) -> Result<Self, Error> {
        settings.check()?;
        let width = scan.settings.beams;
        let mut offset = scan.beams.offset[..width].to_vec();
        offset.resize(width.next_multiple_of(GROUP), f64::NAN);
        Ok(RangeRate { scan, settings, history: History::default(), offset, turned: vec![], beams: Beams::new(width) })
    }

    /// The settings it was made with.
    #[must_use]
    pub fn settings(&self) -> &RateSettings {
        &self.settings
    }

    /// Forgets every scan.
    pub fn reset(&mut self) {
        self.history.clear();
    }

    /// Returns what is remembered.
    #[must_use]
    pub fn state(&self) -> State {
        let oldest_first = || self.history.iter().rev();
        let width = self.scan.settings.beams;
        State {
            stamps: oldest_first().map(|scan| scan.stamp).collect(),
            headings: oldest_first().map(|scan| scan.heading).collect(),
            readings: oldest_first().flat_map(|scan| scan.readings[..width].iter().copied()).collect(),
        }
    }

    /// Remembers what another of the same settings did.
    ///
    /// # Errors
    /// When the state is none that [`RangeRate::state`] gives. Nothing has changed then.
    pub fn restore(&mut self, state: &State) -> Result<(), Error> {
        let State { stamps, headings, readings } = state;
        let width = self.scan.settings.beams;
        let in_order = stamps.windows(2).all(|pair| pair[0] < pair[1]);
        let numbers = stamps.iter().chain(headings).all(|number| number.is_finite());
        let as_many = headings.len() == stamps.len() && readings.len() == stamps.len() * width;
        if !(in_order && numbers && as_many && stamps.len() <= MOST_SCANS) {
            let problem = format!("must be that of a RangeRate of {width} beams, its scans in order");
            return Err(Error::new("state", problem));
        }
        self.history.clear();
        for ((stamp, heading), readings) in stamps.iter().zip(headings).zip(readings.chunks_exact(width)) {
            let mut readings = readings.to_vec();
            readings.resize(width.next_multiple_of(GROUP), f64::NAN);
            self.history.remember(Remembered { stamp: *stamp, heading: *heading, readings });
        }
        Ok(())
    }

    /// Takes the next scan, and returns the nearest beam in time.
    ///
    /// A scan that is not newer than the last changes nothing, and its status is INVALID.
    ///
    /// # Errors
    /// When a length, the stamp or the yaw rate makes no sense. Nothing is remembered then.
    pub fn update<T: Range>(
        &mut self,
        ranges: Column<'_, T>,
        stamp: f64,
        yaw_rate: f64,
        outputs: &mut Outputs<'_, T>,
    ) -> Result<RatedNearest, Error> {
        self.scan.check_beams("ranges", ranges.len())?;
        finite("stamp", stamp)?;
        if yaw_rate.is_nan() || yaw_rate.abs() > FASTEST_TURN {
            let problem = format!("must be at most {FASTEST_TURN} rad/s in size, got {yaw_rate:?}");
            return Err(Error::new("yaw_rate", problem));
        }
        let elapsed = self.history.newest().map(|last| stamp - last.stamp);
        if elapsed.is_some_and(|elapsed| elapsed <= 0.0) {
            outputs.fill_invalid(ranges.len());
            return Ok(RatedNearest::out_of_order());
        }
        let stale = elapsed.is_some_and(|elapsed| elapsed > self.settings.window);
        self.remember(ranges, stamp, elapsed.map_or(0.0, |elapsed| yaw_rate * elapsed));
        let coverage = self.classify(ranges, outputs);
        Ok(self.nearest(&self.scan.view(ranges, Motion::default())?, coverage, stale).at(stamp, &self.history))
    }

    /// Remembers what was measured, and forgets what is older than the window. A scan that is handed over again is no
    /// measurement; a scene that stands, seen without noise, is one from `PATIENCE` of the window on.
    fn remember<T: Range>(&mut self, ranges: Column<'_, T>, stamp: f64, turned: f64) {
        let (rules, offset, memory) = (T::kernel_tables(&self.scan).rules, &self.offset, self.history.memory());
        let readings = match ranges.dense() {
            Some(ranges) => self.scan.level.run(Measure { ranges, rules, offset, memory }),
            None => Level::BASELINE.run(Measure { ranges, rules, offset, memory }),
        };
        let unchanged = self.history.newest().is_some_and(|last| looks_like(&last.readings, &readings));
        if unchanged && stamp - self.history.unchanged_since() < PATIENCE * self.settings.window {
            return self.history.spare(readings);
        }
        self.history.forget(stamp, self.settings.window);
        let heading = self.history.newest().map_or(0.0, |last| last.heading + turned);
        self.history.remember(Remembered { stamp, heading, readings });
    }

    /// Computes what is known of each beam.
    fn classify<T: Range>(&mut self, ranges: Column<'_, T>, outputs: &mut Outputs<'_, T>) -> Coverage {
        let RangeRate { scan, settings, history, offset, turned, beams } = self;
        let past = &*past(history, turned, scan, settings.edge);
        let newest = history.newest().map_or(&[][..], |scan| &scan.readings);
        let (rules, line_fit) = (T::kernel_tables(scan).rules, LineFit::new(settings));
        let least = Least { significance: settings.significance, closing_speed: scan.settings.min_closing_speed };
        match ranges.dense() {
            Some(ranges) => {
                scan.level.run(Classify { ranges, rules, offset, newest, past, line_fit, least, beams, outputs })
            }
            None => {
                Level::BASELINE.run(Classify { ranges, rules, offset, newest, past, line_fit, least, beams, outputs })
            }
        }
    }

    /// Returns the answer for the scan.
    fn nearest<T: Range>(&self, view: &View<'_, T>, coverage: Coverage, stale: bool) -> RatedNearest {
        let counts = view.counts();
        let (best, confirmed) = self.elected();
        let beam = view.deciding(best, &counts);
        let status = if !view.observes() {
            Status::NoData
        } else if stale {
            Status::Stale
        } else if coverage.unrated > 0 && coverage.rated == 0 {
            Status::WarmingUp
        } else if counts.contact > 0 {
            Status::Contact
        } else if !confirmed {
            Status::TooFew
        } else if best.closes() {
            Status::Closing
        } else if coverage.rated > 0 {
            Status::NotClosing
        } else {
            Status::Clear
        };
        let range = beam.map_or(f64::NAN, |beam| view.usable(beam));
        RatedNearest {
            ttc: best.ttc,
            status,
            beam,
            angle: beam.map_or(f64::NAN, |beam| self.scan.settings.angle(beam)),
            range,
            clearance: beam.map_or(f64::NAN, |beam| view.clearance(beam, range)),
            closing_speed: beam.map_or(f64::NAN, |beam| -self.beams.range_rate[beam]),
            standard_error: beam.map_or(f64::NAN, |beam| self.beams.standard_error[beam]),
            counts,
            rated: coverage.rated,
            unrated: coverage.unrated,
            nearest_unrated: coverage.nearest_unrated,
            age: 0.0,
        }
    }

    /// Returns the deciding beam, and whether the vote confirms it. Only beams that close are neighbours of one
    /// another.
    fn elected(&self) -> (Hit, bool) {
        let Some(newest) = self.history.newest() else { return (Hit::NONE, true) };
        let times = &self.beams.ttc[..self.scan.settings.beams];
        let each = times.iter().enumerate().map(|(index, ttc)| Hit { ttc: *ttc, index });
        let usable = |beam: usize| if times[beam] < f64::INFINITY { newest.readings[beam] } else { f64::NAN };
        self.settings.beam_vote.elect(each.filter(Hit::closes).collect(), &self.scan.settings, usable)
    }
}

impl RatedNearest {
    /// The answer predicted from the newest scan that is remembered to `stamp`.
    fn at(self, stamp: f64, history: &History) -> RatedNearest {
        let ahead = history.newest().map_or(0.0, |last| stamp - last.stamp);
        RatedNearest {
            ttc: (self.ttc - ahead).max(0.0),
            standard_error: self.standard_error.hypot(ACCELERATION * ahead),
            age: stamp - history.unchanged_since(),
            ..self
        }
    }

    /// The answer for a scan that is not newer than the last.
    fn out_of_order() -> RatedNearest {
        RatedNearest {
            ttc: f64::INFINITY,
            status: Status::Invalid,
            beam: None,
            angle: f64::NAN,
            range: f64::NAN,
            clearance: f64::NAN,
            closing_speed: f64::NAN,
            standard_error: f64::NAN,
            counts: Counts::default(),
            rated: 0,
            unrated: 0,
            nearest_unrated: f64::INFINITY,
            age: f64::INFINITY,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Outputs, RangeRate, RateSettings, RatedNearest, State};
    use crate::column::{Column, ColumnMut};
    use crate::scan::{ScanTtc, Settings};
    use crate::simd::Level;
    use crate::status::Status;

    const BEAMS: usize = 75;

    fn rates(level: Level) -> RangeRate {
        let scan = ScanTtc::new(Settings::new(-0.5, 0.01, BEAMS), level).unwrap();
        RangeRate::new(scan, RateSettings::default()).unwrap()
    }

    /// Scan `frame` of a box in front of a wall, which comes at 2 m/s, at 10 Hz; some readings are missing.
    fn update(rates: &mut RangeRate, frame: usize, yaw_rate: f64) -> (RatedNearest, Vec<f32>) {
        let reading = |beam: usize| match beam {
            _ if (beam * 7 + frame * 3).is_multiple_of(11) => f32::NAN,
            20..50 => 5.0 - 0.2 * frame as f32,
            _ => 9.0 + 0.003 * (beam * 13 % 7) as f32,
        };
        let ranges: Vec<f32> = (0..BEAMS).map(reading).collect();
        let mut out = vec![0.0; BEAMS];
        let mut outputs = Outputs { range_rate: Some(ColumnMut::new(&mut out)), ..Outputs::default() };
        let said = rates.update(Column::new(&ranges), 1.7e9 + 0.1 * frame as f64, yaw_rate, &mut outputs).unwrap();
        (said, out)
    }

    #[test]
    fn what_comes_closes_and_what_stands_does_not() {
        let mut rates = rates(Level::best());
        (0..7).for_each(|frame| assert!(update(&mut rates, frame, 0.0).0.rated > 0 || frame < 3));
        let (said, each) = update(&mut rates, 7, 0.0);
        assert_eq!(said.status, Status::Closing);
        assert!((said.ttc - 1.8).abs() < 1e-4 && (20..50).contains(&said.beam.unwrap()), "{said:?}");
        assert!(each.iter().enumerate().all(|(beam, rate)| {
            let expected = if (20..50).contains(&beam) { -2.0 } else { 0.0 };
            rate.is_nan() || (rate - expected).abs() < 1e-3
        }));
    }

    #[test]
    fn every_level_says_the_same() {
        let mut every: Vec<RangeRate> = Level::all().into_iter().map(rates).collect();
        for frame in 0..12 {
            let said: Vec<String> =
                every.iter_mut().map(|rates| format!("{:?}", update(rates, frame, 0.3 * (frame % 3) as f64))).collect();
            assert!(said.iter().all(|other| *other == said[0]), "{said:?}");
        }
    }

    #[test]
    fn a_state_goes_on_and_a_wrong_one_is_refused() {
        let (mut first, mut second) = (rates(Level::best()), rates(Level::best()));
        (0..5).for_each(|frame| drop(update(&mut first, frame, 0.1)));
        second.restore(&first.state()).unwrap();
        assert_eq!(format!("{:?}", update(&mut first, 5, 0.1)), format!("{:?}", update(&mut second, 5, 0.1)));
        let short = State { readings: vec![], ..first.state() };
        assert!(second.restore(&short).is_err());
    }
}
