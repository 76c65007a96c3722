//! `RangeRate`.

use crate::array::{Element, Floats, as_array};
use crate::estimators::{beam_vote, beam_vote_object};
use crate::macros::{for_each_type, results, settings};
use crate::scan::ScanTTC;
use crate::util::run::release;
use crate::util::state::{Format, item, lock};
use crate::util::{Given, count, number, value_error};
use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Mutex;
use ttc_fast_core::column::Column;
use ttc_fast_core::range_rate::{self, Outputs, RateSettings, RatedNearest, State};
use ttc_fast_core::scan::Range;

/// The range rate of each beam of a laser scanner, from its last scans, and the time-to-collision that follows.
///
/// For cars without odometry, and for obstacles that move by themselves, which ``ScanTTC`` takes to stand still. Each
/// scan goes through ``update``, with its stamp; a line is fitted to the last readings of every beam, as far back as
/// they belong to one surface, and its slope is the range rate.
///
/// Parameters
/// ----------
/// scan : ScanTTC
///     The scanner. Its range, limits, outline, mask, ``too_close`` and ``min_closing_speed`` hold here too; its
///     ``no_data`` and ``minimum`` do not.
/// window : float
///     A rate is fitted to the scans of this time, s, at most 60, and of the last 64 scans. Longer is steadier and
///     later: the rate is that of the middle of the window. A longer gap between two scans is STALE, and everything
///     starts anew.
/// min_scans : int
///     A beam has a rate from this many readings of one surface on, 3 to 64.
/// noise : float
///     Standard deviation of a reading, m.
/// max_speed : float
///     A range that changes faster, m/s, is that of another surface.
/// max_acceleration : float
///     A range whose rate changes faster, m/s^2, is that of another surface.
/// gate : float
///     Readings may be off by this many standard deviations of the noise before they belong to another surface, or to
///     no line.
/// significance : float
///     A beam closes when its closing speed is more than this many standard errors (and more than
///     ``min_closing_speed``).
/// edge : float
///     Neighbouring beams whose ranges differ by more, m, see different surfaces. Only used while turning.
/// minimum : KthSmallest or NeighbourSupport, optional
///     How a speckle is outvoted, among the beams that close. By default ``NeighbourSupport(count=6, window=4)``: at
///     least 6 of the 8 beams around must close as well. ``KthSmallest(1)`` takes the plain nearest.
///
/// Raises
/// ------
/// TypeError
///     If ``scan`` is not a ``ScanTTC``, or a setting is of the wrong type.
/// ValueError
///     If a setting makes no sense; the message names it and says what would be right.
///
/// Notes
/// -----
/// Least squares: rate = sum (t - mean t)(r - mean r) / sum (t - mean t)^2, and its standard error is the square root
/// of s^2 / sum (t - mean t)^2, where s is ``noise`` or the scatter about the line, whichever is larger.
///
/// The rate is that of what the beam sees, not of a point. For a flat wall, seen under any angle by a sensor that does
/// not turn, range / closing speed is the time in which the sensor reaches the wall's plane; a wall that it drives
/// along has rate 0, where ``ScanTTC`` sees it closing. Along an edge or a round thing that a beam slides over, ranges
/// change although nothing comes closer. Turning changes every range as well: give ``update`` the yaw rate, of a gyro
/// for instance.
///
/// Examples
/// --------
/// A box that comes at 2 m/s, seen at 10 Hz by a sensor that stands:
///
/// >>> import numpy as np, ttc_fast
/// >>> scan = ttc_fast.ScanTTC(-0.15, 0.02, 16, range_min=0.06, range_max=30.0)
/// >>> rates = ttc_fast.RangeRate(scan)
/// >>> for frame in range(5):
/// ...     nearest = rates.update(np.full(16, 8.0 - 0.2 * frame), 1700000000.0 + 0.1 * frame)
/// >>> nearest.status.name, round(nearest.closing_speed, 3), round(nearest.ttc, 3)
/// ('CLOSING', 2.0, 3.6)
#[pyclass(frozen, module = "ttc_fast")]
pub struct RangeRate {
    rates: Mutex<range_rate::RangeRate>,
    scan: Py<ScanTTC>,
    settings: RateSettings,
}

