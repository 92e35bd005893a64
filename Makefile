# make demo: a certified controller for the paper's second example. make test: every check.
# The demo needs Python 3.11 or newer, a C compiler and nothing else; everything stays in .venv.
# The tests also need the tools that .ci/run installs.

SHELL := /bin/bash
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# Rules that the page is checked by in the browser; nothing of npm is needed at run time.
AXE := tests/browser/node_modules/axe-core/axe.min.js
LANE := .ci/lane
# The paper's printed gains are never certified: nothing of them is generated or committed.
PRINTED := $(sort $(wildcard examples/*_printed.yaml))
EXAMPLES := $(filter-out $(PRINTED),$(sort $(wildcard examples/*.yaml)))
# Compilers, checkers, the prover and the emulated target of the generated C; the page's browser.
TOOLS := gcc g++ make cmake clang clang++ clang-tidy cppcheck frama-c x86_64-w64-mingw32-gcc \
  arm-none-eabi-gcc qemu-system-arm chromium npm
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: demo test test-all bench centers baselines conservatism tight generated targets figures \
  gallery docs install tools clean

demo: install
	@$(BIN)/bfppc-synth examples/paper_example_2.yaml --out build/paper_example_2

test: install tools $(AXE)
	@$(LANE) lint $(BIN)/ruff check --quiet .
	@$(LANE) format $(BIN)/ruff format --check --quiet .
	@$(LANE) types $(BIN)/mypy --no-error-summary
	@$(LANE) imports $(BIN)/lint-imports >build/imports.log || { cat build/imports.log; exit 1; }
	@tail -n 1 build/imports.log
	@$(BIN)/python -m pytest -n auto --dist worksteal

# The same tests with ten times the random cases.
test-all: export BFPPC_TESTS := all
test-all: test

bench: install
	@$(BIN)/python benchmarks/bench_speed.py
	@$(BIN)/python benchmarks/bench_c.py
	@$(BIN)/python benchmarks/bench_campaign.py

centers: install
	@$(BIN)/python benchmarks/compare_centers.py

# docs/baselines.md: other methods on the same plants; some minutes.
baselines: install
	@$(BIN)/python benchmarks/compare_baselines.py

# docs/conservatism.md: how far gains may be weakened before an attack from outside succeeds.
conservatism: install
	@$(BIN)/python benchmarks/attack_from_outside.py

# docs/tight.md: every plant by termwise and by tight bounds; some minutes.
tight: install
	@$(BIN)/python benchmarks/bench_tight.py

generated: install
	@set -e; for plant in $(EXAMPLES); do $(BIN)/bfppc-synth $$plant --quiet; done

# Instructions and bytes of every committed controller on an emulated Cortex-M4F.
targets: install tools
	@$(BIN)/python docs/measure_targets.py

figures: install
	@$(BIN)/python docs/draw_picture.py
	@$(BIN)/python docs/draw_paper_figures.py

# docs/gallery.md and its pictures, from generated/.
gallery: install
	@$(BIN)/python docs/draw_gallery.py

# The manual as a site in build/site; a warning is an error.
docs: install
	@$(BIN)/python docs/reference/write_pages.py
	@NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	@echo 'build/site/index.html'

install: $(STAMP)

$(STAMP): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo 'Python 3.11 or newer is needed: make PYTHON=/path/to/python3.11 $(MAKECMDGOALS)' >&2; exit 1; }
	@$(BIN)/python -c '' 2>/dev/null || $(PYTHON) -m venv --clear $(VENV) \
	  || { echo 'python -m venv failed; Debian and Ubuntu keep it in the package python3-venv' >&2; exit 1; }
	@$(LANE) install $(BIN)/python -m pip install -qq --no-input --no-deps --no-compile --requirement requirements.lock
	@$(BIN)/python -m pip install -qq --no-input --no-deps --no-build-isolation --editable .
	@mkdir -p build
	@touch $@

$(AXE): tests/browser/package-lock.json | tools
	@$(LANE) npm npm ci --prefix tests/browser --silent --no-audit --no-fund
	@touch $@

# A test that cannot run is a failure, so the compilers are asked for before anything starts.
tools:
	@mkdir -p build
	@for tool in $(TOOLS); do command -v $$tool >/dev/null \
	  || { echo "$$tool is missing: the tests compile, check and run the generated C and open the page;" \
	  ".ci/run installs what they need" >&2; exit 1; }; done

clean:
	rm -rf build dist tests/browser/node_modules .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache $(VENV)
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
