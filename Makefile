# Each target does its own set-up; the second time it is quick.
# `make run` and `make test` are all that a new user needs.

PYTHON ?= python3
BIN := .venv/bin
# With it each start of the command would compile all of its modules again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help run experiment test lint screenshots firmware firmware-proof clean
help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "make %-14s  %s\n", $$1, $$2}' Makefile

# RUN takes options, such as RUN="--headless --port 8090".
RUN ?=
run: .venv/compiled.stamp ## the main job: the live partner and its studio (Ctrl-C ends it)
	$(BIN)/miburi run $(RUN)

experiment: .venv/compiled.stamp ## the paper's experiment, written to out/experiment
	$(BIN)/miburi experiment --seed 1 --seconds 30 --out out/experiment

# Some tests wait, so use one more worker than there are cores. Each worker loads all modules, which
# takes 10 s, so more workers are slower. Pages come last, on two workers: beside other tests each
# page stays open longer, and drawing it takes more time than the others gain.
PYTEST := $(BIN)/python -m pytest
TESTS := $(PYTEST) -n $$(($$(nproc) + 1))
PAGES := tests/studio/browser
BROWSE := $(PYTEST) -n 2 $(PAGES)
test: .venv/test.stamp .venv/compiled.stamp firmware ## all tests but the proofs (about 6 minutes on two cores)
	$(TESTS) --ignore $(PAGES)
	$(BROWSE)

# What a developer runs every few minutes; and the three parts of `make test`, for machines that
# work side by side.
.PHONY: test-quick test-rest test-firmware test-pages
QUICK := $(foreach room,bma bodies calibration card emulation feelings gestures ground ik people \
	robot safety senses servos talk,$(wildcard tests/$(room)/test_*.py))
LONGER := ninth ears chain conversation http press robustness happenings distress
QUICK := $(filter-out $(LONGER:%=\%/test_%.py),$(QUICK))
test-quick: .venv/test.stamp .venv/compiled.stamp ## what is quick: no program, page, film, study or card (a minute)
	$(BIN)/python -m pytest -n auto $(QUICK)
test-rest: .venv/test.stamp .venv/compiled.stamp firmware ## all tests but those of the card and those in a browser
	$(TESTS) --ignore $(PAGES) --ignore tests/firmware
test-firmware: .venv/test.stamp .venv/compiled.stamp firmware ## the tests of the card
	$(TESTS) tests/firmware
test-pages: .venv/test.stamp .venv/compiled.stamp ## the tests in a browser
	$(BROWSE)

# For each proof `make test` runs a quicker test, which its mark names. All targets but these two and
# `test-lowest` leave the proofs out.
.PHONY: proof
proof: .venv/test.stamp .venv/compiled.stamp firmware ## the long tests: mutants, studies, pages (about 15 minutes)
	$(TESTS) -m proof --ignore $(PAGES)
	$(BROWSE) -m proof

screenshots: .venv/test.stamp ## pictures of the studio and the face, in out/screenshots
	tools/debian-packages fonts-noto-cjk
	$(BIN)/python tools/screenshots out/screenshots

lint: .venv/test.stamp ## style and types
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

# What builds the sketch without the Arduino IDE, and runs the binary in virtual time.
FIRMWARE_PACKAGES := make gcc g++ libc6-dev gcc-avr avr-libc binutils-avr arduino-core-avr \
	libsimavr-dev libelf-dev
firmware: ## the card's firmware, and the emulated card
	tools/debian-packages $(FIRMWARE_PACKAGES)
	$(MAKE) --no-print-directory -C firmware

firmware-proof: .venv/test.stamp ## the firmware's tests with the full counts (about 10 minutes)
	MIBURI_TRACES=100000 MIBURI_MOVES=2000,500 MIBURI_FUZZ=1000000 MIBURI_LIES=300 \
		MIBURI_LOSS=500 $(BIN)/python -m pytest -n auto --dist worksteal --timeout 3600 \
		-m "proof or not proof" tests/firmware

# uv alone can resolve to the lowest versions, and for other systems.
.PHONY: test-lowest check-wheels
.venv-lowest/bin/uv:
	$(PYTHON) -m venv .venv-lowest
	.venv-lowest/bin/python -m pip install --quiet --disable-pip-version-check uv
