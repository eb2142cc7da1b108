# Everything runs in a virtual environment of its own; a stamp file says what is installed in it.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
# What was tested together; empty for the newest of everything.
CONSTRAINTS ?= constraints.txt
export PIP_CONSTRAINT := $(if $(CONSTRAINTS),$(abspath $(CONSTRAINTS)))

.PHONY: help demo test proof bench jupyter edges examples docs site gallery studies pictures arms messages editor fuzz versions sbom clean

help:             ## Show this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' Makefile

$(VENV)/core: pyproject.toml $(CONSTRAINTS)
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

$(VENV)/test: pyproject.toml $(CONSTRAINTS)
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test,urdf]'
	@# It asks for NumPy 1, and works with 2.
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps 'pybotics>=3.0,<4'
	@touch $@ $(VENV)/core

$(VENV)/bench: pyproject.toml $(CONSTRAINTS) $(VENV)/test
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[bench]'
	@touch $@

$(VENV)/docs: pyproject.toml $(CONSTRAINTS)
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	@touch $@ $(VENV)/core

$(VENV)/examples: pyproject.toml $(CONSTRAINTS)
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[export,physics,sweep,clearance,calibration,identification]'
	@touch $@ $(VENV)/core

demo: $(VENV)/core   ## Run the report's stacking program and write its report page
	$(BIN)/armwright run examples/stacking.rlo --cell examples/stanford_cell.toml -o out/stacking

test: $(VENV)/test   ## Run lint, types, the import contracts and all tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	@# Compiled modules are kept, for the processes that tests start.
	PYTHONDONTWRITEBYTECODE= OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder

proof: $(VENV)/test  ## Run every random sample at its full size and write docs/proof.md (hours; ONLY=tests/motion)
	rm -rf out/proof
	OPENBLAS_NUM_THREADS=1 ARMWRIGHT_PROOF=$(CURDIR)/out/proof $(BIN)/python -m pytest -n auto -m proof --timeout 0 $(ONLY); status=$$?; \
	    $(BIN)/python docs/make_proof.py out/proof && exit $$status

examples: $(VENV)/examples   ## Run every example into out/
	$(BIN)/armwright run examples/bench.rlo --cell examples/stanford_cell.toml -o out/bench
	$(BIN)/armwright run examples/twelve_moves.rlo --cell examples/stanford_cell.toml -o out/twelve_moves
	$(BIN)/armwright run examples/portable.rlo --cell examples/stanford_cell.toml -o out/portable
	$(BIN)/armwright run examples/gearbox.rlo --cell examples/puma_cell.toml -o out/gearbox
	$(BIN)/armwright run examples/around.rlo --cell examples/puma_cell.toml --around via -o out/around
	$(BIN)/armwright run examples/palletise.rlo --cell examples/stanford_cell.toml -o out/palletise
	$(BIN)/armwright run examples/weld.rlo --cell examples/stanford_cell.toml -o out/weld
	$(BIN)/armwright run examples/belt.rlo --cell examples/belt_cell.toml -o out/belt
	$(BIN)/armwright export urscript examples/palletise.rlo --cell examples/ur5_cell.toml -o out/ur5
	$(BIN)/armwright export ros2 examples/weld.rlo --cell examples/ur5_cell.toml -o out/ros2
	$(BIN)/armwright run examples/peg.rlo --cell examples/peg_cell.toml -o out/peg
	$(BIN)/armwright run examples/hand_over.rlo --cell examples/two_arms.toml -o out/hand_over
	$(BIN)/armwright run examples/hand_over_sideways.rlo --cell examples/two_arms.toml -o out/hand_over_sideways
	$(BIN)/armwright run examples/hand_over.rlo --cell examples/hand_over_cell.toml --physics -o out/hand_over_nest
	$(BIN)/armwright run examples/insert_peg.rlo --cell examples/socket_cell.toml --physics --seed 1 -o out/insert_peg
	$(BIN)/armwright run examples/stack_by_vision.rlo --cell examples/vision_cell.toml --physics --seed 1 -o out/stack_by_vision
	$(BIN)/armwright move joint puma560-seed examples/puma_poses.toml -o out/joint
	$(BIN)/armwright move cartesian puma560 examples/round_the_post.toml -o out/round_the_post
	$(BIN)/armwright vibration examples/two_link_springs.toml -q 57.3,68.75 -o out/vibration
	$(BIN)/armwright move joint examples/two_link_springs.toml examples/two_link_poses.toml --smooth zvd -o out/smooth
	$(BIN)/python examples/measurements.py out
	$(BIN)/armwright iso9283 examples/measured_poses.csv examples/measured_paths.csv -o out/iso9283
	$(BIN)/python examples/five_bar.py out
	$(BIN)/armwright clearance simulate five-bar --path y1 -o out/rattling
	$(BIN)/armwright clearance estimate five-bar examples/five_bar_rest.csv
	$(BIN)/armwright clearance sweep five-bar --friction-velocity centre --threshold-mm-s 10 -o out/sweep
	$(BIN)/armwright clearance estimate five-bar examples/five_bar_paths.csv --sweep out/sweep --noise-um 2
	$(BIN)/armwright clearance correct five-bar --clearance J2=0.328 --clearance J3=0.171 --clearance J4=0.483 -o out/corrected
	$(BIN)/armwright plan-poses puma560 -n 30 -o out/poses.csv
	$(BIN)/python examples/tracked_points.py out
	$(BIN)/armwright calibrate puma560-seed examples/puma_points.csv --beyond -o out/calibrated
	$(BIN)/armwright study dh-calibration -o out/dh
	$(BIN)/python examples/logged_motion.py out
	$(BIN)/armwright identify puma560 examples/puma_log.csv --check examples/puma_check.csv -o out/identified

