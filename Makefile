# Each target sets up what it needs: a virtual environment in .venv, and the compiled module.
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
BIN := .venv/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
RUST := $(shell find crates -name '*.rs' -o -name Cargo.toml) Cargo.toml .cargo/config.toml
# Wheels of all these packages exist for the usual platforms; nothing but symspline is compiled.
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
# Prints the libraries that symspline and some of its extras need.
REQUIREMENTS = $(BIN)/python -c 'import sys, tomllib; \
	project = tomllib.load(open("pyproject.toml", "rb"))["project"]; extras = project["optional-dependencies"]; \
	print(*project["dependencies"], *(requirement for name in sys.argv[1:] for requirement in extras[name]), sep="\n")'

# Python keeps compiled modules, even where the environment forbids it. Otherwise every process compiles its imports anew,
# which takes three times as long.
unexport PYTHONDONTWRITEBYTECODE
# Cargo would try to use the job server of make, which its recipes do not inherit.
unexport MAKEFLAGS MFLAGS

.PHONY: demo check check-lints check-rust check-types check-python test test-oracles test-torch test-programs \
	test-aarch64 test-timing fuzz bench size docs wheel sdist test-wheel test-packages package-files crate crate-msrv \
	crate-semver publish-wheels publish-crates publish-npm check-tools clean docs-check wasm test-wasm

demo: .venv/built .venv/plot
	$(BIN)/python examples/storms/demo.py --out demo-output

# Format, lints, spelling, types, docstrings, and the laws of every space in Rust: what to run before a commit.
check: check-types check-lints check-rust check-python

# Clippy has its own folder, so that it does not wait for the compiled module.
check-lints: | check-tools
	cargo fmt --all --check
	cargo clippy --quiet --release --all-targets --target-dir target/clippy -- -D warnings

# With --release, the crates that were compiled for the module are used again.
check-rust: .venv/built
	cargo test --quiet --release --workspace --exclude symspline-benches

check-types: .venv/tools
	$(BIN)/mypy

check-python: .venv/built .venv/tools
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell *.md Makefile benchmarks crates docs examples packaging python tests
	$(BIN)/python -m pytest tests/test_docstrings.py tests/test_language.py tests/release

# Workers on all cores with a thread of BLAS per core each would wait for each other.
test: check
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest --numprocesses auto --dist worksteal --doctest-modules python tests \
		--ignore tests/test_docstrings.py --ignore tests/test_language.py --ignore tests/release

# Compares with evo and geomstats, which runs with no NumPy of today, and so in an environment of its own, beside the
# compiled module of .venv, which every Python from 3.11 on can load. Needs .5 GB; not part of `test`.
test-oracles: .venv/built .venv-oracles/built
	.venv-oracles/bin/python -m pytest tests/oracles -o pythonpath='python tests' \
		-W 'ignore:BackendImporter:ImportWarning'

.venv-oracles/built: tests/oracles/requirements.txt | .venv/maturin
	test -x .venv-oracles/bin/python || $(BIN)/python -m venv .venv-oracles
	.venv-oracles/bin/python -m pip install --quiet --disable-pip-version-check --no-compile -r $<
	touch $@

# The adapter for PyTorch, which needs up to 5 GB and is no part of `test`.
test-torch: .venv/built .venv/tools
	$(INSTALL) 'torch>=2'
	$(BIN)/python -m pytest tests/pytorch tests/evidence/test_array_api_table.py tests/test_interface.py -o pythonpath='. tests docs'

# The examples print what their pages claim, the benchmarks run, and the npm package agrees with the Python package.
test-programs: .venv/built .venv/tools
	$(BIN)/python -m pytest --numprocesses auto tests/examples tests/bench tests/javascript

# The Rust tests on a 64-bit ARM processor, which qemu-user plays: about a quarter of an hour. The C library that comes
# with this target, and the linker that comes with Rust, need no tools of that machine.
ARM := CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL
test-aarch64:
	rustup target add aarch64-unknown-linux-musl
	$(ARM)_LINKER=rust-lld $(ARM)_RUNNER=qemu-aarch64 \
		$(ARM)_RUSTFLAGS='-C link-self-contained=yes -C linker-flavor=ld.lld' \
		cargo test --quiet --workspace --exclude symspline-benches --exclude symspline-python \
		--lib --tests --target aarch64-unknown-linux-musl

