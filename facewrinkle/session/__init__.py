"""Sessions: all that can be wished of a face, as one document that the studio edits and commands read.

parts   | what each part may hold
content | all parts together, checked; files
subject | the face that is shown, and what moves it
player  | the simulation that follows a session
program | a session as a program of public calls
session | what users hold
"""

from __future__ import annotations

from .parts import Folds, Key, Look, Pattern, Place, Tear, Timeline
from .player import Moment
from .session import Session
from .subject import Subject

__all__ = ["Folds", "Key", "Look", "Moment", "Pattern", "Place", "Session", "Subject", "Tear", "Timeline"]
