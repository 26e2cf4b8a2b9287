"""The runner of what is tried from outside; its scripts are run by `make outside`."""

import sys
from pathlib import Path

from tools import outside
from tools.outside import Outside, Step, requirements


def test_pages_install_the_wheel_with_their_extras_and_what_else_they_name(tmp_path):
    page = tmp_path / "page.rst"
    page.write_text(
        'Run ``pip install ".[studio,notebook]" jupyter``.\n\n   $ pip install "facewrinkle[export]"   # movies\n'
    )
    assert requirements(Path("x.whl"), [page]) == ["x.whl[export,notebook,studio]", "jupyter"]


def test_the_first_step_that_fails_ends_all_and_says_how_to_repeat_it(tmp_path, monkeypatch):
    monkeypatch.setattr(outside, "PLACE", tmp_path / "place")
    done = []

    def steps():
        yield Step("fine", [sys.executable, "-c", "print('a')"], tmp_path)
        yield Step("wrong", [sys.executable, "-c", "raise SystemExit('such a pity')"], tmp_path)
        done.append("on it went")

    run = Outside()
    run.run(steps())
    assert list(run.times) == ["fine", "wrong"]
    assert run.stop.is_set()
    assert not done
    (said,) = run.failed
    assert said.startswith("such a pity")
    assert f"(cd {tmp_path} && {sys.executable} -c " in said
