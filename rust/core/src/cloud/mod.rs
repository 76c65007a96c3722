//! The robust nearest distance ahead in a point cloud, and a time-to-collision from how it shrinks.
//!
//! A [`gate`] says which points count. A [`pass`] over the cloud finds them and keeps them in a [`buffer`]; [`order`]
//! finds order statistics of their distances, and [`cluster`] the nearest group of points. An [`estimator`] makes one
//! distance of them. [`two_frame`] makes a time of two clouds, and [`tracker`] of many; [`own_vehicle`] looks past
//! the vehicle itself.

mod buffer;
mod cluster;
mod estimator;
mod gate;
mod order;
mod own_vehicle;
mod pass;
mod tracker;
mod two_frame;

pub use {
    estimator::{Detection, Estimator, MinX, robust_min_x},
    gate::{Axis, CheckedGate, Gate, Interval, REP_103, Road},
    own_vehicle::{CloudMemory, CloudTracker, StillBody},
    tracker::{Body, CloudSettings, CloudTrack},
    two_frame::{CloudTtc, ttc_from_clouds},
};
