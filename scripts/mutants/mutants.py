"""Tries the mutants of cargo-mutants in one build: mutants.py WORK PATTERN... [-- TEST...]

cargo-mutants lists the mutants of the files PATTERN. The script copies the repository to the folder
WORK, with every changed function as a further arm of its own body: the variable MUTANT chooses the
arm when a test starts. A mutant that does not compile is left out, and the copy is built again. A
mutant then costs only its tests, those that call its function, until the first one fails.

The tests are those of plumb-core and plumb-protocol. Slow tests run only for the mutants that all
quick ones miss. A TEST is a package of the workspace whose tests are run for the mutants that those
miss. WORK keeps `results.txt`: a mutant of an earlier run that was caught is not tried again.

Needs: cargo install --locked cargo-mutants
"""

import json
import os
import re
import resource
import signal
import subprocess
import sys
from collections import Counter, defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Crates whose functions can be changed, with their folders.
CRATES = {"plumb_core": "firmware/core", "plumb_protocol": "protocol"}
# Processor time in seconds after which a test counts as endless, and the least multiple of the time
# that it takes without a mutant. A busy machine does not change the result.
LIMIT_S = 5
LIMIT_TIMES = 10
# Processor time in seconds of a slow test.
SLOW_S = 2
# What replaces `no_std` in the copy.
ALLOWED = "#![allow(warnings, arithmetic_overflow)]"
PROFILE = """
[profile.mutants]
inherits = "release"
incremental = false
[profile.mutants.package]
plumb-core = { opt-level = 1 }
plumb-protocol = { opt-level = 1 }
"""


class Mutant:
    """A change of one place of a function."""

    def __init__(self, number, listed):
        self.number = number
        self.name = listed["name"]
        self.file = listed["file"]
        self.span = listed["span"]
        self.function = listed["function"]["span"]
        self.replacement = listed["replacement"]


class Source:
    """Text of a file, with places as lines and columns from 1."""

    def __init__(self, text):
        self.text = text
        self.starts = [0]
        for line in text.splitlines(keepends=True):
            self.starts.append(self.starts[-1] + len(line))

    def place(self, at):
        return self.starts[at["line"] - 1] + at["column"] - 1

    def range(self, span):
        return self.place(span["start"]), self.place(span["end"])


def body_start(text, start):
    """Returns the place after the opening brace of the function at `start`."""
    token = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\])*"|\{', re.DOTALL)
    while True:
        found = token.search(text, start)
        if found.group() == "{":
            return found.end()
        start = found.end()


def listed_mutants(patterns):
    """Returns the mutants in the order of the patterns."""
    listed = []
    for pattern in patterns:
        command = ["cargo", "mutants", "--list", "--json", "--file", pattern]
        run = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
        # Warnings come first.
        listed += json.loads(run.stdout[run.stdout.index("[\n") :])
    for entry in listed:
        if entry["function"] is None:
            print("outside of functions, not tried:", entry["name"])
    listed = [entry for entry in listed if entry["function"]]
    return [Mutant(number, entry) for number, entry in enumerate(listed, 1)]


def repository():
    """Returns the names of the files of the repository."""
    names = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    files = subprocess.run(names, cwd=ROOT, check=True, capture_output=True).stdout
    return [name for name in files.decode().split("\0") if name and (ROOT / name).is_file()]


def write_copy(work, mutants):
    """Writes the files of the copy that have changed. A file that is written is compiled again."""
    contents = {name: (ROOT / name).read_bytes() for name in repository()}
    contents["Cargo.toml"] += PROFILE.encode()
    for folder in CRATES.values():
        library = f"{folder}/src/lib.rs"
        text = contents[library].decode().replace("#![no_std]", ALLOWED)
        contents[library] = (text + "\npub mod selection;\n").encode()
        contents[f"{folder}/src/selection.rs"] = contents["scripts/mutants/selection.rs"]
    for name, text in texts_with_mutants(mutants).items():
        contents[name] = text.encode()
    remove_others(work, contents)
    for name, content in contents.items():
        path = work / name
        if not path.is_file() or path.read_bytes() != content:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)


