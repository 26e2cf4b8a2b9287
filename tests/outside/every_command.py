"""Run every command, each as small as it is of use: python every_command.py [bare] [first words ...]

With "bare", none of the extras is installed: what needs one must end with 1 and one line that names it. Without, what
needs an extra runs after it, in the same folder, and README's commands. First words, such as "rig", choose commands.
"""

import re
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path
from urllib.request import urlopen

PICTURE = "--size 64 --out out"
STILL = f"--no-movie --quiet {PICTURE}"
TWO = "--shapes browInnerUp+jawOpen --quiet --out rigs"

LINES = {
    "--version": "",
    "--help": "",
    "compile": "",
    "info": "",
    "atlas --out mine.toml": "",
    "completion bash": "",
    "blender": "",
    "studio --help": "",
    "dataset --help": "",
    f"express surprise --frames 2 {STILL}/all --series --maps 64 --save-mesh glb --save-animation happy.glb": "",
    f"express AU1=0.7,AU4 --frames 2 --atlas mine.toml --folds paper {STILL}": "",
    f"express AU1+AU12 --frames 2 --write-session mine.json {STILL}": "",
    f"express --session mine.json {STILL}/session --save-mesh glb": "",
    f"express surprise --frames 2 {PICTURE}": "export, for its movie",
    f"express surprise --frames 2 {STILL} --save-animation out/happy.usd": "export",
    "demo --quiet --out demo": "",
    "fit scan.obj --quiet --out .": "",
    "info scan.face": "",
    f"tear weeping --seconds 0.4 --fps 10 {STILL}": "",
    f"pattern dimple --frames 2 {STILL}": "",
    "take take.csv": "",
    f"play take.csv --face scan.face --moments 1 {STILL}": "",
    "play out/all/surprise.vtkhdf --moments 1 --no-movie --quiet --size 64 --out played": "",
    f"rig scan.face --page --correctives 1 --errors {TWO}/baked": "",
    f"rig scan.face --wrinkles separate --level 1 --format gltf --dense {TWO}/separate": "",
    f"rig scan.face --wrinkles none {TWO}/none": "",
    f"rig scan.face --wrinkles maps --map-size 64 {TWO}/maps": "",
    f"rig scan.obj --same-mesh --wrinkles maps --map-size 64 {TWO}/same": "",
    f"rig scan.face --format usd {TWO}/usd": "export",
    "dataset spec": "",
    "dataset small.toml --count 2 --quiet --out set": "dataset",
    "dataset check set": "dataset",
    "studio scan.face --no-browser": "studio",
}
"""What follows `facewrinkle`, and the extra that it needs; without one for movies, all else is written, with a note."""

SHORTER = {
    "express": "--frames 2 --size 64",
    "studio": "--no-browser",
    "rig": "--shapes browInnerUp+jawOpen",
    "blender": "",
    "dataset": "small.toml",
}
"""What makes the commands of README shorter: frames, pixels, shapes and people; and no window."""

TAKE = "time,jawOpen,browInnerUp,mouthSmileLeft\n0,0,0,0\n0.1,0.5,0.8,0.9\n"


def main() -> None:
    """Run the lines in turn; the first that does what it must not ends it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell makes what it starts with & deaf to it
    bare, words = "bare" in sys.argv[1:], {word for word in sys.argv[1:] if word != "bare"}
    prepare()
    lines = LINES if bare else {line: extra for line, extra in (LINES | of_readme()).items() if extra}
    for line, extra in lines.items():
        if words and line.split()[0] not in words:
            continue
        began = time.monotonic()
        if bare and extra:
            refused(line, extra)
        elif extra == "studio":
            opened(line)
        else:
            done = run(line)
            assert done.returncode == 0, told(line, done)
            assert "Traceback" not in done.stderr, told(line, done)
        print(f"{time.monotonic() - began:5.1f} s  facewrinkle {line}", flush=True)


def prepare() -> None:
    """Write the files that the lines name, and see that they name all commands."""
    import facewrinkle as fw
    from facewrinkle.cli import app

    assert fw.__file__.startswith(sys.prefix), f"{fw.__file__} is not that of {sys.prefix}"
    commands = {name for name in app if not name.startswith("-")}
    assert commands == {line.split()[0] for line in LINES if not line.startswith("-")}, commands
    Path("take.csv").write_text(TAKE)
    Path("small.toml").write_text("size = [48, 48]\nshard = 2\n")
    fw.write_mesh(fw.default_face().mesh, "scan.obj")


def of_readme() -> dict[str, str]:
    """Return the commands of README, shortened, each with its word for an extra: "all" but for the studio."""
    text = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    found = [line.partition("#")[0].strip() for line in re.findall(r"^ {4}facewrinkle (.+)$", text, re.MULTILINE)]
    assert {line.split()[0] for line in found} == set(SHORTER), found
    return {f"{line} {SHORTER[line.split()[0]]}": "studio" if line == "studio" else "all" for line in found}


def run(line: str) -> subprocess.CompletedProcess[str]:
    """Run the command as its users do."""
    return subprocess.run([program(), *shlex.split(line)], capture_output=True, text=True, check=False)


def program() -> str:
    """Return the path of the command."""
    return str(Path(sys.executable).with_name("facewrinkle"))


def refused(line: str, extra: str) -> None:
    """Run a command whose extra is not installed."""
    done, (extra, *movie) = run(line), extra.split(", ")
    assert done.returncode == (0 if movie else 1), told(line, done)
    named = re.search(r'^facewrinkle: .*not installed.*pip install "[\w.]+\[([\w,]+)\]"', done.stderr, re.MULTILINE)
    assert named is not None, told(line, done)
    assert extra in named[1].split(","), told(line, done)


def opened(line: str) -> None:
    """Open the studio, load its page, and end it as Ctrl-C does."""
    with subprocess.Popen([program(), *shlex.split(line)], stdout=subprocess.PIPE, text=True) as studio:
        assert studio.stdout is not None
        try:
            first = studio.stdout.readline()
            place = re.search(r"http://\S+", first)
            assert place is not None, first
            with urlopen(place[0], timeout=30) as page:
                assert b"<html" in page.read()
        finally:
            studio.send_signal(signal.SIGINT)
        assert studio.wait(30) == 130, studio.returncode


def told(line: str, done: subprocess.CompletedProcess[str]) -> str:
    """Return what a command that failed has said."""
    return f"facewrinkle {line}: exit status {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-4000:]}"


if __name__ == "__main__":
    main()
