# The whole of what a person types. What each target does is in scripts/; ARGS="..." is handed on.

PLUMB := cargo run --release --locked -p plumb --bin plumb --

.DEFAULT_GOAL := help
.PHONY: help setup demo test adversary chip bench links bench-chip firmware flash lint

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s  %s\n", $$1, $$2 }' Makefile

setup: ## install what is missing (the others do it first)
	@scripts/setup

demo: setup ## drive the ball to its target, closed loop, with no hardware (ARGS="--virtual-time" and the like)
	@$(PLUMB) demo $(ARGS)

test: setup ## all tests, and the board's crates built for a chip without std
	@scripts/test $(ARGS)

adversary: setup ## a long search for broken invariants (ARGS="board --first-seed 1 --seeds 100000")
	@cargo run --release --locked -p plumb-adversary -- $(or $(ARGS),board)

chip: setup ## the real firmware in an emulated chip, on a pseudo-terminal, for plumb goto and the like
	@scripts/chip
	@scripts/firmware
	@cargo run --release --locked -p plumb-tests --bin chip-terminal -- target/firmware/plumb.elf

bench: setup ## reproduce the control and vision measurements
	@$(PLUMB) bench control --suite paper $(ARGS)
	@$(PLUMB) bench vision $(ARGS)

links: setup ## every law over slow, lossy and interrupted links (ARGS="--seeds 100" and the like)
	@cargo run --release --locked -p plumb-tests --bin links -- $(ARGS)

bench-chip: setup ## measure the real firmware in the emulated chip (ARGS="--json": the numbers on the last line)
	@scripts/bench-chip $(ARGS)

firmware: ## build the board's firmware: target/firmware/plumb.elf and plumb.uf2
	@scripts/firmware

flash: firmware ## put it onto a Raspberry Pi Pico (ARGS="uf2", "picotool" or "probe-rs" to choose the way)
	@scripts/flash $(ARGS)

lint: ## formatting, clippy, documentation, dependency rules and shell scripts, without a warning
	@scripts/lint
