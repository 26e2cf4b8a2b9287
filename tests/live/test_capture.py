"""Phones and trackers that drive the face, by packets over a real socket.

a packet of Live Link Face | bytes written down here; a simulation that contracts what the reader of takes has read
a frame of VMC             | the same face, by messages in one packet or in many
a second of silence        | the face is released; the document and its history are as they were
bad packets                | nothing happens, and the next good one is taken
"""

import socket
import struct
from contextlib import closing

import numpy as np
import pytest
from expressions import settled
from studio_pages import document, page, until

import facewrinkle as fw
from facewrinkle.live.answers import mixture_of_live

HEADER = [
    "EyeBlinkLeft", "EyeLookDownLeft", "EyeLookInLeft", "EyeLookOutLeft", "EyeLookUpLeft", "EyeSquintLeft",
    "EyeWideLeft", "EyeBlinkRight", "EyeLookDownRight", "EyeLookInRight", "EyeLookOutRight", "EyeLookUpRight",
    "EyeSquintRight", "EyeWideRight", "JawForward", "JawLeft", "JawRight", "JawOpen", "MouthClose", "MouthFunnel",
    "MouthPucker", "MouthLeft", "MouthRight", "MouthSmileLeft", "MouthSmileRight", "MouthFrownLeft",
    "MouthFrownRight", "MouthDimpleLeft", "MouthDimpleRight", "MouthStretchLeft", "MouthStretchRight",
    "MouthRollLower", "MouthRollUpper", "MouthShrugLower", "MouthShrugUpper", "MouthPressLeft", "MouthPressRight",
    "MouthLowerDownLeft", "MouthLowerDownRight", "MouthUpperUpLeft", "MouthUpperUpRight", "BrowDownLeft",
    "BrowDownRight", "BrowInnerUp", "BrowOuterUpLeft", "BrowOuterUpRight", "CheekPuff", "CheekSquintLeft",
    "CheekSquintRight", "NoseSneerLeft", "NoseSneerRight", "TongueOut", "HeadYaw", "HeadPitch", "HeadRoll",
    "LeftEyeYaw", "LeftEyePitch", "LeftEyeRoll", "RightEyeYaw", "RightEyePitch", "RightEyeRoll",
]  # fmt: skip
"""The 61 values of a packet, as the table that the phone records names them."""

VALUES = {"MouthSmileLeft": 0.75, "MouthSmileRight": 0.5, "BrowInnerUp": 1.0, "JawOpen": 0.5, "EyeLookUpLeft": 0.5}
VALUES |= {"EyeLookUpRight": 0.5, "HeadYaw": 0.3}


def live_link(values, count=61):
    """A packet of Live Link Face."""
    names = [struct.pack(">i", len(each)) + each for each in (b"0A1B2C3D-0000", b"iPhone")]
    time_code = struct.pack(">ifii", 1234, 0.5, 60, 1)
    numbers = [values.get(each, 0.0) for each in HEADER]
    return b"".join([b"\6", *names, time_code, struct.pack(f">B{count}f", count, *numbers[:count])])


def text(words):
    """A string of Open Sound Control: it ends with a zero, and is a multiple of four bytes long."""
    return words.encode() + b"\0" * (4 - len(words.encode()) % 4)


def vmc(values):
    """The messages of a frame of VMC."""
    value = text("/VMC/Ext/Blend/Val") + text(",sf")
    called = [value + text(name) + struct.pack(">f", weight) for name, weight in values.items()]
    return [text("/VMC/Ext/OK") + text(",i") + bytes(4), *called, text("/VMC/Ext/Blend/Apply") + text(",")]


def bundle(messages):
    return text("#bundle") + b"\0" * 7 + b"\1" + b"".join(struct.pack(">i", len(each)) + each for each in messages)


def free_port():
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as tried:
        tried.bind(("127.0.0.1", 0))
        return tried.getsockname()[1]


@pytest.fixture(scope="module")
def listening(face):
    port = free_port()
    with fw.live.Studio(face, browser=False, listen=port) as studio:
        yield studio, port


@pytest.fixture
def studio(listening):
    return listening[0]


@pytest.fixture
def seen(studio):
    """A page; at the end nothing drives the face."""
    with page(studio) as seen:
        seen.frame()
        yield seen
        told = [got["name"] for got in seen.texts if got["is"] == "driver"]
        if told and told[-1]:
            assert seen.heard("driver")["name"] == ""


@pytest.fixture
def phone(listening):
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as phone:
        phone.connect(("127.0.0.1", listening[1]))
        yield phone


