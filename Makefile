# armlock: the book, its tests and its environment. `make` lists what there is.
#
# Works with GNU make 3.81 (macOS) and newer. A target whose sources have not changed does
# nothing; FORCE=1 makes it run all the same.

# The first Python that is new enough; say `make book PYTHON=/path/to/python3` for another.
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; \
	done || true)
PORT ?= 8000

VENV := .venv
PY := $(VENV)/bin/python
ENV_READY := $(VENV)/.environment-complete
PACKAGE_READY := $(VENV)/.package-complete
INDEX := build/html/index.html
NOTEBOOKS_RAN := build/notebooks-ran
TESTS_PASSED := build/tests-passed

# What the reader has set up for other projects must not reach this one.
export PYTHONNOUSERSITE := 1
export JUPYTER_PREFER_ENV_PATH := 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export MPLCONFIGDIR := $(CURDIR)/$(VENV)/matplotlib
export IPYTHONDIR := $(CURDIR)/$(VENV)/ipython
# The matrices here are small, and several processes share the machine.
export OPENBLAS_NUM_THREADS := 1
unexport PYTHONPATH PYTHONHOME VIRTUAL_ENV MPLBACKEND
# What one claim, notebook or test has computed, the next one finds here.
export ARMLOCK_SHARED := $(CURDIR)/build/shared

# Two makes in one folder must not build the same files: the second waits for the first.
alone = mkdir -p build; $(or $(PYTHON),python3) tools/alone.py build/lock \
	$(MAKE) --no-print-directory

empty :=
space := $(empty) $(empty)
find-sources = $(shell find $(wildcard $(1)) -type f \
	-not -name '*.pyc' -not -name '*.nbi' -not -name '*.nbc' -not -path '*/.*' | sort)
# What the notebooks depend on, and the book besides.
RUN_SOURCES := $(call find-sources,armlock book/companion notebooks)
BOOK_SOURCES := $(call find-sources,book) tools/check_html.py tools/write_codecheck.py \
	tools/cache_notebooks.py codecheck.yml
TEST_SOURCES := $(call find-sources,armlock book notebooks tests benchmarks tools binder) \
	pyproject.toml conftest.py environment.txt README.md codecheck.yml
