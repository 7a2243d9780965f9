# make run     every command on every test definition, and the figures of the paper under results/figures
# make figures the figures of the paper one by one, and what they need
# make test    style, types, layers and the tests         make lint    without the tests
# make test-long   draws of many seeds, real records in parts, campaigns that are stopped, the pages of the documentation: ten minutes more
# make dist    wheel and source distribution in build/dist, the same bytes each time         make test-minimum   these alone, with the oldest versions
# make test-python   these alone, on Python 3.12 and 3.13, with the newest versions: PYTHONS="python3.12 /opt/python3.13/bin/python3"
# make bench   measured numbers beside their targets         make score   the closed loop on synthetic tests
# make records the closed loop on real records, beside eight standard laws: RECORDS="--record eurosprinter --kind blocks"
# make fuzz    broken input by the thousand: no traceback, no hang
# make docs    the documentation as a site in build/site
# make schema  the JSON schema of the definitions, after an effect was added or changed
# make clean   removes results and caches, keeps .venv

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
TWINDISC := $(BIN)/twindisc
RUNTIME := $(VENV)/.runtime
DEVELOPMENT := $(VENV)/.development
DOCUMENTATION := $(VENV)/.documentation
SOURCES := $(shell find twindisc_cli -name '*.py' -o -name '*.npz' -o -name '*.html' -o -name '*.toml')

# `make -j2 run` computes two results at a time.
export OMP_NUM_THREADS = 1

.PHONY: run figures test test-long dist test-minimum test-python lint fuzz bench score records docs schema clean

# The environment, made where it is not there, and pip in it: what to install follows.
install = { test -x $(BIN)/python || $(PYTHON) -m venv $(VENV); } && \
  $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

$(RUNTIME): pyproject.toml constraints.txt
	$(install) -e .
	touch $@

# It holds what runs the program, too: one call of pip, not two. What no test imports is not compiled.
$(DEVELOPMENT): pyproject.toml constraints.txt
	$(install) --no-compile -e '.[dev]'
	test -e $(RUNTIME) || touch $(RUNTIME)
	touch $@

$(DOCUMENTATION): $(RUNTIME)
	$(install) -e '.[docs]'
	touch $@

