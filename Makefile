# Everything a stranger needs: `make demo` and `make test`. Only python3 (with venv), make and the package
# registry are assumed; the C compiler comes with the packages.
VENV := .venv
PYTHON := $(VENV)/bin/python
STAMP := $(VENV)/installed
WORKERS ?= 2
# Recordings with truth, used when they are there.
export BROAD_DIR ?= $(abspath ../shared/data/broad)

.PHONY: demo test test-all bench lint generate pictures clean help

help:
	@echo "make demo       set up, build the FMUs, run the main example"
	@echo "make test       all fast tests"
	@echo "make test-all   also the slow campaigns"
	@echo "make bench      timing, as ratios, to build/bench.json"
	@echo "make lint       ruff and mypy"
	@echo "make generate   rewrite what is generated from the descriptors"
	@echo "make pictures   run the tutorial, which draws its pictures"
	@echo "make clean      remove outputs and the virtual environment"

$(STAMP): pyproject.toml
	python3 -m venv $(VENV)
	$(PYTHON) -m pip install --quiet --disable-pip-version-check --upgrade "pip>=25.1"
	$(PYTHON) -m pip install --quiet --disable-pip-version-check -e ".[build,records]" --group test --group lint
	@touch $(STAMP)

demo: $(STAMP)
	$(VENV)/bin/ahrs-fmu demo

test: $(STAMP)
	$(PYTHON) -m pytest -q -n $(WORKERS)

test-all: $(STAMP)
	$(PYTHON) -m pytest -q -n $(WORKERS) -m "slow or not slow"

bench: $(STAMP)
	$(PYTHON) -m pip install --quiet --disable-pip-version-check --group peers
	$(PYTHON) tests/bench/bench.py

lint: $(STAMP)
	$(PYTHON) -m ruff check python tests
	$(PYTHON) -m ruff format --check python tests
	$(PYTHON) -m mypy

generate: $(STAMP)
	$(PYTHON) -m ahrs_fmu.export.headers
	$(PYTHON) -m ahrs_fmu.export.classes
	$(PYTHON) -m ahrs_fmu.export.modelica

pictures: $(STAMP)
	$(PYTHON) docs/run_page.py docs/frequency.md

clean:
	rm -rf $(VENV) $(filter-out build/README.md,$(wildcard build/*))
