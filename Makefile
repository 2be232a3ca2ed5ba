# Entry points. The work is in scripts/; ARGS="..." is passed on.

# A program of the default members. Without -p, cargo builds it with the features of all default
# members, as `make test` does: no crate is built again.
RUN := cargo run --release --locked --bin
PLUMB := $(RUN) plumb --
LAB := $(RUN) plumb-lab --

.DEFAULT_GOAL := help
.PHONY: help setup demo test test-all adversary faults fuzz chip bench links soak soak-hour coverage
.PHONY: bench-chip bounce firmware flash lint quick docs sbom reproducible
.PHONY: package package-check foreign-test release

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-14s  %s\n", $$1, $$2 }' Makefile

setup: ## install missing packages (the other targets run this first)
	@scripts/setup

demo: setup ## drive the ball to its target without hardware (ARGS="--virtual-time")
	@$(PLUMB) demo $(ARGS)

test: setup ## build the firmware and run Plumb's own tests
	@scripts/test $(ARGS)

test-all: setup ## run the tests with other people's stacks: cameras, ROS 2, MCAP, MuJoCo, RP2350
	@scripts/test-all

adversary: setup ## search for broken invariants (ARGS="board --seeds 100000")
	@$(RUN) adversary -- $(or $(ARGS),board)

faults: setup firmware ## search for faults that are not noticed, or told wrongly
	@scripts/chip
	@$(RUN) faults -- $(ARGS)
	@PLUMB_KILLS=100 PLUMB_LONG=1 cargo test --release --locked \
		--test it -- killed:: chip_steps:: chip_agrees::

fuzz: setup ## call every parser and the board with random input (ARGS="board --seconds 600")
	@cargo run --release --locked -p plumb-fuzz -- $(ARGS)

chip: setup ## run the firmware in an emulated chip, on a pseudo-terminal
	@scripts/chip
	@scripts/firmware
	@$(RUN) chip-terminal -- target/firmware/plumb.elf

bench: setup ## reproduce the control and vision measurements
	@$(LAB) paper $(ARGS)
	@$(LAB) vision $(ARGS)

links: setup ## run every law over slow, lossy and broken links (ARGS="--seeds 100")
	@$(RUN) links -- $(ARGS)

soak: setup ## drive one board for 100 hours of virtual time, with failures (ARGS="--hours 10")
	@$(RUN) soak -- $(ARGS)

soak-hour: setup ## drive an emulated board for an hour of real time (ARGS="SECONDS")
	@scripts/soak-hour $(ARGS)

coverage: setup ## which lines of protocol and board core the tests execute (needs cargo-llvm-cov)
	@scripts/coverage

bench-chip: setup ## measure the firmware in the emulated chip (BOARD=pico2; ARGS="--json")
	@scripts/bench-chip $(ARGS)

bounce: setup firmware ## press a bouncing emergency button 100 000 times, 500 in the whole chip
	@scripts/chip node tests/chip/bounce.mjs $(ARGS)
	@PLUMB_LONG=1 cargo test --release --locked \
		--test it -- --nocapture the_emergency_input_cuts_the_pulses

firmware: ## build a board's firmware: target/firmware/plumb.uf2 (BOARD=pico2)
	@scripts/firmware

flash: firmware ## write it to a board (BOARD=pico2; ARGS="uf2", "picotool" or "probe-rs")
	@scripts/flash $(ARGS)

lint: ## check formatting, clippy, documentation, dependency rules, shell scripts
	@scripts/lint

quick: ## what to run after an edit: format, clippy and the tests of the crates that changed
	@scripts/quick $(ARGS)

docs: ## the book, in target/book (ARGS="serve")
	@scripts/docs $(ARGS)

sbom: ## list the crates of program and firmware: target/sbom (needs cargo-cyclonedx)
	@scripts/sbom $(ARGS)

package: ## build the Debian package: target/package (ARGS=arm64; says what it installs)
	@scripts/package $(ARGS)

package-check: ## install the package in a bare Debian and try it; root (ARGS="trixie arm64")
	@scripts/package-check $(ARGS)

foreign-test: ## test another architecture in QEMU; root, both packages (ARGS="bookworm arm64")
	@scripts/foreign-test $(ARGS)

release: ## make a release, to be signed and uploaded: target/release-VERSION (ARGS="0.2.0")
	@scripts/release $(ARGS)

reproducible: ## build the firmware in two folders and compare the bytes (ARGS="package")
	@scripts/reproducible $(ARGS)