check-wheels: .venv-lowest/bin/uv ## whether every dependency has a wheel on Linux, macOS and Windows
	tools/check-wheels .venv-lowest/bin/uv
test-lowest: .venv-lowest/bin/uv ## the tests with the lowest versions that pyproject.toml allows
	.venv-lowest/bin/uv pip install --quiet --python .venv-lowest/bin/python \
		--resolution lowest-direct -e '.[dev,docs,ears,hardware,https,mcp,mqtt,ros,studies]'
	@# Old versions use what the newest of their own dependencies call deprecated, and another
	@# Matplotlib draws other pictures than those that are kept.
	.venv-lowest/bin/python -m pytest -n auto -W default::DeprecationWarning \
		-m "proof or not proof" --ignore $(PAGES) --ignore tests/firmware \
		--deselect tests/test_docs.py::test_pictures_are_those_that_their_commands_make

.PHONY: test-wheel
test-wheel: firmware ## the tests on a wheel, with any Python (PYTHON=python3.13)
	rm -rf .venv-wheel dist
	$(PYTHON) -m venv .venv-wheel
	.venv-wheel/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir dist .
	.venv-wheel/bin/python -m pip install --quiet --disable-pip-version-check -c constraints.txt \
		"$$(ls dist/*.whl)[dev,docs,ears,hardware,https,mcp,mqtt,ros,studies]"
	MIBURI_FIRMWARE=$(CURDIR)/build/firmware .venv-wheel/bin/python -m pytest -n auto \
		--ignore $(PAGES) --ignore tests/firmware

# As on the start page: from a wheel, in an environment of its own.
.PHONY: test-lessons
test-lessons: .venv/test.stamp ## the lessons in a new environment, with any Python (PYTHON=python3.13)
	rm -rf .venv-lessons dist
	$(PYTHON) -m venv .venv-lessons
	.venv-lessons/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir dist .
	.venv-lessons/bin/python -m pip install --quiet --disable-pip-version-check "$$(ls dist/*.whl)[studies]"
	MIBURI_LESSONS=$(CURDIR)/.venv-lessons/bin $(BIN)/python -m pytest -n 2 \
		-m "proof or not proof" tests/test_tutorials.py

clean: ## remove what was built
	rm -rf .venv .venv-bench .venv-lessons .venv-lowest .venv-wheel build dist out .mypy_cache .pytest_cache .ruff_cache .hypothesis

# Python packages go into .venv, at the versions of constraints.txt. Debian packages: see tools.
.venv/bin/python:
	tools/debian-packages $$($(PYTHON) -c 'import ensurepip' 2>/dev/null || echo python3-venv)
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Miburi needs Python 3.11 or newer.")'
	$(PYTHON) -m venv .venv

.venv/run.stamp: .venv/bin/python pyproject.toml constraints.txt tools/debian-packages
	tools/debian-packages ffmpeg libegl1 libegl-mesa0 libgl1-mesa-dri
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[https,studies]'
	@touch $@

# Compile the solver and the servos once, so that the first start is as quick as every other.
.venv/compiled.stamp: .venv/run.stamp $(shell grep -rl --include=*.py '^@compiled' src/miburi)
	$(BIN)/miburi ik --right 0.1 -0.1 0.2 --left 0.1 0.1 0.2 --head 0.0279 0 0.1987 >/dev/null
	$(BIN)/miburi experiment --seconds 2 --no-film --out build/first >/dev/null
	@touch $@

.venv/test.stamp: .venv/run.stamp
	tools/debian-packages chromium curl flite mosquitto prusa-slicer $(FIRMWARE_PACKAGES)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev,docs,hardware,https,mcp,mqtt,studies]'
	@# Not every system has wheels for these.
	for extra in ears ros; do \
		$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt \
			--only-binary cyclonedds,pocketsphinx -e ".[$$extra]" || { \
			echo "[$$extra] cannot be installed here; its tests are left out."; test "$$CI" != true; }; \
	done
	@touch $@

