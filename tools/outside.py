"""What is promised, tried from outside, as a stranger would: python -m tools.outside [word ...]

The wheel is built and installed into bare environments, and runs there from an empty folder, without the repository;
beside it, the site and the analyses are made. Words choose steps whose names have one of them, in what an earlier run
left in output/outside. The Pythons are 3.11 and the newest that the package names and the machine has.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import tarfile
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from zipfile import ZipFile

REPOSITORY = Path(__file__).parents[1]
PLACE = REPOSITORY / "output" / "outside"
SCRIPTS = REPOSITORY / "tests" / "outside"
PAGES = [
    REPOSITORY / "README.md",
    *sorted(page for folder in ("", "howto", "theory") for page in (REPOSITORY / "docs" / folder).glob("*.rst")),
]
"""Pages that people wrote: those of the reference are made anew meanwhile."""

TORCH = os.environ.get("FACEWRINKLE_TORCH", "")
"""A requirement such as torch==2.13.0: it is gigabytes in places, so that it is installed only when asked for."""

READERS = ("webdataset", "pandas", "datasets")
"""What reads data sets: with these the page about them shows how."""

SOME = ("atlas", "express", "fit", "rig", "studio", "dataset")
"""Commands that the newest Python runs."""

LOG = 40
"""Lines that are shown of a step that failed."""


@dataclass
class Step:
    """A command, and where it runs.

    Attributes
    ----------
    name : str
    command : list of str
    folder : Path
    """

    name: str
    command: list[str]
    folder: Path = REPOSITORY


@dataclass
class Outside:
    """Runs of steps, which stop at the first that fails.

    Attributes
    ----------
    times : dict of str to float
        Seconds of the steps that are done, by name.
    failed : list of str
        What is said about those that failed.
    """

    times: dict[str, float] = field(default_factory=dict)
    failed: list[str] = field(default_factory=list)
    stop: threading.Event = field(default_factory=threading.Event)

    def run(self, steps: Iterator[Step]) -> None:
        """Run steps in turn."""
        try:
            for step in steps:
                if self.stop.is_set():
                    return
                self._do(step)
        except Exception as problem:
            self.failed.append(str(problem) or repr(problem))
            self.stop.set()

    def _do(self, step: Step) -> None:
        began, log = time.monotonic(), PLACE / f"{step.name.replace(' ', '_')}.log"
        log.parent.mkdir(parents=True, exist_ok=True)
        step.folder.mkdir(parents=True, exist_ok=True)
        with log.open("w") as lines:
            done = subprocess.run(
                step.command, cwd=step.folder, env=surroundings(), stdout=lines, stderr=subprocess.STDOUT, check=False
            )
        self.times[step.name] = time.monotonic() - began
        print(f"{self.times[step.name]:6.0f} s  {step.name}", flush=True)
        if done.returncode:
            end = "\n".join(log.read_text(errors="replace").splitlines()[-LOG:])
            repeat = f"(cd {step.folder} && {shlex.join(step.command)})"
            raise AssertionError(f"{end}\n\nFailed: {step.name}. All it said is in {log}. To repeat it:\n{repeat}")


def main() -> int:
    """Run all steps, two at a time; print what failed, and how long each took."""
    words = sys.argv[1:]
    if not words:
        shutil.rmtree(PLACE, ignore_errors=True)
    began, outside = time.monotonic(), Outside()

    def chosen(steps: Iterator[Step]) -> Iterator[Step]:
        return (step for step in steps if not words or any(word in step.name for word in words))

    with ThreadPoolExecutor(2) as two:
        for chain in CHAINS:
            two.submit(outside.run, chosen(chain()))
    for problem in outside.failed:
        print(f"\n{problem}", file=sys.stderr)
    print(f"\n{sum(outside.times.values()):.0f} s of {len(outside.times)} steps, in {time.monotonic() - began:.0f} s.")
    if not TORCH:
        print("The loader of PyTorch was not tried: FACEWRINKLE_TORCH names what to install, such as torch==2.13.0.")
    return 1 if outside.failed else 0


def analysis() -> Iterator[Step]:
    """All tables and plots."""
    yield Step("analysis", ["make", "analysis"])


def package() -> Iterator[Step]:
    """Build the package, install it bare, as README says and as the pages say, and do there what they say."""
    yield Step("build", [sys.executable, "-m", "build", "--outdir", str(PLACE / "dist"), "."])
    (wheel,), (source,) = (PLACE / "dist").glob("*.whl"), (PLACE / "dist").glob("*.tar.gz")
    complete(wheel, source)
    pythons = interpreters(wheel)
    print(f"Of the Pythons that the package names, there are {pythons}")
    oldest = min(pythons)
    there = Environment(pythons[oldest], oldest)
    yield from there.bare(wheel)
    yield there.script("every name", "every_name.py")
    yield there.script("every command", "every_command.py", "bare")
    yield there.install("README", *requirements(wheel, PAGES[:1]))
    yield there.script("every name with extras", "every_name.py")
    yield there.script("README and extras", "every_command.py")
    yield there.install("pages", *requirements(wheel, PAGES), *READERS, *filter(None, [TORCH]))
    yield there.script("pages", "pages.py")
    if (SCRIPTS / "read_dataset.py").exists():
        yield there.script("data set", "read_dataset.py")


def site() -> Iterator[Step]:
    """The site, with warnings as errors: sphinx-gallery runs every page of the gallery. Then the newest Python."""
    yield Step("docs", ["make", "docs"])
    (wheel,) = (PLACE / "dist").glob("*.whl")
    pythons = interpreters(wheel)
    there = Environment(pythons[max(pythons)], max(pythons))
    if len(pythons) > 1:
        yield from there.bare(wheel)
        yield there.script("every name", "every_name.py")
        yield there.script("some commands", "every_command.py", "bare", *SOME)
        yield there.script("README", "pages.py", "README")


@dataclass
class Environment:
    """A bare environment.

    Attributes
    ----------
    python : str
        The interpreter that makes it.
    version : tuple of int
    """

    python: str
    version: tuple[int, ...]

    def __post_init__(self) -> None:
        self.name = ".".join(map(str, self.version))
        self.folder = PLACE / f"python{self.name}"

    def bare(self, wheel: Path) -> Iterator[Step]:
        """Make it, and install the wheel without extras."""
        yield Step(f"{self.name}: environment", [self.python, "-m", "venv", str(self.folder)])
        yield self.install("bare", str(wheel))

    def install(self, what: str, *packages: str) -> Step:
        """Install packages, without a word where all goes well."""
        options = ["--quiet", "--disable-pip-version-check"]
        return Step(f"{self.name}: install {what}", [self._python(), "-m", "pip", "install", *options, *packages])

    def script(self, what: str, *script: str) -> Step:
        """Run one of the scripts, in a folder that is empty at first."""
        name, *words = script
        return Step(f"{self.name}: {what}", [self._python(), str(SCRIPTS / name), *words], PLACE / f"work{self.name}")

    def _python(self) -> str:
        return str(self.folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python"))


def surroundings() -> dict[str, str]:
    """Return the variables of this process without what points to the repository."""
    return {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}


def complete(wheel: Path, source: Path) -> None:
    """See that the wheel has the package alone, with its data, and the source distribution all that git has."""
    listing = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(listing, cwd=REPOSITORY, capture_output=True, text=True, check=False)
    files = {name for name in listed.stdout.split("\n") if name and not name.startswith(".")}
    with ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if ".dist-info/" not in name}
    with tarfile.open(source) as archive:
        inside = {name.partition("/")[2] for name in archive.getnames()}
    assert files, "git lists no files: it is needed to see whether the package is complete."
    own = {name for name in files if name.startswith("facewrinkle/")}
    assert names == own, f"The wheel lacks {sorted(own - names)}, or should not have {sorted(names - own)}."
    assert files <= inside, f"The source distribution lacks {sorted(files - inside)}: see MANIFEST.in."


def requirements(wheel: Path, pages: list[Path]) -> list[str]:
    """Return what pages install: the package with extras as this wheel, other packages by name."""
    texts = "\n".join(page.read_text(encoding="utf-8") for page in pages)
    found = {word for line in re.findall(r"pip install ([^`#\n]+)", texts) for word in shlex.split(line)}
    extras = {extra for word in found if "[" in word for extra in re.sub(r".*\[|\]", "", word).split(",")}
    names = {word for word in found if re.fullmatch(r"[a-z][\w-]+", word) and word != "torch"}
    assert extras, f"No installation is named in {[page.name for page in pages]}."
    return [f"{wheel}[{','.join(sorted(extras))}]", *sorted(names)]


def interpreters(wheel: Path) -> dict[tuple[int, ...], str]:
    """Return the Pythons of this machine that the wheel names: on the path, and pyenv's."""
    with ZipFile(wheel) as archive:
        metadata = archive.read(next(name for name in archive.namelist() if name.endswith("/METADATA"))).decode()
    found: dict[tuple[int, ...], str] = {}
    for major, minor in re.findall(r"Programming Language :: Python :: (\d+)\.(\d+)", metadata):
        pyenv = sorted((Path.home() / ".pyenv" / "versions").glob(f"{major}.{minor}.*/bin/python3"))
        for place in filter(None, (shutil.which(f"python{major}.{minor}"), *map(str, pyenv))):
            if not subprocess.run([place, "-c", "import venv, ensurepip"], capture_output=True, check=False).returncode:
                found[int(major), int(minor)] = place
                break
    return found or {tuple(sys.version_info[:2]): sys.executable}


CHAINS = (analysis, package, site)
"""What runs side by side, two at a time; what takes longest begins."""

if __name__ == "__main__":
    sys.exit(main())
