#!/usr/bin/env bash
# Build a manylinux wheel, install it in an empty environment and run the tests against it, away from the checkout.
# Called by `make wheel`, which sets PYTHON and MATURIN (the build tool's version).
set -euo pipefail
cd "$(dirname "$0")/.."
checkout=$PWD

# zig links against an old C library, so that the wheel runs on every Linux since 2014.
"$PYTHON" -m venv build/wheel-tools
build/wheel-tools/bin/pip install --quiet --upgrade pip "$MATURIN" ziglang
rm -rf dist
PATH="$checkout/build/wheel-tools/bin:$PATH" \
    maturin build --release --locked --strip true --zig --compatibility manylinux_2_17 --out dist

"$PYTHON" -m venv --clear build/wheel-test
build/wheel-test/bin/pip install --quiet --upgrade pip
build/wheel-test/bin/pip install --quiet "$(echo dist/*.whl)[test]"

# The tests and the evaluations go elsewhere: in the checkout they could import its package instead of the wheel's.
away=$(mktemp -d)
trap 'rm -rf "$away"' EXIT
cp -R tests evaluation pyproject.toml "$away"
if [ -z "${TTC_FAST_DATA:-}" ] && [ -d ../shared/data ]; then
    TTC_FAST_DATA=$(cd ../shared/data && pwd)
    export TTC_FAST_DATA
fi
cd "$away"
"$checkout/build/wheel-test/bin/python" - <<'PYTHON'
import sys, ttc_fast
assert ttc_fast.__file__.startswith(sys.prefix), f"{ttc_fast.__file__} is not the wheel's"
print(f"testing {ttc_fast.__file__} ({ttc_fast.SIMD_LEVEL})")
PYTHON
"$checkout/build/wheel-test/bin/pytest"
