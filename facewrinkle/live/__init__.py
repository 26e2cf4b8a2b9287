"""The studio: a face in the browser, simulated here, with a slider for everything.

The page is plain HTML, CSS and ES modules in `page/`, drawn with WebGL2; nothing is built, and nothing comes from
elsewhere.

document, protocol | what was set by hand; the messages of a page
encoding           | parts of a picture as bytes
visible_parts      | what is seen of a frame, as parts
wishes, stage      | what a document asks of a simulation; the thread that simulates
server             | pages that are connected; the web server
fields             | fields in colour; what made a fold, with the numbers of its formula
answers            | what a page is told first, and what it asks for
library            | faces and clips that are open; files that a page sends
saving             | files; those that take long, in a process of their own; the session that is saved by itself
window             | the object that users hold
"""

from __future__ import annotations

from .window import Studio, studio

__all__ = ["Studio", "studio"]
