# make demo   set up, build, run the plate and draw it
# make test   set up, build, run all tests
# make help   everything else

export CMAKE := $(CURDIR)/.venv/bin/cmake
BIN := target/release/signorini

.PHONY: c counts coverage mutants notebooks crack-depth release help setup build demo test python page fuzz fuzz-coverage validate validation bench peers check-peers study-slurm docs pictures figures methods clean

help:
	@echo 'make demo      build, integrate scenarios/plate.toml, draw it into out/'
	@echo 'make test      the whole test suite'
	@echo 'make python    the Python package: build its wheel (target/wheels), test it in a fresh environment'
	@echo 'make c         the library for C and its example (src/c/signorini.h)'
	@echo 'make notebooks the tutorials as notebooks, executed (after make python)'
	@echo 'make page      the page of signorini view in a real browser; screenshots into out/page/'
	@echo 'make fuzz      ten thousand damaged inputs, none of which may bring the program down'
	@echo 'make fuzz-coverage  the readers of files under libFuzzer, which looks for inputs that reach new code (a C++ compiler; FUZZ_SECONDS a reader, 60 unless said)'
	@echo 'make validate  all closed-form and published cases'
	@echo 'make validation  the same, and the pages of the documentation that tell them and the benchmarks (docs/reference)'
	@echo 'make bench     benchmarks'
	@echo 'make counts    instructions of whole commands against those of the last release (valgrind)'
	@echo 'make coverage  how much of the code the suite runs through (docs/reference/coverage.md); half an hour'
	@echo 'make mutants   operators of the central decisions changed one by one: which changes no unit test of the core notices (docs/reference/mutants.md); an hour'
	@echo 'make peers     what signorini precision --peer scipy, sundials and diffsol need: SciPy into .venv, two small programs (make check-peers compares them)'
	@echo 'make docs      the documentation as a site into target/site/, without a warning; the pages of commands and keys are written anew'
	@echo 'make study-slurm  a study as a job array on a Slurm of one node that is started for it (Debian: slurm-wlm, munge; root); skipped loudly elsewhere'
	@echo 'make figures   harmonic balance, its cross-check in time, and the two figures of the conference paper, into out/; contact methods side by side'
	@echo 'make pictures  the pictures of the README'
	@echo 'make methods   contact methods side by side: tables and pictures of docs/methods.md, into out/ (part of make figures)'
	@echo 'make crack-depth  the frequency of a breathing crack over its depth (docs/tutorials/bodies.md), into out/'
	@echo 'make release   VERSION=0.2.0: versions, changelog, text of the tag, packages of the crates, archive and wheel; nothing is published'
	@echo 'make setup     what the build needs besides Rust (done by all of the above)'

setup:
	@.ci/setup

build: setup
	cargo build --release --locked

demo: build
	@mkdir -p out
	$(BIN) run scenarios/plate.toml -o out/plate.h5 --force
	$(BIN) plot out/plate.h5
	@echo 'Open out/plate-shapes.png, out/plate-contact.png, out/plate-forces.png, out/plate-gap.png, out/plate-energy.png'

test: setup
	cargo test --release --locked

# the wheel is built with a pinned maturin and tested where nothing else of ours is
FRESH := target/python
python: setup
	.venv/bin/python -m pip install --quiet --disable-pip-version-check maturin==1.16.0
	rm -rf target/wheels $(FRESH)
	python3 .ci/licences.py --texts python/LICENSES/THIRDPARTY.txt
	.venv/bin/maturin build --release --locked --quiet -m python/Cargo.toml -o target/wheels
	python3 -m venv $(FRESH)
	$(FRESH)/bin/python -m pip install --quiet --disable-pip-version-check -r python/requirements.txt target/wheels/signorini-*.whl
	$(FRESH)/bin/python -m pytest -q -p no:cacheprovider --rootdir python python/tests

