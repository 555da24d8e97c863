# `make run` and `make test` are the two main commands. Each sets up what it needs.

PYTHON := .venv/bin/python
QUICK := --quick
WORKERS := auto
MINUTES := 5
SEED := 1
COUNT := 40
DRAWING := tests/gpu tests/picture tests/splatting tests/visibility tests/projection tests/backends tests/drawing tests/numerics
COMMIT = $(shell git rev-parse HEAD)

.DEFAULT_GOAL := help
.PHONY: help setup run test test-all test-tenth test-drivers mutate fuzz bench lint docs wheel clean

help: ## print this list
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' $(MAKEFILE_LIST) | expand -t 22

setup: ## install system libraries and .venv; does nothing if they are there
	@tools/setup.sh

run: setup ## open the demo scan, or yours: make run SCAN=path (without a display: write to out/)
	.venv/bin/scan4d view $(if $(SCAN),"$(SCAN)") --fallback out --force

# Most shaders run only a few times here, so Mesa's software driver compiles them without optimising; test-all
# optimises. Processes that tests start reuse compiled modules, whatever the environment says.
# Each core has its tests already: further threads of matrix products would only wait for it.
test: export GALLIVM_PERF := nopt
test: export PYTHONDONTWRITEBYTECODE :=
test: export OPENBLAS_NUM_THREADS := 1
test: setup ## run the quick tests on all cores; WORKERS=0 uses one process
	$(PYTHON) -m pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder -m "not slow"

test-all: setup ## run all tests
	$(PYTHON) -m pytest -n $(WORKERS) --dist loadfile

test-tenth: setup ## run a tenth of the slow tests, chosen by the commit, in five minutes
	$(PYTHON) -m pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder -m slow --tenth $(COMMIT) --seconds 300

test-drivers: setup ## run backend tests on a second driver (Zink), on used memory and as on a graphics card; check shaders
	$(PYTHON) tests/drivers/zink.py $(DRAWING) -m "not slow"
	PYTHONPATH=tests/drivers $(PYTHON) -m pytest -p poisoned $(DRAWING) -m "not slow"
	PYTHONPATH=tests/drivers $(PYTHON) -m pytest -p as_card $(DRAWING) -m "not slow"

mutate: setup ## test the tests: do they find small random mistakes? make mutate COUNT=40 SEED=7
	$(PYTHON) tools/mutate.py $(COUNT) $(SEED)

fuzz: setup ## read thousands of damaged files: make fuzz MINUTES=60 SEED=7
	$(PYTHON) tests/fuzz/campaign.py --minutes $(MINUTES) --seed $(SEED)

bench: setup ## measure run time and error: out/bench/report.html in about three minutes; in full: make bench QUICK=
	.venv/bin/scan4d bench $(QUICK) -o out/bench --force

lint: setup ## ruff and mypy
	$(PYTHON) -m ruff check .
	$(PYTHON) -m ruff format --check .
	$(PYTHON) -m mypy

docs: setup ## build the documentation site, readable offline: out/docs/index.html
	NO_MKDOCS_2_WARNING=1 $(PYTHON) -m mkdocs build --strict --site-dir out/docs

wheel: setup ## build the wheel into dist/
	$(PYTHON) -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .

clean: ## remove everything that make made, except out/
	rm -rf .venv dist .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find viewer tests -name __pycache__ -prune -exec rm -rf {} +
