"""
.. _data:

Data with labels
================

Training and testing need many faces of which everything is known. Here each picture comes with its landmarks in pixels,
the normal and the depth of every pixel, the height of the wrinkles, and the same skin without them.
"""

import numpy as np
import pyvista as pv

import facewrinkle as fw
from facewrinkle.plotting import Scene, Style, figure, side_by_side, stacked

SIZE = (230, 260)

# %%
# The same seed gives the same person to the last bit. ``landmarks_on`` follows the landmarks on the
# moved skin; they lie within triangles, so that the nearest vertex would be some millimeters off.


def played(face, expression, **options):
    """The face that holds an expression."""
    sim = fw.Simulation(face, **options)
    sim.express(expression, intensity=0.8)
    frame = sim.settle()
    return frame


def landmarks_of(face, frame):
    """Landmarks on the skin of a frame, and their names."""
    skin = {name: place for name, place in face.landmarks_on(frame).items() if not name.endswith("_centre")}
    return list(skin), np.array(list(skin.values()))


# %%
# Labels are drawn with the camera of the picture, without light: three numbers at each vertex become red, green, blue.
# Normals n become ``127.5 (1 + n)``, heights ``128 + 100 W`` (a step of gray is a hundredth of a millimeter).


def labeled(frame, colors, camera):
    """Colours of the vertices as a picture, and the distance of each pixel in mm: NaN where there is no skin."""
    plotter = pv.Plotter(off_screen=True, window_size=SIZE, lighting="none")
    plotter.set_background("black")
    colors = np.rint(np.clip(colors, 0, 255)).astype(np.uint8)
    plotter.add_mesh(frame, scalars=colors, rgb=True, lighting=False, culling="back")
    plotter.camera = camera
    image = np.array(plotter.screenshot(None, return_img=True))
    distance = -plotter.get_image_depth(fill_value=np.nan)
    plotter.close()
    return image, distance


def in_pixels(points, camera):
    """Where points are in the picture: columns and rows."""
    matrix = pv.array_from_vtkmatrix(camera.GetCompositeProjectionTransformMatrix(SIZE[0] / SIZE[1], -1.0, 1.0))
    x, y, _, w = (np.column_stack([points, np.ones(len(points))]) @ matrix.T).T
    return 0.5 * np.stack([(1.0 + x / w) * SIZE[0], (1.0 - y / w) * SIZE[1]], axis=1)


# %%
# Three people: the picture with its landmarks, then normals, depth and wrinkles. Labels show the skin alone, without
# hair and eyes.

rows, errors = [], []
for seed, expression in ((7, "surprise"), (3, "anger"), (21, "happiness")):
    face = fw.default_face(fw.Identity.random(seed))
    frame = played(face, expression)
    with Scene(face, Style(SIZE)) as scene:
        image, camera = scene.picture(frame), scene.plotter.camera.copy()
    normals, distance = labeled(frame, 127.5 * (1.0 + frame["Normals"]), camera)
    heights, _ = labeled(frame, np.repeat(128.0 + 100.0 * frame["W"][:, None], 3, axis=1), camera)
    names, places = landmarks_of(face, frame)
    pixels = in_pixels(places, camera)
    column, row = np.floor(pixels).astype(int).T
    away = (places - camera.position) @ np.array(camera.direction)
    errors.append(dict(zip(names, np.abs(distance[row, column] - away), strict=True)))
    for right, down in np.ndindex(3, 3):
        image[row + down - 1, column + right - 1] = 53, 208, 127
    near, far = np.nanmin(distance), np.nanmax(distance)
    gray = np.nan_to_num(255.0 * (far - distance) / (far - near)).astype(np.uint8)
    rows.append(side_by_side([image, normals, np.repeat(gray[..., None], 3, axis=2), heights]))
figure(stacked(rows))

# %%
# What the wrinkles change: the distance of each vertex from the same skin without them.

smooth = played(face, expression, layers=[])
moved = np.linalg.norm(frame.points[: len(face.points)] - smooth.points, axis=1)
print(f"wrinkles move {np.count_nonzero(moved > 0.01)} of {len(moved)} vertices, at most by {moved.max():.2f} mm")

# %%
# Landmarks, camera and depth agree: the pixel of a visible landmark is as far away as the landmark.

middle = [error[name] for error in errors for name in ("nose_tip", "upper_lip_mid", "glabella", "pogonion")]
print(f"depth at landmarks in the middle of the face: off by {max(middle):.2f} mm at most")
assert max(middle) < 1.5
assert np.array_equal(fw.default_face(fw.Identity.random(21)).points, face.points)
