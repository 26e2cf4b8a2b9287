"""One door for every file: what a user names is opened by `files.py` and read by `mesh/formats`, nowhere else."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "facewrinkle"

OPENING = ("open", "read_bytes", "read_text", "load", "loadtxt", "genfromtxt", "fromfile", "memmap", "read_table",
           "ZipFile", "TarFile", "get_reader", "imread")  # fmt: skip
"""Names of functions that open files, besides classes whose names end in Reader."""

OWNERS = {"load": {"np"}, "read_table": {"parquet"}}
"""Whose functions of these names are meant."""

OURS = ("DATA", "DEFAULT", "DEFAULT_ATLAS", "OF_HEAD", "__package__", "__file__", "BytesIO", "devnull")
"""Data of the package, and what is no file."""

MADE_HERE = {
    "live/saving.py: read_bytes": 3,  # files that it has written into a folder of its own
    "dataset/sample.py: read_bytes": 1,  # the same
    "dataset/shards.py: open": 1,  # a shard that it writes
    "dataset/spec.py: read_bytes": 2,  # the code of the package
    "plotting/web.py: read_bytes": 1,  # pages of the package
    "rigging/write.py: read_bytes": 1,  # the extension for Blender
    "live/window.py: open": 1,  # a browser
    "__main__.py: read_text": 1,  # the system's list of processes
    "animation/reading.py: vtkHDFReader": 1,  # what the probe has read
}
"""Calls that open what no user names."""


def name_of(call: ast.Call) -> str:
    return call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")


def handed(function: ast.AST) -> set[str]:
    """Names that `with opened(...) as name`, `written` or a temporary file gives."""
    items = [item for node in ast.walk(function) if isinstance(node, ast.With) for item in node.items]
    doors = ("opened", "written", "replaced", "TemporaryFile", "ZipFile")
    return {
        item.optional_vars.id
        for item in items
        if isinstance(item.context_expr, ast.Call)
        and name_of(item.context_expr) in doors
        and isinstance(item.optional_vars, ast.Name)
    }


def opens(path: Path) -> list[str]:
    """Calls of a module that open a file to read it, except by the doors."""
    tree, found = ast.parse(path.read_text(encoding="utf-8")), []
    given = handed(tree)
    for call in ast.walk(tree):
        name = name_of(call) if isinstance(call, ast.Call) else ""
        if not (name in OPENING or (name.endswith("Reader") and name[0] != "_")):
            continue
        text = ast.unparse(call.func)
        if text.rpartition(".")[0] not in OWNERS.get(name, {text.rpartition(".")[0]}):
            continue
        modes = {each.value for each in ast.walk(call) if isinstance(each, ast.Constant)}
        names = {each.id for each in ast.walk(call) if isinstance(each, ast.Name)}
        names |= {each.attr for each in ast.walk(call) if isinstance(each, ast.Attribute)}
        if modes & {"w", "wb", "xb"} or names & {*OURS, *given}:
            continue
        found.append(name)
    return found


def test_what_a_user_names_is_opened_by_the_doors():
    modules = [path for path in sorted(PACKAGE.rglob("*.py")) if path.name != "files.py"]
    found: dict[str, int] = {}
    for path in modules:
        inner = path.relative_to(PACKAGE).as_posix()
        if not inner.startswith(("mesh/formats/", "rigging/data/")):  # of which the second runs in Blender
            for name in opens(path):
                found[f"{inner}: {name}"] = found.get(f"{inner}: {name}", 0) + 1
    assert found == MADE_HERE


@pytest.mark.parametrize(
    "line",
    ["open(path)", "path.open('rb')", "Image.open(path)", "pv.HDRReader(path)", "np.load(path)", "path.read_bytes()",
     "tarfile.open(path)", "parquet.read_table(path)", "pv.get_reader(path)"],
)  # fmt: skip
def test_the_rule_sees_what_it_forbids(tmp_path, line):
    (tmp_path / "module.py").write_text(line)
    assert len(opens(tmp_path / "module.py")) == 1
    (tmp_path / "module.py").write_text("with opened(path) as path:\n    " + line)
    assert not opens(tmp_path / "module.py")
