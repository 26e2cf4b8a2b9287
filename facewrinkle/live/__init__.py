"""The studio: a face in the browser, simulated here, with a slider for everything.

The page is plain HTML, CSS and ES modules in `page/`, drawn with WebGL2; nothing is built, and nothing comes from
elsewhere.

document, protocol | the session that pages change, with undo; messages between a page and the studio
visible_parts      | what is seen of a frame, as parts
fields             | fields in color; what made a fold, with the numbers of its formula
stage              | the thread that simulates
capture            | phones and trackers that drive the face
server             | pages that are connected; the web server
answers            | what a page is told first, and what it asks for
library            | faces and clips that are open
saving             | files; those that take long, in a process of their own; the session that is saved by itself
window, widget     | the object that users hold; the same in a notebook
"""

from __future__ import annotations

from ..errors import optional_imports

with optional_imports("the studio needs"):
    from .window import Studio, studio

__all__ = ["Studio", "studio"]
