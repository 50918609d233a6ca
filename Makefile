# What a clone needs, from nothing: `make demo` builds and checks a small dataset, `make test` runs the tests.
# Both create .venv with the first python3 of the path (or: make test PYTHON=python3.12) and install into it
# the versions pinned in constraints.txt.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALL := $(BIN)/python -m pip install --quiet --no-input --disable-pip-version-check --constraint constraints.txt
PINS := constraints.txt pyproject.toml setup.py

# Work runs one process a core: more threads in each would only queue for the same cores.
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
export MKL_NUM_THREADS := 1

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help demo test lint wheel clean

help:
	@echo 'make demo    generate, verify, score and report scenes/demo.toml into out/demo'
	@echo 'make test    run every test'
	@echo 'make lint    ruff and mypy'
	@echo 'make wheel   build dist/muslin-*.whl'
	@echo 'make clean   remove what the commands above left behind, .venv and out/ excepted'

demo: $(VENV)/installed-core
	$(BIN)/muslin generate scenes/demo.toml --out out/demo/dataset --workers 2
	$(BIN)/muslin verify out/demo/dataset --json out/demo/verified.json
	$(BIN)/muslin generate scenes/demo.toml --out out/demo/coarse --workers 2 \
	  --set name=demo_coarse --set kind=drape --set scene.garment.edge_length=0.034
	$(BIN)/muslin eval out/demo/coarse out/demo/dataset --json out/demo/scores.json --html out/demo/scores.html
	$(BIN)/muslin report out/demo/dataset --verification out/demo/verified.json --html out/demo/report.html

# Processes that start with a cold kernel cache would each compile every kernel: one compiles first.
test: $(VENV)/installed-dev
	$(BIN)/python -c "from muslin.sim.run import compile_kernels; compile_kernels('cpu')"
	$(BIN)/python -m pytest -n 2 --dist loadfile

lint: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/mypy

# build/lib keeps modules that were renamed or removed since, and a wheel would hold them still.
wheel: $(VENV)/installed-dev
	rm -rf build
	$(BIN)/python -m build --wheel --no-isolation --outdir dist

clean:
	rm -rf build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find $(wildcard garments sim learn eval tests) -name __pycache__ -type d -prune -exec rm -rf {} +

$(VENV)/installed-core: $(VENV)/created $(PINS)
	$(INSTALL) --no-build-isolation --editable .
	@touch $@

$(VENV)/installed-dev: $(VENV)/created $(PINS)
	$(INSTALL) --no-build-isolation --editable '.[dev,usd,alembic]'
	@touch $(VENV)/installed-core $@

# setuptools is installed first because the editable installs above build without isolation.
$(VENV)/created:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo 'muslin needs Python 3.11 or newer; name one: make PYTHON=/path/to/python3.12' >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  version=$$($(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])'); \
	  echo "Python $$version cannot create environments: sudo apt-get install python$$version-venv" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) --upgrade pip setuptools
	@touch $@
