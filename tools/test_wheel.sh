#!/bin/sh
# test_wheel.sh WHEEL: install a wheel or an sdist in an empty environment and run the tests against it, away from the checkout.
#   PYTHON  the Python of the environment; python3 if unset
#   EXTRA   the extra that brings what the tests need; test if unset, and test-kernels where few packages have wheels
#   TESTS   what pytest is to run; everything if unset
set -eu
cd "$(dirname "$0")/.."
"${PYTHON:-python3}" -m venv --clear build/wheel-test
python=$PWD/build/wheel-test/bin/python
[ -x "$python" ] || python=$PWD/build/wheel-test/Scripts/python # on Windows
"$python" -m pip install --quiet --upgrade pip
"$python" -m pip install --quiet "$1[${EXTRA:-test}]"

# The tests and the evaluations go elsewhere: in the checkout they could import its package instead of the wheel's.
away=$(mktemp -d)
trap 'rm -rf "$away"' EXIT
cp -R tests evaluation pyproject.toml "$away"
if [ -z "${TTC_FAST_DATA:-}" ] && [ -d ../shared/data ]; then
    TTC_FAST_DATA=$(cd ../shared/data && pwd)
    export TTC_FAST_DATA
fi
cd "$away"
"$python" - <<'PYTHON'
import sys, ttc_fast
assert ttc_fast.__file__.startswith(sys.prefix), f"{ttc_fast.__file__} is not the wheel's"
print(f"testing {ttc_fast.__file__} ({ttc_fast.SIMD_LEVEL})")
PYTHON
# shellcheck disable=SC2086 # several words, each a test
"$python" -m pytest ${TESTS:-}
