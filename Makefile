# make demo    installs into .venv, then runs the main job; FORCE=1 runs every stage again
# make test    installs the test tools too, then checks style, types, layers, pages and behaviour
# make docs    writes the pages made from the code; make pictures draws those of the pages anew
# make site    makes the web site of all pages, in build/site
# make bench   times the engine beside UXsim and SUMO, writes docs/performance.md; QUICK=1: a few minutes
# make hashes  keeps what the shipped examples give now, where a change of the model is meant
# make lock    resolves the dependencies anew (needs uv)
#
# PYTHON names the interpreter for .venv: make PYTHON=python3.12 demo
# BENCH_PYTHON names one that has UXsim, perhaps SUMO too: make bench BENCH_PYTHON=/path/to/python

SHELL := /bin/sh
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
INSTALL := $(PIP) install --quiet --progress-bar off --no-compile

SUPPORTED := import sys; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 14))
ifndef PYTHON
PYTHON := $(shell for python in python3 python3.13 python3.12 python3.11; do \
	$$python -c '$(SUPPORTED)' 2>/dev/null && echo $$python && break; done)
endif

# a stamp carries the interpreter's name, so that another PYTHON makes another environment
CREATED := $(VENV)/.created-with-$(subst /,-,$(PYTHON))
INSTALLED := $(VENV)/.installed
INSTALLED_FOR_TEST := $(VENV)/.installed-for-test

.PHONY: help demo install test lint check-types check-layers audit unit-test docs pictures hashes site bench lock clean

help:
	@sed -n 's/^# //p' Makefile

# modules are compiled when first used, not all of them on installation, so that must be allowed
demo: $(INSTALLED)
	@env -u PYTHONDONTWRITEBYTECODE $(BIN)/uxsim-geo run configs/sioux_falls.yaml $(if $(FORCE),--force)

install: $(INSTALLED)

test: lint check-types check-layers audit site unit-test

lint: $(INSTALLED_FOR_TEST)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

check-types: $(INSTALLED_FOR_TEST)
	$(BIN)/mypy

check-layers: $(INSTALLED_FOR_TEST)
	$(BIN)/lint-imports --no-logo

# what is locked is looked up where PyPI's advisories can be asked for
audit: $(INSTALLED_FOR_TEST)
	$(BIN)/bandit --quiet --recursive -c pyproject.toml pipeline uxsim_geo docs benchmarks .ci
	$(BIN)/python .ci/advisories.py requirements.lock requirements-test.lock

unit-test: $(INSTALLED_FOR_TEST)
	$(BIN)/python -m pytest

docs: $(INSTALLED)
	$(BIN)/python docs/generate.py

pictures: $(INSTALLED)
	$(BIN)/python docs/pictures.py

hashes: $(INSTALLED_FOR_TEST)
	$(BIN)/python tests/example_hashes.py

site: $(INSTALLED_FOR_TEST)
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet -b html docs build/site

# without QUICK the page of the documentation is made anew; see build/bench for every figure
bench: $(INSTALLED)
	env $(if $(BENCH_PYTHON),BENCH_PYTHON=$(BENCH_PYTHON)) $(BIN)/python benchmarks $(if $(QUICK),--quick)
	$(if $(QUICK),,$(BIN)/python benchmarks/page.py build/bench/results.json docs/performance.md)
	$(if $(wildcard benchmarks/routes.py),$(BIN)/python benchmarks/routes.py)
	$(if $(wildcard benchmarks/memory.py),$(if $(QUICK),,$(BIN)/python benchmarks/memory.py))

lock:
	uv pip compile $(LOCK_OPTIONS) pyproject.toml --group build -o requirements.lock
	uv pip compile $(LOCK_OPTIONS) pyproject.toml --group build --extra test --extra dask --extra video --extra omx --extra docs \
		-c requirements.lock -o requirements-test.lock
	uv pip compile $(LOCK_OPTIONS) --resolution lowest-direct pyproject.toml --group build --extra test --extra dask --extra video \
		--extra omx -o requirements-minimum.lock

LOCK_OPTIONS := --quiet --universal --python-version 3.11 --generate-hashes --upgrade \
	--no-header --no-annotate --no-emit-index-url --no-emit-find-links

clean:
	rm -rf $(VENV) build dist

$(CREATED):
	@test -n "$(PYTHON)" && $(PYTHON) -c '$(SUPPORTED)' || { \
		echo "uxsim-geo needs Python 3.11, 3.12 or 3.13: make PYTHON=/path/to/python ..." >&2; \
		exit 1; }
	$(PYTHON) -m venv --clear $(VENV)
	@touch $@

$(INSTALLED): $(CREATED) requirements.lock pyproject.toml
	$(INSTALL) --require-hashes -r requirements.lock
	$(INSTALL) --no-deps --no-build-isolation --editable .
	@touch $@

$(INSTALLED_FOR_TEST): $(INSTALLED) requirements-test.lock
	$(INSTALL) --require-hashes -r requirements-test.lock
	@touch $@
