"""Files for VTK and USD are first read in a process of their own: damaged ones can crash these, or keep them busy.

There is no such process where Python itself is part of another program; the file is then read at once.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from ...errors import MeshError

SECONDS, PER_SECOND = 8, 1_000_000
"""Processor time that reading may take, s, and the bytes of the file for each further second."""

MEMORY, PER_BYTE = 2 * 2**30, 20
"""Bytes of memory that reading may take, and the further ones for each byte of the file."""

OF_VTK = {
    ".vtk": "vtkIOLegacy.vtkGenericDataObjectReader",
    ".vtp": "vtkIOXML.vtkXMLPolyDataReader",
    ".vtu": "vtkIOXML.vtkXMLUnstructuredGridReader",
    ".vtm": "vtkIOXML.vtkXMLMultiBlockDataReader",
    ".vtkhdf": "vtkIOHDF.vtkHDFReader",
    ".hdf": "vtkIOHDF.vtkHDFReader",
}
"""Classes of VTK by the ending of the file, with their modules."""

_LIMITED = """
import importlib, json, sys
path, reader, seconds, memory, sys.path[:] = json.loads(sys.argv[1])
try:
    import resource
except ImportError:
    pass
else:
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 2))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform.startswith("linux"):
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
"""

_VTK = (
    _LIMITED
    + """
module, name = reader.split(".")
reader = getattr(importlib.import_module("vtkmodules." + module), name)()
reader.SetFileName(path)
reader.UpdateInformation()
steps = reader.GetNumberOfSteps() if hasattr(reader, "GetNumberOfSteps") else 1

def checked(data):
    if hasattr(data, "GetNumberOfBlocks"):
        for k in range(data.GetNumberOfBlocks()):
            checked(data.GetBlock(k))
        return
    for kind in ("Point", "Cell"):
        if hasattr(data, f"Get{kind}Data"):
            count, own = getattr(data, f"GetNumberOf{kind}s")(), getattr(data, f"Get{kind}Data")()
            for k in range(own.GetNumberOfArrays()):
                if own.GetAbstractArray(k).GetNumberOfTuples() != count:
                    sys.exit(f"{own.GetAbstractArray(k).GetName()} has another length than the {kind.lower()}s")
    if hasattr(data, "GetPoints") and data.GetPoints() is not None:
        data.GetBounds()

for step in range(max(steps, 1)):
    if steps > 1:
        reader.SetStep(step)
    reader.Update()
    checked(reader.GetOutputDataObject(0))
"""
)

_USD = (
    _LIMITED
    + """
from pxr import Usd
for prim in Usd.Stage.Open(path).Traverse(Usd.TraverseInstanceProxies()):
    for attribute in prim.GetAttributes():
        attribute.Get()
        for time in attribute.GetTimeSamples():
            attribute.Get(time)
"""
)

_END = """
sys.stdout.write("whole")
sys.stdout.flush()
import os
os._exit(0)
"""


def probe(path: Path) -> None:
    """Raise a MeshError if VTK cannot read a file without harm; what else is wrong with it is found later."""
    _probe(path, _VTK, OF_VTK[path.suffix.lower()], "VTK")


def probe_usd(path: Path) -> None:
    """Raise a MeshError if USD dies of a file; what it refuses is found later, with its own reason."""
    _probe(path, _USD, "", "USD")


def _probe(path: Path, program: str, reader: str, library: str) -> None:
    if not sys.executable or getattr(sys, "frozen", False):
        return
    size = path.stat().st_size
    seconds, memory = SECONDS + size // PER_SECOND, MEMORY + PER_BYTE * size
    arguments = json.dumps([str(path), reader, seconds, memory, sys.path])
    try:
        run = subprocess.run(
            [sys.executable, "-S", "-c", program + _END, arguments],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            check=False,
            timeout=20 * seconds,
        )
    except OSError:  # no processes can be started here
        return
    except subprocess.TimeoutExpired:
        raise _harmful(path, f"{library} does not come to an end with it") from None
    if run.stdout.endswith(b"whole") or (library == "USD" and run.returncode == 1):
        return
    said = run.stderr.decode(errors="replace").strip().splitlines()
    if run.returncode == 1 and said and "has another length" in said[-1]:
        raise _harmful(path, said[-1].strip())
    raise _harmful(path, f"{library} does not get through it")


def _harmful(path: Path, reason: str) -> MeshError:
    return MeshError(
        f"{path.name} cannot be read: {reason}. The file is damaged or of another format: export it again, or as OBJ "
        "or PLY."
    )
