# Each target does its own set-up; the second time it is quick.
# `make run` and `make test` are all that a new user needs.

PYTHON ?= python3
BIN := .venv/bin

.PHONY: help run experiment test lint screenshots clean
help:
	@echo "make run    the main job: the live partner and its studio (Ctrl-C ends it)"
	@echo "make experiment  the paper's experiment, written to out/experiment"
	@echo "make screenshots  pictures of the studio and the face, in out/screenshots"
	@echo "make test   all tests"
	@echo "make lint   style and types"
	@echo "make clean  remove what was built"

# RUN takes options, such as RUN="--headless --port 8090".
RUN ?=
run: .venv/run.stamp
	$(BIN)/miburi run $(RUN)

experiment: .venv/run.stamp
	$(BIN)/miburi experiment --seed 1 --seconds 30 --out out/experiment

# The tests in a browser share one server and one browser: they stay in one process.
test: .venv/test.stamp
	$(BIN)/python -m pytest -n auto --dist loadgroup

screenshots: .venv/test.stamp
	$(BIN)/python tools/screenshots out/screenshots

lint: .venv/test.stamp
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

clean:
	rm -rf .venv build dist out .mypy_cache .pytest_cache .ruff_cache .hypothesis

# Python packages go into .venv, at the versions of constraints.txt. Debian packages: see tools.
.venv/bin/python:
	tools/debian-packages $$($(PYTHON) -c 'import ensurepip' 2>/dev/null || echo python3-venv)
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Miburi needs Python 3.11 or newer.")'
	$(PYTHON) -m venv .venv

.venv/run.stamp: .venv/bin/python pyproject.toml constraints.txt tools/debian-packages
	tools/debian-packages ffmpeg libegl1 libegl-mesa0 libgl1-mesa-dri
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .
	@# Compile the solver now, once, so that the first start is as quick as every other.
	$(BIN)/miburi ik --right 0.05 -0.1 0.1 --left 0.05 0.1 0.1 --head 0.03 0 0.2 >/dev/null
	@touch $@

.venv/test.stamp: .venv/run.stamp
	tools/debian-packages chromium
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

# Peers of the inverse kinematics, in an environment of their own; results in bench/ik.
.PHONY: bench-ik reproduce-ik
bench-ik: .venv-bench/stamp
	cd bench/ik && export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 && \
		../../.venv-bench/bin/python compare.py && ../../.venv-bench/bin/python functions.py
	$(PYTHON) bench/ik/page.py

# The tables and the figure of docs/inverse-kinematics.md that concern the paper's claims.
reproduce-ik: .venv/run.stamp
	cd bench/ik && ../../$(BIN)/python reproduce.py
	$(PYTHON) bench/ik/page.py

.venv-bench/stamp: pyproject.toml bench/ik/requirements.txt
	$(PYTHON) -m venv .venv-bench
	.venv-bench/bin/python -m pip install --quiet --disable-pip-version-check \
		-e . -r bench/ik/requirements.txt
	@touch $@
