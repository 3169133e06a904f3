# make, or make help: what can be made. A text behind two number signs is what it prints.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
OUT ?= out/demo
# rendered once, then kept
HOUSE ?= out/house

# No wheel of llama-cpp-python is on PyPI: it compiles once (7 minutes on two cores), after that pip's cache has it.
# Native code would crash on CPUs that advertise AMX where the kernel forbids it.
export CMAKE_ARGS ?= -DGGML_NATIVE=OFF -DLLAVA_BUILD=OFF
PIP_INSTALL = $(BIN)/python -m pip install --quiet --constraint constraints.txt

QUESTIONS = "where is the sofa" "the monitor upstairs" "which chair is closest to the stove" \
    "the lamp on the nightstand" "find the swimming pool"

.PHONY: help demo test check docs clean

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "make %-6s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

demo: $(VENV)/.installed  ## set everything up in .venv, map a generated two-floor house, ask five questions
	$(BIN)/placegraph house --seed 9002 --floors 2 --out $(HOUSE) --replace
	rm -rf $(OUT)
	$(BIN)/placegraph run configs/demo.toml --source $(HOUSE) --out $(OUT) --endpoint tcp/127.0.0.1:7461
	@for question in $(QUESTIONS); do \
	    echo; echo "? $$question"; $(BIN)/placegraph ask $(OUT) "$$question" || [ $$? -eq 3 ] || exit 1; \
	done
	@echo; echo "against the truth:"; $(BIN)/placegraph evaluate map $(OUT) --source $(HOUSE)
	@echo; echo "the plan:    $(HOUSE)/plan.png"; echo "the map:     $(OUT)"; \
	    echo "look at it:  $(BIN)/placegraph view $(OUT)"

test: $(VENV)/.installed-dev  ## set up what tests need and run them all
	$(BIN)/python -m pytest -q

check: $(VENV)/.installed-dev  ## lint, format, types, documentation
	PYTHON=$(BIN)/python tools/check.sh

docs: $(VENV)/.installed-dev  ## the documentation as a site: build/site/index.html
	$(BIN)/python docs/generate.py
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet
	@echo "the site: build/site/index.html"

$(VENV)/.installed: pyproject.toml constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(PIP_INSTALL) --editable '.[demo]'
	touch $@

$(VENV)/.installed-dev: $(VENV)/.installed
	$(PIP_INSTALL) --editable '.[dev,demo,docs,oak]'
	$(PIP_INSTALL) --no-deps spark-dsg  # a test reads our export with it; its plotting packages are not needed
	touch $@

clean:  ## remove .venv, build and out
	rm -rf $(VENV) build out
