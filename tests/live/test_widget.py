"""The widget, without a notebook: its messages, and its module in a browser."""

import base64
import json

import pytest

pytest.importorskip("anywidget", reason="the widget needs anywidget")

from studio_pages import decoded, pages, until

from facewrinkle.live.server import page_files
from facewrinkle.live.widget import style


class Notebook:
    """Keeps what a widget sends, and sends to it."""

    def __init__(self, widget, monkeypatch):
        self.widget, self.sent = widget, []
        monkeypatch.setattr(type(widget), "send", lambda _, content, buffers=(): self.sent.append((content, buffers)))

    def say(self, do, **words):
        self.widget._received(self.widget, {"text": json.dumps({"do": do, **words})}, [])

    def until(self, right):
        return until(lambda: next((each for each in list(self.sent) if right(each)), None))


def texts(kind):
    return lambda each: each[0].get("text", "").startswith(f'{{"is": "{kind}"')


def test_a_widget_shows_and_changes_the_studio(studio, monkeypatch):
    widget = studio.widget(height=300)
    try:
        notebook = Notebook(widget, monkeypatch)
        notebook.say("undo")  # before it is shown, it has no say
        notebook.say("hello")
        notebook.until(texts("welcome"))
        _, buffers = notebook.until(lambda each: each[1] and each[1][0][:4] != b"PHOT")
        _, arrays = decoded(bytes(buffers[0]))
        assert len(arrays["skin"]["position"]) >= studio.face.mesh.n_points
        notebook.say("change", patches=[[["mixture", "AU26"], 0.5]], gesture="")
        notebook.until(lambda each: texts("document")(each) and "AU26" in each[0]["text"])
        assert studio.rates == {"AU26": 0.5}
        notebook.say("reboot")
        assert "reboot" in notebook.until(texts("error"))[0]["text"]
    finally:
        widget.close()
    until(lambda: not pages(studio))


def test_its_style_stays_in_the_widget():
    text = style(page_files())
    assert text.count("{") == text.count("}")
    assert ":root" not in text
    assert "body {" not in text


@pytest.mark.slow
def test_its_module_draws_in_a_browser(studio, browser, monkeypatch):
    """The module alone, on an empty page, with what a kernel would send."""
    widget = studio.widget(height=300)
    module, notebook = widget._esm, Notebook(widget, monkeypatch)
    notebook.say("hello")
    welcome = notebook.until(texts("welcome"))[0]
    document = notebook.until(texts("document"))[0]
    frame = notebook.until(lambda each: each[1] and each[1][0][:4] != b"PHOT")[1][0]
    widget.close()
    page = browser.new_page(viewport={"width": 800, "height": 320})
    errors = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    sent = page.evaluate(
        """async ([module, texts, frame]) => {
        const place = URL.createObjectURL(new Blob([module], { type: "text/javascript" }));
        const { default: widget } = await import(place), sent = [], hears = {};
        const send = (what) => sent.push(JSON.parse(what.text)), on = (name, act) => { hears[name] = act; };
        const model = { get: () => 300, send, on, off() {} };
        const el = document.createElement("div");
        document.body.append(el);
        widget.render({ model, el });
        for (const text of texts) hears["msg:custom"]({ text }, []);
        const bytes = Uint8Array.from(atob(frame), (c) => c.charCodeAt(0));
        hears["msg:custom"]({}, [new DataView(bytes.buffer)]);
        for (let k = 0; k < 600 && !sent.some((what) => what.do === "shown"); k++)
          await new Promise((done) => setTimeout(done, 50));
        const slider = el.querySelector("input[aria-label='Jaw drop']");
        slider.value = 0.5;
        slider.dispatchEvent(new Event("input"));
        return sent;
        }""",
        [module, [welcome["text"], document["text"]], base64.b64encode(frame).decode()],
    )  # fmt: skip
    page.close()
    assert not errors
    assert sent[0] == {"do": "hello"}
    assert {"do": "shown"} in sent
    assert sent[-1]["patches"] == [[["mixture", "AU26"], 0.5]]
