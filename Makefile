# Everything is set up here: on a fresh Debian machine `make walker` or `make test` is all that is needed.
.DEFAULT_GOAL := help
SHELL := /bin/bash
PYTHON ?= python3
WALKERS := .venv/bin/walkers
OUT ?= runs
CASE ?= fig1b
PILE ?= pile-small
FILM ?= 360p
SWEEP ?= fig2
CALIBRATION ?= ruby
PIP := .venv/bin/python -m pip install --quiet --disable-pip-version-check -c requirements.txt

.PHONY: help
help: ## List the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-12s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

.PHONY: walker
walker: setup ## Run the walker of Fig. 1b (or CASE=...): velocity, pictures, a film, ParaView files
	@$(WALKERS) run $(CASE) --runs $(OUT)
	@echo "pictures:"
	@$(WALKERS) plot $(CASE) --runs $(OUT) | sed 's/^/  /'
	@$(WALKERS) render $(CASE) --runs $(OUT) | sed 's/^/  /'
	@echo "film:"
	@$(WALKERS) render --film $(CASE) --size $(FILM) --runs $(OUT) | sed 's/^/  /'
	@echo "for ParaView:"
	@$(WALKERS) export $(CASE) --format vtk --runs $(OUT) | sed 's/^/  /'

.PHONY: sweep
sweep: setup $(if $(SITE),.venv/with-cluster) ## Run what is missing of SWEEP=fig2 on all cores (SITE=cluster.toml: on that cluster), print its table
	@$(WALKERS) sweep $(SWEEP) --runs $(OUT) $(if $(SITE),--site $(SITE)) $(if $(JOBS),--jobs $(JOBS)); status=$$?; \
	  [ $$status -gt 1 ] || $(WALKERS) list $(basename $(notdir $(SWEEP))) --runs $(OUT); exit $$status

.PHONY: pile
pile: setup ## Shake the small pile until a cluster climbs (or PILE=pile-fig1a): pictures, a film; goes on where it was interrupted
	@$(MAKE) --no-print-directory walker CASE=$(PILE) OUT=$(OUT) FILM=$(if $(filter file,$(origin FILM)),720p,$(FILM))

.PHONY: figures
figures: setup .venv/with-theory ## The paper's figures, and its facts beside ours, in figures/ (runs what is missing)
	@.venv/bin/python -m studies.paper --runs $(OUT) $(if $(JOBS),--jobs $(JOBS))

.PHONY: calibrate
calibrate: setup .venv/with-calibrate ## Calibrate friction and drag to the published numbers (CALIBRATION=ruby); goes on where it was interrupted
	@$(WALKERS) calibrate $(CALIBRATION) --runs $(OUT) $(if $(JOBS),--jobs $(JOBS))

# Tests start hundreds of Python processes; each would compile its imports where the environment forbids bytecode. Tests
# that run beside others have no cores for the threads of NumPy's libraries.
test test-slow: export PYTHONDONTWRITEBYTECODE :=
test test-slow: export OMP_NUM_THREADS := 1

.PHONY: test
test: setup cluster chromium .venv/with-dev ## Lint, check types, run the tests (a 2-bead smoke test first)
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	.venv/bin/lint-imports
	@# Types are checked beside the tests, which leave a part of two cores idle.
	@mkdir -p build; .venv/bin/mypy > build/types.txt & types=$$!; \
	  make --silent build/integrators & built=$$!; \
	  .venv/bin/pytest -q -m smoke tests/test_program.py && { wait $$built; \
	  .venv/bin/pytest -q -n 3 --dist worksteal -m "not smoke and not slow"; }; tests=$$?; \
	  wait $$types; typed=$$?; cat build/types.txt; exit $$((tests | typed))

# Both integrators are compiled once, beside the smoke test; each worker of the tests would by itself.
build/integrators: walkers/theory/stepping.py walkers/second_engine/kernels.py
	@{ $(WALKERS) show fig1b --theory; .venv/bin/pytest -q tests/test_check.py -k momentum; } > /dev/null && touch $@

.PHONY: test-slow
test-slow: setup chromium paraview .venv/with-notebooks .venv/with-docs ## Run what `make test` leaves out: what only a release needs
	.venv/bin/python tests/tools/plant_faults.py check
	.venv/bin/pytest -q -n 2 -m slow

.PHONY: audit
audit: setup .venv/with-check ## Prove what the installed engine does, beside a second engine and closed forms
	@$(WALKERS) check engine

.PHONY: validate
validate: setup .venv/with-check ## Check it against published benchmarks, exact solutions and a second engine (under ten minutes)
	@.venv/bin/python -m studies.literature --runs $(OUT)

.PHONY: docs-pictures
docs-pictures: setup .venv/with-dev ## Make what docs/ shows and is not of today's parameters: pictures, tables, outputs, numbers (ONLY=fig2: that)
	@.venv/bin/python -m docs.illustrations $(OUT) docs $(ONLY)

.PHONY: docs
docs: setup .venv/with-docs ## Build the documentation into build/site, to be opened from disk; runs its examples
	@.venv/bin/python -m sphinx -q -W --keep-going -d build/doctrees docs build/site
	@echo "open build/site/index.html"

