# shellcheck shell=bash
# What the scripts beside this one share. Sourced, never run.

# Tells a person something; standard output is for results.
say() { printf '%s\n' "$*" >&2; }

# The lowest Rust version that the workspace builds with, from Cargo.toml.
wanted_rust() { sed -n 's/^rust-version = "\(.*\)"/\1/p' "$(dirname "${BASH_SOURCE[0]}")/../Cargo.toml"; }

# at_least WANTED VERSION: is VERSION the same or newer?
at_least() { printf '%s\n' "$1" "$2" | sort -V -C; }

# has_apt: are this system's packages Debian's?
has_apt() { command -v apt-get >/dev/null && command -v dpkg-query >/dev/null; }

# as_root COMMAND...: runs it as root, through sudo where that is needed; 2 where there is no way
# to.
as_root() {
  if [ "$(id -u)" -eq 0 ]; then
    "$@"
  elif command -v sudo >/dev/null; then
    sudo "$@"
  else
    say "This needs root, and there is no sudo: $*"
    return 2
  fi
}

# bounded SECONDS COMMAND...: runs it, for no longer than that where the system has timeout.
bounded() {
  if command -v timeout >/dev/null; then timeout "$@"; else "${@:2}"; fi
}
