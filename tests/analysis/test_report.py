"""Reports: what is printed, written, and shown on the page."""

import json

import numpy as np
import pytest

from analysis.report import Plot, Report, Table, order, plot, publish, shown


def made(name="first", caption="A line."):
    figure, axes = plot(1, 2)
    axes[0].plot([0.0, 1.0])
    picture = np.zeros((4, 5, 3), np.uint8)
    rows = [("a < b", 1234, 0.5), ("c", np.int64(2), np.nan)]
    return Report(
        name,
        f"Title of {name}",
        "What & how.",
        "This <much>.",
        [Table("Rows", ("name", "count", "mm"), rows)],
        [Plot("line", figure, caption), Plot("black", picture, "Nothing.")],
        {"list": np.arange(3.0), "scalar": np.float64(0.25), "flag": np.bool_(True)},
    )


def test_a_report_is_printed_and_written(tmp_path, capsys):
    publish(made(), tmp_path / "new")
    printed = capsys.readouterr().out
    assert "Title of first" in printed
    assert "1,234" in printed
    assert "nan" not in printed
    content = json.loads((tmp_path / "new" / "first.json").read_text(encoding="utf-8"))
    assert content["numbers"] == {"list": [0.0, 1.0, 2.0], "scalar": 0.25, "flag": True}
    assert content["tables"][0]["rows"][0] == ["a < b", 1234, 0.5]
    for entry in content["plots"]:
        assert (tmp_path / "new" / entry["file"]).read_bytes().startswith(b"\x89PNG")


def test_the_page_holds_all_reports_of_its_folder_and_nothing_else(tmp_path):
    (tmp_path / "other.json").write_text('{"not": "a report"}', encoding="utf-8")
    publish(made(), tmp_path)
    publish(made("second", "A < line."), tmp_path)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    for name in ("first", "second"):
        assert page.count(f'<section id="{name}">') == 1
        assert f'src="{name}_line.png"' in page
        assert (tmp_path / f"{name}_line.png").exists()
    assert "A &lt; line." in page
    assert "This &lt;much&gt;." in page
    assert "a &lt; b" in page
    publish(made(caption="Anew."), tmp_path)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert page.count("<section") == 2
    assert "Anew." in page


def test_values_as_they_stand_in_tables():
    assert [shown(v) for v in (0.0123456, 12345, 12345.6, 3.0, "x", float("nan"))] == [
        "0.0123", "12,345", "12346", "3", "x", "",
    ]  # fmt: skip


@pytest.mark.parametrize("exponent", [0.5, 2.0])
def test_orders_are_fitted(exponent):
    sizes = np.array([0.1, 0.7, 3.0])
    assert order(sizes, 5.0 * sizes**exponent) == pytest.approx(exponent)
