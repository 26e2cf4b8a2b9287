# Every target sets up what it needs: Python 3.11 (or newer), make and a package registry are enough.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
BIN := .venv/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
READY := .venv/ready

# Pictures are drawn off screen: EGL needs no display (and only Linux has it).
ifeq ($(shell uname -s),Linux)
VTK_DEFAULT_OPENGL_WINDOW ?= vtkEGLRenderWindow
export VTK_DEFAULT_OPENGL_WINDOW
endif

# Many tests start processes, each of which would compile every module anew.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help demo readme test test-all coverage pictures mutants bench analysis docs outside lint clean

help:  ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' Makefile

demo: $(READY)  ## draw the demonstration into output/
	$(BIN)/facewrinkle demo --out output

readme: demo  ## draw the pictures of the README anew (look at them before they are committed)
	for folds in printed wave; do cp output/$$folds.jpg docs/images/expressions_$$folds.jpg; done
	$(BIN)/python -m tools.draw_readme

PYTEST := $(BIN)/python -m pytest -n 2 --dist worksteal -q --benchmark-disable --doctest-modules tests facewrinkle

test: lint  ## lint, types, doctests, and the tests that are not slow
	$(PYTEST) -m "not slow"

test-all: lint  ## lint, types, doctests, all tests, each benchmark once; and make outside
	$(PYTEST)
	$(BIN)/python -m pytest -q --benchmark-disable benchmarks
	$(MAKE) outside

coverage: $(READY)  ## all tests again, with the share of lines that they run (at least 95 %)
	$(PYTEST) --cov --cov-report=term

pictures: $(READY)  ## draw the pictures under test anew (look at them before they are committed)
	rm -rf tests/pictures/baselines/*.png output/pictures
	$(BIN)/python -m pytest -q --reset_image_cache tests/pictures

bench: $(READY)  ## time the hot paths, and write the table of the site (half an hour; on a machine that does nothing else)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[bench]"
	rm -f docs/benchmarks.csv
	$(BIN)/python -m pytest benchmarks -q --benchmark-only --benchmark-group-by=group \
		--benchmark-columns=min,median,max,rounds --benchmark-sort=name

docs: $(READY)  ## build the site into docs/_build/html
	rm -rf docs/_build docs/gallery docs/api/generated
	$(BIN)/python -m sphinx -W --keep-going -q -b html -d docs/_build/doctrees docs docs/_build/html

analysis: $(READY)  ## redo every table and plot, with a page of them all, in output/analysis
	$(BIN)/python -m analysis --out output/analysis

outside: $(READY)  ## what is promised, tried by the wheel in bare environments; the site; the analyses (12 minutes)
	$(BIN)/python -m tools.outside

mutants: $(READY)  ## do the tests notice changed formulas? (20 minutes)
	$(BIN)/python tools/mutants.py

lint: $(READY)  ## style, format, spelling and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell README.md CHANGELOG.md CONTRIBUTING.md SECURITY.md CODE_OF_CONDUCT.md docs gallery
	$(BIN)/codespell --builtin en-GB_to_en-US --regex '[A-Z]?[a-z]+' facewrinkle tests tools analysis benchmarks gallery
	$(BIN)/mypy

clean:  ## remove the set-up, caches and output
	rm -rf .venv build dist output docs/_build docs/gallery docs/api/generated *.egg-info .coverage .pytest_cache .mypy_cache \
		.ruff_cache .hypothesis .benchmarks mutants
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(READY): pyproject.toml tools/check_opengl.py
	@test -n "$(PYTHON)" || { echo "Python 3.11 or newer is needed, and neither python3.11 nor python3 was found." >&2; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e ".[all,dev]"
	$(BIN)/python tools/check_opengl.py
	@touch $@
