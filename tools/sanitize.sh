#!/usr/bin/env bash
# Run the Rust tests of the core under ThreadSanitizer, and then under AddressSanitizer. The standard library is built with them,
# from the source that rustup has: ThreadSanitizer would not know its locks otherwise. Called by `make sanitize`.
set -euo pipefail
cd "$(dirname "$0")/.."

command -v rustup >/dev/null || { echo "rustup is missing, which has the source of the standard library: https://rustup.rs" >&2; exit 1; }
rustup component add rust-src
target=$(rustc -vV | sed -n 's/^host: //p')
# Not leaks: the pool of threads lives as long as the process.
export ASAN_OPTIONS=detect_leaks=0
for sanitizer in ${SANITIZERS:-thread address}; do
    # Sanitizers are not stable yet, and the released compiler has them all the same.
    RUSTC_BOOTSTRAP=1 RUSTFLAGS="-Zsanitizer=$sanitizer" CARGO_TARGET_DIR=target/$sanitizer \
        cargo test --quiet --locked -Zbuild-std --target "$target" --package ttc-fast-core --lib
    echo "$sanitizer sanitizer finds nothing"
done
