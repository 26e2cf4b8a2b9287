"""Every public function that takes a mesh takes it in every form that `read_surface` knows.

what                         | checked against
each function with each form | what it makes of the PolyData that the form was made of
"""

import numpy as np
import pytest
import pyvista as pv
import trimesh
import vtkmodules.vtkCommonDataModel as vtk

import facewrinkle as fw


def _raw(mesh):
    raw = vtk.vtkPolyData()
    raw.DeepCopy(mesh)
    return raw


def _written(mesh, folder):
    path = folder / "head.vtp"
    mesh.save(path)
    return path


FORMS = {
    "PolyData": lambda mesh, folder: mesh,
    "MultiBlock": lambda mesh, folder: pv.MultiBlock({"head": pv.MultiBlock([mesh])}),
    "vtkPolyData": lambda mesh, folder: _raw(mesh),
    "trimesh": lambda mesh, folder: trimesh.Trimesh(mesh.points, mesh.regular_faces, process=False),
    "str": lambda mesh, folder: str(_written(mesh, folder)),
    "Path": _written,
}


def _shed(mesh, face, folder):
    return fw.SheddingTear(mesh, start=face.landmarks["zygion_l"]).surface(1.0).points


FUNCTIONS = {
    "read_surface": lambda mesh, face, folder: fw.read_surface(mesh).points,
    "read_texture": lambda mesh, face, folder: np.array([fw.read_texture(mesh) is None]),
    "prepare": lambda mesh, face, folder: fw.mesh.prepare(mesh).points,
    "surface": lambda mesh, face, folder: fw.surface(mesh).points,
    "Simulation": lambda mesh, face, folder: fw.Simulation(mesh, layers=[]).step().points,
    "fit_face": lambda mesh, face, folder: fw.fit_face(mesh, face.landmarks).landmarks["nose_tip"],
    "find_landmarks": lambda mesh, face, folder: fw.find_landmarks(mesh, given=face.landmarks).landmarks["nose_tip"],
    "refine": lambda mesh, face, folder: fw.refine(mesh, [0, 5]).points,
    "SheddingTear": _shed,
    "DrippingTear": lambda mesh, face, folder: fw.DrippingTear(mesh, face.landmarks["pogonion"]).surface(0.5).points,
    "write_mesh": lambda mesh, face, folder: fw.read_surface(fw.write_mesh(mesh, folder / "out.ply")).points,
}


@pytest.fixture(scope="module")
def bare(face):
    """The points and triangles of the head, without the arrays that not every form can hold."""
    return pv.PolyData.from_regular_faces(face.points, face.triangles)


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_all_forms_are_read(bare, form, tmp_path):
    np.testing.assert_array_equal(fw.read_surface(form(bare, tmp_path)).points, bare.points)


@pytest.mark.parametrize(
    "function",
    [
        pytest.param(function, id=name, marks=pytest.mark.slow if name == "find_landmarks" else ())
        for name, function in FUNCTIONS.items()
    ],
)
def test_all_functions_take_a_file_and_another_form(face, bare, function, tmp_path):
    expected = function(bare, face, tmp_path)
    for form in ("str", "MultiBlock"):
        np.testing.assert_array_equal(function(FORMS[form](bare, tmp_path), face, tmp_path), expected)


@pytest.mark.parametrize("form", ["PolyData", "MultiBlock"])
def test_the_accessor_is_on_all_data_of_pyvista(face, bare, form):
    water = FORMS[form](bare, None).facewrinkle.tear(start=face.landmarks["zygion_l"], t=1.0)
    np.testing.assert_array_equal(water.points, _shed(bare, face, None))
    place = {"center": face.landmarks["glabella"], "size": 20.0, "max_level": 2}
    assert FORMS[form](bare, None).facewrinkle.pattern("dimple", **place)["W"].min() < 0.0


def test_a_face_of_what_pyvista_reads_and_the_texture_of_its_file(face, tmp_path):
    path = fw.write_mesh(face.mesh, tmp_path / "head.glb", face)
    fitted = fw.fit_face(pv.read(path), {name: 1e-3 * place for name, place in face.landmarks.items()})
    assert isinstance(pv.read(path), pv.MultiBlock)
    assert fitted.unit == pytest.approx(1000.0, rel=0.05)
    assert fitted.muscles.keys() == face.muscles.keys()
    np.testing.assert_array_equal(fw.read_texture(fw.read_surface(path)), face.texture[:, :, :3])


@pytest.mark.parametrize("function", FUNCTIONS.values(), ids=FUNCTIONS)
@pytest.mark.parametrize("wrong", [3, None, [1.0], b"head.obj", fw.MuscleWrinkles])
def test_what_is_no_mesh(face, function, wrong, tmp_path):
    if wrong is None and function is FUNCTIONS["DrippingTear"]:
        pytest.skip("a drop may fall through the air")
    with pytest.raises(fw.FaceWrinkleError, match="a mesh must be a path, a PyVista or VTK data set"):
        function(wrong, face, tmp_path)
