"""Mutation testing: whether the tests notice when the formulas are changed a little.

``python tools/mutants.py [--processes N] [--keep]`` changes the modules that pyproject.toml names, one operator,
number, name or argument at a time, in copies under mutants/, runs the tests that call the changed function, and prints
how many changes they noticed, and the names of the others. Noticed are those with which a test failed or did not end;
a change that no test calls, or that made Python crash, counts as missed. Less than FLOOR of all noticed is a failure.
With --keep the folder stays: ``python -m mutmut show NAME`` prints a change.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

FLOOR = 0.85
FOLDER = Path("mutants")
NOTICED = ("killed", "timeout")
MUTMUT = [sys.executable, "-m", "mutmut"]


def run(processes: int) -> bool:
    """Try all mutants; whether the tests could be run at all."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}  # the processes share the cores already
    quiet = not sys.stdout.isatty()  # its progress is for terminals
    command = [*MUTMUT, "run", "--max-children", str(processes)]
    done = subprocess.run(command, env=environment, capture_output=quiet, text=True, encoding="utf-8", check=False)
    if quiet and done.returncode:
        print(done.stdout[-4000:], done.stderr[-4000:], sep="\n")
    return done.returncode == 0


def outcomes() -> dict[str, str]:
    """What became of every mutant."""
    command = [*MUTMUT, "results", "--all", "true"]
    listed = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=True).stdout
    return dict(line.strip().split(": ") for line in listed.splitlines() if ": " in line)


def report(found: dict[str, str]) -> float:
    """Print the numbers of each module; the share of all mutants that was noticed."""
    modules: dict[str, Counter[str]] = {}
    for name, outcome in found.items():
        modules.setdefault(name.rsplit(".", 1)[0], Counter())[outcome] += 1
        if outcome not in NOTICED:
            print(f"{outcome:>12}  {name}")
    total = sum(modules.values(), Counter())
    for module, counts in [*modules.items(), ("all", total)]:
        share = sum(counts[outcome] for outcome in NOTICED) / max(counts.total(), 1)
        details = ", ".join(f"{n} {outcome}" for outcome, n in counts.most_common())
        print(f"{module:38} {share:7.1%} of {counts.total():5}: {details}")
    return share


def main() -> int:
    """Exit status 1 where too much went unnoticed or the tests did not run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--keep", action="store_true", help="leave the changed copies")
    options = parser.parse_args()
    try:
        if not run(options.processes):
            return 1
        found = outcomes()
        share = report(found)
    finally:
        if not options.keep:
            shutil.rmtree(FOLDER, ignore_errors=True)
    untried = sum(outcome == "not checked" for outcome in found.values())
    if untried or share < FLOOR:
        print(f"{share:.1%} noticed, {FLOOR:.0%} wanted; {untried} mutants were not tried.", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