.PHONY: paper
paper: setup chromium .venv/with-docs .venv/with-dev ## The whole comparison with the paper as one article, build/paper/article.html and .pdf
	@.venv/bin/python -m docs.illustrations $(OUT) docs
	@.venv/bin/python -m studies.article build/paper

.PHONY: joss
joss: pandoc ## Build the paper about the program (docs/joss/paper.md) into build/joss.html
	@mkdir -p build && pandoc docs/joss/paper.md --from markdown --citeproc --bibliography docs/joss/paper.bib \
	  --standalone --metadata author= --output build/joss.html
	@echo "open build/joss.html"

.PHONY: bench
bench: setup codes .venv/with-dev ## Measure the speeds of docs/explanation/performance.md, beside Debian's LAMMPS and YADE
	.venv/bin/python -m tests.benchmark

.PHONY: clean
clean: ## Remove the environment and caches, never the runs
	rm -rf .venv .mypy_cache .ruff_cache .pytest_cache build *.egg-info docs/gallery

.PHONY: extras
extras: setup .venv/with-all ## Install what reports, archives, calibrations, the theory, checks and clusters need

.PHONY: setup
setup: plan engine .venv/ready ## Install what is missing: liggghts and what compiles its contact model (apt-get), and .venv
	@# Where PYTHONDONTWRITEBYTECODE is set, each command would compile what it imports: half of its time.
	@.venv/bin/python -m compileall -q walkers
	@.venv/bin/python -c "from walkers.runner.compiled_model import compile_model; compile_model()"

# What `make` is going to install, in a line each, before it begins. DEBIAN and EXTRA are those of the target.
DEBIAN := engine
EXTRA := film
test: DEBIAN := engine cluster chromium
test: EXTRA := dev
.PHONY: plan
plan:
	@$(foreach group,$(DEBIAN),$(call has,$(group)) || \
	  echo "to install with apt-get ($(SIZE_$(group))): $(PACKAGES_$(group))";) \
	ready=.venv/$(if $(filter film,$(EXTRA)),ready,with-$(EXTRA)); \
	if [ requirements.txt -nt $$ready ] || [ pyproject.toml -nt $$ready ]; then \
	  echo "to install with pip into .venv ($(SIZE_$(EXTRA))): granular-walkers[$(EXTRA)] and what it needs"; fi
SIZE_film := 1.2 GB
SIZE_dev := 1.8 GB

# Debian packages of targets, the commands and files without which they are installed, and their size on a bare Debian.
# The engine, what its contact model is compiled with, Mesa, by which pictures are drawn without a screen, and `ip`, by
# which mpirun is kept off the network.
ENGINE := liggghts openmpi-bin g++ libliggghts-dev libopenmpi-dev libegl1 libgl1 libgl1-mesa-dri libxrender1 iproute2
PACKAGES_engine := $(ENGINE)
NEEDED_engine := liggghts mpirun g++ mpicxx /usr/include/liggghts /usr/lib/*/libEGL.so.1 ip
SIZE_engine := 1 GB
PACKAGES_chromium := chromium
NEEDED_chromium := chromium
SIZE_chromium := 0.5 GB
PACKAGES_paraview := paraview python3-paraview xvfb xauth
NEEDED_paraview := pvpython xvfb-run
PACKAGES_pandoc := pandoc
NEEDED_pandoc := pandoc
PACKAGES_codes := lammps yade
NEEDED_codes := lmp yade
PACKAGES_venv-package := python3-venv
NEEDED_venv-package := /usr/lib/python3*/ensurepip
# The tests start a throw-away SLURM of their own where they are root; elsewhere they leave that out and say so.
PACKAGES_cluster := slurm-wlm munge
NEEDED_cluster := $(if $(filter 0,$(shell id -u)),/usr/sbin/slurmctld)
SIZE_cluster := 40 MB
# Whether all commands and files of a group are there.
has = ( for needed in $(NEEDED_$(1)); do command -v $$needed || ls -d $$needed || exit 1; done ) >/dev/null 2>&1

# As root, through sudo, or with one message for whoever is root.
# Without what Debian recommends: with liggghts that is ParaView, 2.4 GB.
.PHONY: engine chromium paraview pandoc codes venv-package cluster
engine chromium paraview pandoc codes venv-package cluster:
	@$(call has,$@) && exit 0; sudo=; echo "installing $(PACKAGES_$@)"; \
	if [ "$$(id -u)" != 0 ]; then sudo=sudo; command -v sudo >/dev/null && { [ -t 0 ] || sudo -n true 2>/dev/null; } || { \
	  echo "$@ is missing and cannot be installed without root. Ask an administrator to run: apt-get install $(PACKAGES_$@)" >&2; exit 1; }; fi; \
	$$sudo apt-get update -qq && \
	$$sudo env RUNLEVEL=1 DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $(PACKAGES_$@) >/dev/null

.venv/ready: requirements.txt pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "Python 3.11 or newer is needed: make PYTHON=/path/to/python3.11" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || $(MAKE) --no-print-directory venv-package
	@echo "installing Python packages into .venv"
	@rm -rf .venv && $(PYTHON) -m venv .venv
	@$(PIP) --editable '.[film]'
	@touch $@

# What an extra of pyproject.toml names, in a stamp of its own.
.venv/with-%: .venv/ready
	@echo "installing the packages of granular-walkers[$*] into .venv"
	@$(PIP) 'granular-walkers[$*]'
	@touch $@
