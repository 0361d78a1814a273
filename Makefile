# SPDX-License-Identifier: GPL-3.0-or-later
# make demo    all set-up, then the main job: out/demo
# make test    all set-up, then everything that CI checks
SHELL := /bin/bash
# The first that starts: pyenv leaves a python3.11 that ends with an error where another version is chosen.
BASE_PYTHON := $(shell for each in python3.11 python3; do $$each -c "" 2>/dev/null && { command -v $$each; break; }; done)
PYTHON := .venv/bin/python
# The tests start hundreds of processes. Where Python may keep no compiled modules, as in many containers, each of them
# compiles the product again, which doubles the time that it takes to start.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help setup lock demo test quick check style format extension real-blender clean

help:
	@sed -n 's/^# make/make/p' Makefile
	@echo "also: setup, quick (one test of each file without a renderer, under a minute), check, format, extension, real-blender, clean"

setup:
	@test -n "$(BASE_PYTHON)" || { echo "there is no python3 here; Debian 12: apt install python3 python3-venv"; exit 1; }
	@"$(BASE_PYTHON)" scripts/setup.py

lock:
	@"$(BASE_PYTHON)" scripts/lock.py

demo: setup
	$(PYTHON) -m blender_addon demo --out out/demo

style: setup
	$(PYTHON) -m ruff format --check .
	$(PYTHON) -m ruff check .

check: style
	$(PYTHON) -m mypy
	.venv/bin/lint-imports

# Types and imports are checked by tests: alone, they would leave one of two cores idle for a minute.
# CI=true: a folder of tests of which nothing could run, for want of bpy or Mitsuba, is a failure.
# Three processes: for a part of its time a test waits, or uses one core. A file stays in one process: its fixtures are
# slow.
test: style
	CI=true $(PYTHON) -m pytest -n 3 --dist loadfile --durations=15

quick: setup
	$(PYTHON) -m pytest --first

format: setup
	$(PYTHON) -m ruff format .
	$(PYTHON) -m ruff check --fix .

extension: setup
	$(PYTHON) scripts/build_extension.py

# BLENDER is any command that runs Blender when its arguments follow, such as BLENDER=/opt/blender/blender
real-blender: extension
	BLENDER="$(BLENDER)" $(PYTHON) -m pytest -m real_blender tests/real_blender

clean:
	rm -rf build dist out .mypy_cache .ruff_cache .pytest_cache .import_linter_cache
