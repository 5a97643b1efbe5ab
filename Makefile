# Each target does its own set-up; the second time it is quick.
# `make run` and `make test` are all that a new user needs.

PYTHON ?= python3
BIN := .venv/bin

.PHONY: help run test lint firmware firmware-proof clean
help:
	@echo "make run    the main job: the paper's experiment, written to out/experiment"
	@echo "make test   all tests"
	@echo "make lint   style and types"
	@echo "make firmware        the card's firmware, and the emulated card"
	@echo "make firmware-proof  the firmware's tests with the full counts (about 20 minutes)"
	@echo "make clean  remove what was built"

run: .venv/run.stamp
	$(BIN)/miburi experiment --seed 1 --seconds 30 --out out/experiment

test: .venv/test.stamp
	$(BIN)/python -m pytest -n auto

lint: .venv/test.stamp
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

# What builds the sketch without the Arduino IDE, and runs the binary in virtual time.
FIRMWARE_PACKAGES := make gcc g++ libc6-dev gcc-avr avr-libc binutils-avr arduino-core-avr \
	libsimavr-dev libelf-dev
firmware:
	tools/debian-packages $(FIRMWARE_PACKAGES)
	$(MAKE) --no-print-directory -C firmware

firmware-proof: .venv/test.stamp
	MIBURI_TRACES=100000 MIBURI_MOVES=2000,500 MIBURI_FUZZ=1000000 \
		$(BIN)/python -m pytest -n auto tests/firmware

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
	@touch $@

.venv/test.stamp: .venv/run.stamp
	tools/debian-packages $(FIRMWARE_PACKAGES)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@
