"""Damaged and boobytrapped files: an error of ours, soon, or a good mesh; never a crash or a hang."""

import json
import os
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import pyvista as pv
from PIL import Image

import facewrinkle as fw
from facewrinkle.errors import MeshError
from facewrinkle.files import inside_only
from facewrinkle.mesh.formats import probing
from tools.trials.fuzzing import READERS, SECONDS, play
from tools.trials.runner import Worker

MUTANTS = 150
"""Of each kind of file; `python -m tools.trials fuzzing` makes more."""

PROBED = (".vtk", ".vtp", ".vtm", ".vtkhdf", ".usda", ".usdc", "clip.vtkhdf", "clip.usda")
"""Kinds that are read by VTK or USD in a further process, which takes longer: a twentieth of the mutants."""


@pytest.fixture(scope="module")
def apart():
    """A process beside this one, which may die."""
    if not Path("/proc/self/statm").exists():
        pytest.skip("the memory of a process is limited by what Linux tells of it")
    worker = Worker(SECONDS)
    yield worker
    worker.close()


@pytest.mark.slow
@pytest.mark.parametrize("kind", sorted(READERS))
def test_mutants(apart, kind):
    for number in range(MUTANTS // 20 + 1 if kind in PROBED else MUTANTS):
        assert apart(play, kind, number) in ("read", "refused"), number


@pytest.fixture
def secret(tmp_path):
    """A picture beside the folder in which a mesh is to be."""
    (tmp_path / "mesh").mkdir()
    path = tmp_path / "secret.png"
    Image.fromarray(np.full((4, 4, 3), 77, np.uint8)).save(path)
    return path


NAMES = ("../secret.png", "{absolute}", "maps/../../secret.png", "..\\secret.png")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", ["obj", "library", "ply", "gltf"])
def test_pictures_outside_the_folder_are_not_read_where_this_is_not_allowed(secret, kind, name):
    folder, name = secret.parent / "mesh", name.format(absolute=secret)
    (folder / "maps").mkdir()
    path = folder / f"mesh.{'obj' if kind == 'library' else kind}"
    obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl skin\nf 1/1 2/2 3/3\n"
    if kind == "obj":
        path.write_text("mtllib m.mtl\n" + obj)
        (folder / "m.mtl").write_text(f"newmtl skin\nmap_Kd {name}\n")
    elif kind == "library":
        (secret.parent / "m.mtl").write_text("newmtl skin\nmap_Kd secret.png\n")
        path.write_text(f"mtllib {name.replace('secret.png', 'm.mtl')}\n" + obj)
    elif kind == "ply":
        numbers = "0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n"
        properties = "".join(f"property float {name}\n" for name in "xyzst")
        path.write_text(
            f"ply\nformat ascii 1.0\ncomment TextureFile {name}\nelement vertex 3\n{properties}element face 1\n"
            f"property list uchar int vertex_indices\nend_header\n{numbers}"
        )
    else:
        _write_gltf(path, name.replace("..", "%2E%2E").replace("/", "%2F"))
    with (
        inside_only(),
        pytest.warns(fw.FaceWrinkleWarning, match=r"outside its folder and is not read.*without --no-outside"),
    ):
        assert fw.surface(path).texture is None


def _write_gltf(path: Path, image: str) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()
    (path.parent / "data.bin").write_bytes(points + np.array([[0, 0], [1, 0], [0, 1]], "<f4").tobytes())
    content = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "data.bin", "byteLength": 60}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 24},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
        ],
        "images": [{"uri": image}],
        "textures": [{"source": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
        "nodes": [{"mesh": 0}],
    }
    path.write_text(json.dumps(content))


def test_buffers_and_pieces_outside_the_folder(secret):
    folder = secret.parent / "mesh"
    _write_gltf(folder / "mesh.gltf", "none.png")
    (folder / "data.bin").rename(secret.parent / "data.bin")
    text = (folder / "mesh.gltf").read_text()
    (folder / "mesh.gltf").write_text(text.replace('"data.bin"', '"..%2Fdata.bin"'))
    with inside_only(), pytest.raises(MeshError, match="outside its folder and is not read"):
        fw.read_surface(folder / "mesh.gltf")
    assert fw.read_surface(folder / "mesh.gltf").n_cells == 1
    pv.Sphere().save(secret.parent / "piece.vtp")
    (folder / "blocks.vtm").write_text(
        '<VTKFile type="vtkMultiBlockDataSet" version="1.0"><vtkMultiBlockDataSet>'
        '<DataSet index="0" file="..&#47;piece.vtp"/></vtkMultiBlockDataSet></VTKFile>'
    )
    with inside_only(), pytest.raises(MeshError, match="outside its folder and is not read"):
        fw.read_surface(folder / "blocks.vtm")
    assert fw.read_surface(folder / "blocks.vtm").n_cells == pv.Sphere().n_cells


def test_usd_layers_and_pictures_outside_the_folder(secret):
    pytest.importorskip("pxr")
    folder = secret.parent / "mesh"
    (secret.parent / "other.usda").write_text(
        '#usda 1.0\ndef Mesh "m" {\n int[] faceVertexCounts = [3]\n int[] faceVertexIndices = [0, 1, 2]\n'
        " point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\n}\n"
    )
    (folder / "scene.usda").write_text("#usda 1.0\n(\n subLayers = [@../other.usda@]\n)\n")
    with inside_only(), pytest.raises(MeshError, match="outside its folder and is not read"):
        fw.read_surface(folder / "scene.usda")
    assert fw.read_surface(folder / "scene.usda").n_cells == 1


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="open files are limited by the system")
@pytest.mark.parametrize("how", ["data", "link"])
def test_hdf_that_lies_in_other_files(secret, how):
    """HDF5 itself opens what a file names: its numbers may be those of any other."""
    path, other = secret.parent / "mesh" / "ball.vtkhdf", secret.parent / "other"
    pv.Icosphere(nsub=1).save(path)
    with inside_only():
        whole = fw.read_surface(path)
    with h5py.File(path, "r+") as file:
        points = file["VTKHDF/Points"][:]
        del file["VTKHDF/Points"]
        if how == "data":
            other.write_bytes(points.tobytes())
            file["VTKHDF"].create_dataset(
                "Points", points.shape, points.dtype, external=[(str(other), 0, points.nbytes)]
            )
        else:
            file["VTKHDF/Points"] = h5py.ExternalLink(str(other), "/points")
            with h5py.File(other, "w") as linked:
                linked["points"] = points
    np.testing.assert_array_equal(fw.read_surface(path).points, whole.points)
    with inside_only(), pytest.raises(MeshError, match="cannot be read by itself: .* its data lie in other files"):
        fw.read_surface(path)


