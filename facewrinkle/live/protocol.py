"""The messages of a page: JSON objects with the name of a command and its arguments, checked before they are used."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from typing import Any

from ..errors import FaceWrinkleError, ParameterError, unknown_name

LARGEST_MESSAGE = 64 * 1024
"""Bytes of a message."""

RATE, BURST = 300.0, 600.0
"""Messages per second that a page may send on average, and at once."""

DEEPEST = 8
"""Nesting of a message."""


class MessageError(FaceWrinkleError):
    """A message that is not one of the protocol."""


def _text(value: Any) -> str:
    if not isinstance(value, str) or len(value) > 256:
        raise ParameterError("a short text is needed.")
    return value


def _session(value: Any) -> str:
    if not isinstance(value, str):
        raise ParameterError("the text of a session is needed.")
    return value


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**53:
        raise ParameterError("a whole number is needed.")
    return value


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ParameterError("true or false is needed.")
    return value


def _name_or_none(value: Any) -> str | None:
    return None if value is None else _text(value)


def _patches(value: Any) -> list[tuple[tuple[str, ...], Any]]:
    if not isinstance(value, list) or len(value) > 512:
        raise ParameterError("a list of patches is needed.")
    out = []
    for each in value:
        if not isinstance(each, list) or len(each) != 2 or not isinstance(each[0], list) or len(each[0]) > 4:
            raise ParameterError("a patch is a path and a value.")
        out.append((tuple(_text(name) for name in each[0]), each[1]))
    return out


def _weights(value: Any) -> dict[str, float]:
    if not isinstance(value, dict) or len(value) > 256:
        raise ParameterError("a table of names and weights is needed.")
    for name, weight in value.items():
        if isinstance(weight, bool) or not isinstance(weight, int | float) or not 0.0 <= weight <= 1.0:
            raise ParameterError(f"the weight of {name[:64]} must lie in [0, 1].")
    return {_text(name): float(weight) for name, weight in value.items()}


def _corners(value: Any) -> list[int]:
    if not isinstance(value, list) or len(value) != 3:
        raise ParameterError("the three corners of a triangle are needed.")
    return [_whole(corner) for corner in value]


def _shares(value: Any) -> list[float]:
    if (
        not isinstance(value, list)
        or len(value) != 3
        or not all(isinstance(x, int | float) and not isinstance(x, bool) and 0.0 <= x <= 1.0 for x in value)
        or sum(value) <= 0.0
    ):
        raise ParameterError("the shares of three corners, in [0, 1], are needed.")
    return [float(share) for share in value]


def _camera(value: Any) -> list[float]:
    numbers = (int, float)
    if (
        not isinstance(value, list)
        or len(value) != 9
        or not all(isinstance(x, numbers) and not isinstance(x, bool) and abs(x) < 1e9 for x in value)
    ):
        raise ParameterError("a camera is nine numbers: position, focal point and up.")
    return [float(x) for x in value]


COMMANDS: Mapping[str, Mapping[str, Callable[[Any], Any]]] = {
    "shown": {},
    "change": {"patches": _patches, "gesture": _text},
    "undo": {},
    "redo": {},
    "reset": {},
    "field": {"name": _name_or_none},
    "probe": {"corners": _corners, "shares": _shares, "version": _whole},
    "show": {"name": _text},
    "pose": {"time": float},
    "play": {"on": _flag},
    "live": {"weights": _weights},
    "copy": {"what": _text},
    "save": {"what": _text, "camera": _camera},
    "load": {"text": _session},
    "continue": {"on": _flag},
}
"""The commands and the checks of their arguments."""


def parse(text: str) -> tuple[str, dict[str, Any], int]:
    """Return the command, its arguments and the number that the answer shall have (0 for none) of a message.

    Raises
    ------
    MessageError
        If it is none of the protocol.
    ParameterError, UnknownNameError
        For arguments that are not allowed.

    Examples
    --------
    >>> parse('{"do": "field", "name": "W", "id": 3}')
    ('field', {'name': 'W'}, 3)
    """
    content = _object(text)
    command = content.pop("do", None)
    number = content.pop("id", 0)
    if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < 2**53:
        raise MessageError("the number of a message must be whole.")
    if not isinstance(command, str) or command not in COMMANDS:
        raise unknown_name("command", str(command)[:64], COMMANDS)
    checks = COMMANDS[command]
    if set(content) != set(checks):
        raise MessageError(f"{command} takes {', '.join(checks) or 'nothing'}.")
    try:
        return command, {name: check(content[name]) for name, check in checks.items()}, number
    except (TypeError, OverflowError):
        raise MessageError(f"{command} was given what it does not take.") from None
    except FaceWrinkleError:
        raise
    except ValueError:
        raise MessageError(f"{command} was given what it does not take.") from None


def greeting(text: str) -> str:
    """Return the key of a page's first message; "" if it is not a greeting."""
    try:
        content = _object(text)
    except MessageError:
        return ""
    key = content.get("key")
    return key if content.get("do") == "hello" and isinstance(key, str) and len(key) <= 128 else ""


def is_greeting(text: str) -> bool:
    """Return True for the first message of a page or a widget."""
    try:
        return _object(text).get("do") == "hello"
    except MessageError:
        return False


def _object(text: str) -> dict[str, Any]:
    try:
        content = json.loads(text, parse_constant=_refused)
    except (ValueError, RecursionError):
        raise MessageError("a message must be JSON.") from None
    if not isinstance(content, dict) or _depth(content) > DEEPEST:
        raise MessageError("a message must be a JSON object, nested little.")
    return content


def _refused(constant: str) -> None:
    raise ValueError(constant)


def _depth(value: Any) -> int:
    depth, level = 0, [value]
    while level and depth <= DEEPEST:
        depth += 1
        level = [
            inner
            for outer in level
            if isinstance(outer, dict | list)
            for inner in (outer.values() if isinstance(outer, dict) else outer)
        ]
    return depth


class Rate:
    """A limit on how often something may happen: a bucket of tokens that fills with time.

    Examples
    --------
    >>> limit = Rate(10.0, 2.0)
    >>> limit.allows(0.0), limit.allows(0.0), limit.allows(0.0), limit.allows(0.2)
    (True, True, False, True)
    """

    def __init__(self, rate: float = RATE, burst: float = BURST) -> None:
        self._rate, self._burst = rate, burst
        self._tokens, self._last = burst, 0.0

    def allows(self, now: float | None = None) -> bool:
        """Return True, and take a token, if there is one."""
        now = time.monotonic() if now is None else now
        self._tokens = min(self._burst, self._tokens + self._rate * max(now - self._last, 0.0))
        self._last = now
        if self._tokens < 1.0:
            return False
        self._tokens -= 1.0
        return True