NOTEBOOKS := $(wildcard notebooks/*.ipynb)

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help env book pdf browser same lab test claims attack mutants bench dist print serve lint format strip lock clean distclean always

help: ## List the targets
	@echo "armlock: make TARGET, where TARGET is one of"
	@sed -n 's/^\([a-z]*\):.*## \(.*\)/\1|\2/p' $(firstword $(MAKEFILE_LIST)) \
		| awk -F'|' '{ printf "  %-11s%s\n", $$1, $$2 }'
	@echo "Variables: PYTHON=python3.12 (for env), PORT=8000 (for serve), FORCE=1 (run again)"

## Environment ---------------------------------------------------------------------------

env: ## Make .venv with every package of environment.txt, and this one
	+@$(alone) $(PACKAGE_READY)
	@echo "The environment is ready: $(VENV)"

# The programs of an environment hold the path of their folder: one that was moved or copied is
# made anew.
ifneq ($(shell cat $(ENV_READY) 2>/dev/null),$(CURDIR))
$(shell rm -f $(ENV_READY) $(PACKAGE_READY))
endif

# Both stamps are written last, so an interrupted install starts over. The lock is complete, as
# `pip check` confirms, and nothing needs to be resolved: an older pip, led by the extras of a
# requirement, would ask for the newest version and refuse it. Modules are compiled at the end,
# on all cores; some hold templates, and cannot be. The kernel's log level keeps its notes on
# transport, one for each notebook, out of the build's output.
$(ENV_READY): environment.txt
	@test -n "$(PYTHON)" || { \
		echo "armlock needs Python 3.11 or newer, and found: $$(python3 --version 2>&1)."; \
		echo "Install one, or name it: make $(MAKECMDGOALS) PYTHON=/path/to/python3"; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
		echo "armlock needs Python 3.11 or newer; $(PYTHON) is not: $$($(PYTHON) --version 2>&1)."; \
		exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
		echo "$(PYTHON) cannot make virtual environments: its venv or ensurepip is missing."; \
		echo "On Debian and Ubuntu: apt-get install python3-venv"; exit 1; }
	@echo "Installing the packages of environment.txt into $(VENV), once: a minute or two ..."
	@rm -f $(ENV_READY) $(PACKAGE_READY)
	@$(PYTHON) -m venv --clear $(VENV)
	@$(PY) -m pip install --quiet --no-deps --no-compile --require-hashes --only-binary :all: \
		-r environment.txt
	@$(PY) -m compileall -qq -j 0 $(VENV)/lib || true
	@mkdir -p $(VENV)/etc/ipython
	@echo '{"IPKernelApp": {"log_level": 40}}' > $(VENV)/etc/ipython/ipython_kernel_config.json
	@$(PY) -c 'import matplotlib.font_manager'
	@echo "$(CURDIR)" > $@

# README.md and LICENSE are part of the package's metadata, and must exist.
$(PACKAGE_READY): $(ENV_READY) pyproject.toml
	@$(PY) -m pip install --quiet --no-index --no-deps --no-build-isolation --editable .
	@$(PY) -m pip check
	@touch $@

## Notebooks -----------------------------------------------------------------------------

# nbmake runs them once, on all cores, for the tests and for the book: a copy, which keeps the
# outputs. The claims are checked before, once for all notebooks and tests, which share what these
# have computed. The two longest notebooks go to two processes, which begin with two each: the
# ledger, a short one, stands between them.
PYTEST := $(PY) -m pytest --numprocesses auto --maxprocesses 4 --dist worksteal
execute = export ARMLOCK_FIGURES="$(CURDIR)/$(1)"; \
	$(PYTEST) --dist load --maxschedchunk 1 --nbmake --overwrite $(addprefix $(2)/,$(3))
run-notebooks = rm -rf $(1) build/shared $(2); export ARMLOCK_FIGURES="$(CURDIR)/$(1)"; \
	echo "Checking every claim of the paper: build/claims.txt ..."; \
	$(PY) -m book.companion.claims $(1) > build/claims.txt && cp -R notebooks $(2) && \
	$(call execute,$(1),$(2),07_simulation.ipynb 09_ledger.ipynb 08c_design.ipynb *.ipynb)

# Where notebooks alone have changed since the last run, only these run again. The stamp goes
# first: what an interrupted run has left is not taken for a whole one.
$(NOTEBOOKS_RAN): $(PACKAGE_READY) $(RUN_SOURCES) build/run-sources $(if $(FORCE),always)
	@rm -f $@
	@touch build/notebooks-started
	@$(if $(filter-out notebooks/%.ipynb,$?),$(call run-notebooks,build/figures,build/executed),\
		cp $? build/executed && $(call execute,build/figures,build/executed,$(notdir $?)))
	@touch -r build/notebooks-started $@

same: ## Run all notebooks again: the data of all figures, equal byte for byte
	+@$(alone) $(NOTEBOOKS_RAN)
	@$(call run-notebooks,build/figures-again,build/executed-again)
	diff --recursive --brief --exclude='*.json' --exclude='*.png' --exclude='*.svg' \
		build/figures build/figures-again

## Book ----------------------------------------------------------------------------------

book: ## Run all notebooks and build the book, as HTML that needs no network
	+@$(alone) $(INDEX)
	@echo "The book is ready. Open it in a browser: file://$(subst $(space),%20,$(CURDIR))/$(INDEX)"

# Every page is built anew: Sphinx does not see that the package has changed. Notebooks come
# from the cache, which holds the last run and nothing older. The new book replaces the old one
# only when it is complete, and is as old as the start of its build, so that a source saved
# meanwhile counts as newer. The link keeps the path right that Jupyter Book has printed.
$(INDEX): $(NOTEBOOKS_RAN) $(BOOK_SOURCES) build/book-sources $(if $(FORCE),always)
	@touch build/book-started
	@rm -rf build/_build
	@mkdir -p build/_build/html
	@cp -R build/figures build/_build/html/figures
	@$(PY) tools/cache_notebooks.py build/_build/.jupyter_cache build/executed/*.ipynb
	ARMLOCK_FIGURES="$(CURDIR)/build/_build/html/figures" \
		$(VENV)/bin/jupyter-book build . --all --config book/_config.yml --toc book/_toc.yml \
		--path-output build -W -n --keep-going
	$(PY) tools/check_html.py build/_build/html
	$(PY) tools/write_codecheck.py --check build/_build/html
	@rm -rf build/html
	@mv build/_build/html build/html
	@ln -s ../html build/_build/html
	@touch -r build/book-started $@

# All pages as one, printed by the browser that is there; the pages then link to the result.
pdf: ## Print the book with Chromium: build/html/armlock.pdf
	+@$(alone) print

print: $(INDEX)
	@rm -rf build/print
	@mkdir -p build/print/_build/singlehtml
	@cp -R build/html/figures build/print/_build/singlehtml/figures
	@$(PY) tools/cache_notebooks.py build/print/_build/.jupyter_cache build/executed/*.ipynb
	ARMLOCK_FIGURES="$(CURDIR)/build/print/_build/singlehtml/figures" \
		$(VENV)/bin/jupyter-book build . --all --config book/_config.yml --toc book/_toc.yml \
		--path-output build/print --builder custom --custom-builder singlehtml --quiet
	$(PY) -m tools.print_book build/print/_build/singlehtml build/html

browser: ## Check every page in Chromium, without network; run the code as it shows it
	+@$(alone) $(INDEX)
	$(PY) tools/check_browser.py build/html
	$(PY) tools/check_cells.py build/html

lab: $(PACKAGE_READY) ## Open the notebooks in JupyterLab
	$(VENV)/bin/jupyter-lab --notebook-dir notebooks $(if $(filter 0,$(shell id -u)),--allow-root)

serve: ## Serve the book at http://localhost:PORT
	+@$(alone) $(INDEX)
	@echo "The book is at http://localhost:$(PORT) until you press Ctrl-C."
	@$(PY) -m http.server $(PORT) --bind 127.0.0.1 --directory build/html

## Tests ---------------------------------------------------------------------------------

test: ## Run all tests, notebooks included
	+@$(alone) $(TESTS_PASSED)
	@test -e build/tests-ran || { echo "Tests passed at $$(cat $(TESTS_PASSED)), and" \
		"nothing has changed since; make test FORCE=1 runs them again."; }
	@rm -f build/tests-ran

$(TESTS_PASSED): $(NOTEBOOKS_RAN) $(TEST_SOURCES) build/test-sources $(if $(FORCE),always)
	@touch build/tests-started
	$(PYTEST) tests
	@date '+%Y-%m-%d %H:%M:%S' > $@
	@touch -r build/tests-started $@
	@touch build/tests-ran

claims: $(PACKAGE_READY) ## Check every claim; print the ledger, write it as CSV and JSON
	$(PY) -m book.companion.claims build/claims

attack: $(PACKAGE_READY) ## Hold margins, counts and roots of random loops against brute force
	$(PY) -m tests.attack

mutants: $(PACKAGE_READY) ## Change a module at random, list what no test notices (MODULE=dcurve)
	$(PY) tools/mutants.py $(MODULE)

bench: $(PACKAGE_READY) ## Measure speed and memory, and print a table
	$(PY) -m benchmarks

# The lists of sources change when a file comes or goes, which no file's date would tell.
build/run-sources: always
	@mkdir -p build
	@echo $(RUN_SOURCES) | cmp -s - $@ || echo $(RUN_SOURCES) > $@

build/book-sources: always
	@mkdir -p build
	@echo $(BOOK_SOURCES) | cmp -s - $@ || echo $(BOOK_SOURCES) > $@

build/test-sources: always
	@mkdir -p build
	@echo $(TEST_SOURCES) | cmp -s - $@ || echo $(TEST_SOURCES) > $@

always:

dist: $(PACKAGE_READY) ## Build the source archive and the wheel into dist/, and check them
	$(PY) tools/build_dist.py dist
	$(PY) -m twine check --strict dist/*

## Upkeep --------------------------------------------------------------------------------

# All that environment.txt has to hold. `lint` asks whether what was installed from it is within
# the ranges; where packages come from is for the reader's settings to say, not for that file.
REQUIRED := pyproject.toml --all-extras --group build --group test --group browser --group lab \
	--group lint --group dist --group lock

lint: $(PACKAGE_READY) ## Check style, types, stripped notebooks, and what is written by tools
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy
	$(if $(NOTEBOOKS),$(PY) -m nbstripout --verify --keep-id $(NOTEBOOKS))
	$(PY) -m uv pip install --dry-run --quiet --no-index --no-deps --no-build \
		--python $(PY) -r $(REQUIRED)
	! grep -n '://' environment.txt
	$(PY) tools/write_binder.py --check
	$(PY) tools/write_codecheck.py --check

format: $(PACKAGE_READY) ## Format the code, strip the notebooks, list what they publish
	$(PY) -m ruff check --fix .
	$(PY) -m ruff format .
	$(if $(NOTEBOOKS),$(PY) -m nbstripout --keep-id $(NOTEBOOKS))
	$(PY) tools/write_codecheck.py

lock: $(ENV_READY) ## Write environment.txt from pyproject.toml (UPGRADE=1: newest versions)
	$(PY) -m uv pip compile $(REQUIRED) \
		--universal --python-version 3.11 --fork-strategy fewest --only-binary :all: \
		--generate-hashes --no-emit-index-url --no-emit-find-links --quiet \
		--custom-compile-command "make lock" $(if $(UPGRADE),--upgrade) -o environment.txt
	$(PY) tools/write_binder.py

clean: ## Remove what was built
	rm -rf build dist .pytest_cache .ruff_cache .mypy_cache .hypothesis
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +

distclean: clean ## Remove the environment as well
	rm -rf $(VENV)
