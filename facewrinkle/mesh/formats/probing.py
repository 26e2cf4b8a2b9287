"""Files for VTK and USD are first read in a process of their own: damaged ones can crash these, or keep them busy.

There is no such process where Python itself is part of another program; the file is then read at once.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from ...errors import MeshError
from ...files import is_inside_only

SECONDS = 8
"""Processor time that reading a small file may take, s."""

OF_VTK = {
    ".vtk": "vtkIOLegacy.vtkGenericDataObjectReader",
    ".vtp": "vtkIOXML.vtkXMLPolyDataReader",
    ".vtm": "vtkIOXML.vtkXMLMultiBlockDataReader",
    ".vtkhdf": "vtkIOHDF.vtkHDFReader",
    ".hdf": "vtkIOHDF.vtkHDFReader",
}
"""Classes of VTK by the ending of the file, with their modules."""

PROGRAM = """
import importlib, json, os, sys

path, reader, seconds, memory, alone, sys.path[:] = json.loads(sys.argv[1])
try:
    import resource
except ImportError:
    pass
else:
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 2))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if sys.platform.startswith("linux"):
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))

def read_with_vtk():
    module, name = reader.split(".")
    source = getattr(importlib.import_module("vtkmodules." + module), name)()
    source.SetFileName(path)
    if alone:
        only_one_file(source)
    source.UpdateInformation()
    steps = source.GetNumberOfSteps() if hasattr(source, "GetNumberOfSteps") else 1
    for step in range(max(steps, 1)):
        if steps > 1:
            source.SetStep(step)
        source.Update()
        check(source.GetOutputDataObject(0))

def only_one_file(source):
    # Let one file be open at a time, so that no other can be read; errors then end the process.
    if "resource" not in globals():  # it cannot be had here
        os._exit(1)
    free = os.open(path, os.O_RDONLY)
    os.close(free)
    resource.setrlimit(resource.RLIMIT_NOFILE, (free + 1, free + 1))
    source.AddObserver("ErrorEvent", lambda *_: os._exit(1))

def check(data):
    if hasattr(data, "GetNumberOfBlocks"):
        for number in range(data.GetNumberOfBlocks()):
            check(data.GetBlock(number))
        return
    for kind in ("Point", "Cell"):
        if hasattr(data, f"Get{kind}Data"):
            count, own = getattr(data, f"GetNumberOf{kind}s")(), getattr(data, f"Get{kind}Data")()
            if any(own.GetAbstractArray(k).GetNumberOfTuples() != count for k in range(own.GetNumberOfArrays())):
                sys.exit(1)
    if hasattr(data, "GetPoints") and data.GetPoints() is not None:
        data.GetBounds()

def read_with_usd():
    from pxr import Usd

    for prim in Usd.Stage.Open(path).Traverse(Usd.TraverseInstanceProxies()):
        for attribute in prim.GetAttributes():
            attribute.Get()
            for time in attribute.GetTimeSamples():
                attribute.Get(time)

try:
    read_with_vtk() if reader else read_with_usd()
except MemoryError:
    sys.exit(1)
except Exception:  # the file is refused again when it is read, with its own reason
    pass
os.write(1, b"whole")
os._exit(0)
"""
"""Reads a file as well as it can, and ends with "whole" if the process has outlived it."""


def probe(path: Path) -> None:
    """Raise a MeshError if VTK or USD cannot read a file without harm; what else is wrong with it is found later."""
    if not sys.executable or getattr(sys, "frozen", False):
        return
    size, ending = path.stat().st_size, path.suffix.lower()
    seconds, memory = SECONDS + size // 1_000_000, 2 * 2**30 + 20 * size  # at a MB a second, and 20 times the file
    reader = OF_VTK.get(ending)
    # HDF files may link to others in ways that only their library sees.
    alone = is_inside_only() and ending in (".vtkhdf", ".hdf")
    arguments = json.dumps([str(path), reader, seconds, memory, alone, sys.path])
    try:
        run = subprocess.run(
            [sys.executable, "-S", "-c", PROGRAM, arguments],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            check=False,
            timeout=5 * seconds,
        )
        whole = run.stdout.endswith(b"whole")
    except subprocess.TimeoutExpired:
        whole = False
    except OSError:  # no processes can be started here
        return
    if not whole:
        if alone:
            raise MeshError(
                f"{path.name} cannot be read by itself: it is damaged, or its data lie in other files, which are not "
                "read. Export it as one file, or, if you trust it, read it without --no-outside."
            )
        raise MeshError(
            f"{path.name} cannot be read: {'VTK' if reader else 'USD'} does not get through it. The file is damaged or "
            "of another format: export it again, or as OBJ or PLY."
        )
