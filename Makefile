VERSIONS = $(shell sed -n 's/.*"Programming Language :: Python :: \(3\..*\)".*/\1/p' pyproject.toml)
# the newest that runs and can make an environment: those that pyenv only stands in for do not
PYTHON ?= $(or $(shell for python in $$(printf 'python%s\n' $(VERSIONS) | sort -rV); do \
	$$python -c 'import ensurepip, venv' >/dev/null 2>&1 && echo $$python && break; done),$(error no Python of \
	$(VERSIONS) runs here: install one, with its module venv, or name it, as in make PYTHON=/path/to/python))
BIN := .venv/bin
# what a stack, its client and pictures need; what tests need; the tools for style, types and pages in a browser; what
# the benchmarks compare with
RUN_STAMP := .venv/.run-stamp
STAMP := .venv/.stamp
TOOLS_STAMP := .venv/.tools-stamp
BENCH_STAMP := .venv/.bench-stamp
SOURCES := sdk core worker service benchmarks tests examples paper tools

# NARROW=1, with any target: no wider vectors than those of x86-64-v3 in numba, numpy and BLAS together
ifdef NARROW
$(foreach setting,$(shell $(PYTHON) tests/support/narrow.py),$(eval export $(setting)))
endif

# three groups of tests run side by side: those without kernels, which begin while these are compiled, and then those of
# stacks; those of arithmetic alone, which leave the processor to all others; those of workers, which often wait
# these compile a few kernels into folders of their own
OWN_KERNELS := tests/unit/core/test_kernel_folder.py tests/unit/core/test_without_parts.py
WITHOUT_KERNELS := tests/unit/contract tests/unit/sdk tests/system/service $(OWN_KERNELS)
ARITHMETIC := tests/unit/core tests/unit/benchmarks
STACKS := tests/system/chaos
# one cache of compiled kernels, for the tests and the workers that they start. In recipes paths are relative, whatever
# the name of this folder is; in variables of the environment they are not, for processes in other folders.
TEST_CACHE := .cache/grazemap
WITH_KERNELS := test test-portable digests digests-all thorough general hardware verify beside-borders chaotic-transients \
	long-transients one-period resolve memory chaos executors fairness unfair first-window load small-questions estimates planes \
	proofs mutants browser languages resonance tolerance-sizes two-motions
$(WITH_KERNELS): export GRAZEMAP_CACHE_DIR = $(CURDIR)/$(TEST_CACHE)
$(WITH_KERNELS): export NUMBA_CACHE_DIR = $(CURDIR)/$(TEST_CACHE)/kernels/numba
$(WITH_KERNELS) kernels-of-lanes other-kernels: | $(TEST_CACHE)/kernels
$(TEST_CACHE)/kernels:
	@mkdir -p -m 700 $@

.DEFAULT_GOAL := help
.PHONY: $(shell awk -F: '/^[a-z-]+:/{print $$1}' $(firstword $(MAKEFILE_LIST)))

help:  #: list the targets that users need
	@awk -F':.*## ' '/^[a-z-]+:.*## /{printf "make %-12s %s\n", $$1, $$2}' $(MAKEFILE_LIST)
	@echo "make targets      all others, for contributors"

targets:  #: list all targets
	@awk -F':.*#[\#:] ' '/^[a-z-]+:.*#[\#:] /{printf "make %-16s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

