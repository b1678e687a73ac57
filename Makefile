# make run    the reel unit under control, against its emulated twin, with a picture at the end
# make test   the test suite without its long proofs; with them: make test MARKS=
# make check  lint, format and types
# make bounds the oldest libraries that pyproject.toml allows, tried in an environment of their own
# make docs   the manual as a web site, build/site/index.html, and the man page

PYTHON ?= python3
MARKS ?= not long
VENV := .venv
BIN := $(VENV)/bin
# bytecode is written of what is imported, when it is: most files of the libraries never are. Where it may not be
# written, every process compiles some 400 files anew, which takes longer than most that the tests start
unexport PYTHONDONTWRITEBYTECODE
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile

.PHONY: run test bounds check format docs bench clean

run: $(VENV)/installed
	$(BIN)/rtctl run configs/ivu.yaml --reference configs/references/steps.yaml --for 12s

# one thread of linear algebra for each of the two workers: more would wait for one another
test: $(VENV)/installed-dev
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadgroup -m "$(MARKS)"

bounds: $(VENV)/installed-dev
	tests/packaging/lower_bounds.sh $(BIN)/python

check: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@# drivers/ and plants/ become rtctl.drivers and rtctl.plants on installation; mypy is shown the same tree by links
	@rm -rf build/types && mkdir -p build/types/rtctl && ln -s $(CURDIR)/rtctl/* build/types/rtctl/ \
	  && ln -s $(CURDIR)/drivers $(CURDIR)/plants $(CURDIR)/configs build/types/rtctl/
	cd build/types && $(CURDIR)/$(BIN)/mypy --config-file $(CURDIR)/pyproject.toml --cache-dir .cache -p rtctl

format: $(VENV)/installed-dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(VENV)/installed-dev
	$(BIN)/python -m rtctl.manual docs/man/rtctl.1
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	@echo build/site/index.html

bench: $(VENV)/installed-dev
	$(BIN)/python benchmarks/fused_speed.py
	$(BIN)/python benchmarks/lateness.py

clean:
	rm -rf $(VENV) build *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed: pyproject.toml | $(VENV)/bin/python
	$(PIP) -e .
	touch $@

$(VENV)/installed-dev: pyproject.toml | $(VENV)/bin/python
	$(PIP) -e '.[dev]'
	touch $(VENV)/installed $@
