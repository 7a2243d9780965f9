# make run     every command on every test definition, and the figures of the paper under results/figures
# make test    the tests         make lint    style, types, layers
# make bench   measured numbers beside their targets         make score   the closed loop on synthetic tests
# make schema  the JSON schema of the definitions, after an effect was added or changed
# make clean   removes results and caches, keeps .venv

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
TWINDISC := $(BIN)/twindisc
RUNTIME := $(VENV)/.runtime
DEVELOPMENT := $(VENV)/.development
SOURCES := $(shell find twindisc_cli -name '*.py' -o -name '*.npz' -o -name '*.html' -o -name '*.toml')

# Two commands at a time, each on one core.
MAKEFLAGS += --jobs=2
export OMP_NUM_THREADS = 1

.PHONY: run test lint bench score schema clean
.DELETE_ON_ERROR:

$(RUNTIME): pyproject.toml constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e .
	touch $@

$(DEVELOPMENT): $(RUNTIME)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	touch $@

# What is run on which definition, TEST_COMMAND_OPTIONS with it. A result depends on its definition, on data/NAME_*.csv and on the program.
FRICTION := friction-chart identify-mu contact check
ambient_COMMANDS := $(FRICTION) simulate-wear fit-k thermal
cryogenic_COMMANDS := $(FRICTION) simulate-wear fit-k thermal
eurosprinter_COMMANDS := $(FRICTION)
mtm_running_in_COMMANDS := $(FRICTION)
cryogenic_contact_OPTIONS := --mu 0.6 --creepage 0.2
TESTS := ambient cryogenic eurosprinter mtm_running_in

# Exit code 5 is a negative finding: a result like any other. What is written beside the HDF5 file is made again where it is gone.
define BESIDE
RESULTS += results/$(1)/$(2).$(3)
results/$(1)/$(2).$(3): results/$(1)/$(2).h5
	@test -s $$@ || $(TWINDISC) $(2) $(4) -o results || [ $$$$? -eq 5 ]
	@touch $$@
endef
define RESULT
RESULTS += results/$(1)/$(2).h5
results/$(1)/$(2).h5: configs/$(1).toml $(wildcard data/$(1)_*.csv) $(SOURCES) $(RUNTIME)
	$(TWINDISC) $(2) $$< $($(1)_$(2)_OPTIONS) -o results --force || [ $$$$? -eq 5 ]
$(call BESIDE,$(1),$(2),png,configs/$(1).toml $($(1)_$(2)_OPTIONS))
endef
$(foreach test,$(TESTS),$(foreach command,$($(test)_COMMANDS),$(eval $(call RESULT,$(test),$(command)))))

# close-loop: the nitrogen test is predicted from the one in air; the others stand alone.
define LOOP
RESULTS += results/$(1)/close-loop.h5
results/$(1)/close-loop.h5: $(foreach test,$(1) $(2),configs/$(test).toml $(wildcard data/$(test)_*.csv)) $(SOURCES) $(RUNTIME)
	$(TWINDISC) close-loop configs/$(1).toml $(if $(2),--validate configs/$(2).toml) -o results --force || [ $$$$? -eq 5 ]
$(foreach kind,png html,$(call BESIDE,$(1),close-loop,$(kind),configs/$(1).toml $(if $(2),--validate configs/$(2).toml))
)
endef
$(eval $(call LOOP,ambient,cryogenic))
$(eval $(call LOOP,cryogenic,))
$(eval $(call LOOP,eurosprinter,))
$(eval $(call LOOP,mtm_running_in,))

# The paper's figures: which command's page of which tests shows them. Figs. 1, 3 and 10 are sketches. Figs. 4 and 5 are
# at mu = 0.6 and 0.2 %, an illustrative case that no step of the test ran at. Fig. 14 needs the K from air.
define FIGURE
FIGURES += results/figures/$(1)_$(2).png
results/figures/$(1)_$(2).png: results/$(2)/$(3).png
	@mkdir -p $$(@D) && cp results/$(2)/$(3).png $$@
endef
figures = $(foreach number,$(1),$(foreach test,$(2),$(eval $(call FIGURE,$(number),$(test),$(3)))))
$(call figures,fig02,ambient cryogenic,identify-mu)
$(call figures,fig04 fig05,cryogenic,contact)
$(call figures,fig06 fig07,ambient cryogenic,friction-chart)
$(call figures,fig08 fig12,ambient cryogenic,simulate-wear)
$(call figures,fig09,ambient cryogenic,fit-k)
$(call figures,fig11,ambient,fit-k)
$(call figures,fig13,ambient cryogenic,thermal)
$(call figures,fig14,cryogenic,simulate-wear)
$(call figures,loop,$(TESTS),close-loop)

run: $(RESULTS) $(FIGURES)
	@printf '%s\n' $(sort $(FIGURES))

test: $(DEVELOPMENT)
	$(BIN)/python -m pytest -n 2 --dist worksteal

lint: $(DEVELOPMENT)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(DEVELOPMENT)
	$(BIN)/python tests/bench.py

# The table goes into the README, between its two marks.
score: $(DEVELOPMENT)
	@mkdir -p results docs
	$(BIN)/python -m tests.score --json results/score.json --figure docs/score.png > results/score.txt
	@cat results/score.txt
	@sed -i -e '/^<!-- score begins/,/^<!-- score ends/{/^<!--/!d}' README.md
	@printf '```\n%s\n```\n![Detection and attribution over the size of the effect, and how often what is told as probable is right](docs/score.png)\n' "$$(cat results/score.txt)" | \
	  sed -i -e '/^<!-- score begins/r /dev/stdin' README.md

schema: $(RUNTIME)
	$(TWINDISC) schema > schema.tmp && mv schema.tmp twindisc_cli/definition/test.schema.json

clean:
	rm -rf results .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