#[pymethods]
impl RangeRate {
    #[new]
    #[pyo3(signature = (scan, *, window=0.5, min_scans=4, noise=0.01, max_speed=20.0, max_acceleration=5.0, gate=3.0,
                        significance=3.0, edge=0.2, minimum=None))]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments of a Python constructor")]
    fn new(
        scan: Bound<'_, ScanTTC>,
        window: f64,
        min_scans: i64,
        noise: f64,
        max_speed: f64,
        max_acceleration: f64,
        gate: f64,
        significance: f64,
        edge: f64,
        minimum: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let default = RateSettings::default();
        let settings = RateSettings {
            window,
            min_scans: count("min_scans", min_scans, 3)?,
            noise,
            max_speed,
            max_acceleration,
            gate,
            significance,
            edge,
            beam_vote: minimum.map_or(Ok(default.beam_vote), beam_vote)?,
        };
        let rates = range_rate::RangeRate::new(scan.get().core().clone(), settings.clone()).map_err(value_error)?;
        Ok(RangeRate { rates: Mutex::new(rates), scan: scan.unbind(), settings })
    }

    /// Take the next scan, and find the nearest beam in time by its own range rate.
    ///
    /// Parameters
    /// ----------
    /// ranges : ndarray, float32 or float64, shape (beams,)
    ///     m; read in place, whatever the stride and alignment. NaN, infinities and readings outside the sensor's range
    ///     are skipped: a beam goes on where it sees the same surface again within the window.
    /// stamp : float
    ///     When the scan was taken, s; of any epoch. Stamps of the sensor's clock, not of arrival: their jitter is
    ///     noise.
    /// yaw_rate : float
    ///     Counter-clockwise, rad/s, since the scan before. Without it a scan while turning gives rates that are wrong
    ///     where a beam slides along a slanted surface, or none.
    /// range_rate_out, standard_error_out : ndarray of the dtype and shape of ``ranges``, optional
    ///     Where to write the range rate of each beam, m/s, positive when opening, and its standard error; NaN where
    ///     unknown. Input for ``ittc(ranges, range_rate=...)``, which is INVALID and infinite where the rate is NaN.
    /// status_out : uint8 ndarray of the shape of ``ranges``, optional
    ///     Where to write the ``Status`` of each beam: CLOSING (significantly), NOT_CLOSING, WARMING_UP where the rate
    ///     is unknown (too few readings of one surface, or none on a line), CONTACT, CLEAR for free space and beyond
    ///     the limits, NO_DATA where masked, INVALID where the reading says nothing.
    ///
    /// Returns
    /// -------
    /// RangeRateNearest
    ///     A scan whose stamp is not after the last one's is INVALID, and changes nothing. One after a gap longer than
    ///     the window is STALE, unless nothing valid was observed (NO_DATA). WARMING_UP: no beam has a rate yet.
    ///
    /// Raises
    /// ------
    /// TypeError
    ///     If ``ranges`` or an output has another dtype, or a number is none.
    /// ValueError
    ///     If ``ranges`` or an output has another shape, or a number is not finite. The scan is then not taken.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> rates = ttc_fast.RangeRate(ttc_fast.ScanTTC(-0.15, 0.02, 16))
    /// >>> range_rate = np.empty(16, np.float32)
    /// >>> for frame in range(5):
    /// ...     ranges = np.full(16, 8.0 - 0.2 * frame, np.float32)
    /// ...     nearest = rates.update(ranges, 0.1 * frame, range_rate_out=range_rate)
    /// >>> nearest.rated, nearest.unrated
    /// (16, 0)
    /// >>> ttc_fast.ittc(ranges, range_rate=range_rate)[:2].round(3)
    /// array([3.6, 3.6], dtype=float32)
    #[pyo3(signature = (ranges, stamp, yaw_rate=Given::NOTHING, *, range_rate_out=None, standard_error_out=None, status_out=None),
           text_signature = "($self, ranges, stamp, yaw_rate=0.0, *, range_rate_out=None, standard_error_out=None, \
               status_out=None)")]
    #[allow(clippy::too_many_arguments, reason = "arguments of a Python method")]
    fn update<'py>(
        &self,
        py: Python<'py>,
        ranges: &Bound<'py, PyAny>,
        stamp: &Bound<'py, PyAny>,
        yaw_rate: Given<'_, 'py>,
        range_rate_out: Option<&Bound<'py, PyAny>>,
        standard_error_out: Option<&Bound<'py, PyAny>>,
        status_out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<RangeRateNearest> {
        let stamp = number("stamp", stamp)?;
        let yaw_rate = yaw_rate.given().map_or(Ok(0.0), |value| number("yaw_rate", value))?;
        let array = as_array("ranges", ranges)?;
        if array.ndim() != 1 {
            let shape = array.shape();
            return Err(PyValueError::new_err(format!("ranges must be one scan, of shape (beams,), got {shape:?}")));
        }
        let ranges = Floats::view("ranges", array)?;
        let outs = Outs { range_rate: range_rate_out, standard_error: standard_error_out, status: status_out };
        for_each_type!(ranges.numbers(), table => self.take(py, &ranges, table.row(0), (stamp, yaw_rate), &outs))
            .map(RangeRateNearest)
    }

    /// Forget every scan, as a new object with the same settings.
    ///
    /// Returns
    /// -------
    /// None
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np, ttc_fast
    /// >>> rates = ttc_fast.RangeRate(ttc_fast.ScanTTC(0.0, 0.1, 3))
    /// >>> _ = rates.update(np.ones(3), 7.0)
    /// >>> rates.reset()
    /// >>> rates.update(np.ones(3), 5.0).status.name
    /// 'WARMING_UP'
    fn reset(&self, py: Python<'_>) {
        lock(py, &self.rates).reset();
    }

    /// Return what is remembered, as numbers, strings and lists that JSON can hold.
    ///
    /// Returns
    /// -------
    /// dict
    ///     ``class``, ``version`` and ``beams``; ``stamps``, ``headings`` and ``readings`` of the last scans, oldest first.
    ///     For ``restore``. NaN and inf may be among the readings, which Python's ``json`` writes and reads.
    ///
    /// Examples
    /// --------
    /// >>> import ttc_fast
    /// >>> print(*ttc_fast.RangeRate(ttc_fast.ScanTTC(0.0, 0.1, 3)).state())
    /// class version beams stamps headings readings
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let State { stamps, headings, readings } = lock(py, &self.rates).state();
        let scans: Vec<&[f64]> = readings.chunks_exact(self.beams()).collect();
        let state = FORMAT.state(py)?;
        state.set_item("beams", self.beams())?;
        state.set_item("stamps", stamps)?;
        state.set_item("headings", headings)?;
        state.set_item("readings", scans)?;
        Ok(state)
    }

    /// Remember what another object with the same scanner and settings remembered, and go on from there, bit for bit.
    ///
    /// Parameters
    /// ----------
    /// state : dict
    ///     A state that ``state()`` gave.
    ///
    /// Returns
    /// -------
    /// None
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     If it is no such state, or one of another class, version or number of beams. What is remembered then stays.
    ///
    /// Examples
    /// --------
    /// >>> import json, numpy as np, ttc_fast
    /// >>> scan = ttc_fast.ScanTTC(0.0, 0.1, 3)
    /// >>> rates, other = ttc_fast.RangeRate(scan), ttc_fast.RangeRate(scan)
    /// >>> for frame in range(4):
    /// ...     _ = rates.update(np.full(3, 8.0 - 0.2 * frame), 0.1 * frame)
    /// >>> other.restore(json.loads(json.dumps(rates.state())))
    /// >>> other.update(np.full(3, 7.2), 0.4) == rates.update(np.full(3, 7.2), 0.4)
    /// True
    fn restore(&self, py: Python<'_>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state = FORMAT.check(state)?;
        let (beams, got) = (self.beams(), item(state, "beams")?);
        let readings: Vec<Vec<f64>> = item(state, "readings")?.extract()?;
        if !got.eq(beams)? || readings.iter().any(|scan| scan.len() != beams) {
            return Err(PyValueError::new_err(format!(
                "state must be that of a RangeRate of {beams} beams, got {got}"
            )));
        }
        let (stamps, headings) = (item(state, "stamps")?.extract()?, item(state, "headings")?.extract()?);
        let state = State { stamps, headings, readings: readings.concat() };
        lock(py, &self.rates).restore(&state).map_err(value_error)
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.state(py)
    }

    fn __setstate__(&self, py: Python<'_>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        self.restore(py, state)
    }
}

