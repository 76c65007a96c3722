//! What `ScanTTC.nearest` and `ScanSweptPath.nearest` give, for one scan and for a batch.

use crate::macros::results;
use pyo3::prelude::*;
use ttc_fast_core::scan;

/// How often each case of a reading occurred in one scan.
///
/// Every beam is counted once in the first seven. ``contact`` counts apart from them.
///
/// Attributes
/// ----------
/// valid : int
///     Valid readings within the user's limits.
/// invalid : int
///     NaN.
/// too_close : int
///     -inf: an object nearer than ``range_min``.
/// no_return : int
///     +inf: observed free space.
/// out_of_range : int
///     Finite and outside the sensor's ``[range_min, range_max]``: discarded.
/// beyond_limits : int
///     Valid readings beyond the user's far limit.
/// masked : int
///     Ignored because of ``mask``, or because the beam looks at the vehicle itself.
/// contact : int
///     Readings inside the outline.
#[pyclass(frozen, module = "ttc_fast")]
pub struct Counts(pub ttc_fast_core::Counts);

/// ``Counts`` of a batch: each field is a uint32 array of shape (B,), and ``batch[i]`` is the ``Counts`` of one scan.
#[pyclass(frozen, sequence, module = "ttc_fast")]
pub struct CountsBatch(pub Vec<ttc_fast_core::Counts>);

results! {
    Counts, CountsBatch of "scan": ttc_fast_core::Counts {
        valid "", invalid "", too_close "", no_return "", out_of_range "",
        beyond_limits "", masked "", contact ""
    }
}

/// The nearest beam in time of one scan, and everything that says why.
///
/// Attributes
/// ----------
/// ttc : float
///     The least time-to-collision, s, in [0, inf].
/// status : Status
///     What ``ttc`` means.
/// beam : int
///     The beam that decided: the one of ``ttc``, else the first in contact, else -1.
/// angle : float
///     The direction of that beam in the sensor frame, rad. This and the next three are NaN without a beam.
/// range : float
///     The reading of that beam, m.
/// clearance : float
///     The part of the reading that lies outside the outline, m.
/// closing_speed : float
///     The speed of the sensor along the beam, m/s.
/// counts : Counts
///     How often each case of a reading occurred.
#[pyclass(frozen, module = "ttc_fast")]
pub struct Nearest(pub scan::Nearest);

/// ``Nearest`` of a batch: each field is an array of shape (B,), and ``batch[i]`` is the ``Nearest`` of one scan.
#[pyclass(frozen, sequence, module = "ttc_fast")]
pub struct NearestBatch(pub Vec<scan::Nearest>);

results! {
    Nearest, NearestBatch of "scan": scan::Nearest {
        ttc "s", status "", beam "", angle "rad", range "m", clearance "m", closing_speed "m/s", counts ""
    }
}
