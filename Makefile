# make reproduce   both experiments of the paper, from nothing but Python 3.11-3.14 and make
# make test        everything that CI runs
# make help        the other targets
#
# Another interpreter: make PYTHON=python3.12 reproduce

PYTHON ?= python3
UV     ?= uv
VENV   := .venv
BIN    := $(VENV)/bin
SITE   := docs/_build/html

# Who may install Debian's packages.
ROOT   := $(if $(filter-out 0,$(shell id -u)),sudo)

# Wheels only: a machine without a C compiler must never meet a source build.
PIP    := $(BIN)/python -m pip --disable-pip-version-check --no-input
LOCKED := --require-hashes --only-binary :all: --quiet --progress-bar off
LOCK   := $(UV) pip compile --quiet --universal --python-version 3.11 --fork-strategy fewest \
          --generate-hashes --no-header --no-annotate --no-emit-index-url \
          pyproject.toml requirements/build.in

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help reproduce results bench soak test lint types imports docs tests slow browser \
        format install lock clean

help: ## this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / {printf "  make %-10s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

reproduce: $(VENV)/runtime.stamp ## both experiments, every claim, the figures
	$(BIN)/alight reproduce

results: $(VENV)/runtime.stamp ## renew what the documentation shows
	$(BIN)/python docs/make_results.py

bench: $(VENV)/bench.stamp ## Alight against its peers, in ratios measured here; renews the docs
	$(BIN)/alight bench --out docs/results

soak: $(VENV)/test.stamp browser ## the live bench under load for a quarter of an hour; renews the docs
	$(BIN)/python -m tests.live.soak --out docs/results/soak.md
	$(BIN)/alight bench --only live --out docs/results/live
	$(BIN)/python -m tests.live.siege --out docs/results/siege.md
	$(BIN)/python -m tests.live.journey docs/images/live.png

test: lint types imports docs tests slow ## everything that CI runs

lint: $(VENV)/test.stamp ## style and formatting
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/test.stamp ## static types of src
	$(BIN)/mypy

imports: $(VENV)/test.stamp ## which folder may import which
	$(BIN)/lint-imports --no-logo

docs: $(VENV)/test.stamp ## the site, warnings as errors, no network
	$(BIN)/sphinx-build --fresh-env -W --keep-going -q docs $(SITE)
	@echo "$(SITE)/index.html"

tests: $(VENV)/test.stamp browser ## the test suite
	$(BIN)/pytest -n 2

slow: $(VENV)/test.stamp browser ## the tests marked slow: a quarter of an hour more
	$(BIN)/pytest -n 2 -m slow

browser: ## Chromium, which the tests of the live page drive; on Debian it is installed here
	@command -v chromium >/dev/null || { $(ROOT) apt-get update -qq && \
	    DEBIAN_FRONTEND=noninteractive $(ROOT) apt-get install -y -qq --no-install-recommends \
	    $$(cat requirements/debian.txt) >/dev/null; }

format: $(VENV)/test.stamp ## rewrite the code in the agreed format
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

install: $(VENV)/test.stamp ## the environment of `make test`, and nothing more

# The stamps make a second call free: they are older than their lock only after a change of it.
$(VENV)/%.stamp: requirements/%.txt pyproject.toml | $(BIN)/python
	@echo "== installing $< into $(VENV): a minute or two, without output"
	@$(PIP) install $(LOCKED) -r $<
	@$(PIP) install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

$(BIN)/python:
	@$(PYTHON) -c 'import sys; (3, 11) <= sys.version_info < (3, 15) or sys.exit( \
	    "the locked wheels are for Python 3.11 to 3.14; this is %d.%d. " \
	    "Name another: make PYTHON=python3.13 ..." % sys.version_info[:2])'
	$(PYTHON) -m venv $(VENV)

lock: ## renew requirements/*.txt from pyproject.toml (needs uv; UPGRADE=--upgrade)
	$(LOCK) $(UPGRADE) --extra identify --extra live --extra drives \
	    --output-file requirements/runtime.txt
	$(LOCK) $(UPGRADE) --extra test --constraint requirements/runtime.txt \
	    --output-file requirements/test.txt
	$(LOCK) $(UPGRADE) --extra bench --constraint requirements/test.txt \
	    --override requirements/override.in --output-file requirements/bench.txt

clean: ## remove what the targets above made, the environment included
	rm -rf $(VENV) docs/_build docs/generated .mypy_cache .ruff_cache .pytest_cache \
	    .hypothesis .import_linter_cache
