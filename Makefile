# make demo    installs into .venv, then runs the main job; FORCE=1 runs every stage again
# make test    installs the test tools too, then checks style, types, layers, pages and behaviour
# make docs    writes the pages made from the code; make pictures draws those of the pages anew
# make site    makes the web site of all pages, in build/site
# make bench   times the engine beside UXsim and SUMO, writes docs/performance.md; QUICK=1: a few minutes
# make check-package, check-minimum, check-pythons
#              wheel and sdist; the tests of SOME with the oldest libraries allowed; and with every
#              other supported Python that is found
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

#: of unit-test; with --numprocesses=2 --dist=loadfile it takes two cores
PYTEST_OPTIONS :=

RUNTIME_LOCK := requirements.lock
TEST_LOCK := requirements-test.lock

VERSIONS := 3.11 3.12 3.13
OWN_VERSION = $(shell $(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])')

# what tells one library, or one Python, from another: installation, hashes, readers, writers, pictures, theory
SOME := $(addprefix tests/test_,$(addsuffix .py,packaging repeatability cli_commands library theory_links \
	gmns_round_trip network_files osm_formats osm_shapes demand_omx demand_od_files demand_trip_list \
	export_geopackage export_plots export_space_time export_documents page_content study_dask world_listings))

# a stamp carries the interpreter's name, so that another PYTHON makes another environment
CREATED := $(VENV)/.created-with-$(subst /,-,$(PYTHON))
INSTALLED := $(VENV)/.installed
INSTALLED_FOR_TEST := $(VENV)/.installed-for-test

.PHONY: help demo install test lint check-types check-layers audit unit-test check-package check-some check-minimum check-pythons docs pictures hashes site bench lock clean

help:
	@sed -n '/^$$/q; s/^# //p' Makefile

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
	$(BIN)/python -m pytest $(PYTEST_OPTIONS)

check-package: $(INSTALLED_FOR_TEST)
	$(BIN)/python -m pytest tests/test_packaging.py tests/test_examples.py

check-some: $(INSTALLED_FOR_TEST)
	$(BIN)/python -m pytest $(SOME) -k "not checked_by_the_types"

# old libraries warn of one another
check-minimum:
	UXSIM_GEO_WARNINGS=default $(MAKE) VENV=$(VENV)-minimum RUNTIME_LOCK=requirements-minimum.lock TEST_LOCK=requirements-minimum.lock check-some

check-pythons: $(addprefix check-python-,$(filter-out $(OWN_VERSION),$(VERSIONS)))

# by its name, or where pyenv keeps it
check-python-%:
	@for python in python$* "$$HOME"/.pyenv/versions/$*.*/bin/python; do \
		if "$$python" -c 'import sys; sys.exit("%d.%d" % sys.version_info[:2] != "$*")' 2>/dev/null; then \
			exec $(MAKE) VENV=$(VENV)-$* PYTHON="$$python" check-some; \
		fi; \
	done; echo "Python $* is not here: not tried"

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

$(INSTALLED): $(CREATED) $(RUNTIME_LOCK) pyproject.toml
	$(INSTALL) --require-hashes -r $(RUNTIME_LOCK)
	$(INSTALL) --no-deps --no-build-isolation --editable .
	@touch $@

$(INSTALLED_FOR_TEST): $(INSTALLED) $(TEST_LOCK)
	$(INSTALL) --require-hashes -r $(TEST_LOCK)
	@touch $@