def test_a_data_set_does_not_name_pictures(secret):
    sheet = replace(
        fw.mesh.Surface.of(pv.Plane().triangulate()), pieces=(fw.mesh.Piece(image=str(secret)),)
    ).to_polydata()
    assert fw.surface(sheet).texture is not None
    sheet.save(secret.parent / "mesh" / "sheet.vtp")
    assert fw.surface(secret.parent / "mesh" / "sheet.vtp").texture is None


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
@pytest.mark.parametrize("place", ["library", "picture", "buffer", "case"])
def test_named_pipes_are_not_waited_for(tmp_path, place):
    name = {"library": "m.mtl", "picture": "skin.png", "buffer": "data.bin", "case": "M.MTL"}[place]
    if place == "buffer":
        _write_gltf(tmp_path / "mesh.gltf", "none.png")
        (tmp_path / "data.bin").unlink()
        os.mkfifo(tmp_path / name)
        with pytest.raises(MeshError, match=r"needs the file 'data\.bin' beside it, which is not there"):
            fw.read_surface(tmp_path / "mesh.gltf")
        return
    (tmp_path / "mesh.obj").write_text(
        "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl skin\nf 1/1 2/2 3/3\n"
    )
    if place == "picture":
        (tmp_path / "m.mtl").write_text("newmtl skin\nmap_Kd skin.png\n")
    os.mkfifo(tmp_path / name)
    with warnings.catch_warnings(action="ignore", category=fw.FaceWrinkleWarning):
        assert fw.surface(tmp_path / "mesh.obj").texture is None


