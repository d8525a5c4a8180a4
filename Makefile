PYTHON ?= python3.11
BIN := .venv/bin
STAMP := .venv/.stamp
BENCH_STAMP := .venv/.bench-stamp
SOURCES := sdk core worker service benchmarks tests examples tools

# what needs no kernels; what is arithmetic alone; the rest starts workers and stacks, and waits much of its time
WITHOUT_KERNELS := tests/contract tests/sdk tests/service
ARITHMETIC := tests/core tests/performance
# one cache of compiled kernels for the tests and for the workers that they start
TEST_CACHE := $(CURDIR)/.cache/grazemap

.DEFAULT_GOAL := help
.PHONY: help run reproduce borders serve test kernels test-without-kernels test-arithmetic test-processes hardware certify bench bench-quick performance house lint types lock browser clean

help:  ## this list
	@awk -F':.*## ' '/^[a-z-]+:.*## /{printf "make %-12s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

$(STAMP): requirements.lock pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $@

run: $(STAMP)  ## the paper's grazing curve, codimension-two points and unfolding map, into out/
	$(BIN)/python examples/reproduce_default.py

reproduce: $(STAMP)  ## docs/reproduction.md: the paper's figures and numbers, and its motions, through the service (five minutes)
	$(BIN)/python -m examples.reproduce

borders: $(STAMP)  ## unfolding diagrams with every border explained, into out/ (five minutes)
	$(BIN)/python examples/unfolding_borders.py

serve: $(STAMP)  ## keep the whole stack up on this machine, until Ctrl-C
	$(BIN)/grazemap up

test: export GRAZEMAP_CACHE_DIR = $(TEST_CACHE)
test: export NUMBA_CACHE_DIR = $(TEST_CACHE)/kernels/numba
test: $(STAMP)  ## every test that needs nothing but this machine
	@echo "the kernels are compiled, a minute or two, while the first tests run"
	$(MAKE) --no-print-directory -j 2 kernels test-without-kernels
	$(MAKE) --no-print-directory -j 2 test-arithmetic test-processes

# one process here too: maps, orbits and trajectories share many of them
kernels: $(STAMP)
	@mkdir -p -m 700 $(TEST_CACHE)/kernels
	@$(BIN)/python -m grazemap_core.warmup

test-without-kernels: $(STAMP)
	$(BIN)/python -m pytest $(WITHOUT_KERNELS)

# one process: kernels for other numbers of masses are compiled on the way, and two would compile them twice
test-arithmetic: $(STAMP)
	$(BIN)/python -m pytest $(ARITHMETIC)

test-processes: $(STAMP)
	$(BIN)/python -m pytest $(foreach folder,$(WITHOUT_KERNELS) $(ARITHMETIC),--ignore=$(folder))

hardware: export GRAZEMAP_CACHE_DIR = $(TEST_CACHE)
hardware: export NUMBA_CACHE_DIR = $(TEST_CACHE)/kernels/numba
hardware: $(STAMP)  ## every kernel compiled for other processors, beside 48-digit arithmetic (eight minutes)
	$(BIN)/python -m pytest -m hardware tests/core/test_hardware.py

certify: export GRAZEMAP_CACHE_DIR = $(TEST_CACHE)
certify: export NUMBA_CACHE_DIR = $(TEST_CACHE)/kernels/numba
certify: $(STAMP)  ## a thousand certified points of maps, run once more in 50 digits (ten minutes)
	$(BIN)/python tests/certified_pixels.py 1000

# The peers go into the same environment: both locks agree on every version, so nothing that was there changes.
$(BENCH_STAMP): $(STAMP) requirements-bench.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements-bench.lock
	touch $@

bench: $(BENCH_STAMP)  ## speed beside scipy and heyoka, into out/bench.json (ten minutes)
	$(BIN)/python -m benchmarks out/bench.json

bench-quick: $(BENCH_STAMP)  ## the same in a minute, with rougher figures, into out/bench-quick.json
	$(BIN)/python -m benchmarks out/bench-quick.json --quick

performance: $(STAMP)  ## docs/performance.md and its picture, from the last out/bench.json
	cp out/bench.json docs/performance.json
	$(BIN)/python -m benchmarks.report docs/performance.json > docs/performance.md

house: $(STAMP)  ## docs/pictures/house.svg: the folders and modules, floor by floor, from the imports
	$(BIN)/python -m tools.house

lint: $(STAMP)  ## style, spelling, import contracts, compose file
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell $(SOURCES) docs *.md
	$(BIN)/lint-imports
	$(BIN)/check-jsonschema --builtin-schema vendor.compose-spec docker-compose.yml

types: $(STAMP)  ## mypy, strict
	$(BIN)/mypy

browser: $(STAMP)  ## tests of the pages in headless Chromium; installs Debian's chromium where it is missing
	@test -x /usr/bin/chromium || { echo "chromium is missing: installing the Debian package"; apt-get update -qq && apt-get install -y -qq chromium; }
	$(BIN)/python -m pytest tests/browser

COMPILE := $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header --no-annotate --no-emit-index-url
lock: $(STAMP)  ## pin every dependency again, with hashes; the image's are a part of them
	$(COMPILE) --extra dev pyproject.toml -o requirements.lock
	$(COMPILE) --extra bench --constraint requirements.lock pyproject.toml -o requirements-bench.lock
	echo hatchling | $(COMPILE) --extra server --constraint requirements.lock pyproject.toml - -o requirements-server.lock

clean:  ## remove what the other targets made
	rm -rf .venv .cache out dist
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