def remove_others(work, contents):
    """Removes the files of an earlier copy that the repository has no more."""
    for folder in {name.split("/")[0] for name in contents if "/" in name}:
        for path in (work / folder).rglob("*"):
            if path.is_file() and path.relative_to(work).as_posix() not in contents:
                path.unlink()


def functions(mutants):
    """Returns the mutants by their outermost function."""
    found = []
    for mutant in sorted(mutants, key=lambda m: (m.function["start"]["line"], m.number)):
        span = mutant.function
        inside = found and found[-1][0]["end"]["line"] >= span["end"]["line"]
        if inside:
            found[-1][1].append(mutant)
        else:
            found.append((span, [mutant]))
    return found


def with_arms(text, mutants, first_function):
    """Returns the text of a file with its mutants, and the number of its functions."""
    source = Source(text)
    groups = functions(mutants)
    for index, (span, group) in reversed(list(enumerate(groups, first_function))):
        start, end = source.range(span)
        start, end = body_start(source.text, start), end - 1
        arms = []
        for mutant in group:
            a, b = source.range(mutant.span)
            body = source.text[start:a] + mutant.replacement + source.text[b:end]
            arms.append(f"{mutant.number} => {{ /*M{mutant.number}*/{body}\n/*E*/ }}\n")
            mutant.index = index
        # A constant function cannot ask for the mutant.
        signature = source.range(span)[0]
        fixed = text.find("const fn", signature, start)
        head = f" match crate::selection::mutant({index}) {{\n"
        body = source.text[start:end]
        text = text[:start] + head + "".join(arms) + f"_ => {{{body}\n}} }} " + text[end:]
        if fixed >= 0:
            text = text[:fixed] + text[fixed + len("const ") :]
    return text, len(groups)


def texts_with_mutants(mutants):
    """Returns the texts of the changed files by their names."""
    by_file = defaultdict(list)
    for mutant in mutants:
        by_file[mutant.file].append(mutant)
    count, texts = 0, {}
    for file, group in by_file.items():
        texts[file], functions_here = with_arms((ROOT / file).read_text(), group, count)
        count += functions_here
    return texts


def lines_of_mutants(path):
    """Returns the number of the mutant of each line of a file of the copy."""
    numbers, number = {}, None
    for line, text in enumerate(path.read_text().splitlines(), 1):
        if found := re.search(r"/\*M(\d+)\*/", text):
            number = int(found.group(1))
        if number:
            numbers[line] = number
        if "/*E*/" in text:
            number = None
    return numbers


def build(work, packages):
    """Builds the tests. Returns their programs, and the numbers of mutants that do not compile."""
    command = ["cargo", "test", "--locked", "--no-run", "--profile", "mutants", "-q"]
    command += ["--message-format=json", "--lib", "--tests"]
    for package in packages:
        command += ["-p", package]
    environment = dict(os.environ, CARGO_TARGET_DIR=str(work / "target"))
    run = subprocess.run(command, cwd=work, capture_output=True, text=True, env=environment)
    programs, broken, unplaced = [], set(), []
    for line in run.stdout.splitlines():
        message = json.loads(line)
        if message.get("executable"):
            programs.append((message["target"]["name"], message["executable"]))
        if message.get("reason") != "compiler-message":
            continue
        report = message["message"]
        if report["level"] != "error":
            continue
        spans = [span for span in report["spans"] if span["is_primary"]]
        found = [lines_of_mutants(work / s["file_name"]).get(s["line_start"]) for s in spans]
        broken.update(filter(None, found))
        if spans and not any(found):
            unplaced.append(report["rendered"])
    if run.returncode != 0 and not broken:
        sys.exit("\n".join(unplaced) or run.stderr)
    return programs, broken


