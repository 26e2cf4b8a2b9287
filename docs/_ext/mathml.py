"""Formulas as MathML, which browsers draw by themselves: the site needs no script and no network for them."""

from docutils.utils.math.latex2mathml import tex2mathml


def inline(writer, node):
    """A formula in a line."""
    _write(writer, node, tex2mathml(node.astext()))


def display(writer, node):
    """A formula by itself."""
    _write(writer, node, f'<div class="math-display">{tex2mathml(node.astext(), as_block=True)}</div>')


def _write(writer, node, markup):
    from docutils import nodes

    writer.body.append(" ".join(line.strip() for line in markup.splitlines()).replace("> <", "><"))
    raise nodes.SkipNode


def setup(app):
    """Register the renderer `mathml`."""
    app.add_html_math_renderer("mathml", (inline, None), (display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