# the library for C (src/c/signorini.h), and its example held against the program; a C compiler
c: build
	cargo build --release --locked -p signorini-c
	src/c/check.sh

# the tutorials as notebooks: executed, and as pages, in target/notebooks (after make python)
notebooks:
	$(FRESH)/bin/python -m pip install --quiet --disable-pip-version-check nbconvert==7.17.2 ipykernel==7.4.0
	$(FRESH)/bin/python python/tutorials/render.py --notebooks target/notebooks
	cp -r scenarios target/notebooks/
	MPLBACKEND=agg $(FRESH)/bin/python -m nbconvert --to html --execute --log-level WARN --output-dir target/notebooks target/notebooks/*.ipynb

# needs Chromium (the package chromium of the distribution) or Chrome
page: build
	.venv/bin/python -m pip install --quiet --disable-pip-version-check -r tests/page/requirements.txt
	.venv/bin/python tests/page/check.py

# FUZZ=scene-0141 make fuzz: one case again, or all whose names begin so; FUZZ_SEED=1 make fuzz: other cases
fuzz: setup
	cargo test --release --locked fuzz:: -- --ignored --nocapture

# FUZZ_SECONDS=600 FUZZ_READERS='msh mtx' make fuzz-coverage
fuzz-coverage: build
	fuzz/run.sh $(or $(FUZZ_SECONDS),60) $(FUZZ_READERS)

validate: build
	$(BIN) validate

# the pages of validation and of benchmarks from the answers of the program; ten minutes
validation: build
	@mkdir -p target/validation
	$(BIN) validate --json > target/validation/answer.json
	python3 validate/page.py < target/validation/answer.json > target/validation/page.md
	cp target/validation/page.md docs/reference/validation.md
	$(BIN) benchmark --markdown $(addprefix --with ,$(wildcard validate/benchmarks/results/*.toml)) > target/validation/benchmarks.md
	cp target/validation/benchmarks.md docs/reference/benchmarks.md

bench: setup
	cargo bench --locked

# instructions of whole commands against those of the last release (valgrind); KEEP=--keep writes them anew
counts: build
	python3 .ci/counts.py $(BIN) $(KEEP)

# how much of the code the suite runs through: docs/reference/coverage.md; half an hour, rustup component add llvm-tools
coverage: setup
	python3 .ci/coverage.py

# which changed operators no unit test of the core notices: docs/reference/mutants.md; MUTANTS='lcp find' make mutants: of these files alone
mutants: setup
	.venv/bin/python -m pip install --quiet --disable-pip-version-check tree-sitter==0.26.1 tree-sitter-rust==0.24.2
	.venv/bin/python -u .ci/mutants.py $(or $(MUTANTS),--page)

# needs a C compiler; SUNDIALS is taken from the distribution's packages, unpacked below target/ where it is not installed
peers: build
	.venv/bin/python -m pip install --quiet --disable-pip-version-check -r validate/peers/requirements.txt
	validate/peers/build.sh

# all of them against the exact flow, after make peers
check-peers:
	.venv/bin/python validate/peers/check.py

# versions in all files, packages that build by themselves; a clean tree is asked for (.ci/release.py)
release: setup
	@test -n "$(VERSION)" || { echo 'make release VERSION=0.2.0'; exit 2; }
	python3 .ci/release.py $(VERSION)

docs: build
	.venv/bin/python -m pip install --quiet --disable-pip-version-check mkdocs==1.6.1
	$(BIN) man --markdown > docs/reference/commands.md
	$(BIN) schema --markdown > docs/reference/scenes.md
	$(BIN) schema study --markdown > docs/reference/studies.md
	$(BIN) schema files --markdown > docs/reference/datasets.md
	.venv/bin/mkdocs build --strict --quiet
	@echo 'Open target/site/index.html'

# a part of make test as well
study-slurm: setup
	cargo test --release --locked study::a_job_array -- --nocapture

pictures: build peers
	@mkdir -p out docs
	$(BIN) run scenarios/plate.toml -o out/plate.h5 --force -q
	$(BIN) plot out/plate.h5 --only shapes,contact
	cp out/plate-shapes.png docs/plate.png
	cp out/plate-contact.png docs/contact.png
	$(BIN) precision scenarios/plate.toml --peer scipy --peer sundials --peer diffsol -o out/plate-precision --force
	cp out/plate-precision.png docs/precision.png
	$(BIN) precision validate/peers/slope.toml --peer scipy --peer sundials -o out/slope-precision --force
	cp out/slope-precision.png docs/precision-friction.png
	$(BIN) precision validate/peers/two-plates.toml --peer scipy --peer sundials --peer diffsol -o out/two-plates-precision --force
	cp out/two-plates-precision.png docs/precision-pair.png
	$(BIN) run scenarios/bracket.toml -o out/bracket.h5 --force -q
	$(BIN) plot out/bracket.h5 --only shapes
	cp out/bracket-shapes.png docs/bracket.png
	$(BIN) run scenarios/feet.toml -o out/feet.h5 --force -q
	$(BIN) plot out/feet.h5 --only states
	cp out/feet-states.png docs/friction-states.png
	$(BIN) run scenarios/joint.toml -o out/joint.h5 --force -q
	$(BIN) plot out/joint.h5 --only friction
	cp out/joint-friction.png docs/friction-loops.png
	$(BIN) run scenarios/probed-plate.toml -o out/probed.h5 --force -q
	$(BIN) plot out/probed.h5 --only probes,spectra --dpi 110
	cp out/probed-probes.png docs/probes.png
	cp out/probed-spectra.png docs/spectra.png
	$(BIN) trust scenarios/probed-plate.toml -o out/trust --force
	cp out/trust.png docs/trust.png
	$(BIN) run scenarios/two-stops.toml -o out/two-stops.h5 --force -q
	$(BIN) plot out/two-stops.h5 --only shapes --dpi 110
	cp out/two-stops-shapes.png docs/two-stops.png
	$(BIN) run scenarios/rotating-casing.toml -o out/casing.h5 --force -q
	$(BIN) plot out/casing.h5 --only contact --dpi 110
	cp out/casing-contact.png docs/casing.png
	$(BIN) run scenarios/blocks.toml -o out/blocks.h5 --force -q
	$(BIN) plot out/blocks.h5 --only forces
	cp out/blocks-forces.png docs/forces.png
	$(BIN) backbone scenarios/lap-joint-mode.toml --method hbm --amplitudes 1e-5,6e-4 --harmonics 7 -o out/lap-joint-mode.h5 --force
	$(BIN) plot out/lap-joint-mode.h5
	cp out/lap-joint-mode-backbone.png docs/lap-joint-mode.png
	cargo run --release --locked --example refinement -- out/refinement
	cp out/refinement.png docs/refinement.png
	cargo run --release --locked --example scaling -- out/scaling
	cp out/scaling.png docs/scaling.png
	printf '%s\n' 'scene = "../scenarios/half-plate-viscous.toml"' 'command = "backbone"' 'options = ["--viscous", "--quick", "--step", "0.02"]' \
	  '[vary]' '"orbit.beta" = [0.02, 0.01]' '"body.elements" = [[10, 5], [15, 7], [23, 11]]' > out/viscous.toml
	$(BIN) study run out/viscous.toml -o out/viscous.study -q && $(BIN) study collect out/viscous.toml -o out/viscous.study --to out/viscous --force -q
	cp out/viscous-families.png docs/study.png

# figure 1: forced responses and their ridge, viscous backbone with its errors (coarser meshes, half the viscosity), harmonic balance of it; figure 2: the
# viscous orbit at ω = 1.87 over one period, on a mesh of 46 × 21 elements; and the cross-check of conservative series, which have no such limit
PLATE := scenarios/half-plate-orbit.toml
FINER := scenarios/half-plate-20x6
figures: build
	@mkdir -p out docs
	$(BIN) backbone $(PLATE) --method hbm --harmonics 1,3,7,15,31 -o out/hbm.h5 --force
	$(BIN) crosscheck out/hbm.h5 $(PLATE) -o out/checked.h5 --force | tail -7
	$(BIN) plot out/checked.h5 --only crosscheck -o out/half-plate
	$(BIN) backbone $(FINER).toml --viscous --step 0.01 -o out/viscous.h5 --force
	$(BIN) backbone $(FINER).toml --viscous --method hbm --harmonics 3,7,15 --step 0.01 -o out/series.h5 --force
	$(BIN) response $(FINER)-response.toml -o out/response.h5 --force
	$(BIN) plot out/response.h5 out/series.h5 out/viscous.h5 --frequency 1.55,2.0 --energy 0.1,12 -o out/figure1
	$(BIN) orbit scenarios/half-plate-viscous.toml --omega 1.87 --viscous -o out/orbit-a.h5 --force
	$(BIN) plot out/orbit-a.h5 --only shapes,portrait,multipliers --at 0,0.125,0.25,0.375,0.5,0.625,0.75,0.875 -o out/figure2
	cp out/half-plate-crosscheck.png docs/crosscheck.png
	$(MAKE) methods
	cp out/figure1.png docs/figure1.png

# docs/methods.md: contact methods side by side (some ten minutes, most of it Nitsche's method on the finest mesh)
ON_BAR := nbm,nbm:constant,nitsche,penalty,impact,moreau-jean,waves
ON_PLATE := nbm,nbm:constant,mass-redistribution,mass-redistribution:optimal,nitsche,penalty,impact,impact:1
IN_TIME := nbm,nbm:constant,mass-redistribution,nitsche,nitsche:theta=0,penalty,impact,impact:0.5,impact:1,moreau-jean
OF_MODES := nbm,nbm:constant,mass-redistribution,nitsche,penalty
methods: build
	@mkdir -p out docs
	$(BIN) compare scenarios/bar.toml --methods $(ON_BAR) --elements 10,20,40,80,160 -o out/methods-bar --force
	$(BIN) compare scenarios/bar.toml --methods $(ON_BAR) --elements 10,20,40,80,160 --parameter run.until=1.68 -o out/methods-bar-half --force
	$(BIN) compare scenarios/half-plate-transient.toml --methods $(ON_PLATE) --elements 10x3,20x6,40x12 --reference mass-redistribution@80x24 -o out/methods-plate --force
	$(BIN) compare scenarios/half-plate-transient.toml --methods $(IN_TIME) --elements 10x3,20x6 --parameter run.until=105 -o out/methods-long --force
	$(BIN) compare scenarios/half-plate-viscous.toml --viscous --beta 0.01 --omega 1.7,1.8,1.86 --methods $(OF_MODES) --elements 10x3,20x6,30x9,40x12 -o out/methods-viscous --force
	$(BIN) compare scenarios/half-plate-viscous.toml --viscous --beta 0.01 --methods $(OF_MODES) --elements 20x6,40x12,80x24 -o out/methods-finer --force
	$(BIN) compare scenarios/bar.toml --orbit --omega 1.87 --methods $(OF_MODES) --elements 10,20,40,80 -o out/methods-orbits --force
	cp out/methods-bar.png out/methods-bar-half.png out/methods-plate.png out/methods-viscous.png docs/

# the first frequency of a beam over the depth of a breathing crack, beside the bilinear formula: table and picture
crack-depth: build
	@mkdir -p out docs
	.venv/bin/python -m pip install --quiet --disable-pip-version-check matplotlib==3.11.2
	.venv/bin/python validate/bodies/crack_depth.py $(BIN) out/crack-depth
	cp out/crack-depth.png docs/

clean:
	rm -rf out target
