"""Takes: weights of shapes over time, as phones and trackers record them, without a mesh of their own."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ..animation.action_units import named_shapes, plain_name
from ..animation.recorded import Track
from ..array_types import Array, BoolArray, IntArray
from ..checks import finite
from ..errors import LARGEST, ParameterError, check_range, warn
from ..files import check_file, path_of, reading, text_of
from .tables import (
    CAMERA,
    FRAMES,
    HEAD,
    PEOPLE,
    SURE,
    THOUSANDTHS,
    TIMES,
    Kind,
    Table,
    kind_of_column,
    shapes_of_column,
    table_of,
    yaw_pitch_roll,
)

SUFFIXES = (".csv", ".tsv", ".txt", ".json", ".jsonl")


@dataclass(frozen=True, eq=False)
class Take:
    """Weights of shapes over time; made by :func:`facewrinkle.read_take` or from arrays.

    Attributes
    ----------
    names : tuple of str
        Shapes: ARKit's, visemes, further ones of :data:`facewrinkle.rigging.shapes.SETS`, or action units.
    times : ndarray, shape (f,)
        Increasing, from 0, s.
    weights : ndarray, shape (f, k)
        In [0, 1].
    head : ndarray, shape (f, 3), optional
        Turn of the head, radians: yaw to the subject's left, pitch upwards, roll to the subject's right shoulder.

    Examples
    --------
    >>> take = Take(("jawOpen",), np.array([0.0, 0.5]), np.array([[0.0], [1.0]]))
    >>> take
    Take(1 shapes, 0.5 s)
    >>> take.at(0.25)
    {'jawOpen': 0.5}
    """

    names: tuple[str, ...]
    times: Array
    weights: Array
    head: Array | None = None

    def __post_init__(self) -> None:
        track = Track(self.times, self.weights)
        if self.head is not None:
            head = finite("head", self.head)
            if head.shape != (len(track.times), 3):
                raise ParameterError(
                    f"a take needs three angles of the head at each of its {len(track.times)} times, received the "
                    f"shape {head.shape}."
                )
            object.__setattr__(self, "head", head)
        if track.values.shape[1:] != (len(self.names),) or not self.names:
            raise ParameterError(
                f"a take needs a column of weights for each of its {len(self.names)} shapes, received the shape "
                f"{track.values.shape}."
            )
        outside = np.asarray((track.values < 0.0) | (track.values > 1.0))
        if outside.any():
            which = [name for name, out in zip(self.names, np.atleast_1d(outside.any(axis=0)), strict=True) if out]
            warn(f"weights outside [0, 1] are clamped, in {int(outside.any(axis=1).sum())} frames: {_listed(which)}.")
        object.__setattr__(self, "times", track.times)
        object.__setattr__(self, "weights", np.clip(track.values, 0.0, 1.0))

    def __repr__(self) -> str:
        return f"Take({len(self.names)} shapes, {self.duration:g} s)"

    @property
    def duration(self) -> float:
        """Seconds from the first to the last frame."""
        return float(self.times[-1] - self.times[0])

    def at(self, time: float) -> dict[str, float]:
        """Return the weights at a time, by shape; they are interpolated linearly."""
        return dict(zip(self.names, Track(self.times, self.weights).at(time).tolist(), strict=True))

    def turn(self, time: float) -> Array:
        """Return the turn of the head at a time as a matrix (3, 3), in axes [left, up, forward]."""
        if self.head is None:
            return np.eye(3)
        yaw, pitch, roll = Track(self.times, self.head).at(time)
        return np.asarray(Rotation.from_euler("YXZ", [yaw, -pitch, roll]).as_matrix())

    def gained(self, gains: Mapping[str, float]) -> Take:
        """Return a take with weights of some shapes multiplied, for trackers that make too little of them.

        Names may be in any spelling; one without a side means both.

        Examples
        --------
        >>> take = Take(("mouthSmileLeft", "jawOpen"), np.zeros(1), np.array([[0.4, 0.2]]))
        >>> take.gained({"mouthSmile": 2.0}).at(0.0)
        {'mouthSmileLeft': 0.8, 'jawOpen': 0.2}
        """
        factors = np.ones(len(self.names))
        for asked, gain in gains.items():
            for name in named_shapes(asked, self.names):
                factors[self.names.index(name)] = check_range(f"the gain of {asked}", gain, 0.0, 100.0)
        return replace(self, weights=np.minimum(self.weights * factors, 1.0))


def read_take(
    path: str | Path,
    fps: float | None = None,
    *,
    full: float | None = None,
    person: int | None = None,
    degrees: bool | None = None,
) -> Take:
    """Read what a phone or a tracker recorded: weights of shapes over time.

    A file is read by what it is, whatever its ending says. Each reading that a file leaves open is told in a sentence,
    with the parameter that overrules it.

    - Tables with any separator, decimal commas and lines before the names of the columns: Live Link Face, OpenFace,
      Py-Feat, LibreFace, Unity's curves, spreadsheets. Recordings of Face Cap and iFacialMocap.
    - JSON of any nesting that holds frames with weights by name: MediaPipe's face landmarker (in a browser or in
      Python), Audio2Face; lines of JSON.
    - Mouth cues of Rhubarb Lip Sync (.json, .tsv).

    Names of shapes are ARKit's in any spelling, those of Character Creator, MetaHuman, Unified Expressions, VRM and
    Meta's headsets, visemes, and action units (``AU12``, ``AU12_L``, ``AU12_r`` of OpenFace, from 0 to 5).

    Parameters
    ----------
    path : path
    fps : float, optional
        Frames per second of files that tell no times, of frame numbers, and of time codes. Default: what the file says;
        for time codes what they count up to (60 if they do not reach a full second); otherwise 30.
    full : float, optional
        The number that stands for a weight of 1, such as 1, 5 or 100. Default: by the largest numbers.
    person : int, optional
        Whose face, in files that show several.
    degrees : bool, optional
        Whether the turn of the head is in degrees. Default: if it exceeds 2 radians.

    Returns
    -------
    Take

    Raises
    ------
    MeshError
        If the file cannot be read.
    ParameterError
        If it has no shapes, a row has the wrong number of columns, a weight is no number, times do not increase, or it
        shows several people.

    Warns
    -----
    FaceWrinkleWarning
        For columns that are no shapes, frames without a face, weights outside [0, 1], and readings that are guessed.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "take.csv"
    ...     _ = path.write_text("time, JawOpen, mouth_frown\\n0.0, 0.1, 0\\n0.1, 0.6, 0.5\\n")
    ...     take = read_take(path)
    >>> take, take.names
    (Take(3 shapes, 0.1 s), ('jawOpen', 'mouthFrownLeft', 'mouthFrownRight'))
    """
    path = path_of(path)
    check_file(path)
    for name, number in (("fps", fps), ("full", full)):
        if number is not None:
            check_range(name, number, 1e-3, 1e4)
    if path.suffix.lower() not in SUFFIXES:
        raise ParameterError(f"takes are read from {', '.join(SUFFIXES)} files, received {path.name}.")
    with reading(path):
        reader = _Reader(path.name, table_of(path.name, text_of(path)))
        return reader.take(fps, full, person, degrees)


class _Reader:
    """Reads the columns of a table as a take, and tells what it took them for."""

    def __init__(self, file: str, table: Table) -> None:
        self.file, self.table = file, table
        names = table.names
        if any(re.fullmatch(r"(?i)au\d+_l", name) for name in names):  # then the r is a side, and no intensity
            names = [re.sub(r"^((?i:au)\d+)_r$", r"\1R", name) for name in names]
        self.names, self.plain = names, [plain_name(name) for name in names]

    def tell(self, what: str) -> None:
        """Warn of something about the file."""
        warn(f"{self.file}: {what}")

    def column(self, plain: Iterable[str]) -> Array | None:
        """Return the first column with one of some plain names."""
        return next((self.table.values[:, i] for i, name in enumerate(self.plain) if name in plain), None)

    def take(self, fps: float | None, full: float | None, person: int | None, degrees: bool | None) -> Take:
        """Return the take."""
        columns = self._columns()
        rows = self._rows_of(person)
        names, weights = self._weights(columns, rows, full)
        times = self._times(rows, fps)
        known = ~np.isnan(weights)
        seen = known.any(axis=1) & ~self._lost(rows)
        empty = [name for name, some in zip(names, known[seen].T, strict=True) if not some.any()]
        if empty:
            raise ParameterError(f"{self.file} has no frame with a weight of {_listed(empty)}. Record it again.")
        whole = seen & known.all(axis=1)
        if not whole.all():
            self.tell(f"{int((~whole).sum())} of {len(seen)} frames lack values or a face; their neighbors are used.")
        fresh = seen & np.concatenate([[True], np.diff(np.maximum.accumulate(times)) > 0.0])
        times, rows = times[fresh], rows[fresh]
        return Take(tuple(names), times - times[0], _filled(times, weights[fresh]), self._head(times, rows, degrees))

    def _columns(self) -> list[int]:
        """Return the numbers of the columns with weights; tell of those that are nothing."""
        kinds = [kind_of_column(name) for name in self.names]
        known = [i for i, kind in enumerate(kinds) if kind not in ("", "presence")]
        needless = {"blendshapecount", "neutral"}  # as are the turns of eyes: these turn by eyeLookInLeft and so on
        needless |= {f"{side}eye{turn}" for side in ("left", "right") for turn in ("yaw", "pitch", "roll")}
        other = {*needless, *TIMES, *THOUSANDTHS, *FRAMES, *PEOPLE, *HEAD, *CAMERA, *SURE}
        unknown = [self.names[i] for i, kind in enumerate(kinds) if not kind and self.plain[i] not in other]
        if not known:
            raise ParameterError(
                f"{self.file} has no column of a shape: ARKit's names are needed, such as jawOpen, or action units, "
                f"such as AU12; received {_listed(self.names)}."
            )
        shapes = [i for i in known if kinds[i] == "shape"]
        if shapes and len(shapes) < len(known):
            self.tell(
                f"it has both {len(shapes)} shapes and {len(known) - len(shapes)} action units: the shapes are used. "
                "Delete their columns to use the units."
            )
            known = shapes
        if unknown:
            self.tell(f"{len(unknown)} columns are not shapes and are ignored: {_listed(unknown, 40)}.")
        return known

    def _rows_of(self, person: int | None) -> IntArray:
        """Return the numbers of the rows of one person."""
        column = self.column(PEOPLE)
        if column is None:
            return np.arange(len(self.table.values))
        people = np.unique(column[~np.isnan(column)]).astype(int).tolist()
        named = _listed(map(str, people))
        if person is None and len(people) > 1:
            raise ParameterError(f"{self.file} shows {len(people)} people: give person, one of {named}.")
        if person is not None and person not in people:
            raise ParameterError(f"person must be one of {named} in {self.file}, received {person}.")
        return np.flatnonzero(column == (people[0] if person is None else person))

    def _lost(self, rows: IntArray) -> BoolArray:
        """Tell which rows (f,) show no face, by what the tracker says of itself."""
        told = ((self.column({name}), least) for name, least in SURE.items())
        column, least = next(
            (each for each in told if each[0] is not None and not np.isnan(each[0]).all()), (None, 0.0)
        )
        return np.zeros(len(rows), bool) if column is None else np.asarray(column[rows] < least)

    def _weights(self, columns: list[int], rows: IntArray, full: float | None) -> tuple[list[str], Array]:
        """Return the names of shapes and their weights (f, k)."""
        values = self.table.values[rows]
        # Numbers that may stand for a weight of 1, by kind of column; the first is usual.
        full_of: Mapping[Kind, Sequence[float]] = {
            "intensity": (5.0, 100.0),
            "unit": (1.0, 5.0, 100.0),
            "shape": (1.0, 100.0),
            "evidence": (1.0,),
        }
        of_kind = {kind: [i for i in columns if kind_of_column(self.names[i]) == kind] for kind in full_of}
        if evidence := of_kind["evidence"]:
            values[:, evidence] = 1.0 / (1.0 + 10.0 ** -values[:, evidence])
            self.tell("its evidence (the logarithm of odds) is read as a probability, and that as a weight.")
        most = np.nanmax(np.nan_to_num(values), axis=0, initial=0.0)
        scale = np.ones(len(self.names))
        for kind, scales in full_of.items():
            scale[of_kind[kind]] = full or self._full(most[of_kind[kind]], scales)
        found: dict[str, Array] = {}
        for i in columns:
            for shape in shapes_of_column(self.names[i]):
                found[shape] = np.fmax(found.get(shape, values[:, i] / scale[i]), values[:, i] / scale[i])
        return list(found), np.stack(list(found.values()), axis=1)

    def _full(self, most: Array, scales: Sequence[float]) -> float:
        """Return which of some numbers stands for a weight of 1, given the largest of each column."""
        moved = most[most > 0.0]
        if not len(moved):
            return scales[0]
        if scales[0] > 1.0 and moved.max() <= 1.0:
            self.tell("no intensity exceeds 1, so they are read as 0 to 1. If they go up to 5, say that 5 is full.")
            return 1.0
        # A few weights above 1 are those of a tracker that overshoots; where half are, the scale is another.
        fits = [scale for scale in scales if np.mean(moved > 1.5 * scale) < 0.5]
        scale = fits[0] if fits else scales[-1]
        if scale != scales[0]:
            self.tell(f"its numbers go up to {moved.max():.3g} and are read as 0 to {scale:g}. Give full otherwise.")
        return scale

    def _head(self, times: Array, rows: IntArray, degrees: bool | None) -> Array | None:
        """Return yaw, pitch and roll (f, 3) of the head at the times of rows, radians."""
        names = next((names for names in (HEAD, CAMERA) if set(names) <= set(self.plain)), None)
        if names is None:
            return None
        angles = self.table.values[rows][:, [self.plain.index(name) for name in names]]
        if degrees is None and np.nanmax(np.abs(np.nan_to_num(angles))) > 2.0:  # radians: no head turns so far
            degrees = True
            self.tell("the turn of the head is read as degrees. If it is radians, say that degrees are wrong.")
        known = ~np.isnan(angles).any(axis=1)
        turns = np.radians(angles[known]) if degrees else angles[known]
        if names is CAMERA and len(turns):  # right, down and away; ours are left, up and forward
            turns = yaw_pitch_roll(Rotation.from_euler("XYZ", turns * [1.0, -1.0, -1.0]).as_matrix())
        angles[known], angles[~known] = np.unwrap(turns, axis=0), np.nan
        return _filled(times, angles) if known.any() else None

    def _times(self, rows: IntArray, fps: float | None) -> Array:
        """Return the seconds (f,) of rows."""
        fps, usual = fps or self.table.fps, 30.0  # of trackers that do not tell
        if self.table.times is None:
            frames = self.column(FRAMES)
            if frames is None or np.isnan(frames[rows]).any() or (np.diff(frames[rows]) < 0).any():
                return np.arange(len(rows)) / (fps or usual)
            steps = np.diff(frames[rows])
            if fps is None and len(steps) and np.median(steps) != 1.0:
                self.tell(
                    f"it numbers its frames, without times: they are read as {usual:g} a second. Give fps otherwise."
                )
            return np.asarray(frames[rows] - frames[rows][0]) / (fps or usual)
        texts = [self.table.times[row].strip().replace(",", ".") for row in rows]
        seconds = self._codes(texts, fps)
        if seconds is None:
            seconds = np.array([self._bounded(text) for text in texts])
            if plain_name(self.table.clock) in THOUSANDTHS:
                seconds = seconds / 1000.0
            while len(seconds) > 1 and np.median(np.diff(seconds)) > 1.0:  # thousandths, or millionths
                seconds = seconds / 1000.0
        back = np.flatnonzero(~(np.diff(seconds) >= 0.0))
        if len(back):
            raise ParameterError(
                f"{self.file}: times must increase, and row {int(rows[back[0] + 1]) + 2} comes before the one above it."
            )
        return np.asarray(seconds - seconds[0])

    def _codes(self, texts: Sequence[str], fps: float | None) -> Array | None:
        """Return the seconds of time codes, None if there are others.

        Frames stand after a colon, or after a semicolon if numbers are dropped; parts of a second after a point.
        """
        codes = [re.fullmatch(r"(?:(\d+):)?(\d+):(\d+)(?:([:;])(\d+(?:\.\d+)?))?(\.\d+)?", text) for text in texts]
        if not all(codes):
            return None
        hours, minutes, seconds, frames, parts = np.array(
            [[self._bounded(code[k] or "0") for k in (1, 2, 3, 5, 6)] for code in codes if code]
        ).T
        whole = 3600.0 * hours + 60.0 * minutes + seconds
        usual = (24, 25, 30, 50, 60, 100, 120)
        counted = next((rate for rate in usual if rate > frames.max()), frames.max() + 1)
        phone = 60.0  # frames per second of those that write time codes
        rate = fps or (phone if whole[0] == whole[-1] and counted < phone else counted)
        if any(code[4] == ";" for code in codes if code):  # two numbers are left out each minute but the tenth
            count = round(rate * 1.001)
            skipped = count / 15.0 * (whole // 60.0 - whole // 600.0)
            times = (whole * count + frames - skipped) * 1.001 / count
        else:
            times = whole + frames / rate + parts
        times += 86400.0 * np.cumsum(np.diff(times, prepend=times[0]) < -43200.0)  # past midnight
        return np.asarray(times)

    def _bounded(self, text: str) -> float:
        """Return a number of a time; an error for what is none, or too large to count with."""
        try:
            number = float(text)
        except ValueError:
            number = np.nan
        if not abs(number) < LARGEST:
            raise ParameterError(
                f"{self.file}: times must be seconds, or time codes such as 10:31:02:15.5, received {text[:40]!r}."
            )
        return number


def _filled(times: Array, values: Array) -> Array:
    """Return values (f, k) at times (f,), with those that are NaN interpolated from those before and after."""
    columns = [(column, ~np.isnan(column)) for column in values.T]
    return np.stack([np.interp(times, times[known], column[known]) for column, known in columns], axis=1)


def _listed(names: Iterable[str], most: int = 8) -> str:
    every = list(names)
    return ", ".join(every[:most]) + (f" and {len(every) - most} more" if len(every) > most else "")
