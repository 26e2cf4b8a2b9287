"""A small set that tests look at, and copy."""

import pytest

SPEC = {"size": [48, 48], "quick": True, "shard": 2, "per_person": 2, "tears": {"share": 0.0}}


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """A set of three samples in two shards. Not to be changed."""
    from facewrinkle.dataset import generate

    return generate(SPEC, tmp_path_factory.mktemp("set") / "small", count=3)


@pytest.fixture(scope="session")
def backwards():
    """The same samples, made the other way round."""
    from facewrinkle.dataset import SampleMaker, Spec

    with SampleMaker(Spec.of(SPEC)) as maker:
        return {index: maker.sample(index) for index in (2, 1, 0)}


@pytest.fixture
def remembered(backwards, monkeypatch):
    """Samples that were made before are not made again: for tests of what becomes of them."""

    from facewrinkle.dataset import SampleMaker, generation, shards

    class Remembering(SampleMaker):
        def pictures(self, index):
            return [backwards[index]]

    for module in (shards, generation):
        monkeypatch.setattr(module, "SampleMaker", Remembering)
