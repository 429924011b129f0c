PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --disable-pip-version-check -q --no-compile --use-pep517 -c constraints.txt

# pip compiles nothing: Python does so at the first import, and keeps the result. Many container
# images set this variable, which forbids to keep it: each start would then take twice as long.
unexport PYTHONDONTWRITEBYTECODE

# Libraries that the benchmarks compare with; those that cannot be had are named as absent.
PEERS := pykdtree point-cloud-utils pykeops faiss-cpu

.PHONY: help demo test bench docs pictures lint clean
.DEFAULT_GOAL := help

help:
	@echo "make demo   set up, build the embedded tables, train and compare five regimes (CPU, a quarter of an hour)"
	@echo "make test   set up, run the tests"
	@echo "make bench  set up, compare speed with other libraries (a quarter of an hour)"
	@echo "make docs   set up, build the documentation into site/"
	@echo "make pictures   set up, make pictures in docs/ anew, all or NAME=... (trains what is missing)"
	@echo "make lint   set up, run ruff and mypy"
	@echo "make clean  remove the environment"

demo: $(VENV)/.installed
	$(BIN)/python train.py -m regime=b,w,e,r,posterior category=table name=demo

test: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

bench: $(VENV)/.installed
	@for peer in $(PEERS); do $(PIP) $$peer || echo "$$peer cannot be installed here"; done
	$(BIN)/python -m benchmarks

docs: $(VENV)/.installed-dev
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet
	$(BIN)/python docs/tools/links.py site
	@echo "site/index.html; to search it: $(BIN)/python -m http.server -d site"

pictures: $(VENV)/.installed
	$(PIP) -e '.[pictures]'
	$(BIN)/python docs/tools/pictures.py $(NAME)

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

clean:
	rm -rf $(VENV)

$(VENV)/.created:
	@$(PYTHON) -c "import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))" || \
		{ echo "Python 3.11 to 3.13 is needed; name one with: make PYTHON=python3.11 ..."; exit 1; }
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.installed: $(VENV)/.created pyproject.toml constraints.txt
	@echo "Installing the packages (some minutes, once) ..."
	$(PIP) -e .
	@touch $@

$(VENV)/.installed-dev: $(VENV)/.created pyproject.toml constraints.txt
	@echo "Installing the packages, and those for tests and documentation (some minutes, once) ..."
	$(PIP) -e '.[dev]'
	@touch $(VENV)/.installed $@
