//! Tells the binding which profile it is built with: the name of Cargo's folder, `target/<profile>/build/<package>/out`.

use std::env;
use std::path::Path;

fn main() {
    let out = env::var_os("OUT_DIR").expect("Cargo sets it");
    let profile = Path::new(&out).ancestors().nth(3).and_then(Path::file_name).expect("Cargo's layout");
    println!("cargo::rustc-env=TTC_FAST_BUILD_PROFILE={}", profile.display());
    println!("cargo::rerun-if-changed=build.rs");
}