settings! {
    RangeRate |it, py| {
        scan: &it.scan,
        window: it.settings.window,
        min_scans: it.settings.min_scans,
        noise: it.settings.noise,
        max_speed: it.settings.max_speed,
        max_acceleration: it.settings.max_acceleration,
        gate: it.settings.gate,
        significance: it.settings.significance,
        edge: it.settings.edge,
        minimum: beam_vote_object(py, it.settings.beam_vote)?,
    }
}

const FORMAT: Format = Format { class: "RangeRate", version: 1 };

impl RangeRate {
    fn beams(&self) -> usize {
        self.scan.get().core().settings().beams
    }

    fn take<T: Range + Element>(
        &self,
        py: Python<'_>,
        array: &Floats<'_>,
        ranges: Column<'_, T>,
        (stamp, yaw_rate): (f64, f64),
        outs: &Outs<'_, '_>,
    ) -> PyResult<RatedNearest> {
        let [mut range_rate, mut standard_error] = [
            array.separate_output::<T>("range_rate_out", outs.range_rate, &[])?,
            array.separate_output::<T>("standard_error_out", outs.standard_error, &[outs.range_rate])?,
        ];
        let others = [outs.range_rate, outs.standard_error];
        let mut status = array.separate_output::<u8>("status_out", outs.status, &others)?;
        let mut outputs = Outputs {
            range_rate: range_rate.as_mut().map(|table| table.row(0)),
            standard_error: standard_error.as_mut().map(|table| table.row(0)),
            status: status.as_mut().map(|table| table.row(0)),
        };
        let mut guard = lock(py, &self.rates);
        let rates = &mut *guard;
        release(py, ranges.len(), || rates.update(ranges, stamp, yaw_rate, &mut outputs)).map_err(value_error)
    }
}

