#!/usr/bin/env bash
# Build a wheel into dist, and test it. Called by `make wheel`, which sets PYTHON and MATURIN (the build tool's version).
#   TARGET         Rust's name of a processor and C library that are not this machine's; such a wheel is not tested here
#   COMPATIBILITY  the tag of the wheel's C library; manylinux_2_17 if unset
# TESTS and EXTRA are those of test_wheel.sh.
set -euo pipefail
cd "$(dirname "$0")/.."

"$PYTHON" -m venv build/wheel-tools
tools=$PWD/build/wheel-tools/bin
[ -d "$tools" ] || tools=$PWD/build/wheel-tools/Scripts # on Windows
packages=("$MATURIN")
options=(--release --locked --out dist --compression-level 9)
case "$(uname -s)" in
Linux) # zig links against an old C library, so that the wheel runs on every Linux since 2014.
    packages+=(ziglang)
    options+=(--zig --compatibility "${COMPATIBILITY:-manylinux_2_17}")
    targets=${TARGET:-}
    ;;
Darwin) # one wheel for both processors
    options+=(--target universal2-apple-darwin)
    targets="x86_64-apple-darwin aarch64-apple-darwin"
    ;;
*) targets= ;;
esac
[ -z "${TARGET:-}" ] || options+=(--target "$TARGET")
for each in $targets; do
    [ -d "$("${RUSTC:-rustc}" --print target-libdir --target "$each")" ] || rustup target add "$each"
done
"$tools/python" -m pip install --quiet --upgrade pip "${packages[@]}"
rm -rf dist
PATH="$tools:$PATH" maturin build "${options[@]}" --interpreter "$PYTHON"
[ -n "${TARGET:-}" ] || tools/test_wheel.sh dist/*.whl
