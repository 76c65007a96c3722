//! What a tracker is told: the motion model, the noise, and when a distance belongs to another target.

use crate::error::Error;

/// How distances become a closing speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// The least-squares line through the newest `window` seconds.
    SlidingLine {
        /// s
        window: f64,
        /// Std of the acceleration that a line knows nothing of, m/s^2.
        acceleration: f64,
    },
    /// The least-squares parabola through the newest `window` seconds.
    SlidingParabola {
        /// s
        window: f64,
        /// Std of the jerk that a parabola knows nothing of, m/s^3.
        jerk: f64,
    },
    /// The median slope of all pairs in the newest `window` seconds.
    TheilSen {
        /// s
        window: f64,
        /// Std of the acceleration that a line knows nothing of, m/s^2.
        acceleration: f64,
    },
    /// A line with exponentially fading memory, as a recursion with gains alpha and beta.
    AlphaBeta {
        /// Time in which a frame's weight falls to 1/e, s.
        memory: f64,
        /// Std of the acceleration that the filter knows nothing of, m/s^2.
        acceleration: f64,
    },
    /// A Kalman filter whose closing speed wanders.
    KalmanCv {
        /// How far within one second, std, m/s.
        acceleration: f64,
    },
    /// A Kalman filter whose closing acceleration wanders.
    KalmanCa {
        /// How far within one second, std, m/s^2.
        jerk: f64,
        /// Std of the acceleration at first, m/s^2.
        acceleration: f64,
    },
}

/// The standard deviation of one distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// Known, m.
    Given(f64),
    /// Learnt from how distances differ from their predictions.
    Estimated {
        /// What it is taken for at first, m.
        start: f64,
        /// How many frames it is remembered for.
        frames: f64,
    },
}

/// Everything a tracker is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How distances become a closing speed.
    pub method: Method,
    /// The standard deviation of one distance.
    pub noise: Noise,
    /// A distance more than so many standard deviations from its prediction does not belong to it.
    pub gate: f64,
    /// Such a distance nearer by more than this is a new target, m.
    pub jump: f64,
    /// So many frames in a row make a target of distances that do not fit the present one.
    pub confirm: u32,
    /// Data older than this say nothing any more, s.
    pub max_gap: f64,
    /// What moves faster than this is not the same target, m/s.
    pub max_speed: f64,
    /// Closing at or below this is not closing, m/s.
    pub min_closing_speed: f64,
}

/// No window is longer than this, s.
const LONGEST: f64 = 60.0;

impl Default for Settings {
    fn default() -> Self {
        Settings {
            method: Method::KalmanCa { jerk: 1.5, acceleration: 3.0 },
            noise: Noise::Estimated { start: 0.03, frames: 30.0 },
            gate: 4.0,
            jump: 1.0,
            confirm: 3,
            max_gap: 1.0,
            max_speed: 100.0,
            min_closing_speed: 0.05,
        }
    }
}

impl Settings {
    /// The settings, if they make sense.
    ///
    /// # Errors
    /// When a number is out of its domain.
    pub fn checked(self) -> Result<Self, Error> {
        self.method.checked()?;
        self.noise.checked()?;
        above_zero("gate", self.gate)?;
        above_zero("jump", self.jump)?;
        above_zero("max_gap", self.max_gap)?;
        above_zero("max_speed", self.max_speed)?;
        crate::error::non_negative("min_closing_speed", self.min_closing_speed)?;
        if !(2..=1000).contains(&self.confirm) {
            return Err(Error::new("confirm", format!("must be from 2 to 1000 frames, got {}", self.confirm)));
        }
        Ok(self)
    }
}

impl Method {
    /// The method, if its settings make sense.
    ///
    /// # Errors
    /// When a number is out of its domain.
    pub fn checked(self) -> Result<Self, Error> {
        match self {
            Method::SlidingLine { window, acceleration } | Method::TheilSen { window, acceleration } => {
                time("window", window)?;
                crate::error::non_negative("acceleration", acceleration)?;
            }
            Method::SlidingParabola { window, jerk } => {
                time("window", window)?;
                crate::error::non_negative("jerk", jerk)?;
            }
            Method::AlphaBeta { memory, acceleration } => {
                time("memory", memory)?;
                crate::error::non_negative("acceleration", acceleration)?;
            }
            Method::KalmanCv { acceleration } => {
                above_zero("acceleration", acceleration)?;
            }
            Method::KalmanCa { jerk, acceleration } => {
                above_zero("jerk", jerk)?;
                above_zero("acceleration", acceleration)?;
            }
        }
        Ok(self)
    }
}

impl Noise {
    /// The noise, if it makes sense.
    ///
    /// # Errors
    /// When a number is out of its domain.
    pub fn checked(self) -> Result<Self, Error> {
        match self {
            Noise::Given(noise) => {
                above_zero("noise", noise)?;
            }
            Noise::Estimated { start, frames } => {
                above_zero("start", start)?;
                if !(frames >= 5.0 && frames.is_finite()) {
                    return Err(Error::new("frames", format!("must be finite and at least 5, got {frames:?}")));
                }
            }
        }
        Ok(self)
    }
}

/// `value`, if it is a finite number above 0.
pub(super) fn above_zero(argument: &'static str, value: f64) -> Result<f64, Error> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(Error::new(argument, format!("must be finite and above 0, got {value:?}")))
    }
}

fn time(argument: &'static str, value: f64) -> Result<f64, Error> {
    if value > 0.0 && value <= LONGEST {
        Ok(value)
    } else {
        Err(Error::new(argument, format!("must be above 0 and at most {LONGEST} s, got {value:?}")))
    }
}
