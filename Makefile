# `make demo` and `make test` do all the set-up on a machine with Python 3.11 or newer and make.

VENV ?= .venv
PYTHON_IN := $(VENV)/bin/python
STAMPS := $(VENV)/stamps

# Compiled kernels are kept in the checkout, so that every process and every run finds them.
export NUMBA_CACHE_DIR ?= $(CURDIR)/.numba_cache
# Each test worker has a core: threads of the linear algebra would only wait for each other.
export OPENBLAS_NUM_THREADS ?= 1
# Two workers a core, four at most, as many tests wait for devices and pages.
WORKERS ?= $(shell cores=$$(nproc 2>/dev/null || echo 2); echo $$((cores < 2 ? 2 : 4)))
export PATH := $(abspath $(VENV)/bin):$(PATH)
# Without stored bytecode every process that a test starts compiles its imports anew.
unexport PYTHONDONTWRITEBYTECODE

# Measured data, where they lie beside the checkout.
ifeq ($(RIGWATCH_DATA),)
RIGWATCH_DATA := $(wildcard $(abspath ../shared/datasets))
endif
ifneq ($(RIGWATCH_DATA),)
export RIGWATCH_DATA
endif

RUN_LOCKS := requirements/lock.txt requirements/build.txt
VIEWER_PACKAGES := mesa-vulkan-drivers libvulkan1
BROWSER_PACKAGES := chromium chromium-driver

.DEFAULT_GOAL := help
.PHONY: help setup test sbom vulnerabilities docs demo demo-duration bench lint tests-read unit again nightly commissioned demo-headless demo-beside mutate lock viewer-packages clean

help:  ## what can be made
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 18

setup: $(STAMPS)/dev  ## only the virtual environment, in .venv

demo: demo-duration $(STAMPS)/run  ## simulated rig, monitor and live dashboard: friction appears, an alarm names it
	@rigwatch demo $(DEMO)

demo-duration:
	@[ -e $(STAMPS)/run ] || printf 'demo: %s\n' \
		'the first time it is some three minutes to the first alarm, more on a slow network:' \
		'the set-up (one to three), a model of the healthy rig (about one), and half a minute of the rig'

SYNC := $(if $(filter output-sync,$(.FEATURES)),--output-sync=target)

# Debian's packages come beside Python's: both mostly wait for the network, and say how far they are.
# The packages of the tests are installed and the tests read while the demo makes its model, whose
# kernels the tests use. The demo's rig then mostly waits, and types are checked in what the tests
# leave of the cores: both run beside them.
test:  ## everything that is checked: style, types, layers, demo, tests
	@echo 'test: about a quarter of an hour on two cores'
	@$(MAKE) --no-print-directory -j2 $(STAMPS)/run viewer-packages
	@$(MAKE) --no-print-directory -j6 $(SYNC) unit demo-beside lint sbom FIRST="commissioned tests-read"
	@if [ -e $(DEMO_FAILED) ]; then $(MAKE) --no-print-directory demo-headless; fi

lint: $(STAMPS)/dev  ## ruff, mypy --strict and the rules of which layer imports which
	@ruff check .
	@ruff format --check .
	@nice -n 15 mypy
	@lint-imports

commissioned: $(STAMPS)/run
	@rigwatch demo --commission-only

demo-headless: commissioned
	@rigwatch demo --headless

# As with the tests: what fails beside others is tried once more, alone.
DEMO_FAILED := $(STAMPS)/demo-failed
demo-beside: commissioned
	@rm -f $(DEMO_FAILED); rigwatch demo --headless || touch $(DEMO_FAILED)

# Once, so that each of the workers finds the bytecode of the tests, and kernels that several need:
# those that begin together would each compile the same.
tests-read: $(STAMPS)/dev
	@nice pytest -m kernels -p no:cacheprovider $(TESTS) >/dev/null || true

unit: $(STAMPS)/dev viewer-packages $(FIRST)
	@if [ "$${CI:-}" = true ] && [ ! -d "$${RIGWATCH_DATA:-}" ]; then \
		echo "test: RIGWATCH_DATA names no folder with the measured data sets" >&2; exit 1; fi
	@pytest -n $(WORKERS) --dist loadgroup --no-loadscope-reorder --cache-clear $(TESTS) || $(MAKE) --no-print-directory again

# Real processes, lines and browsers beside each other on a busy machine may miss a moment. What
# fails twice, the second time alone, fails; the first failure remains printed above.
again: $(STAMPS)/dev
	@python -m tools.failed_tests > .pytest_cache/failed && pytest --maxfail 5 @.pytest_cache/failed

nightly: $(STAMPS)/dev  ## the tests that take too long for every change
	@pytest -m nightly $(TESTS)

bench: $(STAMPS)/bench  ## run the benchmarks (BENCH names some) and write docs/benchmarks.md
	@python -m benchmarks --page $(BENCH)

docs: $(STAMPS)/run  ## write the pages, tables and pictures that are made by the code
	@python -m tools.docs
	@python -m tools.pictures

sbom: $(STAMPS)/dev  ## software bill of materials (CycloneDX) of what is installed, in dist/rigwatch.cdx.json
	@python -m tools.supply_chain.sbom dist/rigwatch.cdx.json

vulnerabilities: $(STAMPS)/dev  ## compare the locked packages with a copy of osv.dev's archive for PyPI (OSV names it)
	@python -m tools.supply_chain.vulnerabilities $(OSV)

mutate: $(STAMPS)/mutation  ## change the code a little and see which changes no test notices (MUTATE names some)
	@mutmut run --max-children $(WORKERS) $(MUTATE)
	@mutmut results | grep -v ': not checked' || true
	@python -m tools.mutants

lock: $(STAMPS)/dev  ## write the lock files again (UPGRADE=1 takes newer versions)
	@tools/lock.sh $(PYTHON_IN)

viewer-packages:  # what the tests of the dashboard and of the workbench's pages look with
	@tools/debian_packages.sh --wish $(VIEWER_PACKAGES) $(BROWSER_PACKAGES)

# Each environment is made anew only when its lock files or the project's metadata change.
$(STAMPS)/run: $(RUN_LOCKS) pyproject.toml tools/setup.sh
	@tools/setup.sh $(VENV) $(RUN_LOCKS)
	@mkdir -p $(STAMPS) && touch $@

$(STAMPS)/dev: requirements/dev.txt $(STAMPS)/run
	@tools/setup.sh $(VENV) requirements/dev.txt
	@mkdir -p $(STAMPS) && touch $@

BENCH_LOCKS := requirements/bench.txt requirements/bench_unresolved.txt
$(STAMPS)/mutation: requirements/mutation.txt $(STAMPS)/dev
	@tools/setup.sh $(VENV) requirements/mutation.txt
	@mkdir -p $(STAMPS) && touch $@

$(STAMPS)/bench: $(BENCH_LOCKS) $(STAMPS)/dev
	@tools/setup.sh $(VENV) $(BENCH_LOCKS)
	@mkdir -p $(STAMPS) && touch $@

clean:  ## remove the environment and all that was computed
	rm -rf $(VENV) .numba_cache .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