# About ten minutes of random input on two cores; what fails is kept in .hypothesis and tried first the next time. Then the
# table of the page on trust, from few recordings.
fuzz: .venv/built .venv/tools
	$(BIN)/python -m pytest --numprocesses auto tests/fuzz
	$(BIN)/python -m tests.trust 20

# What depends on the time or the memory that the machine has left: one test at a time, on an idle machine.
test-timing: .venv/built .venv/tools
	$(BIN)/python -m pytest tests/timing
	$(BIN)/python tests/timing/interrupts.py

# Lines of code by part of the package, beside the aims.
size:
	@python3 packaging/size.py

# Some minutes; the machine should have nothing else to do.
bench: .venv/built .venv/tools
	$(BIN)/python -m benchmarks

# The site, in build/docs: its gallery is run, and what is wrong with a page or a link to another one is an error. First,
# the formulas of the theory are checked, and small tables of the pages made. Where the tools of `make wasm` are, the site
# has the page "Drag the points".
docs: .venv/built .venv/tools
	$(INSTALL) $$($(REQUIREMENTS) docs)
	@if command -v node >/dev/null && rustup target list --installed 2>/dev/null | grep -qx wasm32-unknown-unknown && \
		$(WASM_BINDGEN) --version 2>/dev/null | grep -q ' $(WASM_VERSION)$$'; then $(MAKE) wasm; \
		else echo 'The site will have no page "Drag the points": `make wasm` names the tools that it needs.'; fi
	$(BIN)/python -m pytest --numprocesses auto tests/evidence
	SYMSPLINE_NUM_THREADS=1 $(BIN)/python -m sphinx -j auto -W --keep-going -q -b html -d build/doctrees docs build/docs
	$(BIN)/python docs/links.py build/docs

# What a reader of the built site would stumble over, on a desktop and on a phone; needs Node.js and Chromium.
docs-check:
	npm install --prefix build/check --silent --no-audit --no-fund playwright-core@1 axe-core@4
	node docs/check_pages.mjs build/docs build/check

# One wheel for every processor of this architecture, in dist/: on x86-64 with three compiled modules, so three builds.
wheel: .venv/maturin
	$(BIN)/python packaging/wheel.py

# The source archive, in dist/.
sdist: .venv/maturin
	$(BIN)/python -m maturin sdist --out dist

# Installs the wheel of dist/ where there is nothing but NumPy, and tests it far from the checkout. NUMPY='numpy==1.26.4'
# takes another NumPy, the environment variable SYMSPLINE_CPU=plain the module for any processor.
NUMPY ?= numpy
test-wheel: .venv/maturin
	$(BIN)/python packaging/test_wheel.py '$(NUMPY)'

# The wheel of dist/, the crates and the npm package of build/npm, each installed in an empty folder, where the examples of
# its README run. `make wheel` and `make wasm` come first. PACKAGES=python tests one of them.
PACKAGES ?= python rust javascript
test-packages: .venv/maturin
	$(BIN)/python packaging/test_packages.py $(PACKAGES)

# Files that packages contain and that are derived from others: the licences of the crates in the compiled module, and the
# README for package indexes. `make check-python` compares them with their sources.
package-files: .venv/maturin
	$(BIN)/python packaging/licenses.py
	$(BIN)/python packaging/index_readme.py

