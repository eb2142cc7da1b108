# Everything runs in a virtual environment of its own; a stamp file says what is installed in it.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin

.PHONY: help demo test bench edges examples pictures clean

help:             ## Show this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' Makefile

$(VENV)/core: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

$(VENV)/test: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test,urdf]'
	@touch $@ $(VENV)/core

$(VENV)/bench: pyproject.toml $(VENV)/test
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[bench]'
	@touch $@

demo: $(VENV)/core   ## Run the report's stacking program and write its report page
	$(BIN)/armwright run examples/stacking.rlo --cell examples/stanford_cell.toml -o out/stacking

test: $(VENV)/test   ## Run lint, types, the import contracts and all tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m pytest -n auto

examples: $(VENV)/core   ## Run every example into out/
	$(BIN)/armwright run examples/bench.rlo --cell examples/stanford_cell.toml -o out/bench
	$(BIN)/armwright run examples/twelve_moves.rlo --cell examples/stanford_cell.toml -o out/twelve_moves
	$(BIN)/armwright run examples/portable.rlo --cell examples/stanford_cell.toml -o out/portable
	$(BIN)/armwright run examples/gearbox.rlo --cell examples/puma_cell.toml -o out/gearbox
	$(BIN)/armwright run examples/around.rlo --cell examples/puma_cell.toml --around via -o out/around
	$(BIN)/armwright move joint puma560 examples/puma_poses.toml -o out/joint
	$(BIN)/armwright move cartesian puma560 examples/round_the_post.toml -o out/round_the_post

pictures: $(VENV)/core  ## Draw the pictures of the physics pages
	$(BIN)/python docs/pictures/make.py

bench: $(VENV)/bench  ## Measure against the peers, one core each
	PYTHONPATH=tests $(BIN)/python benchmarks/run.py

edges: $(VENV)/bench  ## Measure inverse kinematics at its edges, beside the peers (6 minutes)
	PYTHONPATH=tests $(BIN)/python benchmarks/inverse_edges.py

clean:            ## Remove what was built
	rm -rf $(VENV) out build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
