# armlock: the book, its tests and its environment. `make` lists what there is.
# Works with GNU make 3.81 (macOS) and newer.

PYTHON ?= python3
VENV := .venv
PY := $(VENV)/bin/python
READY := $(VENV)/.complete
EXECUTED := build/executed/.complete
BOOK := build/html/index.html
# In the order of the last build's times, or of those that `make format` has kept.
LONGEST_FIRST = $(firstword $(wildcard build/longest_first.txt) book/longest_first.txt)
LISTED := $(wildcard $(addprefix notebooks/,$(shell cat $(LONGEST_FIRST))))
NOTEBOOKS := $(LISTED) $(filter-out $(LISTED),$(wildcard notebooks/*.ipynb))

# What the reader has set up for other projects must not reach this one.
export PYTHONNOUSERSITE := 1
export JUPYTER_PREFER_ENV_PATH := 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export MPLCONFIGDIR := $(CURDIR)/$(VENV)/matplotlib
export IPYTHONDIR := $(CURDIR)/$(VENV)/ipython
# The matrices here are small, and several processes share the machine.
export OPENBLAS_NUM_THREADS := 1
unexport PYTHONPATH PYTHONHOME VIRTUAL_ENV MPLBACKEND PYTHONDONTWRITEBYTECODE

# Two makes in one folder must not build the same files: the second waits for the first.
alone = mkdir -p build; $(PYTHON) tools/alone.py build/lock $(MAKE) --no-print-directory
sources = $(shell find $(1) -type f -not -name '*.py[co]' -not -name '*.nb[ic]' -not -path '*/.*')

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help env book pdf print browser same lab test tests attack pins bench dist lint \
	format lock clean

help: ## List the targets
	@sed -n 's/^\([a-z]*\):.*## \(.*\)/  make \1|\2/p' Makefile | awk -F'|' '{printf "%-15s%s\n", $$1, $$2}'

env: ## Make .venv with every package of environment.txt, and this one (PYTHON=python3.12)
	+@$(alone) $(READY)
	@echo "The environment is ready: $(VENV)"

# The programs of an environment hold the path of their folder: a moved one is made anew.
ifneq ($(shell cat $(READY) 2>/dev/null),$(CURDIR))
$(shell rm -f $(READY))
endif

# uv installs in a fifth of pip's time, and does not know pip's settings: where uv fails, pip
# installs. The lock is complete, so nothing is resolved.
install = -m pip install --quiet --no-deps --no-compile --require-hashes --only-binary :all: -r
$(READY): environment.txt book/kernel.json
	@$(PYTHON) -c 'import sys, ensurepip, venv; sys.exit(sys.version_info < (3, 11))' || { \
		echo "armlock needs Python 3.11 or newer with venv (Debian: apt-get install" \
			"python3-venv). To name one: make $(MAKECMDGOALS) PYTHON=/path/to/python3"; exit 1; }
	@echo "Installing the packages of environment.txt into $(VENV), once: a minute or two ..."
	@$(PYTHON) -m venv --clear $(VENV)
	@sed -n '/^uv==/,/[^\\]$$/p' environment.txt > $(VENV)/uv.txt
	@$(PY) $(install) $(VENV)/uv.txt
	@$(PY) -m uv pip install --quiet --no-config --python $(PY) --no-deps --require-hashes \
		--only-binary :all: -r environment.txt 2> $(VENV)/uv.log || $(PY) $(install) environment.txt
	@$(PY) -m pip install --quiet --no-index --no-deps --no-build-isolation --editable .
	@$(PY) -m pip check && $(PY) -c 'import matplotlib.font_manager'
	@mkdir -p $(VENV)/etc/ipython
	@cp book/kernel.json $(VENV)/etc/ipython/ipython_kernel_config.json
	@echo "$(CURDIR)" > $@

# nbmake runs copies of the notebooks for the tests and for the book, the longest first.
PYTEST := $(PY) -m pytest --numprocesses auto --maxprocesses 4 --dist worksteal
# A progress bar, which a slow machine would show, is no part of a page.
execute = export TQDM_DISABLE=1 ARMLOCK_FIGURES=$(CURDIR)/$(1); \
	$(PYTEST) --dist load --maxschedchunk 1 --nbmake --overwrite $(2:notebooks/%=build/executed/%) && \
	$(PY) tools/collect_figures.py build/executed $(1) build/cache
execute-all = rm -rf $(1) build/executed; cp -R notebooks build/executed && \
	$(call execute,$(1),$(NOTEBOOKS))

# If notebooks alone have changed, only these run again.
$(EXECUTED): $(READY) $(call sources,armlock book/companion notebooks) book/claims.toml
	@rm -f $@
	@$(if $(filter-out notebooks/%.ipynb,$?),$(call execute-all,build/figures),\
		cp $? build/executed && $(call execute,build/figures,$?))
	@touch $@

same: $(EXECUTED) ## Run all notebooks again: the data of all figures, equal byte for byte
	@$(call execute-all,build/figures-again)
	@touch $(EXECUTED)
	diff --recursive --brief --exclude='*.json' --exclude='*.svg' build/figures build/figures-again

book: ## Run all notebooks and build the book, as HTML that needs no network
	+@$(alone) $(BOOK)
	@echo "The book is ready. Open it in a browser: file://$(CURDIR)/$(BOOK)"

prepare = rm -rf $(1); mkdir -p $(1)/$(2); cp -R build/figures $(1)/$(2); \
	cp -R build/cache $(1)/.jupyter_cache; $(PY) -m book.companion.ledger write $(1)/$(2)/figures
jupyter-book = $(VENV)/bin/jupyter-book build . --all --config book/_config.yml --toc book/_toc.yml

# The new book replaces the old one when it is complete.
$(BOOK): $(EXECUTED) $(call sources,book tools) codecheck.yml
	@$(call prepare,build/_build,html)
	$(jupyter-book) --path-output build -W -n --keep-going
	$(PY) tools/check_html.py build/_build/html
	$(PY) tools/write_codecheck.py --check build/_build/html
	@rm -rf build/html
	@mv build/_build/html build/html
	@touch $@

pdf: ## Print the book with Chromium: build/html/armlock.pdf
	+@$(alone) print

print: $(BOOK)
	@$(call prepare,build/print/_build,singlehtml)
	$(jupyter-book) --path-output build/print --builder custom --custom-builder singlehtml --quiet
	$(PY) -m tools.print_book build/print/_build/singlehtml build/html

browser: ## Check every page and all windows in Chromium; run the code as it shows it
	+@$(alone) $(BOOK)
	$(PY) tools/check_browser.py build/html
	$(PY) tools/check_cells.py build/html
	FULL=1 $(PYTEST) tests/test_live.py

lab: $(READY) ## Open the notebooks in JupyterLab
	$(VENV)/bin/jupyter-lab --notebook-dir notebooks $(if $(filter 0,$(shell id -u)),--allow-root)

test: ## Build the book and run all tests
	+@$(alone) tests

tests: $(BOOK)
	$(PYTEST) tests

attack: $(BOOK) ## Run all tests in full: more random cases, all windows; and brute force
	FULL=1 $(PYTEST) tests
	$(PY) -m tests.attack --loops 200

# Of some chapters: make pins NOTEBOOKS=notebooks/08_controller.ipynb
pins: $(READY) ## Run the notebooks, write what they find into the ledger's file, show what changed
	@rm -rf build/found && mkdir -p build/found
	ARMLOCK_FOUND=$(CURDIR)/build/found $(PYTEST) --dist load --maxschedchunk 1 --nbmake $(NOTEBOOKS)
	@$(PY) -m book.companion.ledger update build/found

bench: $(READY) ## Measure speed and memory, and print a table
	$(PY) -m benchmarks

dist: $(READY) ## Build the source archive and the wheel into dist/, and check them
	rm -rf dist
	$(PY) -m uv build --quiet --no-build-isolation --python $(PY) --out-dir dist
	$(PY) -m twine check --strict dist/*.whl dist/*.tar.gz

# All that environment.txt has to hold; `lint` checks that what was installed is in the ranges.
REQUIRED := pyproject.toml --all-extras --group build --group test --group browser --group lab \
	--group lint --group dist --group lock

lint: $(READY) ## Check style, types, stripped notebooks, and what is written by tools
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy
	$(PY) -m nbstripout --verify --keep-id $(NOTEBOOKS)
	$(PY) -m uv pip install --dry-run --quiet --no-index --no-deps --no-build --python $(PY) -r $(REQUIRED)
	$(PY) tools/write_codecheck.py --check

format: $(READY) ## Format the code, strip the notebooks, list their figures and their order
	$(PY) -m ruff check --fix .
	$(PY) -m ruff format .
	$(PY) -m nbstripout --keep-id $(NOTEBOOKS)
	$(PY) tools/write_codecheck.py
	@if [ -f build/longest_first.txt ]; then cp build/longest_first.txt book; fi

lock: $(READY) ## Write environment.txt from pyproject.toml (UPGRADE=1: newest versions)
	$(PY) -m uv pip compile $(REQUIRED) --universal --python-version 3.11 \
		--fork-strategy fewest --only-binary :all: --generate-hashes --no-emit-index-url \
		--no-emit-find-links --quiet --custom-compile-command "make lock" \
		$(if $(UPGRADE),--upgrade) -o environment.txt

clean: ## Remove what was built
	rm -rf build dist .pytest_cache .ruff_cache .mypy_cache .hypothesis
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +
