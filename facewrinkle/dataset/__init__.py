"""Pictures of faces with exact labels, by the hundred thousand."""

from __future__ import annotations

from ..errors import optional_imports

with optional_imports("data sets need"):
    from .generation import generate, preview
    from .sample import Sample, SampleMaker
    from .shards import check
    from .spec import Spec

__all__ = ["Sample", "SampleMaker", "Spec", "check", "generate", "preview"]
