//! What is worked out from the settings once for each type of ranges.

use super::reading::Rules;
use super::settings::Settings;
use super::tables::{Beams, Tables};
use crate::real::Real;

/// Everything that a kernel reads besides the scan itself.
#[derive(Clone, Debug)]
pub(super) struct KernelTables<T> {
    pub tables: Tables<T>,
    pub rules: Rules<T>,
}

impl<T: Real> KernelTables<T> {
    pub(super) fn new(settings: &Settings, beams: &Beams) -> Self {
        let sensor = (settings.range_min, settings.range_max);
        KernelTables {
            tables: Tables::new(beams, settings.beams),
            rules: Rules::new(sensor, settings.limits, settings.limits_policy, settings.too_close),
        }
    }
}