# What Rust users get: documentation without warnings, examples and interface, every feature by itself, and packages with
# licence and README.
CRATES := --workspace --exclude symspline-python --exclude symspline-benches
crate:
	RUSTDOCFLAGS='-D warnings' cargo doc --quiet --no-deps $(CRATES) --all-features
	cargo test --quiet -p symspline
	cargo run --quiet -p symspline --example rotations_and_poses
	cargo run --quiet -p symspline --example custom_space
	for features in '' vectors rotations positive-definite subspaces rotations,nalgebra,glam,mint,serde vectors,smoothing; do \
		RUSTFLAGS='-D warnings' cargo check --quiet -p symspline --no-default-features --features "$$features" \
			--target-dir target/features || exit 1; done
	cargo package --quiet --no-verify --allow-dirty $(CRATES)
	for package in target/package/*.crate; do tar tzf $$package | grep -c -E '/(LICENSE|README.md)$$' | grep -q 2 \
		|| { echo "$$package lacks its licence or README"; exit 1; }; done

# The oldest compiler that Cargo.toml promises, which rustup must be able to install.
crate-msrv:
	rustup toolchain install --profile minimal $(MSRV)
	cargo +$(MSRV) check --quiet -p symspline --all-features --target-dir target/msrv

MSRV = $(shell sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)

# What a maintainer runs for a release; CONTRIBUTING.md describes the credentials.
publish-wheels: | check-tools
	$(INSTALL) twine
	$(BIN)/python -m twine upload dist/symspline-*

publish-crates:
	cargo publish $(CRATES)

publish-npm: wasm
	cd build/npm && npm publish

# Whether the interface is compatible with that of the published version; needs cargo-semver-checks.
crate-semver:
	cargo semver-checks --package symspline

# The npm package in build/npm and the page of figures in build/play, which `make docs` builds as well.
# Needs Node.js, the Rust target wasm32-unknown-unknown, and wasm-bindgen of the version in crates/symspline-wasm.
WASM_BINDGEN ?= wasm-bindgen
WASM_VERSION = $(shell sed -n 's/^wasm-bindgen = "=\(.*\)"/\1/p' crates/symspline-wasm/Cargo.toml)
wasm: build/node/built
	@$(WASM_BINDGEN) --version | grep -q ' $(WASM_VERSION)$$' || { echo "the npm package needs wasm-bindgen $(WASM_VERSION): \
	cargo install --locked wasm-bindgen-cli --version $(WASM_VERSION)"; exit 1; }
	cd crates/symspline-wasm && cargo build --quiet --release --locked --target-dir $(CURDIR)/target/wasm --config \
		"target.wasm32-unknown-unknown.rustflags = ['--remap-path-prefix=$${CARGO_HOME:-$$HOME/.cargo}/registry/src=crates']"
	$(PYTHON) packaging/licenses.py crates/symspline-wasm build/node/THIRD-PARTY-LICENSES.txt
	node packaging/npm/build.mjs target/wasm/wasm32-unknown-unknown/release/symspline_wasm.wasm $(WASM_BINDGEN)

build/node/built: packaging/npm/package.json
	@command -v node >/dev/null || { echo "the npm package needs Node.js 18 or newer"; exit 1; }
	mkdir -p build/node && cp packaging/npm/package.json build/node/
	npm install --prefix build/node --no-audit --no-fund --no-package-lock --silent
	touch $@

# The npm package against the Python package, and the page in Chromium (CHROMIUM=/path/to/it), for which `make wasm`
# comes first. `make test-programs` contains these tests, and skips them where nothing was built.
test-wasm: .venv/built .venv/tools
	cd crates/symspline-wasm && cargo fmt --check && cargo clippy --quiet --target-dir $(CURDIR)/target/wasm -- -D warnings
	$(BIN)/python -m pytest tests/javascript -rs

.venv/maturin: | check-tools
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(INSTALL) 'maturin>=1.9,<2'
	touch $@

# The compiled module alone: it takes one core for minutes, and the other libraries can be installed meanwhile.
.venv/built: pyproject.toml $(RUST) | .venv/maturin
	$(INSTALL) --no-deps --editable .
	touch $@

# What the demonstration needs besides.
.venv/plot: pyproject.toml | .venv/maturin
	$(REQUIREMENTS) plot > .venv/plot.txt
	$(INSTALL) -r .venv/plot.txt
	touch $@

# What tests and benchmarks need besides: 1.6 GB with JAX and Pyright.
.venv/tools: pyproject.toml | .venv/maturin
	$(REQUIREMENTS) bench test > .venv/tools.txt
	$(INSTALL) -r .venv/tools.txt
	touch $@

check-tools:
	@test -n "$(PYTHON)" || { echo "symspline needs Python 3.11 or newer (set PYTHON=/path/to/python)"; exit 1; }
	@command -v cargo >/dev/null || { echo "symspline needs a Rust toolchain: see https://rustup.rs"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
		{ echo "$(PYTHON) cannot make virtual environments: install its venv package (Debian: python3-venv)"; exit 1; }

clean:
	rm -rf .venv .venv-oracles target demo-output dist build docs/gallery docs/api/generated docs/api/backreferences docs/_static/play