# Every command on every definition in configs/ that has what it needs. A definition is named as its file, so that
# results/ambient/check.png is what `twindisc check configs/ambient.toml` draws. The program itself knows what is up to
# date; it is made to compute again where the program changed. Exit code 5 is a negative finding: a result.
DEFINITIONS := $(wildcard configs/*.toml)
TESTS := $(DEFINITIONS:configs/%.toml=%)
HEATED := $(patsubst configs/%.toml,%,$(shell grep -lE '^\[thermal\]' $(DEFINITIONS)))
WORN := $(patsubst configs/%.toml,%,$(shell grep -lE '^(profile|mass) *=' $(DEFINITIONS)))

# $(call files,COMMAND,TESTS): the file and the figure of a command for each test.
files = $(2:%=results/%/$(1).h5) $(2:%=results/%/$(1).png)
RESULTS := \
  $(call files,friction-chart,$(TESTS)) \
  $(call files,identify-mu,$(TESTS)) \
  $(call files,contact,$(TESTS)) \
  $(call files,check,$(TESTS)) \
  $(call files,simulate-wear,$(WORN)) \
  $(call files,fit-k,$(WORN)) \
  $(call files,thermal,$(HEATED)) \
  $(call files,close-loop,$(TESTS)) $(TESTS:%=results/%/close-loop.html) $(TESTS:%=results/%/revised.toml)

INPUTS := $(wildcard data/*.csv) $(SOURCES) $(RUNTIME)
done = || [ $$? -eq 5 ]
# $(call compute,COMMAND): run it on the definition of a rule; what was up to date is as good as new.
compute = $(TWINDISC) $(1) $< -o results $(done) && touch -c results/$*/$(1).h5 results/$*/$(1).png

results/%/friction-chart.h5 results/%/friction-chart.png: configs/%.toml $(INPUTS)
	$(call compute,friction-chart)
results/%/identify-mu.h5 results/%/identify-mu.png: configs/%.toml $(INPUTS)
	$(call compute,identify-mu)
results/%/contact.h5 results/%/contact.png: configs/%.toml $(INPUTS)
	$(call compute,contact)
results/%/check.h5 results/%/check.png: configs/%.toml $(INPUTS)
	$(call compute,check)
results/%/simulate-wear.h5 results/%/simulate-wear.png: configs/%.toml $(INPUTS)
	$(call compute,simulate-wear)
results/%/fit-k.h5 results/%/fit-k.png: configs/%.toml $(INPUTS)
	$(call compute,fit-k)
results/%/thermal.h5 results/%/thermal.png: configs/%.toml $(INPUTS)
	$(call compute,thermal)
results/%/close-loop.h5 results/%/close-loop.png results/%/close-loop.html results/%/revised.toml: configs/%.toml $(INPUTS)
	$(call compute,close-loop) results/$*/close-loop.html results/$*/revised.toml

# By itself: the nitrogen test predicted from the one in air.
PREDICTED := $(addprefix results/ambient/,close-loop.h5 close-loop.png close-loop.html revised.toml)
$(PREDICTED) &: configs/ambient.toml configs/cryogenic.toml $(INPUTS)
	$(TWINDISC) close-loop configs/ambient.toml --validate configs/cryogenic.toml -o results $(done)
	@touch -c $(PREDICTED)

# The figures of the paper by number (1, 3 and 10 are sketches, which it has not), and a sheet of its model beside the one
# that the closed loop revised on the test in air.
PAPER_FIGURES := $(addsuffix .png,fig02 fig04 fig05 fig06 fig07 fig08 fig09 fig11 fig12 fig13 fig14 before_and_after)
PAPER := $(addprefix results/paper/,paper.h5 $(PAPER_FIGURES))
$(PAPER) &: configs/ambient.toml configs/cryogenic.toml results/ambient/revised.toml $(INPUTS)
	$(TWINDISC) paper configs/ambient.toml configs/cryogenic.toml --revised results/ambient/revised.toml -o results
	@touch -c $(PAPER)

# Figures to look at, in one folder: the paper's, and the closed loop of each test.
FIGURES := $(addprefix results/figures/,$(PAPER_FIGURES)) $(TESTS:%=results/figures/loop_%.png)
$(addprefix results/figures/,$(PAPER_FIGURES)): results/figures/%: results/paper/%
	@mkdir -p $(@D) && cp $< $@
results/figures/loop_%.png: results/%/close-loop.png
	@mkdir -p $(@D) && cp $< $@

figures: $(FIGURES)
	@printf '%s\n' $(sort $(FIGURES))

run: $(RESULTS) $(PAPER) $(FIGURES)
	@printf '%s\n' $(sort $(FIGURES))

test: lint
	$(BIN)/python -m pytest -n 2 --dist worksteal

test-long: $(DEVELOPMENT)
	$(BIN)/python -m pytest -n 2 --dist worksteal -m long

# The same files give the same bytes: dated as SOURCE_DATE_EPOCH says, else as the last commit; packed in order, by nobody.
dist: export SOURCE_DATE_EPOCH ?= $(shell git log -1 --format=%ct 2>/dev/null || echo 315532800)
dist: $(DEVELOPMENT)
	rm -rf build/dist build/lib
	umask 022 && $(BIN)/python -m build --outdir build/dist .
	cd build/dist && tar -xzf twindisc-*.tar.gz && rm twindisc-*.tar.gz && for folder in twindisc-*/; do \
	  tar --sort=name --format=gnu --mtime=@$$SOURCE_DATE_EPOCH --owner=0 --group=0 --numeric-owner --mode=u=rwX,go=rX \
	    -cf - $$folder | gzip -n9 > $${folder%/}.tar.gz && rm -r $$folder; done

# The wheel by itself, through the tests of the unpacked source: with the oldest versions that pyproject.toml allows, and
# with the newest there are on other versions of Python. Each in a folder of its own under build/alone.
PYTHONS := python3.12 python3.13

test-minimum: dist
	$(BIN)/python tests/minimum_versions.py > build/pins.txt
	sh tests/alone.sh $(PYTHON) -c build/pins.txt

test-python: dist
	for python in $(PYTHONS); do sh tests/alone.sh $$python || exit 1; done

lint: $(DEVELOPMENT)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# Mutated definitions, tables and results, extreme physics, kills: 100,000 cases take half an hour. FUZZ="--tables 1000 --seed 7"
fuzz: $(DEVELOPMENT)
	$(BIN)/python -m tests.fuzz $(FUZZ)

# Cases are drawn anew by a seed: BENCH="--seed 7 drawn"
bench: $(DEVELOPMENT)
	PYTHONPATH=. $(BIN)/python tests/bench.py $(BENCH)

# The table goes into docs/score.md, between its two marks.
score: $(DEVELOPMENT)
	@mkdir -p results docs
	$(BIN)/python -m tests.score --json results/score.json --figure docs/score.png > results/score.txt
	@cat results/score.txt
	@sed -i -e '/^<!-- score begins/,/^<!-- score ends/{/^<!--/!d}' docs/score.md
	@printf '```\n%s\n```\n![Detection and attribution over the size of the effect, and how often what is reported as probable is right](score.png)\n' "$$(cat results/score.txt)" | \
	  sed -i -e '/^<!-- score begins/r /dev/stdin' docs/score.md

# The table goes into docs/records.md, between its two marks; a part of it, by RECORDS, is printed only.
records: $(DEVELOPMENT)
	@mkdir -p results docs
	$(BIN)/python -m tests.records $(RECORDS) $(if $(RECORDS),,--json results/records.json --figure docs/real-records.png) > results/records.txt
	@cat results/records.txt
ifeq ($(RECORDS),)
	@sed -i -e '/^<!-- records begin/,/^<!-- records end/{/^<!--/!d}' docs/records.md
	@printf '```\n%s\n```\n' "$$(cat results/records.txt)" | sed -i -e '/^<!-- records begin/r /dev/stdin' docs/records.md
endif

# The site, in build/site: every command and figure in it is made here.
docs: $(DOCUMENTATION)
	$(BIN)/python docs/build.py build/pages
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict --config-file build/mkdocs.yml

schema: $(RUNTIME)
	$(TWINDISC) schema > schema.tmp && mv schema.tmp twindisc_cli/definition/test.schema.json

clean:
	rm -rf results build .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
