//! What every method offers: it takes distances of one target, and gives a posterior at any later time.

use super::recursive::{Model, Recursive};
use super::settings::Method;
use super::window::{Fit, Window};

/// One distance, and how much it is trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measured {
    /// s, since the tracker's first.
    pub stamp: f64,
    /// m
    pub distance: f64,
    /// m^2
    pub variance: f64,
    /// Whether the variance came with the distance, rather than from what is believed of all.
    pub own: bool,
}

/// Mean and covariance of distance and closing speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Posterior {
    /// m
    pub distance: f64,
    /// m/s
    pub closing_speed: f64,
    /// Variance of the distance.
    pub dd: f64,
    /// Covariance of both.
    pub dv: f64,
    /// Variance of the closing speed.
    pub vv: f64,
    /// The part of `dd` that allows for motion which the method does not follow, rather than for noise.
    pub lag: f64,
}

impl Posterior {
    /// The same with every standard deviation multiplied by the root of `factor`.
    pub(super) fn widened(self, factor: f64) -> Self {
        Posterior { dd: self.dd * factor, dv: self.dv * factor, vv: self.vv * factor, lag: self.lag * factor, ..self }
    }
}

/// The memory of one target.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Filter {
    Recursive(Recursive),
    Window(Window),
}

impl Filter {
    pub(super) fn new(method: Method) -> Self {
        let recursive = |speed_wander: f64, acceleration_wander: f64, acceleration, memory| {
            Filter::Recursive(Recursive::new(Model {
                speed_wander: speed_wander * speed_wander,
                acceleration_wander: acceleration_wander * acceleration_wander,
                acceleration,
                memory,
            }))
        };
        match method {
            Method::SlidingLine { window, acceleration } => {
                Filter::Window(Window::new(window, Fit::Line, acceleration))
            }
            Method::SlidingParabola { window, jerk } => Filter::Window(Window::new(window, Fit::Parabola, jerk)),
            Method::TheilSen { window, acceleration } => {
                Filter::Window(Window::new(window, Fit::MedianLine, acceleration))
            }
            Method::AlphaBeta { memory, acceleration } => recursive(0.0, 0.0, acceleration, Some(memory)),
            Method::KalmanCv { acceleration } => recursive(acceleration, 0.0, 0.0, None),
            Method::KalmanCa { jerk, acceleration } => recursive(0.0, jerk, acceleration, None),
        }
    }

    /// How many frames it has seen, as far as it remembers.
    pub(super) fn frames(&self) -> usize {
        match self {
            Filter::Recursive(filter) => filter.frames as usize,
            Filter::Window(filter) => filter.frames.len(),
        }
    }

    /// How many it takes to say anything.
    pub(super) fn frames_needed(&self) -> usize {
        match self {
            Filter::Recursive(_) => 3,
            Filter::Window(filter) => filter.frames_needed(),
        }
    }

    pub(super) fn push(&mut self, new: Measured) {
        match self {
            Filter::Recursive(filter) => filter.push(new),
            Filter::Window(filter) => filter.push(new),
        }
    }

    /// What is believed of `stamp`, from two frames on; `variance` is that of every distance that did not bring its own.
    pub(super) fn at(&self, stamp: f64, variance: f64) -> Option<Posterior> {
        match self {
            Filter::Recursive(filter) => (filter.frames >= 2).then(|| filter.at(stamp)),
            Filter::Window(filter) => filter.at(stamp, variance),
        }
    }
}
