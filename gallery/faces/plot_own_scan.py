"""
.. _own_scan:

Your own scan
=============

A scan comes without landmarks, in any unit and any orientation, noisy, and without the back of the head. One call finds
the face on it, and places skull, eyes and muscles under it.
"""

import numpy as np
import pyvista as pv

import facewrinkle as fw
from facewrinkle.geometry.normals import vertex_normals
from facewrinkle.plotting import Scene, Style, figure, picture, side_by_side

# %%
# This "scan" is made here, so that the page needs no data: another person with finer triangles, a quarter of them
# removed again, noise of a tenth of a millimeter, the back of the head cut off, turned on its side, in meters. Use a
# file of your own instead: ``fw.fit_face("scan.obj")``.

person = fw.default_face({"jaw": 0.6, "nose_width": 0.5, "age": 0.4, "length": -0.4})
mesh = fw.refine(person.mesh, np.arange(person.mesh.n_cells))
mesh.clear_data()
mesh = mesh.clip((0, 0, 1), origin=(0, 0, -30), invert=False).extract_surface(algorithm="dataset_surface")
mesh = mesh.triangulate().decimate_pro(0.25, preserve_topology=True)
normals = vertex_normals(mesh.points, mesh.regular_faces)
mesh.points += 0.1 * np.random.default_rng(0).normal(size=(mesh.n_points, 1)) * normals
to_scanner = pv.Transform().rotate_z(90).rotate_y(-40).scale(0.001).translate((1.0, 0.2, -0.5))
scan = mesh.transform(to_scanner, inplace=False)

# %%
# Find the face. A mesh that does not look like one is an error, a doubtful one a warning; each landmark comes with a
# confidence. The unit is taken from the eyes: an adult's pupils are 63 mm apart.

face = fw.fit_face(scan)
doubtful = min(face.confidences, key=face.confidences.get)
print(f"{scan.n_cells} triangles; one unit of the scan is {face.unit:.0f} mm")
print(f"{len(face.landmarks)} landmarks; least sure is {doubtful}, {face.confidences[doubtful]:.2f}")

# %%
# Check the landmarks before anything else. Give those that are wrong by name, in the coordinates of the scan, as in
# ``fw.fit_face(scan, {"nose_tip": (x, y, z)})`` or in a JSON file; the others follow. To find landmarks only, and to
# see how much a mesh looks like a face, use :func:`facewrinkle.find_landmarks`.

scene = Scene(face, Style(size=(700, 700), view="left_three_quarter", quick=True))
scene.show(face.mesh)
skin = [point for name, point in face.landmarks.items() if not name.endswith("_centre")]
scene.plotter.add_points(
    np.array(skin), color="#35d07f", point_size=12, render_points_as_spheres=True, reset_camera=False
)
scene.plotter.show()

# %%
# Now it is a face like the built-in one, for any expression, pattern or tear. Frames are in the unit and the
# coordinates of the scan.

sim = fw.Simulation(face)
images = [picture(face.mesh, face, Style(size=(400, 440)))]
for what in ("surprise", "disgust"):
    sim.reset()
    sim.express(what)
    frame = sim.settle()
    images.append(picture(frame, face, Style(size=(400, 440))))
figure(side_by_side(images), ["the scan", "surprise", "disgust"])

# %%
# How far the found landmarks are from those that the person was made with, in millimeters.

error = {
    name: 1000 * np.linalg.norm(face.landmarks[name] - to_scanner.apply(place))
    for name, place in person.landmarks.items()
    if name not in face.estimated
}
print(
    f"median {np.median(list(error.values())):.1f} mm, worst {max(error, key=error.get)} {max(error.values()):.1f} mm"
)
assert np.median(list(error.values())) < 3.0