docs: gallery site  ## Build the site of the documentation into site/, its gallery made anew (the first time 4 minutes)

site: $(VENV)/docs  ## Build the site from the pages and pictures that are there
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict
	@echo "open site/index.html"

gallery: $(VENV)/docs  ## Run the commands of the gallery, those whose sources have changed, and write its page
	$(BIN)/python docs/make_gallery.py

studies: $(VENV)/docs  ## Write the page of printed numbers beside computed ones (some minutes)
	$(BIN)/python docs/make_studies.py

pictures: $(VENV)/docs  ## Draw the pictures of the physics pages, and take those of the tutorial on the studio
	$(BIN)/python docs/pictures/make.py

arms: $(VENV)/core  ## Write the table of the catalogue into the page of arm files
	$(BIN)/python docs/make_arms.py

messages: $(VENV)/core  ## Write the page of all messages
	$(BIN)/python docs/make_messages.py

bench: $(VENV)/bench  ## Measure against the peers, one core each
	PYTHONPATH=tests $(BIN)/python benchmarks/run.py

jupyter: $(VENV)/test  ## Test the widget in JupyterLab, in a virtual environment of its own
	test -x out/jupyter/bin/python || $(PYTHON) -m venv out/jupyter
	out/jupyter/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[test,urdf,studio,notebook]' jupyterlab
	out/jupyter/bin/python -m pytest tests/studio/test_jupyter.py

edges: $(VENV)/bench  ## Measure inverse kinematics at its edges, beside the peers (6 minutes)
	PYTHONPATH=tests $(BIN)/python benchmarks/inverse_edges.py

editor:           ## Build, check and package the VS Code extension (needs npm)
	cd editors/vscode && npm ci && npm run check && npm run build && npm test && npm run package

fuzz: $(VENV)/test  ## Fuzz everything that reads: changed files, then bytes under watch (hours; TARGET=cell RUNS=1000)
	for target in $(or $(FILES),arm linkage urdf mjcf cell world mesh step poses iso9283 calibration clearance pictures corners \
	    picture_joints lens log robot); do \
	    $(BIN)/python -W ignore fuzz/files.py $$target $(or $(RUNS),100000) || exit 1; done
	$(BIN)/python -m pip install --quiet --disable-pip-version-check atheris
	for target in $(or $(TARGET),tokens tree cell code program format); do \
	    $(BIN)/python fuzz/fuzz.py $$target -runs=$(or $(RUNS),1000000) || exit 1; done

versions:         ## Write constraints.txt from the newest versions of everything, to be tested then
	rm -rf build/versions && $(PYTHON) -m venv build/versions
	PIP_CONSTRAINT= build/versions/bin/python -m pip install --quiet --disable-pip-version-check --editable \
	    '.[test,urdf,docs,bench,online,optimal,sweep,clearance,calibration,identification,cad,physics,planning,lsp]'
	PIP_CONSTRAINT= build/versions/bin/python -m pip install --quiet --disable-pip-version-check --no-deps 'pybotics>=3.0,<4'
	sed -n '/^#/p' constraints.txt > build/constraints.txt
	build/versions/bin/python -m pip --disable-pip-version-check freeze --exclude-editable >> build/constraints.txt
	mv build/constraints.txt constraints.txt && rm -rf build/versions

sbom: $(VENV)/core  ## Write what armwright is installed with as a CycloneDX list, out/sbom.json
	$(PYTHON) -m venv build/sbom && build/sbom/bin/python -m pip install --quiet --disable-pip-version-check cyclonedx-bom
	mkdir -p out && build/sbom/bin/cyclonedx-py environment $(BIN)/python --pyproject pyproject.toml -o out/sbom.json
	rm -rf build/sbom

clean:            ## Remove what was built
	rm -rf $(VENV) out site build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
