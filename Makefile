# make run     every command on every test definition, and the figures of the paper under results/figures
# make figures the figures of the paper one by one, and what they need
# make test    the tests         make lint    style, types, layers
# make dist    wheel and source distribution in build/dist         make test-minimum   these alone, with the oldest versions
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

# A campaign uses all cores; one of them after the other.
.NOTPARALLEL:
export OMP_NUM_THREADS = 1

.PHONY: run figures test dist test-minimum test-python lint fuzz bench score records docs schema clean

$(RUNTIME): pyproject.toml constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .
	touch $@

$(DEVELOPMENT): $(RUNTIME)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	touch $@

$(DOCUMENTATION): $(RUNTIME)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[docs]'
	touch $@

# Every command on every definition in configs/ that has what it needs; a definition is named as its file. What is there
# and up to date is not computed again, unless the program changed. Exit code 5 is a negative finding: a result.
DEFINITIONS := $(wildcard configs/*.toml)
named = $(patsubst configs/%.toml,%,$(1))
holding = $(shell grep -lE '$(1)' $(DEFINITIONS))
WORN := $(call holding,^(profile|mass) *=)
friction-chart_ON := $(DEFINITIONS)
identify-mu_ON := $(DEFINITIONS)
contact_ON := $(DEFINITIONS)
check_ON := $(DEFINITIONS)
simulate-wear_ON := $(WORN)
fit-k_ON := $(WORN)
thermal_ON := $(call holding,^\[thermal\])
# The slips of Lewis and Dwyer-Joyce are eight tests apart: a loop over them as one history would find effects of time.
LOOPS := $(filter-out configs/lewis2004.toml,$(DEFINITIONS))
close-loop_ON := $(filter-out configs/ambient.toml,$(LOOPS))
close-loop_MORE := close-loop.html revised.toml
COMMANDS := friction-chart identify-mu contact check simulate-wear fit-k thermal close-loop

INPUTS := $(wildcard data/*.csv) $(SOURCES) $(RUNTIME)
anew = $(if $(filter $(SOURCES),$?),--force)
done = || [ $$? -eq 5 ]

define CAMPAIGN
$(1)_FILES := results/campaign-$(1).csv $(foreach test,$(call named,$($(1)_ON)),results/$(test)/$(1).h5 results/$(test)/$(1).png $($(1)_MORE:%=results/$(test)/%))
RESULTS += $$($(1)_FILES)
$$($(1)_FILES) &: $($(1)_ON) $(INPUTS)
	$(TWINDISC) campaign $(1) $($(1)_ON) -o results $$(anew) $$(done)
	@touch -c $$($(1)_FILES)
endef
$(foreach command,$(COMMANDS),$(eval $(call CAMPAIGN,$(command))))

# By itself: the nitrogen test predicted from the one in air.
PREDICTED := $(addprefix results/ambient/,close-loop.h5 close-loop.png $(close-loop_MORE))
$(PREDICTED) &: configs/ambient.toml configs/cryogenic.toml $(INPUTS)
	$(TWINDISC) close-loop configs/ambient.toml --validate configs/cryogenic.toml -o results $(anew) $(done)
	@touch -c $(PREDICTED)

# The figures of the paper by number (1, 3 and 10 are sketches, which it has not), and a sheet of its model beside the one
# that the closed loop revised on the test in air.
PAPER_FIGURES := $(addsuffix .png,fig02 fig04 fig05 fig06 fig07 fig08 fig09 fig11 fig12 fig13 fig14 before_and_after)
PAPER := $(addprefix results/paper/,paper.h5 $(PAPER_FIGURES))
$(PAPER) &: configs/ambient.toml configs/cryogenic.toml results/ambient/revised.toml $(INPUTS)
	$(TWINDISC) paper configs/ambient.toml configs/cryogenic.toml --revised results/ambient/revised.toml -o results $(anew)
	@touch -c $(PAPER)

# Figures to look at, in one folder: the paper's, and the closed loop of each test.
FIGURES := $(addprefix results/figures/,$(PAPER_FIGURES)) $(patsubst configs/%.toml,results/figures/loop_%.png,$(LOOPS))
$(addprefix results/figures/,$(PAPER_FIGURES)): results/figures/%: results/paper/%
	@mkdir -p $(@D) && cp $< $@
results/figures/loop_%.png: results/%/close-loop.png
	@mkdir -p $(@D) && cp $< $@

figures: $(FIGURES)
	@printf '%s\n' $(sort $(FIGURES))

run: $(RESULTS) $(PREDICTED) $(PAPER) $(FIGURES)
	@printf '%s\n' $(sort $(FIGURES))

test: $(DEVELOPMENT)
	$(BIN)/python -m pytest -n 2 --dist worksteal

dist: $(DEVELOPMENT)
	rm -rf build/dist build/lib
	$(BIN)/python -m build --outdir build/dist .

# The wheel by itself, through the tests of the unpacked source: with the oldest versions that pyproject.toml allows, and
# with the newest there are on other versions of Python. Each in a folder of its own under build/alone.
PYTHONS := python3.12 python3.13
define ALONE
	rm -rf build/alone/$(1) && mkdir -p build/alone/$(1)
	tar -xzf build/dist/twindisc-*.tar.gz -C build/alone/$(1) --strip-components=1
	find build/alone/$(1)/twindisc_cli -name '*.py' -delete
	$(1) -m venv build/alone/$(1)/.venv
	build/alone/$(1)/.venv/bin/python -m pip install --quiet --disable-pip-version-check $(2) \
	  "$$(ls build/dist/*.whl)[test,cluster,rigs]"
	build/alone/$(1)/.venv/bin/python -m pip check
	cd build/alone/$(1) && .venv/bin/python -m pytest -n 2 --dist worksteal

endef

test-minimum: dist
	$(BIN)/python tests/minimum_versions.py > build/pins.txt
	$(call ALONE,$(PYTHON),-c build/pins.txt)

test-python: dist
	$(foreach python,$(PYTHONS),$(call ALONE,$(python),))

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
	$(BIN)/python tests/bench.py $(BENCH)

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
