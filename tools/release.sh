#!/usr/bin/env bash
# Build the sdist into dist, install it in an empty environment and run ttc-fast doctor there; check all that is in dist for the
# package index. Called by `make release-check`, which sets PYTHON and MATURIN (the build tool's version).
set -euo pipefail
cd "$(dirname "$0")/.."

"$PYTHON" -m venv build/release-tools
build/release-tools/bin/pip install --quiet --upgrade pip "$MATURIN" twine abi3audit auditwheel
rm -f dist/*.tar.gz
build/release-tools/bin/maturin sdist --out dist

"$PYTHON" -m venv --clear build/sdist-test
build/sdist-test/bin/pip install --quiet "$(echo dist/*.tar.gz)"
(cd build && sdist-test/bin/ttc-fast doctor)

build/release-tools/bin/twine check --strict dist/*
for wheel in dist/*.whl; do
    [ -e "$wheel" ] || continue
    echo "$wheel: $(stat -c %s "$wheel") bytes"
    case $wheel in *-abi3-*) build/release-tools/bin/abi3audit --strict --report "$wheel" >/dev/null ;; esac
    case $wheel in *linux*) build/release-tools/bin/auditwheel show "$wheel" ;; esac
done
