//! A coarse plane, by vote.
//!
//! Every plane on a grid of slopes and heights that could be the road is tried, and the one that the ground of most stacks
//! lies on wins. No starting point to get stuck at, and nothing random. Walls and bushes lie on many planes, a little on
//! each, so a vote weighs as much as its stack is flat.

use super::stacks::{LAYERS_PER_METRE, Stack};
use super::{Road, RoadSearch};

/// Across the whole region two neighbouring slopes differ by this much in height, m: little enough for the steps of
/// the refinement.
const STEP: f64 = 0.6;

/// The plane with most votes; of several the flattest, then the lowest.
pub(super) fn elect(stacks: &[Stack], search: &RoadSearch) -> Road {
    let lowest = -search.sensor_height - search.height_tolerance;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a checked number above 0")]
    let bins = ((2.0 * search.height_tolerance * LAYERS_PER_METRE).ceil() as usize).max(2);
    let mut winner = (0.0, Road { slope_x: 0.0, slope_y: 0.0, offset: -search.sensor_height });
    let mut votes = vec![0.0; bins + 1]; // the last is for planes that cannot be the road
    for slope_x in slopes(search.x, search.max_slope) {
        for slope_y in slopes(search.y, search.max_slope) {
            votes.fill(0.0);
            for Stack { ground: [x, y, z], flatness, .. } in stacks {
                let place = (z - slope_x * x - slope_y * y - lowest) * LAYERS_PER_METRE;
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a bin, when it is one")]
                let bin = if 0.0 <= place { place as u32 as usize } else { bins };
                votes[bin.min(bins)] += flatness;
            }
            // Two bins together, or a road on the border between them would lose half its votes.
            for (bin, pair) in votes[..bins].windows(2).enumerate() {
                if pair[0] + pair[1] > winner.0 {
                    let offset = lowest + (bin + 1) as f64 / LAYERS_PER_METRE;
                    winner = (pair[0] + pair[1], Road { slope_x, slope_y, offset });
                }
            }
        }
    }
    winner.1
}

/// Slopes up to the steepest, the flattest first.
fn slopes((low, high): (f64, f64), steepest: f64) -> impl Iterator<Item = f64> {
    #[allow(clippy::cast_possible_truncation, reason = "the size of the region is checked")]
    let steps = (steepest * (high - low) / STEP).ceil() as i32;
    let signed = (1..=steps).flat_map(|step| [-step, step]);
    std::iter::once(0).chain(signed).map(move |step| f64::from(step) * steepest / f64::from(steps.max(1)))
}
