//! A car drives towards a wall; a tracker of distances says when it will be there: `cargo run --example approach`.

use ttc_fast_core::Error;
use ttc_fast_core::tracker::{DistanceTracker, Settings};

const INTERVAL: f64 = 0.1; // s between measurements
const SPEED: f64 = 5.0; // m/s

fn main() -> Result<(), Error> {
    let mut tracker = DistanceTracker::new(Settings::default())?;
    println!("time s  distance m  status     closing m/s  TTC s");
    for frame in 0..20 {
        let stamp = INTERVAL * f64::from(frame);
        let jitter = 0.02 * (7.0 * f64::from(frame)).sin(); // what a sensor adds
        let seen = tracker.update(20.0 - SPEED * stamp + jitter, stamp, None)?;
        println!(
            "{stamp:6.1}  {:10.2}  {:9}  {:11.2}  {:5.2}",
            seen.distance,
            format!("{:?}", seen.status),
            seen.closing_speed,
            seen.ttc
        );
    }
    Ok(())
}
