//! What goes into a filter, and what comes out of it.

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
