# `make` lists the targets. Every target that needs the environment creates it first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SWEEP := $(BIN)/sweep
STUDIES := $(notdir $(patsubst %/study.toml,%,$(wildcard studies/*/study.toml)))

.DEFAULT_GOAL := help
.PHONY: dist-test test-versions bench-latency bench-scale smoke-scale three test-browser test-faults bench-object-store site notebooks nightly smoke-nightly bench-estimates bench-enclosures bench-extrema bench-first-use bench-optimise bench-basins help setup test test-long lint types imports check smoke bench bench-scene bench-peers study-accuracy smoke-accuracy search-worse search-wrong docs frames clean $(STUDIES:%=study-%) $(STUDIES:%=smoke-%)

help:  ## list the targets
	@grep -hE '^[a-z%-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 22
	@printf 'study-NAME            run or resume one study, into results/NAME\n'
	@printf 'smoke-NAME            its tiny version, into results/smoke/NAME\n'
	@echo "NAME is one of: $(STUDIES)"

$(VENV)/ready: pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit("linksweep needs Python 3.11 or later") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --constraint constraints.txt --editable .
	@touch $@

$(VENV)/dev: $(VENV)/ready
	$(BIN)/python -m pip install --constraint constraints.txt --editable '.[dev]'
	@touch $@

setup: $(VENV)/ready  ## create the environment in .venv, with what studies need; targets that need more add it

test: $(VENV)/dev  ## run the tests, in two processes
	$(BIN)/python -m pytest -n 2 --dist loadfile

test-long: $(VENV)/dev  ## what make test leaves out: slow tests, all parameters, thousands of hostile tables; properties at random; loads against Pinocchio, which it installs
	$(BIN)/python -m pip install --constraint constraints.txt --editable '.[dev,peers]'
	$(BIN)/python -m pytest -m 'long or hypothesis' --hypothesis-profile=random

test-faults: $(VENV)/dev  ## kills, signals, full disks, damage: 150 kills and 375 other faults, a table
	$(BIN)/python -m tests.faults

test-versions: $(VENV)/dev  ## oracle tables, bits and speed with the oldest and the newest dependencies allowed
	$(BIN)/python -m tests.bench.versions

test-browser: $(VENV)/dev  ## the report and exported models in headless Chromium, which has to be installed
	$(BIN)/python -m pytest -m browser

lint: $(VENV)/dev  ## ruff
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/dev  ## mypy --strict
	$(BIN)/mypy

imports: $(VENV)/dev  ## studies -> sweep -> kernels, never back
	$(BIN)/lint-imports

check: lint types imports test  ## what CI runs first

smoke: $(STUDIES:%=smoke-%) smoke-accuracy  ## every study's tiny version

$(STUDIES:%=study-%): study-%: $(VENV)/ready
	$(SWEEP) run studies/$* --out results/$*/designs --report

$(STUDIES:%=smoke-%): smoke-%: $(VENV)/ready
	$(SWEEP) run studies/$* --smoke --force --out results/smoke/$*/designs --report

NIGHTS ?= nights
nightly: $(VENV)/ready  ## all studies into a dated folder under nights/, and what changed since the last good night
	$(SWEEP) nightly studies --into $(NIGHTS) --budget 6h --keep 14

smoke-nightly: $(VENV)/ready  ## the same with every study's tiny version, into nights/smoke
	$(SWEEP) nightly studies --smoke --into $(NIGHTS)/smoke --budget 1h --keep 3

study-accuracy: $(VENV)/dev  ## what accuracy costs in time: writes docs/accuracy.md and docs/accuracy/, about 10 minutes
	$(BIN)/python -m studies.accuracy --out results/accuracy
	$(BIN)/python -m tests.bench.factors

smoke-accuracy: $(VENV)/ready  ## the same on few designs, writes no page
	$(BIN)/python -m studies.accuracy --smoke --out results/smoke/accuracy

bench-peers: $(VENV)/dev  ## next to pylinkage and Pinocchio, which get an environment of their own, and loads next to MuJoCo
	$(PYTHON) -m venv .venv-peers
	.venv-peers/bin/python -m pip install --constraint constraints.txt --editable '.[peers]' 'pylinkage[numba]'
	.venv-peers/bin/python -m tests.bench.peers --out results/accuracy
	.venv-peers/bin/python -m tests.bench.peer_loads --out results/accuracy
	$(BIN)/python -m tests.bench.loads --out results/accuracy
	$(BIN)/python -m tests.bench.programs --out results/accuracy

bench-latency: $(VENV)/dev  ## one design, one pose: next to a plain numba function, and to pylinkage where make bench-peers has been; commands and reports; five minutes
	$(if $(wildcard .venv-peers/bin/python),.venv-peers/bin/python,$(BIN)/python) -m tests.bench.latency

bench-scale: $(VENV)/dev  ## 10^5 to 10^9 samples, to 10^8 designs, and reading them: writes docs/scale.md, about 10 minutes
	$(BIN)/python -m tests.bench.scale --out docs/scale.md

smoke-scale: $(VENV)/dev  ## the same to 10^7, writes no page
	$(BIN)/python -m tests.bench.scale --samples 7 --designs 6

bench-object-store: $(VENV)/dev  ## a dataset by way of an object store; its server gets an environment of its own
	$(PYTHON) -m venv .venv-store
	.venv-store/bin/python -m pip install 'moto[server]'
	.venv-store/bin/moto_server -H 127.0.0.1 -p 5005 & server=$$!; trap "kill $$server" EXIT; sleep 5; \
	$(BIN)/python -m tests.bench.object_store 127.0.0.1:5005

search-worse: $(VENV)/dev  ## look for poses with larger errors than any known; appends to tests/oracle/worst_found.json
	$(BIN)/python -m tests.search.worse

search-wrong: $(VENV)/dev  ## look for design outputs that are wrong though their status is OK: every family, chain and effect; an hour
	$(BIN)/python -m tests.search.wrong

bench: $(VENV)/dev  ## ns per sample against numpy and C; what everything takes, into sweep/costs.toml and docs
	$(BIN)/python -m tests.bench.kernels
	$(BIN)/python -m tests.bench.chains
	$(BIN)/python -m tests.bench.costs
	$(BIN)/python docs/effects_page.py

docs: $(VENV)/dev  ## make docs/effects.md and docs/study.schema.json from the register
	$(BIN)/python docs/effects_page.py
	$(SWEEP) schema > docs/study.schema.json

site: $(VENV)/dev  ## the docs as a site, into build/site; no network
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build
	$(BIN)/python docs/site/links.py build/site

DIST := build/dist
dist-test:  ## wheel and sdist, built and installed in an environment of their own: run, report, explore, read with pandas
	rm -rf $(DIST) && mkdir -p $(DIST)
	$(PYTHON) -m venv $(DIST)/venv
	$(DIST)/venv/bin/python -m pip install --quiet build
	$(DIST)/venv/bin/python -m build --outdir $(DIST) .
	$(DIST)/venv/bin/python -m pip install --quiet --constraint constraints.txt "$$(echo $(DIST)/*.whl)[cad,excel,explore]"
	$(DIST)/venv/bin/python -P tests/dist.py $(DIST)

notebooks: $(VENV)/dev  ## run the notebooks of docs/notebooks in place
	$(BIN)/python docs/site/notebooks.py

frames: $(VENV)/dev  ## draw the frames of all families for their pages
	$(BIN)/python docs/frames.py

bench-estimates: $(VENV)/dev  ## what sweep check expects of every study against what a slice of it takes
	$(BIN)/python -m tests.bench.estimates

bench-extrema: $(VENV)/dev  ## errors and times of the search for true extrema, as in docs/extrema.md
	$(BIN)/python -m tests.bench.extrema

bench-enclosures: $(VENV)/dev  ## Taylor models of the proofs against intervals and balls, as in docs/proof.md; about 2 minutes
	$(BIN)/python -m tests.bench.enclosures

bench-first-use: $(VENV)/dev  ## from an empty cache of kernels to the first number; caches of its own, about 2 minutes; AGAINST=FOLDER takes turns with another checkout
	$(BIN)/python -m tests.bench.first_use $(if $(AGAINST),--against $(AGAINST))

bench-scene: $(VENV)/dev  ## all effects on 10^5 designs x 360 angles: rate, its parts, memory; about 5 minutes
	$(BIN)/python -m tests.bench.effects

bench-optimise: $(VENV)/dev  ## 60 specifications of a crank-rocker, three seeds each: writes docs/internals/optimise-marks.md, about 10 minutes of processor time
	$(BIN)/python -m tests.bench.optimise --out docs/internals/optimise-marks.md

bench-basins: $(VENV)/dev  ## five seeds of the search over proportions, two requirements: writes docs/internals/basins.md, about an hour
	mkdir -p results
	$(BIN)/python -m tests.bench.basins --keep results/basins.jsonl --out docs/internals/basins.md

# The moving picture of the report: three.js with its licence, what is used of it, in one file that pages carry.
THREE := three@0.187.0
ESBUILD := esbuild@0.28.2
LIVE := sweep/templates/live
three:  ## bundle three.js for the report anew; needs node and npm, only where its version changes
	rm -rf build/three && mkdir -p build/three && cp $(LIVE)/three.entry.js build/three/entry.js
	cd build/three && npm init --yes >/dev/null && npm install --silent --no-save $(THREE) $(ESBUILD)
	cp build/three/node_modules/three/LICENSE $(LIVE)/three.LICENSE
	cd build/three && npx esbuild entry.js --bundle --minify --format=iife --global-name=THREE --outfile=three.min.js --log-level=error
	{ echo '/*! $(THREE)'; cat $(LIVE)/three.LICENSE; echo '*/'; grep -v '^$$' build/three/three.min.js; } > $(LIVE)/three.min.js
	rm -rf build/three

clean:  ## remove results and the environment
	rm -rf results $(VENV)
