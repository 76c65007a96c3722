#!/usr/bin/env bash
# Build a wheel for aarch64 and run its tests in qemu, on an x86-64 Debian 12. What rustup has not is taken from Debian's
# packages, which are unpacked in build/aarch64 and not installed: no root, no chroot, nothing changed on the machine. It takes
# 300 MB and about five minutes of CPU, and the tests an hour. Called by `make wheel-aarch64`; TESTS says what pytest is to run.
set -euo pipefail
cd "$(dirname "$0")/.."
mkdir -p build/aarch64
work=$PWD/build/aarch64

mkdir -p "$work"/{lists/partial,archives/partial,state}
cat > "$work/apt.conf" <<CONF
APT::Architecture "amd64"; APT::Architectures { "amd64"; "arm64"; }; APT::Sandbox::User "";
Dir::State "$work/state"; Dir::State::Lists "$work/lists"; Dir::State::status "/dev/null";
Dir::Cache "$work"; Acquire::Languages "none";
CONF
export APT_CONFIG=$work/apt.conf

# unpack FOLDER PACKAGE...: download packages and unpack them into a folder that appears only when all are in it.
unpack() {
    local to=$1
    shift
    rm -rf "$work/debs" "$to.part"
    mkdir "$work/debs"
    (cd "$work/debs" && apt-get download -qq "$@" && for each in *.deb; do dpkg -x "$each" "$to.part"; done)
    rm -rf "$work/debs"
    mv "$to.part" "$to"
}

# on PACKAGE PATTERN: the package that another one depends on.
on() { apt-cache depends "$1" | sed -n "s/.*Depends: \($2\)\$/\1/p" | head -1; }

python=(libc6 libgcc-s1 libstdc++6 python3.11-minimal libpython3.11-minimal libpython3.11-stdlib zlib1g libexpat1 libffi8 libssl3
    libbz2-1.0 liblzma5 libsqlite3-0 libuuid1 libcrypt1 libtirpc3 libnsl2 libcom-err2 libgssapi-krb5-2 libkrb5-3 libk5crypto3
    libkrb5support0 libkeyutils1 libncursesw6 libtinfo6 libreadline8)
if ! [ -d "$work/rust" ] || ! [ -d "$work/qemu" ] || ! [ -d "$work/root" ]; then
    apt-get update -qq
    std=$(on libstd-rust-web-dev 'libstd-rust-web-[0-9.]*')
    # A compiler and a standard library of one build.
    [ -d "$work/rust" ] || unpack "$work/rust" rustc-web "$std" "$(on "$std" 'libllvm[0-9]*')" libstd-rust-web-dev:{amd64,arm64}
    [ -d "$work/qemu" ] || unpack "$work/qemu" qemu-user-static
    [ -d "$work/root" ] || unpack "$work/root" "${python[@]/%/:arm64}"
fi

# Any cargo does, but not rustup's proxy, which chooses a compiler of its own.
cargo=$(dirname "$(rustup which cargo 2>/dev/null || command -v cargo)")
PATH=$cargo:$PATH RUSTC=$work/rust/usr/bin/rustc LD_LIBRARY_PATH=$work/rust/usr/lib/x86_64-linux-gnu \
    CARGO_TARGET_DIR=$work/target TARGET=aarch64-unknown-linux-gnu tools/wheel.sh

rm -rf "$work/site"
build/wheel-tools/bin/pip install --quiet --target "$work/site" --python-version 3.11 --implementation cp --abi cp311 --abi abi3 --abi none \
    --platform manylinux2014_aarch64 --platform manylinux_2_27_aarch64 --platform manylinux_2_28_aarch64 --only-binary=:all: \
    "$(echo dist/*_aarch64.whl)[test-kernels]"

away=$(mktemp -d)
trap 'rm -rf "$away"' EXIT
cp -R tests evaluation pyproject.toml "$away"
cd "$away"
# qemu-user and the many threads of OpenBLAS do not mix well.
qemu() {
    "$work/qemu/usr/bin/qemu-aarch64-static" -L "$work/root" -E PYTHONPATH="$work/site:$away" -E PYTHONHOME="$work/root/usr" \
        -E OPENBLAS_NUM_THREADS=1 -E PYTHONDONTWRITEBYTECODE=1 "$work/root/usr/bin/python3.11" "$@"
}
qemu -c 'import platform, ttc_fast; print(f"testing {ttc_fast.__file__} on {platform.machine()} ({ttc_fast.SIMD_LEVEL})")'
# What starts a process of its own would need qemu to be registered with the system.
processes="not modules_come_with_the_package and not a_copy_would_not_fit and not before_the_first_or_after_the_last_byte and not guards_guard"
# shellcheck disable=SC2086 # several words, each a test
qemu -m pytest -p no:cacheprovider -q -k "$processes" ${TESTS:-}