def test_a_library_that_is_named_a_hundred_thousand_times(tmp_path):
    (tmp_path / "m.mtl").write_text("newmtl skin\nmap_Kd skin.png\n" * 1000)
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    (tmp_path / "mesh.obj").write_text("mtllib m.mtl\n" * 100_000 + "mtllib " + "m.mtl " * 100_000 + "\n" + corners)
    assert fw.read_surface(tmp_path / "mesh.obj").n_cells == 1


VAST = {
    "points.vtk": "DATASET STRUCTURED_POINTS\nDIMENSIONS 100000 100000 100000\nORIGIN 0 0 0\nSPACING 1 1 1\n",
    "rectilinear.vtk": "DATASET RECTILINEAR_GRID\nDIMENSIONS 3000 3000 3000\n"
    + "".join(f"{axis}_COORDINATES 3000 float\n" + "0 " * 3000 + "\n" for axis in "XYZ"),
    "image.vti": '<VTKFile type="ImageData" version="1.0"><ImageData WholeExtent="0 99999 0 99999 0 99999" '
    'Origin="0 0 0" Spacing="1 1 1"><Piece Extent="0 99999 0 99999 0 99999"/></ImageData></VTKFile>',
    "blocks.vtm": '<VTKFile type="vtkMultiBlockDataSet" version="1.0"><vtkMultiBlockDataSet>'
    '<DataSet index="0" file="image.vti"/></vtkMultiBlockDataSet></VTKFile>',
}
"""Small files of grids of which VTK would make more points than any memory holds."""


@pytest.mark.slow
def test_vast_grids_are_refused(tmp_path):
    """In a process of its own: VTK ends it where it finds no memory."""
    for name, text in VAST.items():
        head = "# vtk DataFile Version 3.0\nvast\nASCII\n" if name.endswith(".vtk") else ""
        (tmp_path / name).write_text(head + text)
    files = [name for name in VAST if name != "image.vti"]
    program = (
        "import pyvista as pv, facewrinkle as fw\n"
        "IMAGE = pv.ImageData(dimensions=(3000, 3000, 3000))\n"
        "BLOCKS = pv.MultiBlock([pv.Sphere(), IMAGE])\n"
        f"for source in [*{files}, IMAGE, BLOCKS]:\n"
        " try: fw.read_surface(source)\n except fw.FaceWrinkleError as error: print(error)"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    told = run.stdout.splitlines()
    assert len(told) == len(files) + 2
    assert all("Take its surface first" in line for line in told)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="only where a process can die of a signal")
@pytest.mark.parametrize(
    "harm",
    [
        "os.abort()",
        *(
            pytest.param(harm, marks=pytest.mark.slow)
            for harm in ("os.kill(os.getpid(), 11)", "bytearray(10**11)", "exec('while True: pass')")
        ),
    ],
)
def test_whatever_vtk_does_is_an_error(tmp_path, monkeypatch, harm):
    pv.Sphere().save(tmp_path / "mesh.vtp")
    monkeypatch.setattr(probing, "PROGRAM", probing.PROGRAM.replace("source.UpdateInformation()", f"exec({harm!r})"))
    monkeypatch.setattr(probing, "SECONDS", 1)
    with pytest.raises(MeshError, match=r"mesh\.vtp cannot be read: VTK does not get through it\. The file is damaged"):
        fw.read_surface(tmp_path / "mesh.vtp")


def test_without_a_python_of_its_own_the_file_is_read_at_once(tmp_path, monkeypatch):
    pv.Sphere().save(tmp_path / "mesh.vtp")
    monkeypatch.setattr("sys.executable", "")
    assert fw.read_surface(tmp_path / "mesh.vtp").n_cells == pv.Sphere().n_cells
    monkeypatch.setattr("sys.executable", "/no/such/python")
    assert fw.read_surface(tmp_path / "mesh.vtp").n_cells == pv.Sphere().n_cells
