# shellcheck shell=bash
# Functions of the scripts in this folder. This file is sourced and never run.

# say TEXT...: prints a message to standard error. Standard output is for results.
say() { printf '%s\n' "$*" >&2; }

# wanted_rust: prints the oldest Rust version that builds the workspace, from Cargo.toml.
wanted_rust() {
  sed -n 's/^rust-version = "\(.*\)"/\1/p' "$(dirname "${BASH_SOURCE[0]}")/../Cargo.toml"
}

# workspace_version: prints Plumb's version, from Cargo.toml.
workspace_version() {
  sed -n '/^\[workspace.package\]/,/^\[/s/^version = "\(.*\)"/\1/p' \
    "$(dirname "${BASH_SOURCE[0]}")/../Cargo.toml"
}

# at_least WANTED VERSION: succeeds if VERSION is the same or newer.
at_least() { printf '%s\n' "$1" "$2" | sort -V -C; }

# has_apt: succeeds if this system has Debian's packages.
has_apt() { command -v apt-get >/dev/null && command -v dpkg-query >/dev/null; }

# as_root COMMAND...: runs COMMAND as root, with sudo if necessary; returns 2 if that is
# impossible.
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

# bounded SECONDS COMMAND...: runs COMMAND, with a time limit if the system has `timeout`.
bounded() {
  if command -v timeout >/dev/null; then timeout "$@"; else "${@:2}"; fi
}

# python_packages FOLDER PACKAGE...: makes the virtual environment FOLDER anew with PACKAGE... from
# PyPI, or prints why that failed and returns 3.
python_packages() {
  local folder=$1 log
  shift
  # Debian has ensurepip in a separate package.
  if ! python3 -c 'import ensurepip' 2>/dev/null && has_apt; then
    "$(dirname "${BASH_SOURCE[0]}")/setup" python3-venv || return 3
  fi
  if ! log=$(new_environment "$folder" "$@" 2>&1); then
    tail -n 5 <<<"$log" >&2
    return 3
  fi
}

# new_environment FOLDER PACKAGE...: the two commands of python_packages.
new_environment() {
  python3 -m venv --clear "$1" &&
    bounded 900 "$1/bin/python" -m pip install -qq --no-input --only-binary :all: "${@:2}"
}

# cargo_tool NAME VERSION [OPTION...]: puts NAME of crates.io on the PATH. Where that version is not
# there, cargo builds it into target/tools, with these options.
cargo_tool() {
  local name=$1 version=$2 tools
  tools=$(dirname "${BASH_SOURCE[0]}")/../target/tools
  shift 2
  mkdir -p "$tools"
  PATH=$(cd "$tools" && pwd)/bin:$PATH
  if [[ "$("$name" --version 2>/dev/null)" != *[\ v]"$version" ]]; then
    say "Building $name $version from crates.io into target/tools (some minutes)"
    cargo install --quiet --locked --root "$tools" "$@" "$name@$version"
  fi
}

# phase NAME: begins a phase of a script, whose time print_phases prints.
phase() { phases+=("$(date +%s) $1"); }

# print_phases: ends the last phase, and prints how many seconds each phase took.
print_phases() {
  local i begin end
  phases+=("$(date +%s) end")
  say "Seconds of each phase:"
  for ((i = 0; i < ${#phases[@]} - 1; i++)); do
    begin=${phases[i]%% *} end=${phases[i + 1]%% *}
    say "$(printf '%6d  %s' $((end - begin)) "${phases[i]#* }")"
  done
}

# cargo_test ARGUMENT...: runs tests, and keeps what they print in $log, with the time of each.
cargo_test() {
  cargo --config "target.'cfg(all())'.runner = '$PWD/scripts/timed'" \
    test --release --locked --no-fail-fast "$@" | tee -a "$log"
}

# print_slowest: prints the ten slowest tests of cargo_test.
print_slowest() {
  say "The ten slowest tests:"
  say "$(sed -nE 's/^test (.*) \.\.\. .*<([0-9.]+)s>$/\2 s  \1/p' "$log" | sort -rn | head -n 10)"
}
