"""The command line from outside: what it prints, what it writes, and with which code it ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from vtkmodules.vtkIOHDF import vtkHDFReader

import facewrinkle as fw
from facewrinkle.anatomy.atlas import DEFAULT_ATLAS, load_atlas
from facewrinkle.anatomy.landmarks import write_landmarks
from facewrinkle.cli import main
from facewrinkle.commands import demo as demo_module
from facewrinkle.commands.common import FaceOptions, mixture
from facewrinkle.commands.express import FaceWrinkleWarning, record  # noqa: F401
from facewrinkle.commands.take import FIELDS, Take
from facewrinkle.errors import MissingPackageError
from facewrinkle.table1 import PAPER, as_text, measure

SIZE = 96
FEW = ["--frames", "6", "--size", str(SIZE)]
