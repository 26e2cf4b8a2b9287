"""Pictures of faces with exact labels, by the hundred thousand."""

from __future__ import annotations

from .generation import generate, preview
from .sample import Sample, SampleMaker
from .shards import check
from .spec import Spec

__all__ = ["Sample", "SampleMaker", "Spec", "check", "generate", "preview"]
