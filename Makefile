# Everything runs in a local virtual environment, made on first use. Needed: Python >= 3.11 with pip.
# Another Python than python3: make PYTHON=python3.12 test

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
RUNTIME := $(VENV)/.runtime-installed
DEV := $(VENV)/.dev-installed
PIP_INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c requirements.lock

.PHONY: help sweep test test-nojit lint types bench clean

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-11s %s\n", $$1, $$2 }' Makefile

sweep: $(RUNTIME) ## the main job: sweep the snap-fit finger's designs into results/snapfit-circle
	$(BIN)/fastncm sweep sweeps/snapfit-circle.toml --out results/snapfit-circle

test: $(DEV) ## the tests
	$(BIN)/fastncm warmup
	$(BIN)/pytest

# Compiled code divides by zero in lanes that hold no design and drops the result; NumPy's scalars warn.
test-nojit: $(DEV) ## the solver without the compiler, with the coverage of the kernels
	NUMBA_DISABLE_JIT=1 $(BIN)/pytest tests/scene tests/kernels tests/sqp tests/path \
	  -m "not compiled" -W ignore::RuntimeWarning --cov

lint: $(DEV) ## style, format, and that imports point downwards
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/lint-imports

types: $(DEV) ## type hints
	$(BIN)/mypy

bench: $(DEV) ## the measurements, one file per question, and bench/REPORT.md from them
	@$(PIP_INSTALL) -e '.[bench]'
	@for file in $(filter-out bench/report.py,$(wildcard bench/*.py)) bench/report.py; do \
	  echo "== $$file"; $(BIN)/python "$$file" || exit 1; done

clean: ## remove the environment and all caches; results/ stays
	rm -rf $(VENV) build *.egg-info .coverage htmlcov
	rm -rf .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find fastncm tests bench -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "fastncm needs Python 3.11 or newer, and $(PYTHON) is not." \
	       "Name one that is, for example: make PYTHON=python3.12" >&2; exit 1; }
	@echo "Setting up $(VENV) ..."
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); exit 1; }

$(RUNTIME): pyproject.toml requirements.lock | $(BIN)/python
	@echo "Installing fastncm and what it needs ..."
	@$(PIP_INSTALL) -e .
	@touch $@

$(DEV): $(RUNTIME)
	@echo "Installing what the tests need ..."
	@$(PIP_INSTALL) -e '.[dev]'
	@touch $@
