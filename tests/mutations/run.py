#!/usr/bin/env python3
"""Seeds defects into ppl, one at a time, and sees whether a test catches each.

    tests/mutations/run.py            all defects of defects.toml
    tests/mutations/run.py NAME …     these
    tests/mutations/run.py --check    only whether every defect still fits its source

A defect is a wrong expression in place of a right one. All of them are compiled at once, into a
copy of the workspace, each behind a switch that an environment variable turns on: one build, then
one short run of the named test a defect. Without a defect every named test has to pass. It needs
Python 3.11 and takes some minutes; it is no part of CI.
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
SWITCH = "PPL_SEEDED_DEFECT"
# the test program with the unit tests in ppl/src, which defects.toml calls "lib"
UNIT_TESTS = "ppl-unit"
# the switch as it is added to the copy of ppl/src/lib.rs
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


def seed(text, number, defect):
    """The source with the defect behind its switch; None if it does not fit any more."""
    within = defect.get("within", defect["right"])
    if text.count(within) != 1 or within.count(defect["right"]) != 1:
        return None
    switched = "(if crate::seeded_defect(%d) { %s } else { %s })" % (
        number,
        defect["wrong"],
        defect["right"],
    )
    return text.replace(within, within.replace(defect["right"], switched))


def copy_workspace(target):
    files = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout.split("\n")
    for name in filter(None, files):
        source = ROOT / name
        if source.is_file():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, target / name)


def build(workspace, tests):
    """Compiles the test programs; their paths by name."""
    arguments = ["cargo", "test", "-p", "ppl", "-p", "crate-tests", "--no-run"]
    arguments += ["--message-format=json-render-diagnostics"]
    for name in sorted(tests):
        arguments += ["--test", UNIT_TESTS if name == "lib" else name]
    result = subprocess.run(arguments, cwd=workspace, stdout=subprocess.PIPE, text=True)
    if result.returncode != 0:
        sys.exit("the seeded copy does not compile: is every `wrong` of the type of its `right`?")
    programs = {}
    for line in result.stdout.splitlines():
        message = json.loads(line)
        if message.get("reason") == "compiler-artifact" and message.get("executable"):
            name = message["target"]["name"]
            programs["lib" if name == UNIT_TESTS else name] = message["executable"]
    return programs


# seconds that the tests of one defect may take
PATIENCE = 300


def outcome(program, filters, number, workspace):
    """How the tests end: "pass", "fail", "no test" if the filters name none, or "timeout"."""
    environment = dict(os.environ, **({} if number is None else {SWITCH: str(number)}))
    try:
        result = subprocess.run(
            [program, *filters],
            cwd=workspace / "ppl",
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


def main():
    asked = [a for a in sys.argv[1:] if not a.startswith("--")]
    defects = tomllib.loads((HERE / "defects.toml").read_text())["defect"]
    unknown = set(asked) - {d["name"] for d in defects}
    if unknown:
        sys.exit(f"no such defect: {', '.join(sorted(unknown))}")

    sources, stale = {}, []
    for number, defect in enumerate(defects):
        path = defect["file"]
        source = ROOT / path
        text = sources.get(path) or (source.read_text() if source.is_file() else "")
        seeded = seed(text, number, defect)
        if seeded is None:
            stale.append(defect["name"])
        if text:
            sources[path] = seeded or text
    for name in stale:
        print(f"{name}: no longer fits its source; write it anew")
    if "--check" in sys.argv:
        print(f"{len(defects) - len(stale)} of {len(defects)} defects fit")
        sys.exit(bool(stale))

    chosen = [
        (number, d)
        for number, d in enumerate(defects)
        if d["name"] not in stale and (not asked or d["name"] in asked)
    ]
    # beside the other build outputs, so that compiled dependencies serve again
    cache = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve()
    os.environ["CARGO_TARGET_DIR"] = str(cache)
    workspace = cache / "mutations"
    shutil.rmtree(workspace, ignore_errors=True)
    copy_workspace(workspace)
    for path, text in sources.items():
        (workspace / path).write_text(text)
    with (workspace / "ppl/src/lib.rs").open("a") as lib:
        lib.write(CODE)
    programs = build(workspace, {d["test"] for _, d in chosen})

    clean, missed = {}, []
    for number, defect in chosen:
        program, filters = programs[defect["test"]], defect["filter"]
        key = (program, *filters)
        if key not in clean:
            clean[key] = outcome(program, filters, None, workspace)
        if clean[key] != "pass":
            verdict = f"its test ends with \"{clean[key]}\" without any defect: {defect['test']} {filters}"
        else:
            # a run without end is no assertion that failed: it is not caught, and told by itself
            verdict = {
                "fail": "caught",
                "pass": "MISSED",
                "timeout": f"TIMED OUT after {PATIENCE} s: no test failed",
                "no test": "MISSED",
            }[outcome(program, filters, number, workspace)]
        print(f"{defect['name']}: {verdict}", flush=True)
        if verdict != "caught":
            missed.append(defect["name"])
    print(f"{len(chosen) - len(missed)} of {len(chosen)} caught")
    sys.exit(bool(missed or stale))


main()
