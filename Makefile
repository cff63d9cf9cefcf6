# Everything a stranger needs: `make demo` and `make test`. Only python3 (with venv), make and the package
# registry are assumed; the C compiler comes with the packages.
VENV := .venv
PYTHON := $(VENV)/bin/python
PIP := $(PYTHON) -m pip install --quiet --disable-pip-version-check
RUN := $(VENV)/ready-to-run
DEVELOP := $(VENV)/ready-to-develop
WORKERS ?= 2
# Recordings with truth, used when they are there.
export BROAD_DIR ?= $(abspath ../shared/data/broad)
# The matrices are small: more threads than one only wait for each other.
export OPENBLAS_NUM_THREADS ?= 1

.PHONY: demo test test-all bench lint generate pictures clean help

help:
	@echo "make demo       set up, build the FMUs, run the main example"
	@echo "make test       all fast tests"
	@echo "make test-all   also the slow campaigns"
	@echo "make bench      timing, as ratios: updates (to build/bench.json), batches, Python as an FMU, responses, the closed loop"
	@echo "make lint       ruff and mypy"
	@echo "make generate   rewrite what is generated from the descriptors"
	@echo "make pictures   run the pages that draw their pictures"
	@echo "make clean      remove outputs and the virtual environment"

# What runs, and what also tests: a demonstration need not wait for the second.
$(RUN): pyproject.toml
	@echo "setting up $(VENV): this downloads packages, and is done once"
	@python3 -m venv $(VENV)
	@$(PIP) -e ".[build]"
	@touch $@

$(DEVELOP): pyproject.toml | $(RUN)
	@echo "setting up the tests in $(VENV): this downloads packages, and is done once"
	@$(PIP) --upgrade "pip>=25.1"
	@$(PIP) -e ".[build,records,campaign]" --group test --group lint
	@touch $@

demo: $(RUN)
	@$(VENV)/bin/ahrs-fmu demo

test: $(DEVELOP)
	$(PYTHON) -m pytest -q -n $(WORKERS)

test-all: $(DEVELOP)
	$(PYTHON) -m pytest -q -n $(WORKERS) -m "slow or not slow"

bench: $(DEVELOP)
	@$(PIP) -e ".[peers]"
	@missed=0; for part in bench batch python_fmu kcf frequency closed_loop campaign; do \
		PYTHONPATH=tests/fmu $(PYTHON) tests/bench/$$part.py || missed=1; \
	done; exit $$missed

lint: $(DEVELOP)
	$(PYTHON) -m ruff check python tests
	$(PYTHON) -m ruff format --check python tests
	$(PYTHON) -m mypy

generate: $(DEVELOP)
	$(PYTHON) -m ahrs_fmu.export.headers
	$(PYTHON) -m ahrs_fmu.export.classes
	$(PYTHON) -m ahrs_fmu.export.modelica

pictures: $(DEVELOP)
	$(PYTHON) docs/run_page.py docs/frequency.md
	$(PYTHON) docs/run_page.py docs/vehicle.md

clean:
	rm -rf $(VENV) $(filter-out build/README.md,$(wildcard build/*))
