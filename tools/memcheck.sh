#!/usr/bin/env bash
# Run the Rust tests of the core's files, those with `unsafe` code (column, simd) among them, and the calls that `make instructions`
# counts, which read points and scans through them, under valgrind; AVX2 is the highest level that it knows. Called by `make memcheck`.
set -euo pipefail
cd "$(dirname "$0")/.."

command -v valgrind >/dev/null || { echo "valgrind is missing: on Debian and Ubuntu run apt install valgrind" >&2; exit 1; }
# Not leaks: the pool of threads lives as long as the process.
check() { valgrind --quiet --error-exitcode=99 --leak-check=no "$@"; }
# executable COMMAND OPTION...: the executable that a command of Cargo builds.
executable() {
    cargo "$@" --quiet --locked --message-format=json-render-diagnostics | sed -n 's/.*"executable":"\([^"]*\)".*/\1/p'
}

tests=$(executable test --no-run --package ttc-fast-core --lib)
check "$tests" --test-threads 1 column:: simd:: mixture:: threads:: vehicle:: real::
calls=$(executable build --package ttc-fast-benches --bin hot_calls)
"$calls" | while IFS= read -r name; do
    check "$calls" "$name" 4
    echo "valgrind finds nothing in $name"
done
