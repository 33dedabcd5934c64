#!/usr/bin/env python3
"""Seeds defects into the crates, one at a time, and checks that a test detects each defect.

    tests/mutations/run.py            all defects
    tests/mutations/run.py fem        the defects of one crate, in fem.toml
    tests/mutations/run.py NAME …     these defects
    tests/mutations/run.py --check    checks only that every defect still matches its source

A defect is a wrong expression in place of a correct expression. All defects of the chosen crates are compiled
at once, into a copy of the workspace. Each defect is behind a switch that an environment variable
turns on, so that there is one build, and then one short run of the named tests per defect. Without a
defect, every named test has to pass. The script needs Python 3.11 and takes some minutes; it is not
part of CI.
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SWITCH = "SEEDED_DEFECT"
# the switch that is added to the copy of a crate's src/lib.rs
CODE = """
/// Whether the seeded defect with this number is on.
#[doc(hidden)]
pub fn seeded_defect(number: u32) -> bool {
    static ON: std::sync::LazyLock<u32> = std::sync::LazyLock::new(|| {
        std::env::var("%s").ok().and_then(|n| n.parse().ok()).unwrap_or(u32::MAX)
    });
    *ON == number
}
""" % SWITCH
# packages that compile the tests
PACKAGES = ["crate-tests", "unoptimised-tests"]
# the seeded crates are compiled in several units: their speed does not matter here
SETTINGS = ["codegen-units=16", "opt-level=2"]
# time limit of the tests of one defect in seconds
PATIENCE = 300


def test_program(defect):
    """Returns the name of the test program; "lib" stands for the unit tests of the crate."""
    return f"{defect['crate']}-unit" if defect["test"] == "lib" else defect["test"]


def read_defects():
    """Returns the defects of all crates, each with its crate and its number."""
    defects = []
    for section in sorted(HERE.glob("*.toml")):
        for defect in tomllib.loads(section.read_text())["defect"]:
            defects.append(dict(defect, crate=section.stem, number=len(defects)))
    return defects


def seed(text, defect):
    """Returns the source with the defect behind its switch; None if the defect no longer matches the source."""
    within = defect.get("within", defect["right"])
    if text.count(within) != 1 or within.count(defect["right"]) != 1:
        return None
    switched = "(if crate::seeded_defect(%d) { %s } else { %s })" % (
        defect["number"],
        defect["wrong"],
        defect["right"],
    )
    return text.replace(within, within.replace(defect["right"], switched))


def seed_all(defects):
    """Returns the seeded sources by path, and the defects that no longer match."""
    sources, stale = {}, []
    for defect in defects:
        path = defect["file"]
        source = ROOT / path
        text = sources.get(path) or (source.read_text() if source.is_file() else "")
        seeded = seed(text, defect)
        if seeded is None:
            stale.append(defect)
        if text:
            sources[path] = seeded or text
    return sources, stale


def copy_workspace(target):
    files = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout.split("\n")
    for name in filter(None, files):
        source = ROOT / name
        if source.is_file():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, target / name)


def build(workspace, crates, tests):
    """Compiles the test programs; returns path and working directory by name."""
    arguments = ["cargo", "test", "--release", "--no-run", "--message-format=json-render-diagnostics"]
    for package in PACKAGES:
        arguments += ["-p", package]
    for crate in crates:
        for setting in SETTINGS:
            arguments += ["--config", f"profile.release.package.{crate}.{setting}"]
    for name in sorted(tests):
        arguments += ["--test", name]
    result = subprocess.run(arguments, cwd=workspace, stdout=subprocess.PIPE, text=True)
    if result.returncode != 0:
        sys.exit("the seeded copy does not compile: is every `wrong` of the type of its `right`?")
    programs = {}
    for line in result.stdout.splitlines():
        message = json.loads(line)
        if message.get("reason") == "compiler-artifact" and message.get("executable"):
            folder = pathlib.Path(message["manifest_path"]).parent
            programs[message["target"]["name"]] = (message["executable"], folder)
    return programs


def outcome(program, filters, number):
    """Runs tests and returns "pass", "fail", "timeout", or "no test" if the filters match no test."""
    path, folder = program
    environment = dict(os.environ, **({} if number is None else {SWITCH: str(number)}))
    try:
        result = subprocess.run(
            [path, *filters],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )
    except subprocess.TimeoutExpired:
        return "timeout"
    if "running 0 tests" in result.stdout:
        return "no test"
    return "pass" if result.returncode == 0 else "fail"


def choose(defects, asked):
    """Returns the defects of the given crates and with the given names; all defects without arguments."""
    unknown = set(asked) - {d["name"] for d in defects} - {d["crate"] for d in defects}
    if unknown:
        sys.exit(f"no such defect or crate: {', '.join(sorted(unknown))}")
    return [d for d in defects if not asked or d["name"] in asked or d["crate"] in asked]


def main():
    asked = [a for a in sys.argv[1:] if not a.startswith("--")]
    defects = read_defects()
    chosen = choose(defects, asked)
    crates = sorted({d["crate"] for d in chosen})
    sources, stale = seed_all([d for d in defects if d["crate"] in crates])
    for defect in stale:
        print(f"{defect['name']}: no longer fits its source; write it anew")
    if "--check" in sys.argv:
        count = sum(d["crate"] in crates for d in defects)
        print(f"{count - len(stale)} of {count} defects fit")
        sys.exit(bool(stale))

    chosen = [d for d in chosen if d not in stale]
    # beside the other build outputs, so that compiled dependencies are reused
    cache = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve()
    os.environ["CARGO_TARGET_DIR"] = str(cache)
    workspace = cache / "mutations"
    shutil.rmtree(workspace, ignore_errors=True)
    copy_workspace(workspace)
    for path, text in sources.items():
        (workspace / path).write_text(text)
    for crate in crates:
        with (workspace / crate / "src/lib.rs").open("a") as lib:
            lib.write(CODE)
    programs = build(workspace, crates, {test_program(d) for d in chosen})

    clean, missed = {}, []
    for defect in chosen:
        program, filters = programs[test_program(defect)], defect["filter"]
        key = (program, *filters)
        if key not in clean:
            clean[key] = outcome(program, filters, None)
        if clean[key] != "pass":
            verdict = f"its test ends with \"{clean[key]}\" without any defect: {defect['test']} {filters}"
        else:
            # a test that does not end has no failed assertion, so that the defect does not count as detected
            verdict = {
                "fail": "caught",
                "pass": "MISSED",
                "timeout": f"TIMED OUT after {PATIENCE} s: no test failed",
                "no test": "MISSED",
            }[outcome(program, filters, defect["number"])]
        print(f"{defect['name']}: {verdict}", flush=True)
        if verdict != "caught":
            missed.append(defect["name"])
    print(f"{len(chosen) - len(missed)} of {len(chosen)} caught")
    sys.exit(bool(missed or stale))


if __name__ == "__main__":
    main()