@pytest.fixture(scope="module")
def taken(face, tmp_path_factory):
    """The face at rest with the weights that the reader of takes reads."""
    path = tmp_path_factory.mktemp("take") / "take.csv"
    values = [VALUES.get(name, 0.0) for name in HEADER]
    path.write_text(f"Timecode,{','.join(HEADER)}\n00:00:00:00,{','.join(map(str, values))}\n")
    mixture = mixture_of_live(fw.read_take(path).at(0.0), face)
    assert mixture == {"AU12L": 0.75, "AU12R": 0.5, "AU1L": 1.0, "AU1R": 1.0, "AU27": 0.5, "AU63L": 0.5, "AU63R": 0.5}
    return settled(fw.Simulation(face), mixture)


def driven(studio, phone, *packets):
    """The frame at rest under packets that are sent again and again."""
    stage, first = studio.stage, studio.stage.shown.step

    def at_rest():
        for packet in packets:
            phone.send(packet)
        return stage.shown.step > first + 12 and stage.shown.still

    until(at_rest)
    return stage.shown.frame


def differ(a, b, face):
    n = face.mesh.n_points
    return np.abs(np.asarray(a.points)[:n] - np.asarray(b.points)[:n]).max()


@pytest.mark.parametrize(
    ("name", "packets"),
    [
        ("Live Link Face", [live_link(VALUES)]),
        *(pytest.param("VMC", packets, marks=pytest.mark.slow) for packets in ([bundle(vmc(VALUES))], vmc(VALUES))),
    ],
    ids=["Live Link Face", "VMC", "VMC in many packets"],
)
def test_a_phone_drives_the_face_as_a_take_would(studio, seen, phone, taken, face, name, packets, capfd):
    history = document(studio)
    frame = driven(studio, phone, *packets)
    assert differ(frame, taken, face) < 0.05
    gazes = [np.degrees(np.arcsin(each.field_data["gaze_l"][0, 1])) for each in (frame, taken)]
    assert gazes[0] == pytest.approx(gazes[1], abs=0.5)
    assert gazes[0] > 10.0
    assert seen.heard("driver")["name"] == name
    with page(studio) as later:
        assert later.heard("welcome")["driver"] == name
    assert document(studio) == history
    assert not studio.undo()
    assert seen.heard("driver")["name"] == ""  # a second later
    assert differ(studio.frame(), settled(fw.Simulation(face), {}), face) < 0.05
    assert capfd.readouterr().out.splitlines()[0] == f"{name} drives the face."


def test_bad_packets_are_left_out(studio, seen, phone, face, caplog):
    good = live_link({"JawOpen": 1.0})
    bad = [
        b"", b"\6", b"/", b"#", b"#bundle\0", b"/VMC", good[:-1], good + b"\0", good[:40], live_link({}, count=60),
        b"\1" + good[1:],
        bundle(vmc({"Joy": 1.0})), bundle([bundle(vmc(VALUES))])[:-9],
        text("/VMC/Ext/Blend/Val") + text(",fs") + bytes(4) + text("JawOpen"), text("/VMC/Ext/Blend/Apply") + text(","),
        b"#bundle\0" * 40, b"#bundle\0" + bytes(8) + struct.pack(">i", -1), bundle([b""] * 300), bundle([bytes(8)]),
        bundle([b"#bundle\0" + bytes(8) + b"\xff" * 4]),
    ]  # fmt: skip
    rest = studio.frame()
    for packet in bad:
        phone.send(packet)
    assert studio.frame() == rest
    assert not [got for got in seen.texts if got["is"] == "driver"]
    phone.send(live_link({"JawOpen": np.nan}))  # a number that is none counts as 0
    assert seen.heard("driver")["name"] == "Live Link Face"
    assert differ(studio.frame(), rest, face) < 0.05
    assert seen.heard("driver")["name"] == ""
    assert differ(driven(studio, phone, live_link({"JawOpen": 7.0})), rest, face) > 5.0
    assert seen.heard("driver")["name"] == "Live Link Face"
    assert not caplog.records  # each would be a line in the terminal


def test_a_port_that_is_in_use_is_a_sentence(listening, face):
    port = listening[1]
    with pytest.raises(fw.errors.ParameterError, match=f"cannot listen at 127.0.0.1, port {port}"):
        fw.live.Studio(face, browser=False, listen=port)
    with pytest.raises(fw.errors.ParameterError, match="port 70000"):
        fw.live.Studio(face, browser=False, listen=70000)
