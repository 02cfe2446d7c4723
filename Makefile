# make demo   set up, build, run the plate and draw it
# make test   set up, build, run all tests
# make help   everything else

export CMAKE := $(CURDIR)/.venv/bin/cmake
BIN := target/release/signorini

.PHONY: help setup build demo test validate bench pictures clean

help:
	@echo 'make demo      build, integrate scenarios/plate.toml, draw it into out/'
	@echo 'make test      the whole test suite'
	@echo 'make validate  all closed-form and published cases'
	@echo 'make bench     benchmarks'
	@echo 'make pictures  the pictures of the README'
	@echo 'make setup     what the build needs besides Rust (done by all of the above)'

setup:
	@.ci/setup

build: setup
	cargo build --release --locked

demo: build
	@mkdir -p out
	$(BIN) run scenarios/plate.toml -o out/plate.h5 --force
	$(BIN) plot out/plate.h5
	@echo 'Open out/plate-shapes.png, out/plate-contact.png, out/plate-gap.png, out/plate-energy.png'

test: setup
	cargo test --release --locked

validate: build
	$(BIN) validate

bench: setup
	cargo bench --locked

pictures: build
	@mkdir -p out docs
	$(BIN) run scenarios/plate.toml -o out/plate.h5 --force -q
	$(BIN) plot out/plate.h5 --only shapes,contact
	cp out/plate-shapes.png docs/plate.png
	cp out/plate-contact.png docs/contact.png
	.venv/bin/python -m pip install --quiet --disable-pip-version-check -r validate/peers/requirements.txt
	$(BIN) precision scenarios/plate.toml --peer scipy -o out/plate-precision
	cp out/plate-precision.png docs/precision.png

clean:
	rm -rf out target