# Thirty-two thousand trials. Interrupted, each goes on where it was.
.PHONY: docs-safety
TRIALS = $(BIN)/miburi trials --seed 1 --out $@
SOME := --free 200 --blocked 200
out/trials/default-servo.parquet: .venv/run.stamp
	$(TRIALS) --free 5000 --blocked 5000
out/trials/twelve-servos.parquet: .venv/run.stamp
	$(TRIALS) --free 2000 --blocked 2000 --servos 12
out/trials/play-%-degrees.parquet: .venv/run.stamp
	$(TRIALS) --free 2000 --blocked 2000 --servos 12 --play $*
out/trials/imagined-servo.parquet: .venv/run.stamp
	$(TRIALS) --free 100 --blocked 100 --servo imagined
out/trials/rule-off.parquet: .venv/run.stamp
	$(TRIALS) --free 10 --blocked 5000 --rule off
out/trials/states/%.parquet: .venv/run.stamp
	$(TRIALS) $(SOME) --state $*
out/trials/parts/as-printed.parquet: .venv/run.stamp
	$(TRIALS) $(SOME) --rule printed
out/trials/parts/delayed-profile.parquet: .venv/run.stamp
	$(TRIALS) $(SOME) --rule profile
out/trials/parts/without-gravity.parquet: .venv/run.stamp
	$(TRIALS) $(SOME) --rule weightless
out/trials/parts/without-%.parquet: .venv/run.stamp
	$(TRIALS) $(SOME) --without $*
COLUMNS := default-servo twelve-servos play-0.25-degrees play-0.5-degrees imagined-servo rule-off
COLUMNS += $(addprefix states/,hot warmed-up worn 4.75V 5.25V)
COLUMNS += $(addprefix parts/,as-printed delayed-profile without-gravity without-lift without-ceiling)
docs-safety: $(COLUMNS:%=out/trials/%.parquet) ## contact trials and their page (about 20 minutes)
	$(BIN)/miburi safety-page $^ --out docs

# MkDocs 2 will drop plugins and hooks; constraints.txt holds it below (its banner says so each time).
.PHONY: docs
docs: .venv/test.stamp ## the site that users read, in out/site
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --site-dir out/site

.PHONY: docs-images
docs-images: .venv/test.stamp ## the documents' pictures anew (a few minutes; tools/renew-images)
	$(BIN)/python tools/renew-images

.PHONY: docs-paper
docs-paper: .venv/run.stamp firmware ## the paper, claim by claim, and its figures (about 12 minutes)
	$(BIN)/miburi paper --out docs

# What the pages show is made by commands. Continuous integration does this each night, and fails
# where a page is older than what it tells of.
.PHONY: docs-renew docs-check
docs-renew: .venv/test.stamp ## all that commands make of the documents anew (about 50 minutes)
	rm -rf out/trials
	$(MAKE) --no-print-directory docs-images docs-paper docs-safety
	$(BIN)/python tools/renew-learn docs/learn/*.md
docs-check: docs-renew ## the same, and fail if what was committed is stale
	$(BIN)/python tools/stale-docs

# Peers of the inverse kinematics, in an environment of their own; results in bench/ik.
.PHONY: bench-ik bench-functions reproduce-ik
bench-ik: .venv-bench/stamp ## the inverse kinematics beside its peers (about 10 minutes)
	cd bench/ik && export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 && \
		../../.venv-bench/bin/python compare.py
	$(PYTHON) bench/ik/page.py

# The same numbers in each run, on any machine.
bench-functions: .venv-bench/stamp ## the optimiser beside its peers, on test functions (a few minutes)
	cd bench/ik && ../../.venv-bench/bin/python functions.py
	$(PYTHON) bench/ik/page.py

# The tables and the figure of docs/inverse-kinematics.md that concern the paper's claims.
reproduce-ik: .venv/run.stamp ## what the paper claims of its inverse kinematics, and what holds
	cd bench/ik && ../../$(BIN)/python reproduce.py
	$(PYTHON) bench/ik/page.py

.venv-bench/stamp: pyproject.toml bench/ik/requirements.txt
	$(PYTHON) -m venv .venv-bench
	.venv-bench/bin/python -m pip install --quiet --disable-pip-version-check \
		-e . -r bench/ik/requirements.txt
	@touch $@
