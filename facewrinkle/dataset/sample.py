"""One sample: a picture with its labels and what is told of it, made from the specification and a number alone."""

from __future__ import annotations

import io
import json
import warnings
import zipfile
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, field, fields
from functools import lru_cache, partial
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista as pv

from .. import __version__
from ..anatomy import Face, Identity, default_face, fit_face, load_atlas, read_face
from ..anatomy.landmarks import NAMES, NOT_ON_SKIN
from ..appearance.seen import Appearance
from ..array_types import Image
from ..errors import FaceWrinkleError, FaceWrinkleWarning
from ..export.meshes import write_mesh
from ..layers.wave_folds import WaveFolds
from ..mesh.arrays import rest_of
from ..plotting import Style, TearScene
from ..simulation import Simulation
from ..simulation.fold_layers import fold_layers
from ..tears.presets import preset, surfaces
from .furrows import FurrowTracker
from .labels import DEPTH_STEP, HEIGHT_STEP, PARTS, PLACE_STEP, REGIONS, labels_of
from .plan import Person, Plan, person_of, plan_of
from .spec import TIME_STEP, Spec
from .surroundings import files_of, place
from .visible import Camera

LEVEL = 2
"""Level of compression of pictures and arrays."""


@dataclass(frozen=True, eq=False)
class Sample:
    """A picture with its labels.

    Attributes
    ----------
    index : int
    frame : int or None
        Number of the picture in a clip; None for a single picture.
    image : ndarray of uint8, shape (h, w, 3)
    labels : dict of str to ndarray
        Arrays of pixels; see :func:`facewrinkle.dataset.labels.skin_labels` and, for ``part``,
        :data:`facewrinkle.dataset.labels.PARTS`.
    facts : dict
        All else that is known: person, expression, contractions, landmarks, camera, furrows.
    mesh : dict of str to bytes
        The content of the mesh's file by its ending, if asked for; see :func:`mesh_files`.

    Examples
    --------
    >>> sample = Sample(12, np.zeros((4, 4, 3), np.uint8), {"depth": np.zeros((4, 4), np.uint16)}, {})
    >>> sample.key, sorted(sample.labels)
    ('000000012', ['depth'])
    """

    index: int
    image: Image
    labels: dict[str, npt.NDArray[Any]]
    facts: dict[str, Any]
    frame: int | None = None
    mesh: dict[str, bytes] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """The name of the picture in its shard."""
        return key_of(self.index, self.frame)

    def files(self) -> dict[str, bytes]:
        """Return the contents of the sample's files by ending; the same bytes for the same sample."""
        from PIL import Image as Pillow

        picture = io.BytesIO()
        Pillow.fromarray(self.image).save(picture, format="PNG", compress_level=LEVEL)
        text = json.dumps(record_of(self.facts), sort_keys=True, separators=(",", ":"))
        files = {"png": picture.getvalue(), "npz": compressed(self.labels), "json": text.encode()}
        return files | self.mesh


def key_of(index: int, frame: int | None = None) -> str:
    """Return the name of a picture in its shard.

    Examples
    --------
    >>> key_of(12), key_of(12, 3)
    ('000000012', '000000012-0003')
    """
    return f"{index:09d}" if frame is None else f"{index:09d}-{frame:04d}"


