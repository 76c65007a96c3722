//! The settings of a tracker: the motion model, the noise, and when a distance belongs to another target.

use crate::error::{Error, count_in, duration, non_negative, positive};

/// The motion model, and how it is fitted to distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// A bank of Kalman filters, from a steady gap to hard braking, averaged by their evidence.
    MotionMixture {
        /// Time in which evidence falls to 1/e, s.
        memory: f64,
        /// The accelerations and jerks of the models over those of cars on a road.
        scale: f64,
    },
    /// The least-squares line through the newest `window` seconds.
    SlidingLine {
        /// Length of the window, s.
        window: f64,
        /// Standard deviation of the acceleration that a line does not model, m/s^2.
        acceleration: f64,
    },
    /// The least-squares parabola through the newest `window` seconds.
    SlidingParabola {
        /// Length of the window, s.
        window: f64,
        /// Standard deviation of the jerk that a parabola does not model, m/s^3.
        jerk: f64,
    },
    /// The median slope of all pairs in the newest `window` seconds.
    TheilSen {
        /// Length of the window, s.
        window: f64,
        /// Standard deviation of the acceleration that a line does not model, m/s^2.
        acceleration: f64,
    },
    /// A line with exponentially fading memory, as a recursion with gains alpha and beta.
    AlphaBeta {
        /// Time in which a frame's weight falls to 1/e, s.
        memory: f64,
        /// Standard deviation of the acceleration that the filter does not model, m/s^2.
        acceleration: f64,
    },
    /// A Kalman filter of constant velocity, with white acceleration as process noise.
    KalmanCv {
        /// Strength of the white acceleration: the standard deviation by which the closing speed changes within one
        /// second, m/s.
        acceleration: f64,
    },
    /// A Kalman filter of constant acceleration, with white jerk as process noise.
    KalmanCa {
        /// Strength of the white jerk: the standard deviation by which the closing acceleration changes within one
        /// second, m/s^2.
        jerk: f64,
        /// Standard deviation of the acceleration at first, m/s^2.
        acceleration: f64,
    },
}

/// The standard deviation of one distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// A known standard deviation, m.
    Given(f64),
    /// A standard deviation that is learnt from innovations.
    Estimated {
        /// First estimate, m.
        start: f64,
        /// The number of frames that the estimate remembers.
        frames: f64,
    },
}

/// The settings of a tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The motion model, and how it is fitted to distances.
    pub method: Method,
    /// The standard deviation of one distance.
    pub noise: Noise,
    /// The largest innovation of a distance that belongs to a track, in standard deviations. Python calls it `gate`.
    pub innovation_gate: f64,
    /// A distance outside the gate that is nearer by more than this is a new target at once, m.
    pub jump: f64,
    /// The frames in a row that confirm a tentative track.
    pub confirm: u32,
    /// A track without a distance for longer than this is dropped, s.
    pub max_gap: f64,
    /// Two distances that differ by a faster motion than this are not of one target, m/s.
    pub max_speed: f64,
    /// A closing speed at or below this does not count as closing, m/s.
    pub min_closing_speed: f64,
}

/// The longest window or memory, s.
const LONGEST: f64 = 60.0;

impl Default for Settings {
    fn default() -> Self {
        Settings {
            method: Method::MotionMixture { memory: 2.0, scale: 1.0 },
            noise: Noise::Estimated { start: 0.03, frames: 30.0 },
            innovation_gate: 4.0,
            jump: 1.0,
            confirm: 3,
            max_gap: 1.0,
            max_speed: 100.0,
            min_closing_speed: 0.05,
        }
    }
}

impl Settings {
    /// Returns the settings if they make sense.
    ///
    /// # Errors
    /// When a number is out of its domain.
    pub fn checked(self) -> Result<Self, Error> {
        self.method.checked()?;
        self.noise.checked()?;
        positive("gate", self.innovation_gate)?;
        positive("jump", self.jump)?;
        positive("max_gap", self.max_gap)?;
        positive("max_speed", self.max_speed)?;
        non_negative("min_closing_speed", self.min_closing_speed)?;
        count_in("confirm", self.confirm as usize, 2..=1000)?;
        Ok(self)
    }
}

impl Method {
    /// Returns the method if its settings make sense.
    ///
    /// # Errors
    /// When a number is out of its domain.
    pub fn checked(self) -> Result<Self, Error> {
        match self {
            Method::MotionMixture { memory, scale } => {
                duration("memory", memory, LONGEST)?;
                positive("scale", scale)?;
            }
            Method::SlidingLine { window, acceleration } | Method::TheilSen { window, acceleration } => {
                duration("window", window, LONGEST)?;
                non_negative("acceleration", acceleration)?;
            }
            Method::SlidingParabola { window, jerk } => {
                duration("window", window, LONGEST)?;
                non_negative("jerk", jerk)?;
            }
            Method::AlphaBeta { memory, acceleration } => {
                duration("memory", memory, LONGEST)?;
                non_negative("acceleration", acceleration)?;
            }
            Method::KalmanCv { acceleration } => {
                positive("acceleration", acceleration)?;
            }
            Method::KalmanCa { jerk, acceleration } => {
                positive("jerk", jerk)?;
                positive("acceleration", acceleration)?;
            }
        }
        Ok(self)
    }
}

impl Noise {
    /// Returns the noise if it makes sense.
    ///
    /// # Errors
    /// When a number is out of its domain.
    pub fn checked(self) -> Result<Self, Error> {
        match self {
            Noise::Given(noise) => {
                positive("noise", noise)?;
            }
            Noise::Estimated { start, frames } => {
                positive("start", start)?;
                if !(frames >= 5.0 && frames.is_finite()) {
                    return Err(Error::new("frames", format!("must be finite and at least 5, got {frames:?}")));
                }
            }
        }
        Ok(self)
    }
}
