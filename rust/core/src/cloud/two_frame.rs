//! Time-to-collision from how the nearest distance shrinks between two clouds.

use super::estimator::{Detection, Estimator, MinX, robust_min_x};
use super::gate::CheckedGate;
use crate::error::{Error, elapsed, finite};
use crate::motion::ttc_from_distances;
use crate::points::Points;
use crate::real::Real;
use crate::simd::Level;
use crate::status::Status;

/// Time-to-collision from two clouds, and the distances that it rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudTtc {
    /// Time-to-collision, s; infinite where nothing closes or too little is known.
    pub ttc: f64,
    /// What the numbers mean.
    pub status: Status,
    /// Distance from the bumper to the nearest thing in the current cloud, m. Infinite when clear, NaN without data.
    pub distance: f64,
    /// Closing speed, m/s, positive when approaching. NaN unless both clouds show a distance.
    pub closing_speed: f64,
    /// What was found in the earlier cloud.
    pub previous: MinX,
    /// What was found in the later cloud.
    pub current: MinX,
}

/// Time-to-collision by two clouds taken `dt` seconds apart.
///
/// If either cloud has too few points for the estimator, the plain nearest distance of both is used, and the status
/// says so.
///
/// # Errors
/// When `dt` is not a time or the offset is not a number, and for the reasons of [`robust_min_x`].
pub fn ttc_from_clouds<T: Real>(
    [previous, current]: [&Points<'_, T>; 2],
    dt: f64,
    gate: &CheckedGate,
    estimator: Estimator,
    front_offset: f64,
    level: Level,
) -> Result<CloudTtc, Error> {
    elapsed(dt)?;
    finite("front_offset", front_offset)?;
    let previous = robust_min_x(previous, gate, estimator, level, 1)?;
    let current = robust_min_x(current, gate, estimator, level, 1)?;
    let too_few = [&previous, &current].iter().any(|seen| seen.detection == Detection::TooFew);
    let distance = |seen: &MinX| if too_few { seen.nearest_x } else { seen.x } - front_offset;
    let (before, now) = (distance(&previous), distance(&current));
    let seen = CloudTtc {
        ttc: f64::INFINITY,
        status: Status::Clear,
        distance: now,
        closing_speed: f64::NAN,
        previous,
        current,
    };
    Ok(match current.detection {
        Detection::NoData => CloudTtc { status: Status::NoData, ..seen },
        Detection::Clear => seen,
        // Contact outranks that nothing tells how it moves.
        _ if !before.is_finite() && now <= 0.0 => CloudTtc { status: Status::Contact, ..seen },
        _ if !before.is_finite() => CloudTtc { status: Status::WarmingUp, ..seen },
        Detection::Found | Detection::TooFew => {
            let ttc = ttc_from_distances(before, now, dt)?;
            let status = if now <= 0.0 {
                Status::Contact
            } else if too_few {
                Status::TooFew
            } else if ttc < f64::INFINITY {
                Status::Closing
            } else {
                Status::NotClosing
            };
            CloudTtc { ttc, status, closing_speed: (before - now) / dt, ..seen }
        }
    })
}
