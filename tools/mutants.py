"""Mutation testing: do the tests notice when the formulas are changed a little?

``python tools/mutants.py [--processes N] [--keep]`` changes the modules that pyproject.toml names, one operator,
number, name or argument at a time, in copies under mutants/. It runs the tests that call the changed function, and
prints the number of changes that they noticed and the names of those that they missed. A change is noticed if a test
fails or does not end; it counts as missed if no test calls it, or if Python crashes. The exit status is 1 if a smaller
share than LEAST_NOTICED is noticed. With --keep the folder stays: ``python -m mutmut show NAME`` prints a change.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

LEAST_NOTICED = 0.85
FOLDER = Path("mutants")
NOTICED = ("killed", "timeout")
MUTMUT = [sys.executable, "-m", "mutmut"]


def run(processes: int) -> bool:
    """Try all mutants; return True if the tests could be run."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}  # the processes share the cores already
    quiet = not sys.stdout.isatty()  # its progress is for terminals
    command = [*MUTMUT, "run", "--max-children", str(processes)]
    done = subprocess.run(command, env=environment, capture_output=quiet, text=True, encoding="utf-8", check=False)
    if quiet and done.returncode:
        print(done.stdout[-4000:], done.stderr[-4000:], sep="\n")
    return done.returncode == 0


def outcomes() -> dict[str, str]:
    """Outcome of every mutant by its name."""
    command = [*MUTMUT, "results", "--all", "true"]
    listed = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=True).stdout
    return dict(line.strip().split(": ") for line in listed.splitlines() if ": " in line)


def report(found: dict[str, str]) -> float:
    """Print the numbers of each module; return the share of all mutants that was noticed."""
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
    """Return the exit status: 1 if too few mutants were noticed or the tests did not run."""
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
    if untried or share < LEAST_NOTICED:
        print(f"{share:.1%} noticed, {LEAST_NOTICED:.0%} wanted; {untried} mutants were not tried.", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
