"""Pictures of faces with exact labels, by the hundred thousand."""

from .generation import generate, preview
from .sample import Sample, SampleMaker
from .spec import Spec
from .verification import check

__all__ = ["Sample", "SampleMaker", "Spec", "check", "generate", "preview"]
