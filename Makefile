VENV := .venv
STAMP := $(VENV)/.setup-done
BIN := $(VENV)/bin
PYTEST := $(BIN)/python -m pytest -q -n 2 --dist loadfile

.DEFAULT_GOAL := help
.PHONY: help setup demo check test test-all bench clean

help: ## list the targets
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

setup: $(STAMP) ## create .venv with libLLVM, torch, Mitsuba and vlnhijack

$(STAMP): pyproject.toml constraints.txt tools/setup.sh
	tools/setup.sh $(VENV)
	@touch $@

demo: setup ## hijack an agent in a shipped house
	$(BIN)/vlnhijack run experiments/quickstart.yaml --resume

check: setup ## format, lint, types, import directions, fast unit tests
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(PYTEST) -x -m "not slow" tests/unit

test: setup ## every test that is not slow
	$(PYTEST) -m "not slow"

test-all: setup ## every test
	$(PYTEST)

bench: setup ## time, memory and error of the renderers, into bench/
	$(BIN)/vlnhijack bench render scenes/cedar --out bench

clean: ## remove .venv and caches; runs/ stays
	rm -rf $(VENV) bench *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
