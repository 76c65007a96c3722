//! What every method offers: it takes distances of one target, and gives a posterior at any later time.

use super::posterior::{Measured, Posterior};
use super::recursive::{Model, Recursive};
use super::settings::Method;
use super::window::{Fit, Window};

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
