# Two commands on a fresh machine: "make demo" and "make test". Each sets up what it needs in $(VENV) first, with a
# Python 3.13 (Blender 5.2 LTS) or 3.11 (Blender 4.5 LTS) that it finds by itself; PYTHON=/path/to/python names one.

VENV ?= .venv
BLENDER ?= blender
XVFB_BLENDER ?= xvfb-blender
RUN := $(VENV)/bin/python
WITH_KERNELS := $(addprefix tests/tracer/,test_oracle.py test_random_scenes.py test_invariance.py)
export BLENDER XVFB_BLENDER
unexport PYTHONPATH PYTHONHOME

help:  ## Show this list
	@awk -F ':.*  ## ' '/^[a-z-]+:.*  ## / {printf "  make %-16s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

demo: venv  ## Render a sample scene hybrid; says where the picture, the mask and the report are
	$(RUN) tools/demo.py

test: venv  ## Run the whole test suite (ARGS= goes to pytest)
	$(RUN) tools/run_tests.py $(ARGS)

test-kernels: venv  ## Tests of the tracer with compiled kernels in use, not numpy
	$(RUN) tools/run_tests.py -p tests.with_kernels -m "not once" $(or $(ARGS),$(WITH_KERNELS))

test-real: venv  ## Build, install and use the extension in the real Blender BLENDER= (XVFB_BLENDER=: one with a window)
	$(RUN) tools/run_tests.py -v tests/real_blender/checks.py $(ARGS)

pictures: venv  ## Make the pictures in docs/ anew (ARGS=hybrid.png: one of them; XVFB_BLENDER=)
	$(RUN) tools/pictures.py $(ARGS)

pages: venv  ## Write the parts of docs/ that come from the code anew: settings, plan, docs/followed.md
	$(RUN) -m tools.followed
	$(RUN) -m tools.pages

docs: venv  ## Build the site from docs/ in build/site; a broken link fails
	$(RUN) -m venv .venv-docs
	.venv-docs/bin/python -m pip install --quiet --disable-pip-version-check -r tools/docs-requirements.txt
	.venv-docs/bin/python -m mkdocs build --strict

walks: venv  ## 300 random sequences of what scripts do between renders (SEEDS=1-300: which of them)
	PYTHONPATH=. $(RUN) tests/blender/pipeline/script_walk.py $(or $(SEEDS),1-300) 3

stability: venv  ## Run the stiff and extreme cases: build/stability/stability.html and .json, docs/stability.md
	$(RUN) -m hybrid_addon stability --output build/stability
	$(RUN) -m tools.pages.stability build/stability/stability.json

bench: venv  ## Measure the cost: build/bench/bench.md and .json, docs/benchmarks.md (ARGS="--only thesis --quick", --help)
	$(RUN) -m tools.bench --page docs/benchmarks.md $(ARGS)

first-picture: venv  ## EEVEE, Hybrid at its defaults and Cycles on 15 scenes: build/first_picture, docs/benchmarks.md
	$(RUN) -m tools.first_picture --page docs/benchmarks.md $(ARGS)

fronts: venv  ## Presets on the front of error against run time, sample scenes: build/fronts, docs/benchmarks.md
	$(RUN) -m tools.fronts --page docs/benchmarks.md $(ARGS)

materials: venv  ## Forty materials by EEVEE, Hybrid and Cycles: sheets and a table in build/materials (ARGS="--only 2")
	$(RUN) -m tools.material_library $(ARGS)

balls: venv  ## A ball for each shader and input by EEVEE, Hybrid and Cycles, in build/balls; docs/reference/parity.md
	$(RUN) -m tools.ball_table --page $(ARGS)

assets: venv  ## Make the asset library of the extension anew (with Blender 4.5's Python: VENV=.venv311)
	$(RUN) -m tools.asset_library

lint: venv  ## Style, banned imports, types
	$(RUN) -m ruff check
	$(RUN) -m ruff format --check
	$(RUN) -m mypy

format: venv  ## Lay the source out as "make lint" wants it
	$(RUN) -m ruff check --fix
	$(RUN) -m ruff format

extension: venv  ## Build and validate the extension in dist/, one zip per platform and Blender's Python
	$(RUN) tools/build_extension.py

extension-local: venv  ## The same for this machine and one Blender's Python: FOR_PYTHON=3.14 (Debian's Blender)
	$(RUN) tools/build_extension.py --python $(or $(FOR_PYTHON),3.14)

wheels: venv  ## Fetch the wheels that the manifest lists, for Blender's own "extension build" and "validate"
	$(RUN) tools/fetch_wheels.py

venv:  ## Set up the development environment in VENV=.venv, once
	@python="$(PYTHON)"; \
	if [ -z "$$python" ] && [ -e $(VENV)/set-up-stamp.txt ]; then python=$(RUN); fi; \
	if [ -z "$$python" ]; then python=$$(tools/find_python.sh) || exit 1; fi; \
	"$$python" tools/bootstrap.py $(VENV)

clean:  ## Remove what was built and rendered (not $(VENV))
	rm -rf build dist wheels demo .pytest_cache .ruff_cache .mypy_cache .hypothesis
	find hybrid_addon tests tools -name __pycache__ -prune -exec rm -rf {} +

.PHONY: help demo test test-kernels test-real pictures pages docs stability bench first-picture fronts materials balls assets lint format extension extension-local wheels venv clean