# Modules are compiled when they are first imported: most never are. Where the environment forbids storing them, every
# process would compile them again, which takes seconds.
export PYTHONDONTWRITEBYTECODE :=
# what is measured and tested runs on stacks of its own
export GRAZEMAP_LOCAL := own
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
# $(call timed,what is done,command): says what is done, then how long it took
timed = @echo "$(1) ..."; began=$$(date +%s); $(2) && echo "... took $$(($$(date +%s) - $$began)) s"
# the packages that are installed
PACKAGES = $$(ls -d .venv/lib/python*/site-packages/*.dist-info | wc -l) packages

# $(call install,heading): installs the parts of the lock before the one with this heading
install = sed '/^\# $(1)$$/,$$d' requirements.lock | $(INSTALL) --require-hashes -r /dev/stdin

$(RUN_STAMP): requirements.lock pyproject.toml
	$(call timed,installing what runs (about half a minute),$(PYTHON) -m venv .venv && \
		$(call install,what tests need) && $(INSTALL) --no-deps --no-build-isolation -e . && echo "$(PACKAGES)")
	@touch $@

$(STAMP): $(RUN_STAMP)
	$(call timed,installing what tests (about half a minute),$(call install,what style and pages need) && echo "$(PACKAGES)")
	@touch $@

$(TOOLS_STAMP): $(STAMP)
	$(call timed,installing what checks the style,$(call install,what benchmarks need) && echo "$(PACKAGES)")
	@touch $@

run: $(RUN_STAMP)  ## compute the paper's grazing curve, codimension-two points and unfolding map, into out/
	$(BIN)/python -m paper.first

reproduce: $(RUN_STAMP)  #: compute the paper's figures, numbers and motions again, into docs/reproduction.md (five minutes)
	$(BIN)/python -m paper

published: $(RUN_STAMP)  #: compute published numbers of other oscillators again, into docs/published.md (three minutes)
	$(BIN)/python -m paper.published

resonance: $(STAMP)  #: the impacts of fifty undamped chains at resonance and beside it, in 60 digits (ten minutes)
	$(BIN)/python -m tests.slow.resonance 50

borders: $(RUN_STAMP)  #: compute unfolding diagrams with every border explained, into out/ (three minutes)
	$(BIN)/python examples/unfolding_borders.py

pictures: $(STAMP)  ## make the gallery of the guide, docs/gallery.md, with its pictures (some minutes)
	$(BIN)/python examples/pictures.py

# made anew where a page or a picture is newer
GUIDE := service/grazemap_service/guide/index.html
$(GUIDE): $(RUN_STAMP) $(shell find docs -type f)
	@echo "building the guide ..."
	@$(BIN)/python -m sphinx -q -W --keep-going -d .cache/guide docs $(@D)
	@touch $@

guide: $(GUIDE)  ## build the guide, for any web server, into service/grazemap_service/guide/; `make serve` shows it at /guide

serve: $(RUN_STAMP) $(GUIDE)  ## run the whole stack on this machine until Ctrl-C, with the jobs of make run
	$(BIN)/grazemap up $(if $(wildcard out/data),--data out/data)

# The instructions of x86-64-v3, as the recorded digests have them: one set of kernels serves these and all other tests.
# threads of small products wait for one another where others compute too
test: export OPENBLAS_NUM_THREADS = 1
test: $(RUN_STAMP)  ## every test that needs only this machine
	$(call timed,testing (about ten minutes),$(MAKE) --no-print-directory -j 3 $(if $(NATIVE),,NARROW=1) \
		test-processes test-without-kernels test-arithmetic test-stacks)
	@$(BIN)/python -m tools.all_checks --age

test-native:  #: `make test` with all instructions of this processor (ten minutes)
	@$(MAKE) --no-print-directory test NATIVE=1

test-portable: export GRAZEMAP_SYSTEM = portable
test-portable: kernels $(STAMP)  #: the tests of stacks and of the client without what only Linux offers (five minutes)
	$(BIN)/python -m pytest -n 2 tests/system/service tests/system/worker tests/system/chaos tests/system/integration tests/unit/sdk

all-checks: $(TOOLS_STAMP)  #: every long check, recorded in tests/slow/checks.md (eight hours)
	$(BIN)/python -m tools.all_checks

# two processes: the kernels of lanes take as long as all others, with which they share few parts; those of observables of
# maps come last, as they need both
kernels: kernels-of-lanes other-kernels

kernels-of-lanes: COMPONENTS := lockstep apart
other-kernels: COMPONENTS := curves trajectories classification orbits observables map_observables
kernels-of-lanes other-kernels: $(RUN_STAMP)
	$(call timed,compiling the $(subst -, ,$@) (a minute or two unless they are cached),$(BIN)/python -m grazemap_core.warmup \
		$(COMPONENTS))

# ON_TWO_CORES: a file of tests at a time on each of two cores
PYTEST := $(BIN)/python -m pytest
ON_TWO_CORES := $(PYTEST) -n 2 --dist loadfile

test-without-kernels: $(STAMP)
	$(PYTEST) $(WITHOUT_KERNELS)

test-arithmetic: kernels $(STAMP)
	nice -n 19 $(ON_TWO_CORES) $(ARITHMETIC) $(OWN_KERNELS:%=--ignore=%)

test-processes: kernels $(STAMP)
	$(PYTEST) $(foreach folder,$(WITHOUT_KERNELS) $(ARITHMETIC) $(STACKS) tests/system/browser,--ignore=$(folder))

test-stacks: kernels test-without-kernels
	$(PYTEST) $(STACKS)

# the unit tests run on each further Python that runs, without kernels
ci: lint types test  ## what continuous integration runs: style, types, every test, the unit tests on other Pythons
	@$(BIN)/python -m tools.other_pythons

digests digests-all: export OPENBLAS_NUM_THREADS = 1
digests: $(STAMP)  #: say which results changed, and by how much, and record their digests (ten minutes; kernels stored: one)
	$(BIN)/python -m tests.support.digests

digests-all: $(STAMP)  #: compare all results with their digests, and labels with this processor's own (twenty minutes; two)
	$(BIN)/python -m tests.support.digests --check

# What a user's pip installs: the wheel, not these sources, with the newest versions that pyproject.toml admits.
NEWEST := .cache/newest
define OF_THE_WHEEL
import sys, grazemap, grazemap_core, grazemap_service, grazemap_worker, rq
for module in (grazemap, grazemap_core, grazemap_service, grazemap_worker, rq):
    if not module.__file__.startswith(sys.prefix):
        sys.exit(f"not of the wheel's environment: {module.__file__}")
endef
test-newest: export OF_THE_WHEEL := $(OF_THE_WHEEL)
test-newest: export GRAZEMAP_CACHE_DIR = $(CURDIR)/$(NEWEST)/cache
test-newest: export NUMBA_CACHE_DIR = $(CURDIR)/$(NEWEST)/cache/kernels/numba
test-newest: export PYTHONPATH =
test-newest: $(STAMP)  #: the wheel with the newest dependencies, in an environment of its own: service, worker, chaos, SDK
	rm -rf $(NEWEST)
	mkdir -p -m 700 $(NEWEST)/cache/kernels
	$(BIN)/python -m hatchling build -t wheel -d $(NEWEST)/dist
	$(PYTHON) -m venv $(NEWEST)/venv
	$(NEWEST)/venv/bin/python -m pip install --quiet --disable-pip-version-check "$$(ls $(NEWEST)/dist/*.whl)[test]"
	$(NEWEST)/venv/bin/python -m pip list --disable-pip-version-check
	$(NEWEST)/venv/bin/python -c "$$OF_THE_WHEEL"
	$(NEWEST)/venv/bin/python -m grazemap_core.warmup
	$(NEWEST)/venv/bin/python -m pytest -m "not hardware" tests/system/service tests/system/worker tests/system/chaos tests/unit/sdk \
		tests/system/integration/test_notebook.py

first-start: $(STAMP)  #: what `grazemap up` says on a first start: every Python, an idle and a busy machine (ten minutes)
	$(BIN)/python -m tools.first_start

latency: $(STAMP)  #: the time of small requests to a service that is started by itself, and to `grazemap up`
	$(BIN)/python -m tools.latency

thorough: kernels $(STAMP)  #: tests that take long, of whose kind `make test` has quicker ones (twenty minutes)
	$(ON_TWO_CORES) -m thorough tests/unit
	$(PYTEST) -m thorough tests/system --ignore=tests/system/browser

slips: $(STAMP)  #: slips of units and right requests at random: which have a note that names the remedy (a minute)
	$(BIN)/python -m tests.slow.slips

general: $(STAMP)  #: systems of any structure and stops against many digits; SHARE=0.05 takes a part (half an hour)
	$(BIN)/python -m tests.slow.general_checks

hardware: $(STAMP)  #: compile every kernel for other processors and compare with 48-digit arithmetic (eight minutes)
	$(BIN)/python -m pytest -m hardware tests/unit/core/test_hardware.py

verify: $(STAMP)  #: a thousand verified points of maps, simulated again in 50 digits (ten minutes)
	$(BIN)/python -m tests.slow.verified_points 1000

beside-borders: $(STAMP)  #: verified points beside borders of maps, run on for 6000 periods and in 50 digits (ten minutes)
	$(BIN)/python -m tests.slow.beside_borders 300 400

chaotic-transients: $(STAMP)  #: chances to settle and exponents of 300 chaotic points, run on for 20,000 periods (five minutes)
	$(BIN)/python -m tests.slow.chaotic_transients 300

long-transients: $(STAMP)  #: how many of 500 long transients that double precision follows are called sensitive (ten minutes)
	$(BIN)/python -m tests.slow.long_transients 500

one-period: kernels $(STAMP)  #: ten machines as harmonic p at omega and harmonic 1 at p omega, every process (ten minutes)
	$(BIN)/python -m tests.slow.one_period

two-motions: kernels $(STAMP)  #: how often results from rest tell of another stable motion, and at what cost (fifteen minutes)
	$(BIN)/python -m tests.slow.two_motions

tolerance-sizes: $(STAMP)  #: sizes in tolerances modules that no bound gives, measured on fifty random systems (ten minutes)
	$(BIN)/python -m tests.slow.tolerance_sizes 50

resolve: $(STAMP)  #: 200 points after long transients, resolved and run once more exactly (an hour)
	$(BIN)/python -m tests.slow.resolved_points 200

memory: $(STAMP)  #: the peak memory of requests at every limit, each for two minutes at most (half an hour)
	$(BIN)/python -m tests.slow.limits_of_memory

small-machine: $(STAMP)  #: a first start and every example in a control group of 4 GiB, as root (three minutes)
	$(BIN)/python -m tests.slow.small_machine

# another program's environment, as it needs other versions
SCHEMATHESIS := .cache/schemathesis
schemathesis: $(STAMP)  #: a thousand requests from the API's document to each operation, and sequences of them (an hour)
	$(PYTHON) -m venv $(SCHEMATHESIS)
	$(SCHEMATHESIS)/bin/python -m pip install --quiet --disable-pip-version-check "schemathesis>=4.32,<5"
	$(BIN)/python -m tests.slow.described_requests $(SCHEMATHESIS)/bin/schemathesis 1000

storage: $(STAMP)  #: append-only files with a hundred damaged tails, and a full disk and memory of Redis (two minutes)
	$(BIN)/python -m pytest -m "" tests/system/service/test_storage.py tests/system/service/test_http_storage_full.py

chaos: kernels $(STAMP)  #: 110 signals at random to the processes of a stack, for each of 5 seeds (an hour)
	$(BIN)/python -m tests.slow.signals_at_random

executors: kernels $(STAMP)  #: results by a service, pools, Dask, MPI and an array of tasks: the same bytes (ten minutes)
	$(INSTALL) distributed mpi4py openmpi
	$(BIN)/python -m tests.slow.executors

fairness: kernels $(STAMP)  #: 51 large maps beside another client's, 10,500 small jobs, short maps beside long tiles (ten minutes)
	$(BIN)/python -m tests.slow.fairness

unfair: kernels $(STAMP)  #: small questions and maps beside dense zeros and long trajectories of another client (five minutes)
	$(BIN)/python -m tests.slow.unfair_askers

first-window: kernels chromium $(TOOLS_STAMP)  #: the explorer's first window: previews, and verified, on two cores (three minutes)
	$(BIN)/python -m tests.slow.first_window

load: kernels $(STAMP)  #: 500 event streams, and twice a thousand clients for a minute (ten minutes)
	$(BIN)/python -m tests.slow.load

small-questions: kernels $(STAMP)  #: the time from a small question to its answer, alone and beside two large maps (three minutes)
	$(BIN)/python -m tools.small_questions

cold-start: $(STAMP)  #: from the first start to the first curve, trajectory and map, by steps (fifteen minutes)
	$(BIN)/python -m tools.cold_start

kernels-wheel: $(RUN_STAMP)  #: into dist/ the wheel, and that of the kernels, compiled ahead of time for x86-64-v3 (three minutes)
	$(BIN)/python -m hatchling build -t wheel -d dist
	$(BIN)/python tools/kernels_wheel.py dist

release-check: $(TOOLS_STAMP) $(GUIDE)  #: build what is published, into dist/, and check it: metadata, contents, versions (a minute)
	$(BIN)/python -m tools.release_check $(if $(TAG),--tag $(TAG))

estimates: $(STAMP)  #: the processor time of random requests of every process, over its estimate (ten minutes)
	$(BIN)/python -m benchmarks.estimates

planes: kernels $(STAMP)  #: the processor time of maps over other parameters, beside that over omega and clearance (ten minutes)
	$(BIN)/python -m benchmarks.planes

large-models: $(STAMP)  #: maps of 40 dense degrees of freedom and of a chain of 64, beside their estimates (ten minutes)
	$(BIN)/python -m benchmarks.large_models

$(BENCH_STAMP): $(TOOLS_STAMP)
	$(call timed,installing what the speed is compared with,$(INSTALL) --require-hashes -r requirements.lock)
	@touch $@

proofs: $(STAMP)  #: prove orbits, attractions, bifurcations and codimension-two points, and refuse false certificates (half an hour)
	$(BIN)/python -m tests.slow.proven_statements
	$(BIN)/python -m tests.slow.proven_points

mutants: $(STAMP)  #: change certificates at random, and judge in 100 digits what the checker accepts (hours)
	$(BIN)/python -W ignore -m tests.slow.mutated_certificates $(MUTANTS)

bench: $(BENCH_STAMP)  #: compare the speed with scipy and heyoka, into out/bench.json (ten minutes)
	$(BIN)/python -m benchmarks out/bench.json

bench-quick: $(BENCH_STAMP)  #: the same in two minutes with less precise figures, into out/bench-quick.json
	$(BIN)/python -m benchmarks out/bench-quick.json --quick

performance: $(STAMP)  #: write docs/performance.md and its picture from the last out/bench.json
	cp out/bench.json docs/performance.json
	$(BIN)/python -m benchmarks.report docs/performance.json > docs/performance.md

tables: $(STAMP)  #: write the tables and signatures of the guide, and the stubs of the client, from the code
	$(BIN)/python -m tools.guide.tables
	$(BIN)/python tools/generate_stubs.py

pages: $(STAMP)  #: run the examples of the guide, and write what they print and draw (some minutes)
	$(BIN)/python -m tools.guide.drawings
	$(BIN)/python -m tools.guide.pages

check-pages: $(STAMP)  #: compare what the examples of the guide print with what it shows (some minutes)
	$(BIN)/python -m tools.guide.pages --check

house: $(STAMP)  #: draw docs/pictures/house.svg, the folders and modules, from the imports
	$(BIN)/python -m tools.house

ISSUE_FORMS := $(filter-out %/config.yml,$(wildcard .github/ISSUE_TEMPLATE/*.yml))
lint: $(TOOLS_STAMP)  #: check style, spelling, import contracts, import circles, and files for compose, GitHub and citations
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell $(SOURCES) docs joss conda .github *.md
	$(BIN)/lint-imports
	$(BIN)/python -m tests.support.import_circles
	$(BIN)/check-jsonschema --builtin-schema vendor.compose-spec docker-compose.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff
	$(BIN)/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.github-issue-forms $(ISSUE_FORMS)
	$(BIN)/check-jsonschema --builtin-schema vendor.github-issue-config .github/ISSUE_TEMPLATE/config.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.dependabot .github/dependabot.yml

types: $(TOOLS_STAMP)  #: check types with mypy, strict
	$(BIN)/mypy

# the page has no build step: node only checks its sources
PAGE := service/grazemap_service/static
PAGE_TOOLS := .cache/page
IN_PAGE_TOOLS := $(PAGE_TOOLS)/node_modules/.bin
lint-page:  #: check the style and the types of the page's sources, with node and npm's packages (half a minute)
	@mkdir -p $(PAGE_TOOLS)
	cp tools/page/package.json tools/page/eslint.config.js $(PAGE_TOOLS)
	cd $(PAGE_TOOLS) && npm install --no-audit --no-fund --silent
	$(IN_PAGE_TOOLS)/eslint --config $(PAGE_TOOLS)/eslint.config.js --max-warnings 0 $(PAGE)
	$(IN_PAGE_TOOLS)/prettier --print-width 120 --log-level warn --check '$(PAGE)/**/*.{js,css}'
	$(IN_PAGE_TOOLS)/tsc --project tools/page/tsconfig.json

chromium:
	@test -x /usr/bin/chromium || { echo "chromium is missing: installing the Debian package"; apt-get update -qq && apt-get install -y -qq chromium; }

# what a machine does not have, and Debian and npm do; Julia and MATLAB are taken where they are
TYPESCRIPT := .cache/typescript
languages: kernels chromium $(TOOLS_STAMP)  #: the examples in other languages; installs R, Octave and npm's packages (three minutes)
	@which Rscript octave curl node gs gnuplot >/dev/null || { apt-get update -qq && apt-get install -y -qq --no-install-recommends \
		r-base-core r-cran-httr2 r-cran-jsonlite octave curl gnuplot-nox ghostscript fonts-freefont-otf nodejs npm; }
	mkdir -p $(TYPESCRIPT)
	cp examples/languages/typescript/* $(TYPESCRIPT)
	cd $(TYPESCRIPT) && npm install --no-audit --no-fund
	$(BIN)/python -m pytest tests/system/integration/test_languages.py tests/system/browser/test_page_of_another_host.py

browser: kernels chromium $(TOOLS_STAMP) $(GUIDE)  #: test the pages in headless Chromium; installs Debian's chromium if it is missing
	$(BIN)/python -m pytest tests/system/browser

lock: $(TOOLS_STAMP)  #: pin the newest version of every dependency, with hashes
	$(BIN)/python -m tools.lock

clean:  #: remove what the other targets have made
	rm -rf .venv .cache out dist
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
