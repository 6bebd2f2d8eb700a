# The commands of this project; `make` alone lists them.
#
# Everything happens in .venv, which is made on the first use. Stamps in it record what is installed, so that a
# second call starts at once. Another interpreter:  make clean, then  make PYTHON=/path/to/python3.12 test

PYTHON ?= python3
JOBS   ?= $(shell nproc 2>/dev/null || echo 2)

VENV   := .venv
BIN    := $(VENV)/bin
CHECKED := $(wildcard kinegen tests scripts docs examples benchmarks generated)

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
MAKEFLAGS += --no-print-directory

.PHONY: help demo view test test-boards test-browser test-controllers test-counts test-imports test-languages test-learning test-long test-notebooks test-sabotage test-slow test-windows docs-firmware check full mutants fix format lint types robots generated current docs docs-current site commits bench prove wheel release clean

help: ## lists these commands
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-16s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

# For people who try it ------------------------------------------------------------------------------------------------

demo: $(VENV)/.kinegen ## shows the closed form of a PUMA 560, builds and verifies it, evaluates 100,000 poses
	$(BIN)/kinegen show robots/puma560.yaml
	@echo
	$(BIN)/kinegen build robots/puma560.yaml -o build/demo
	@echo
	$(BIN)/python scripts/demo.py build/demo/puma560

view: $(VENV)/.kinegen ## opens a PUMA 560 in the 3D viewer
	@mkdir -p build
	$(BIN)/kinegen view robots/puma560.yaml -o build/puma560.html --open

# For people who change it ---------------------------------------------------------------------------------------------

test: $(VENV)/.dev ## runs the test suite except for slow tests
	$(BIN)/python -m pytest -n $(JOBS) --dist loadfile $(PYTEST_OPTIONS)

test-boards: $(VENV)/.dev ## runs the kernels on emulated microcontrollers; as root, installs the tools
	@$(BIN)/python scripts/install_boards.py
	$(BIN)/python -m pytest -n $(JOBS) -m boards $(PYTEST_OPTIONS)

test-browser: $(VENV)/.browser ## tries the pages of `kinegen view` in Chromium; as root, installs it
	@$(BIN)/python scripts/install_browser.py build/browser
	$(BIN)/python -m pytest tests/browser -m browser $(PYTEST_OPTIONS)

test-controllers: $(VENV)/.dev ## moves arms in LinuxCNC, and tries the packages for other controllers; as root, installs it
	@$(BIN)/python scripts/install_controllers.py
	$(BIN)/python -m pytest tests/controllers -n $(JOBS) --dist loadgroup --no-loadscope-reorder -m controllers $(PYTEST_OPTIONS)

test-counts: $(VENV)/.dev ## counts all solutions of inverses with slow independent solvers; takes hours
	$(BIN)/python -m pytest tests/inverse tests/complete_inverse -n $(JOBS) -m counts $(PYTEST_OPTIONS)

test-imports: $(VENV)/.dev ## compares real URDF, xacro and MJCF files with Pinocchio and MuJoCo, and operations with CasADi
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev,judges]'
	$(BIN)/python scripts/get_descriptions.py build/descriptions
	$(BIN)/python -m pytest tests/imports tests/operations -n $(JOBS) -m imports $(PYTEST_OPTIONS)

test-languages: $(VENV)/.dev ## verifies every output in other languages; as root, installs the tools
	@$(BIN)/python scripts/install_languages.py
	$(BIN)/python -m pytest tests/languages tests/inverse -n $(JOBS) --dist loadgroup -m languages $(PYTEST_OPTIONS)

test-learning: $(VENV)/.learning ## tries packages in PyTorch, JAX, Numba and SciPy; installs these
	$(BIN)/python -m pytest tests/learning -m learning $(PYTEST_OPTIONS)

test-notebooks: $(VENV)/.dev ## runs the notebooks of examples/ from top to bottom
	$(BIN)/python -m pytest tests/api -n $(JOBS) -m notebooks $(PYTEST_OPTIONS)

test-sabotage: $(VENV)/.dev ## checks that the build refuses every one of a hundred alterations of what it emits
	$(BIN)/python -m pytest tests/sabotage tests/verify -n $(JOBS) --dist loadgroup -m sabotage $(PYTEST_OPTIONS)

test-slow: $(VENV)/.dev ## runs the tests that take over 0.4 seconds; most of them build packages
	$(BIN)/python -m pytest -n $(JOBS) --dist loadfile -m slow $(PYTEST_OPTIONS)

test-windows: $(VENV)/.dev ## compiles for Windows and macOS, and compares with Linux in Wine; as root, installs that
	@$(BIN)/python scripts/install_windows.py
	$(BIN)/python -m pytest tests/windows -n $(JOBS) --dist loadgroup -m windows $(PYTEST_OPTIONS)

test-long: $(VENV)/.dev ## runs the tests that try many more robots than the suite does
	$(BIN)/python -m pytest -n $(JOBS) -m long $(PYTEST_OPTIONS)

mutants: $(VENV)/.dev ## sees that a test fails for every mutant of tests/mutants.yaml; MUTANTS_OPTIONS=--sample: for some
	$(BIN)/python scripts/mutants.py --jobs $(JOBS) $(MUTANTS_OPTIONS)