def processor_time():
    """Returns the processor time in seconds of the tests that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run_test(program, folder, variables, limit_s=3600):
    """Runs a test. Returns "passed", "failed" or "endless"."""

    def set_limit():
        resource.setrlimit(resource.RLIMIT_CPU, (limit_s, limit_s))

    run = subprocess.run(
        [program, "--test-threads=1", "-q"],
        cwd=folder,
        env=dict(os.environ, **variables),
        preexec_fn=set_limit,
        capture_output=True,
    )
    if run.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return "endless"
    return "passed" if run.returncode == 0 else "failed"


class Test:
    """A program of tests, with its processor time in seconds and the functions that it calls."""

    def __init__(self, name, program, work, folder):
        self.name = name
        self.program = program
        log = work / "reached"
        log.unlink(missing_ok=True)
        begin = processor_time()
        if run_test(program, folder, {"REACHED": str(log)}) != "passed":
            sys.exit(f"{name} fails without a mutant")
        self.time = processor_time() - begin
        self.calls = set(map(int, log.read_text().split())) if log.exists() else set()

    def outcome(self, mutant, folder):
        """Returns "passed", "failed" or "endless" with a mutant."""
        if mutant.index not in self.calls:
            return "passed"
        limit_s = max(LIMIT_S, round(LIMIT_TIMES * self.time))
        return run_test(self.program, folder, {"MUTANT": str(mutant.number)}, limit_s)


def outcome(mutant, tests, folder):
    """Returns "caught", "endless" or "missed", and the test that decided."""
    for test in tests:
        result = test.outcome(mutant, folder)
        if result != "passed":
            return "caught" if result == "failed" else "endless", test.name
    return "missed", ""


def try_all(work, mutants, packages, results):
    """Builds and tries the mutants without a result that counts."""
    left = [mutant for mutant in mutants if results.get(mutant.name, ("missed",))[0] == "missed"]
    while True:
        write_copy(work, left)
        programs, broken = build(work, packages)
        if not broken:
            break
        for mutant in left:
            if mutant.number in broken:
                results[mutant.name] = ("unviable", "")
        left = [mutant for mutant in left if mutant.number not in broken]
        save(work, results)
        print(f"{len(broken)} do not compile", flush=True)
    folder = work / CRATES["plumb_core"]
    tests = sorted((Test(*p, work, folder) for p in programs), key=lambda test: test.time)
    quick = [test for test in tests if test.time <= SLOW_S]
    for group in quick, tests[len(quick) :]:
        print(*(f"{test.name} {test.time:.1f} s" for test in group), flush=True)
        for mutant in left:
            results[mutant.name] = outcome(mutant, group, folder)
            save(work, results)
            print(*results[mutant.name], mutant.name, flush=True)
        left = [mutant for mutant in left if results[mutant.name][0] == "missed"]


def save(work, results):
    lines = [f"{result}\t{test}\t{name}\n" for name, (result, test) in results.items()]
    (work / "results.txt").write_text("".join(lines))


def load(work):
    path = work / "results.txt"
    lines = path.read_text().splitlines() if path.exists() else []
    entries = (line.split("\t") for line in lines)
    return {name: (result, test) for result, test, name in entries}


def main(arguments):
    if len(arguments) < 2:
        sys.exit(__doc__)
    at = arguments.index("--") if "--" in arguments else len(arguments)
    work, patterns, further = Path(arguments[0]).resolve(), arguments[1:at], arguments[at + 1 :]
    work.mkdir(parents=True, exist_ok=True)
    mutants, results = listed_mutants(patterns), load(work)
    try_all(work, mutants, ["plumb-core", "plumb-protocol"], results)
    if further:
        try_all(work, mutants, further, results)
    for file in sorted({mutant.file for mutant in mutants}):
        counts = Counter(results[m.name][0] for m in mutants if m.file == file)
        print(file, dict(counts))


main(sys.argv[1:])