def compressed(arrays: dict[str, npt.NDArray[Any]]) -> bytes:
    """Return arrays as `np.savez_compressed` writes them, at a level that takes two thirds of the time."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name, values in arrays.items():
            content = io.BytesIO()
            np.lib.format.write_array(content, values, allow_pickle=False)
            member = zipfile.ZipInfo(f"{name}.npy")  # of 1980, whenever it is written
            archive.writestr(member, content.getvalue(), zipfile.ZIP_DEFLATED, LEVEL)
    return file.getvalue()


class BadDraw(Exception):
    """A draw that would be a bad sample; its message says why."""


class SampleMaker(AbstractContextManager["SampleMaker"]):
    """Makes the samples of a specification; it keeps the last person, for the next sample that shows the same one.

    Close it after use, or use it in a `with` statement.

    Parameters
    ----------
    spec : Spec

    Attributes
    ----------
    simulation_of : callable
        Returns a person, by number, with a simulation of the face: the last ones again for the same number.

    Examples
    --------
    >>> with SampleMaker(Spec.of({"size": [48, 48]})) as maker:
    ...     sample = maker.sample(0)
    >>> sample.image.shape, sorted(sample.labels), sample.facts["person"]["number"]
    ((48, 48, 3), ['depth', 'furrow', 'height', 'normal', 'part', 'place', 'region'], 0)
    """

    def __init__(self, spec: Spec) -> None:
        self.spec = spec
        self.simulation_of = lru_cache(maxsize=1)(partial(simulation_of, spec))
        self._scene: TearScene | None = None

    def close(self) -> None:
        """Free the window."""
        if self._scene is not None:
            self._scene.close()
            self._scene = None

    def __exit__(self, *_: object) -> None:
        self.close()

    def sample(self, index: int) -> Sample:
        """Make a sample; of a clip, return the last picture. See :meth:`pictures`."""
        return self.pictures(index)[-1]

    def pictures(self, index: int) -> list[Sample]:
        """Make the pictures of a sample: one, or those of a clip. Bad draws are replaced by others.

        Raises
        ------
        FaceWrinkleError
            If no draw was good.
        """
        refused: list[str] = []
        for attempt in range(5):  # so many draws are tried
            plan = plan_of(self.spec, index, attempt)
            try:
                return self._made(plan, refused)
            except BadDraw as problem:
                refused.append(str(problem))
        raise FaceWrinkleError(f"sample {index}: no draw of {len(refused)} was good ({'; '.join(refused)}).")

    def _made(self, plan: Plan, refused: list[str]) -> list[Sample]:
        person, simulation = self.simulation_of(plan.person)
        clip = self.spec.clip.frames > 1
        tracker = FurrowTracker(0.5 / simulation.face.unit) if clip else None  # mm
        made = []
        for number, frame in enumerate(self.frames(simulation, plan)):
            time = None if plan.tears is None else plan.tears + number * self.spec.clip.stride * TIME_STEP
            tears = self._tears(simulation.face, plan, frame, time)
            image, labels, facts = self._drawn(simulation, plan, frame, tears, tracker)
            rates = zip(simulation.motion.names, simulation.motion.rates.tolist(), strict=True)
            facts |= {
                "plan": asdict(plan),
                "person": asdict(person),
                "refused": refused,
                "contractions": {name: rate for name, rate in rates if rate > 0.0},
                "action_units": action_units_of(simulation, plan.expression),
                "size": list(self.spec.size),
                "unit": simulation.face.unit,
                "steps": {"depth": DEPTH_STEP, "height": HEIGHT_STEP, "place": PLACE_STEP},
                "parts": list(PARTS),
                "regions": list(REGIONS),
                "files": files_of(plan, person, self.spec),
                "spec": self.spec.digest,
                "version": __version__,
            }
            facts |= {"frame": number} if clip else {}
            mesh = mesh_files(self.spec.mesh, frame, simulation.face, tears)
            made.append(Sample(plan.index, image, labels, facts, number if clip else None, mesh))
        return made

    def _tears(self, face: Face, plan: Plan, frame: pv.PolyData, time: float | None) -> list[pv.PolyData]:
        """The surfaces of tears that began so many seconds ago."""
        if time is None or not face.eyes:
            return []
        smiling = plan.expression.keys() & {"happiness", "laughter", "AU12"}
        return surfaces(preset("joy" if smiling else "weeping", face, seed=plan.index), time, frame)

    def _drawn(
        self,
        simulation: Simulation,
        plan: Plan,
        frame: pv.PolyData,
        tears: list[pv.PolyData],
        tracker: FurrowTracker | None,
    ) -> tuple[Image, dict[str, npt.NDArray[Any]], dict[str, Any]]:
        """The picture of a frame, its labels, and facts."""
        face = simulation.face
        scene = self._staged(face, plan)
        image, camera = scene.picture(frame, tears), Camera.of(scene.plotter.camera, self.spec.size)
        families = next((tuple(layer.lines) for layer in simulation.layers if isinstance(layer, WaveFolds)), ())
        seen = Appearance.of(face).at(frame)
        labels, facts = labels_of(face, seen, frame, camera, tears, families, tracker)
        if fault := fault_of(labels, facts, self.spec.size):
            raise BadDraw(fault)
        return image, labels, facts

    def _staged(self, face: Face, plan: Plan) -> TearScene:
        """A scene of the face with what a plan puts around it; that of the last sample, if it shows the same face."""
        scene = self._scene
        if scene is None or scene.face is not face or any(part.texture is not None for part in face.parts.values()):
            self.close()
            self._scene = scene = TearScene(face, Style(self.spec.size, quick=self.spec.quick))
        place(scene, plan, self.spec)
        return scene

    def frames(self, simulation: Simulation, plan: Plan) -> Iterator[pv.PolyData]:
        """Yield the frames of a plan: the face that holds its expression, or on the way there."""
        if self.spec.clip.frames > 1:
            simulation.reset()
        else:
            simulation.motion.reset()
        if simulation.face.eyes:
            simulation.look(plan.gaze["yaw"], plan.gaze["pitch"])
        simulation.express(plan.expression)
        if self.spec.clip.frames > 1:
            steps = simulation.run(self.spec.clip.frames * self.spec.clip.stride)
            yield from islice(steps, self.spec.clip.stride - 1, None, self.spec.clip.stride)
            return
        with warnings.catch_warnings():
            warnings.simplefilter("error", FaceWrinkleWarning)
            try:
                yield simulation.settle(most=150)
            except FaceWrinkleWarning:
                raise BadDraw("the face does not come to rest") from None


def simulation_of(spec: Spec, number: int) -> tuple[Person, Simulation]:
    """Return a person with a simulation of the face.

    Examples
    --------
    >>> person, simulation = simulation_of(Spec.of(), 3)
    >>> person.number, "AU12" in simulation.face.atlas.action_units
    (3, True)
    """
    person = person_of(spec, number)
    face = face_of(spec, person)
    options: dict[str, Any] = dict(person.folds)
    # Longer steps bring a face to rest in two thirds of the work, and nearer.
    step = TIME_STEP if spec.clip.frames > 1 else 0.1
    return person, Simulation(face, layers=fold_layers(face, "wave", **options), time_step=step)


def mesh_files(kind: str, frame: pv.PolyData, face: Face, tears: list[pv.PolyData]) -> dict[str, bytes]:
    """Return the file of a mesh by its ending, or nothing.

    Arrays ("npz") are ``points`` and ``rest``, float32 (n, 3), in the unit of the face, and ``triangles``, int32
    (m, 3); a binary glTF ("glb") is what is seen, see :func:`facewrinkle.write_mesh`.

    Examples
    --------
    >>> face = default_face()
    >>> mesh_files("glb", face.mesh, face, [])["mesh.glb"][:4]
    b'glTF'
    """
    if kind == "npz":
        rest = np.asarray(rest_of(frame), np.float32)
        arrays = {"points": np.asarray(frame.points, np.float32), "rest": rest}
        return {"mesh.npz": compressed(arrays | {"triangles": np.asarray(frame.regular_faces, np.int32)})}
    if kind == "glb":
        with TemporaryDirectory() as folder:
            path = write_mesh(frame, Path(folder) / "face.glb", face, parts=True, tears=tears)
            return {"mesh.glb": path.read_bytes()}
    return {}


def action_units_of(simulation: Simulation, expression: dict[str, float]) -> dict[str, float]:
    """Return the weights of action units of a face that is on its way from rest into an expression, or has it.

    Examples
    --------
    >>> simulation = Simulation(default_face(), layers=[])
    >>> simulation.express({"contempt": 0.8})
    >>> frames = simulation.run(2, ramp=1.0)
    >>> for frame in frames:
    ...     print(action_units_of(simulation, {"contempt": 0.8}))
    {'AU12R': 0.2, 'AU14R': 0.4}
    {'AU12R': 0.4, 'AU14R': 0.8}
    """
    atlas, motion = simulation.face.atlas, simulation.motion
    held = motion.rates_of(atlas.contractions(expression))
    share = float(motion.rates @ held) / max(float(held @ held), 1e-300)
    return {unit: round(share * weight, 6) for unit, weight in atlas.units_of(expression).items()}


def fault_of(labels: dict[str, npt.NDArray[Any]], facts: dict[str, Any], size: tuple[int, int]) -> str:
    """Return why a picture is not fit for a set, in words; nothing if it is.

    The face must be in the picture, and the inside of the skin must not be, as through the open neck of a bust: skin
    whose normal points away from the camera. A little of it is allowed: at the borders of lids and lips, normals are
    those of vertices.
    """
    shown = ("nose_tip", "glabella", "pogonion", "eye_l_outer", "eye_r_outer")
    pixels = [facts["landmarks"][name]["pixel"] for name in shown if name in facts["landmarks"]]
    if pixels and sum(0 <= x < size[0] and 0 <= y < size[1] for x, y in pixels) < 3:
        return "the face is not in the picture"
    skin = labels["depth"] > 0
    inside = skin & (labels["normal"][..., 2] > 127 * 0.2)
    if inside.sum() > 0.005 * skin.sum():
        return "the inside of the skin is seen"
    return ""


def face_of(spec: Spec, person: Person) -> Face:
    """Return the face of a person."""
    if person.scan is None:
        return default_face(Identity.of(person.identity))
    path = Path(spec.faces.scans[person.scan].path)
    face = read_face(path) if path.suffix == ".face" else fit_face(path)
    return face.aged(max(person.identity["age"], 0.0))


def record_of(facts: dict[str, Any]) -> dict[str, Any]:
    """Return the facts of a picture as its JSON has them: the same names and types for every picture.

    Nothing is null or left out: what a picture does not have is 0, "" or, of times and places, -1.

    Examples
    --------
    >>> from facewrinkle.dataset import SampleMaker, Spec
    >>> with SampleMaker(Spec.of({"size": [32, 32]})) as maker:
    ...     record = record_of(maker.sample(0).facts)
    >>> record["person"]["scan"], record["person"]["monk"], len(record["action_units"])
    ('', 9, 73)
    """
    atlas, plan, person, files = load_atlas(), facts["plan"], facts["person"], facts["files"]
    names = [name for name in NAMES if name not in NOT_ON_SKIN]
    absent = dict.fromkeys((field.name for field in fields(Identity)), 0.0)
    hidden = {"point": [0.0, 0.0, 0.0], "pixel": [-1.0, -1.0], "visible": False}
    none = {"number": 0, "source": "", "depth": 0.0, "length": 0.0, "pixels": 0, "box": [0, 0, 0, 0]}  # the label 0
    return facts | {
        "plan": plan | {"expression": mixture_text(plan["expression"]), "tears": _or(plan["tears"], -1.0)},
        "person": person | {"monk": _or(person["monk"], 0), "identity": absent | person["identity"]}
        | {"scan": files.get("scan", "")},
        "files": {name: files.get(name, "") for name in ("scan", "environment", "background")},
        "refused": "; ".join(facts["refused"]),
        "contractions": dict.fromkeys(atlas.muscles, 0.0) | facts["contractions"],
        "action_units": dict.fromkeys(atlas.action_units, 0.0) | facts["action_units"],
        "landmarks": dict.fromkeys(names, hidden) | facts["landmarks"],
        "furrows": [none, *(furrow | {"box": furrow["box"] or none["box"]} for furrow in facts["furrows"])],
    }  # fmt: skip


def row_of(facts: dict[str, Any], key: str) -> dict[str, Any]:
    """Return what the table tells of a picture: numbers to search and to plot by."""
    record = record_of(facts)
    plan, person, furrows = record["plan"], record["person"], facts["furrows"]
    row = {
        "index": plan["index"],
        "key": key,
        "person": person["number"],
        "frame": record.get("frame", 0),
        "scan": person["scan"],
        "monk": person["monk"],
        "expression": plan["expression"],
        "tears": plan["tears"] >= 0.0,
        "attempt": plan["attempt"],
        "furrows": len(furrows),
        "deepest": max((furrow["depth"] for furrow in furrows), default=0.0),
        "visible_landmarks": sum(landmark["visible"] for landmark in record["landmarks"].values()),
    }
    row |= {f"{what}_file": record["files"][what] for what in ("environment", "background")}
    drawn = {"identity": person["identity"], "gaze": plan["gaze"], "camera": plan["camera"], "light": plan["lights"]}
    row |= {f"{group}_{name}": value for group, values in drawn.items() for name, value in values.items()}
    return row | record["action_units"]


def mixture_text(mixture: dict[str, float]) -> str:
    """Return a mixture of expressions or action units as text.

    Examples
    --------
    >>> mixture_text({"AU9": 0.2085, "AU15": 1.0}), mixture_text({})
    ('AU9=0.2085+AU15=1', '')
    """
    return "+".join(f"{name}={weight:.6g}" for name, weight in mixture.items())


def _or(value: Any, absent: Any) -> Any:
    return absent if value is None else value
