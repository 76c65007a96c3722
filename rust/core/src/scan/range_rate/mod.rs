//! How fast each beam's range changes from scan to scan, and the time-to-collision that follows.
//!
//! Where there is no odometry, or where things move by themselves, the closing speed of a beam has to come from the
//! ranges: [`history`] keeps the last scans, turned into the directions in which the beams point now, [`fit`] lays
//! a line through the readings of each beam as far back as they belong to one surface, and [`judge`] says which of the
//! slopes mean that something closes, and when it is here; [`nearest`] is the answer for the whole scan.

mod fit;
mod history;
mod judge;
mod measure;
mod nearest;
mod settings;
mod turn;

pub use judge::Outputs;
pub use nearest::RatedNearest;
pub use settings::RateSettings;

use super::{Motion, Range, ScanTtc};
use crate::column::Column;
use crate::error::{Error, finite};
use history::{GROUP, History, Past, Remembered};
use judge::{Beams, Coverage, Judge};
use measure::Measure;
use turn::{Turn, Turned};

/// So many scans are remembered at most, however long the window.
pub const MOST_SCANS: usize = 64;

/// No vehicle turns faster, rad/s. Keeps headings far from overflow.
const FASTEST_TURN: f64 = 1e4;

/// What a [`RangeRate`] remembers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// When each scan was taken, s.
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
    /// From the sensor to the outline, in whole groups; NaN where a beam is ignored, and in the padding.
    offset: Vec<f64>,
    /// Room for old scans in new directions.
    turned: Vec<f64>,
    beams: Beams,
}

impl RangeRate {
    /// Nothing is known before a few scans.
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

    /// Forget every scan.
    pub fn reset(&mut self) {
        self.history.clear();
    }

    /// What is remembered, the oldest first: stamps (s), headings (rad), and readings (m) one scan after the other.
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

    /// Remember what another of the same settings did.
    ///
    /// # Errors
    /// When that is not what [`RangeRate::state`] gives; nothing has changed then.
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

    /// Take the next scan, and find the nearest beam in time.
    ///
    /// A scan that is not newer than the last changes nothing and is INVALID.
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
            return Ok(RatedNearest::OUT_OF_ORDER);
        }
        let stale = elapsed.is_some_and(|elapsed| elapsed > self.settings.window);
        self.remember(ranges, stamp, elapsed.map_or(0.0, |elapsed| yaw_rate * elapsed));
        let coverage = self.judge(ranges, outputs);
        Ok(self.nearest(&self.scan.view(ranges, Motion::default())?, coverage, stale))
    }

    /// Keep what was measured, and forget what is older than the window.
    fn remember<T: Range>(&mut self, ranges: Column<'_, T>, stamp: f64, turned: f64) {
        self.history.forget(stamp, self.settings.window, MOST_SCANS);
        let (rules, offset, memory) = (T::prepared(&self.scan).rules, &self.offset, self.history.memory());
        let readings = match ranges.dense() {
            Some(ranges) => self.scan.level.run(Measure { ranges, rules, offset, memory }),
            None => self.scan.level.run(Measure { ranges, rules, offset, memory }),
        };
        let heading = self.history.newest().map_or(0.0, |last| last.heading + turned);
        self.history.remember(Remembered { stamp, heading, readings });
    }

    fn judge<T: Range>(&mut self, ranges: Column<'_, T>, outputs: &mut Outputs<'_, T>) -> Coverage {
        let RangeRate { scan, settings, history, offset, turned, beams } = self;
        let past = past(history, turned, scan, settings.edge);
        let newest = history.newest().map_or(&[][..], |scan| &scan.readings);
        let readings = T::prepared(scan).rules;
        let least =
            judge::Least { significance: settings.significance, closing_speed: scan.settings.min_closing_speed };
        let rules = fit::Rules::new(settings);
        let past = past.as_slice();
        match ranges.dense() {
            Some(ranges) => {
                scan.level.run(Judge { ranges, readings, offset, newest, past, rules, least, beams, outputs })
            }
            None => scan.level.run(Judge { ranges, readings, offset, newest, past, rules, least, beams, outputs }),
        }
    }
}

/// All but the newest scan, from the second newest on, in the directions in which the beams point now.
fn past<'a>(history: &'a History, turned: &'a mut Vec<f64>, scan: &ScanTtc, edge: f64) -> Vec<Past<'a>> {
    let mut scans = history.iter();
    let Some(newest) = scans.next() else { return vec![] };
    let length = newest.readings.len();
    turned.resize(length * MOST_SCANS, f64::NAN);
    let mut rooms = turned.chunks_exact_mut(length);
    let settings = &scan.settings;
    scans
        .filter_map(|old| {
            let angle = newest.heading - old.heading;
            let age = newest.stamp - old.stamp;
            if angle == 0.0 {
                return Some(Past { age, readings: &old.readings });
            }
            let turn = Turn::new(angle, settings.angle_increment, settings.beams)?;
            let out = rooms.next()?;
            scan.level.run(Turned { readings: &old.readings, turn, edge, out: &mut *out });
            Some(Past { age, readings: out })
        })
        .collect()
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
