# Every target sets up what it needs: a fresh machine needs python3 (3.11+, with venv and pip), make and git.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
COMPILED := $(VENV)/.compiled

# The tests start hundreds of processes: each would read all of visup's source anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: setup demo test check fuzz oracles bench docs wheel built-wheel clean

setup: $(COMPILED)

# The plain way of an editable install (a path, no import hook) is what type checkers and editors can follow.
# Python keeps the bytecode of what is imported; pip would make that of all modules, which takes a minute.
$(STAMP): pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "visup needs Python 3.11 or newer")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt setuptools
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -c constraints.txt \
	  --config-settings editable_mode=compat -e '.[dev]'
	touch $@

# What runs nothing (check, docs) need not wait for this.
$(COMPILED): $(STAMP)
	@echo 'Compiling the hot loops: once, for two to three minutes.'
	$(BIN)/python -m visup.serving.warm_up
	touch $@

demo: setup
	$(BIN)/visup demo

# Each worker begins with neighbouring tests, which share fixtures, and takes over tests of the other at the end.
test: setup
	$(BIN)/python -m pytest -n 2 --dist worksteal

check: $(STAMP)
	@! git grep -InE '^(<{7}|>{7}|[|]{7})( |$$)' || { echo 'Conflict markers: resolve the merges named above.'; exit 1; }
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/bandit -q -c pyproject.toml -r agent percepts rules tasks visup
	$(BIN)/python -m tests.supply_chain

# Damaged and hostile files of every kind, for half a minute; `make bench` takes longer.
fuzz: setup
	$(BIN)/visup eval hardening --count 60 --cuts 30 --seed 0

oracles: setup
	$(BIN)/python -m tests.oracles

bench: setup
	$(BIN)/python -m visup.evaluation.bench
	$(BIN)/python -m tests.console.pace
	test ! -d ../shared/data || $(BIN)/python -m tests.narrative ../shared/data/worlds ../shared/data/machines

# The documentation as a site in site/; every warning is an error.
docs: $(STAMP)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo 'Documentation: site/index.html'

# Built from the sdist, it works in a clean environment, and for a user who may write nowhere.
wheel: built-wheel setup
	.ci/wheel try

built-wheel:
	.ci/wheel build

clean:
	rm -rf $(VENV) build dist site *.egg-info demo-run runs .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
