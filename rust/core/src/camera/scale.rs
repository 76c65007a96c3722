//! From a change of scale to a time.

use crate::error::{Error, elapsed};

/// Time-to-collision by how many times as large a thing looks as `dt` seconds before.
///
/// `dt / (scale - 1)`; infinite when it does not grow.
///
/// # Errors
/// When the scale is not finite and above 0, or `dt` is not a time.
pub fn ttc_from_scale(scale: f64, dt: f64) -> Result<f64, Error> {
    positive("scale", scale, "it is the size now over the size before")?;
    elapsed(dt)?;
    Ok(time(scale, dt))
}

/// Time-to-collision by two heights of the same thing in the picture, `dt` seconds apart.
///
/// `previous dt / (current - previous)`; infinite when it does not grow.
///
/// # Errors
/// When a height is not finite and above 0, or `dt` is not a time.
pub fn ttc_from_heights(previous: f64, current: f64, dt: f64) -> Result<f64, Error> {
    let hint = "it is the height of a thing that is seen, px";
    positive("previous", previous, hint)?;
    positive("current", current, hint)?;
    elapsed(dt)?;
    let grown = current - previous;
    Ok(if grown <= 0.0 { f64::INFINITY } else { previous * (dt / grown) })
}

/// The time for a scale that is a number.
pub(super) fn time(scale: f64, dt: f64) -> f64 {
    if scale <= 1.0 { f64::INFINITY } else { dt / (scale - 1.0) }
}

fn positive(argument: &'static str, value: f64, hint: &str) -> Result<(), Error> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::new(argument, format!("must be finite and above 0, got {value:?}; {hint}")))
}

#[cfg(test)]
mod tests {
    use super::{ttc_from_heights, ttc_from_scale};

    #[test]
    fn growing_standing_shrinking() {
        assert!((ttc_from_scale(1.05, 0.1).unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(ttc_from_scale(1.0, 0.1).unwrap(), f64::INFINITY);
        assert_eq!(ttc_from_scale(0.5, 0.1).unwrap(), f64::INFINITY);
        assert!((ttc_from_heights(100.0, 105.0, 0.1).unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(ttc_from_heights(105.0, 105.0, 0.1).unwrap(), f64::INFINITY);
        assert!(ttc_from_scale(0.0, 0.1).is_err());
        assert!(ttc_from_heights(0.0, 105.0, 0.1).is_err());
        assert!(ttc_from_heights(100.0, 105.0, 0.0).is_err());
    }
}