check: format lint types test current docs-current ## the gate: everything that has to hold before a change lands

full: check ## every check, with all that the others try a sample of; takes hours, and is what a release needs
	$(BIN)/python scripts/generated.py --check --every
	$(MAKE) robots ROBOTS_OPTIONS=--every
	$(MAKE) test-slow test-languages test-sabotage test-long test-boards test-controllers test-windows test-learning \
	    test-browser test-imports test-notebooks mutants prove PYTEST_OPTIONS=--every

fix: $(VENV)/.dev ## fixes what tools can fix: format, import order, simple lint
	$(BIN)/ruff check --fix $(CHECKED)
	$(BIN)/ruff format $(CHECKED)

format: $(VENV)/.dev ## checks the layout of the Python code
	$(BIN)/ruff format --check $(CHECKED)

lint: $(VENV)/.dev ## checks the Python code, the generated one too
	$(BIN)/ruff check $(CHECKED)

types: $(VENV)/.dev ## checks the types
	$(BIN)/mypy

robots: $(VENV)/.kinegen ## builds and verifies one in seven of robots/, drawn by the commit; ROBOTS_OPTIONS=--every: all
	@$(BIN)/python scripts/robots.py --jobs $(JOBS) $(ROBOTS_OPTIONS)

generated: $(VENV)/.kinegen ## rewrites generated/: some packages, and the digests of what every robot gives
	$(BIN)/python scripts/generated.py

current: $(VENV)/.kinegen ## checks that generated/ is what the robots give
	$(BIN)/python scripts/generated.py --check

# Every page with real output has a script docs/make_*.py that rewrites it; --check compares instead.
docs: $(VENV)/.kinegen ## rewrites the output shown in README.md and docs/
	@for script in docs/make_*.py; do echo "$$script"; $(BIN)/python $$script || exit 1; done

docs-firmware: $(VENV)/.kinegen ## measures the kernels on all boards and rewrites the tables of docs/firmware.md
	@$(BIN)/python scripts/install_boards.py
	$(BIN)/python docs/make_firmware.py --all

docs-current: $(VENV)/.kinegen ## checks that the pages show what the commands print
	@for script in docs/make_*.py; do echo "$$script --check"; $(BIN)/python $$script --check || exit 1; done

site: $(VENV)/.site ## makes the documentation as a site in build/site, with a 3D arm; it opens from the disk
	$(BIN)/python scripts/make_site.py --check

# BASE names the commit before the first one; COMMITS_OPTIONS=--strict makes warnings errors.
commits: ## warns about commits since the upstream or main whose messages are hard to read later
	@$(PYTHON) scripts/check_commits.py $(BASE) $(COMMITS_OPTIONS)

prove: $(VENV)/.dev ## proves with Frama-C that the kernels have no run-time error; rewrites docs/proof.md
	$(BIN)/python scripts/prove_eva.py
	$(BIN)/python -m pytest tests/prove

# Peers take part where they are installed: $(BIN)/python -m pip install -e '.[bench]'
bench: $(VENV)/.kinegen ## prints the figures of this machine
	$(BIN)/python -m benchmarks.speed $(BENCH_OPTIONS)
	$(BIN)/python -m benchmarks.velocity
	$(BIN)/python -m benchmarks.inverse
	$(BIN)/python -m benchmarks.build
	$(BIN)/python -m benchmarks.imports

wheel: $(VENV)/.dev ## builds a wheel in dist/ and tries it outside the checkout
	$(BIN)/python -m hatchling build -t wheel -d dist
	$(BIN)/python -m pytest tests/test_packaging.py

release: $(VENV)/.release ## builds wheel and sources in dist/, tries them in a bare environment, says how to publish
	$(BIN)/python scripts/release.py

clean: ## removes what was built, and .venv
	rm -rf build dist $(VENV) .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find kinegen tests docs scripts benchmarks generated -name __pycache__ -prune -exec rm -rf {} +
	find generated -name '*.so' -delete

# The environment ------------------------------------------------------------------------------------------------------

$(VENV)/.made: scripts/make_venv.py scripts/get_headers.py
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null || { \
	    echo "error: kinegen needs Python 3.10 or newer, and '$(PYTHON)' is $$($(PYTHON) --version 2>/dev/null || echo missing)"; \
	    echo "  Name another one:  make PYTHON=/path/to/python3.10"; exit 1; }
	@$(PYTHON) scripts/make_venv.py $(VENV)
	@$(PYTHON) scripts/get_headers.py $(VENV)
	@touch $@

$(VENV)/.kinegen: $(VENV)/.made pyproject.toml
	@echo "Installing kinegen into $(VENV) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
	@touch $@

$(VENV)/.dev: $(VENV)/.made pyproject.toml
	@echo "Installing kinegen and its tools into $(VENV) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	@touch $(VENV)/.kinegen $@

$(VENV)/.browser $(VENV)/.learning $(VENV)/.release: $(VENV)/.%: $(VENV)/.dev
	@echo "Installing what the target for $* needs into $(VENV) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev,$*]'
	@touch $@

$(VENV)/.site: $(VENV)/.kinegen
	@echo "Installing the tools of the site into $(VENV) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	@touch $@