/// The arrays to write to, as they came.
struct Outs<'a, 'py> {
    range_rate: Option<&'a Bound<'py, PyAny>>,
    standard_error: Option<&'a Bound<'py, PyAny>>,
    status: Option<&'a Bound<'py, PyAny>>,
}

/// The beam that comes nearest in time by its own range rate, and everything that says why.
///
/// Attributes
/// ----------
/// ttc : float
///     The least time-to-collision, s, in [0, inf].
/// status : Status
///     What ``ttc`` means. TOO_FEW: beams close, but too few for the vote of ``minimum``; ``ttc`` is the plain least.
/// beam : int
///     The beam that decided: the one of ``ttc``, else the first in contact, else -1.
/// angle : float
///     The direction of that beam in the sensor frame, rad. This and the next four are NaN without a beam.
/// range : float
///     The reading of that beam, m.
/// clearance : float
///     The part of the reading that lies outside the outline, m.
/// closing_speed : float
///     How fast the range shrinks, m/s: the negative of the range rate. NaN where that is unknown.
/// standard_error : float
///     The standard error of ``closing_speed``, m/s.
/// counts : Counts
///     How often each case of a reading occurred.
/// rated : int
///     Beams whose range rate is known.
/// unrated : int
///     Beams that see something whose range rate is unknown. What has just come into view is among them, whatever
///     ``ttc`` says.
/// nearest_unrated : float
///     The least clearance among the unrated beams, m; infinite without one.
/// age : float
///     The time since the newest scan that was not the one before handed over again, s; inf before the first. Above 0 the
///     answer is predicted.
#[pyclass(frozen, module = "ttc_fast")]
pub struct RangeRateNearest(RatedNearest);

results! {
    RangeRateNearest: RatedNearest {
        ttc "s", status "", beam "", angle "rad", range "m", clearance "m", closing_speed "m/s", standard_error "m/s",
        counts "", rated "", unrated "", nearest_unrated "m", age "s"
    }
}
