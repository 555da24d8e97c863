# Two commands: `make run` and `make test`. Each sets up all that it needs by itself.

PYTHON := .venv/bin/python
QUICK := --quick
WORKERS := auto
MINUTES := 5
SEED := 1
COUNT := 40
COMMIT = $(shell git rev-parse HEAD)

.DEFAULT_GOAL := help
.PHONY: help setup run test test-all test-tenth test-drivers mutate fuzz bench lint docs wheel clean

help: ## print this list
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' $(MAKEFILE_LIST) | expand -t 22

setup: ## system libraries, and .venv with all dependencies; what is there is left alone
	@tools/setup.sh

run: setup ## open the demo scan, or yours: make run SCAN=path (without a display: into out/)
	.venv/bin/scan4d view $(if $(SCAN),"$(SCAN)") --fallback out --force

# Most shaders run a few times here: Mesa's software driver compiles them in less time without optimising, and
# test-all has it optimise. Processes that tests start find modules compiled, whatever the environment says.
# Each core has its tests already: further threads of matrix products would only wait for it.
test: export GALLIVM_PERF := nopt
test: export PYTHONDONTWRITEBYTECODE :=
test: export OPENBLAS_NUM_THREADS := 1
test: setup ## the tests, without the slow ones; a process for each core: make test WORKERS=0 has but one
	$(PYTHON) -m pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder -m "not slow"

test-all: setup ## all tests
	$(PYTHON) -m pytest -n $(WORKERS) --dist loadfile

test-tenth: setup ## a tenth of the slow tests, as the commit chooses, in five minutes
	$(PYTHON) -m pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder -m slow --tenth $(COMMIT) --seconds 300

test-drivers: setup ## backends and numerics on a second driver (Zink), shaders through glslangValidator; on used memory
	$(PYTHON) tests/drivers/zink.py tests/gpu tests/backends tests/numerics -m "not slow"
	PYTHONPATH=tests/drivers $(PYTHON) -m pytest -p poisoned tests/gpu tests/backends tests/numerics -m "not slow"

mutate: setup ## small mistakes in the code by chance: do the quick tests find them? make mutate COUNT=40 SEED=7
	$(PYTHON) tools/mutate.py $(COUNT) $(SEED)

fuzz: setup ## damaged files by the thousand: make fuzz MINUTES=60 SEED=7
	$(PYTHON) tests/fuzz/campaign.py --minutes $(MINUTES) --seed $(SEED)

bench: setup ## run time against error, in two minutes: out/bench/report.html; all of it: make bench QUICK=
	.venv/bin/scan4d bench $(QUICK) -o out/bench --force

lint: setup ## ruff and mypy
	$(PYTHON) -m ruff check .
	$(PYTHON) -m ruff format --check .
	$(PYTHON) -m mypy

docs: setup ## the documentation as a site that needs no network: out/docs/index.html
	NO_MKDOCS_2_WARNING=1 $(PYTHON) -m mkdocs build --strict --site-dir out/docs

wheel: setup ## build the wheel into dist/
	$(PYTHON) -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir dist .

clean: ## remove what make has made, except your pictures in out/
	rm -rf .venv dist .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find viewer tests -name __pycache__ -prune -exec rm -rf {} +
