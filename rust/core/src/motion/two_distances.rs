//! Time-to-collision from two distances.

use crate::error::{Error, finite};

/// Time-to-collision by two distances `dt` seconds apart, if the gap goes on shrinking as it did.
///
/// `current dt / (previous - current)`; infinite when the gap does not shrink. At or inside contact: 0 while closing.
///
/// # Errors
/// When a distance is not finite, or `dt` is not a time.
pub fn ttc_from_distances(previous: f64, current: f64, dt: f64) -> Result<f64, Error> {
    finite("previous", previous)?;
    finite("current", current)?;
    checked_dt(dt)?;
    let shrunk = previous - current;
    Ok(if shrunk <= 0.0 {
        f64::INFINITY
    } else if current <= 0.0 {
        0.0
    } else {
        let product = current * dt;
        if product < f64::INFINITY { product / shrunk } else { current / shrunk * dt }
    })
}

/// `dt`, if it is a time that has passed.
pub(crate) fn checked_dt(dt: f64) -> Result<f64, Error> {
    if dt.is_finite() && dt > 0.0 {
        return Ok(dt);
    }
    let hint = "is the time between the two, from their stamps";
    Err(Error::new("dt", format!("must be finite and above 0 s, got {dt:?}; it {hint}")))
}

#[cfg(test)]
mod tests {
    use super::ttc_from_distances;

    #[test]
    fn shrinking_standing_growing_touching() {
        assert!((ttc_from_distances(10.0, 9.5, 0.1).unwrap() - 1.9).abs() < 1e-12);
        assert_eq!(ttc_from_distances(9.5, 9.5, 0.1).unwrap(), f64::INFINITY);
        assert_eq!(ttc_from_distances(9.5, 10.0, 0.1).unwrap(), f64::INFINITY);
        assert_eq!(ttc_from_distances(0.1, -0.1, 0.1).unwrap(), 0.0);
        assert_eq!(ttc_from_distances(-0.2, -0.1, 0.1).unwrap(), f64::INFINITY);
        assert_eq!(ttc_from_distances(1.5e308, 1e308, 10.0).unwrap(), 20.0);
        assert!(ttc_from_distances(1.0, 0.5, 0.0).is_err());
        assert!(ttc_from_distances(f64::INFINITY, 0.5, 0.1).is_err());
    }
}
