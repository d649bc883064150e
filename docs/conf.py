"""Configuration of the site: `sphinx-build -W -b html docs docs/_build`; nothing is read off a network."""

from __future__ import annotations

import sys
from pathlib import Path

from docutils import nodes
from docutils.utils.math import latex2mathml
from sphinx.application import Sphinx

sys.path.insert(0, str(Path(__file__).parents[1]))

import ibvs_qp  # of this source tree, not of an installed copy

project, author, copyright = "ibvs_qp", "The ibvs_qp contributors", "The ibvs_qp contributors"
version = release = ibvs_qp.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_build", "draw", "tuning"]
nitpicky = False

myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "attrs_inline"]
myst_heading_anchors = 3

# Docstrings: Google style; a single backquote is code.
default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_preserve_defaults = True
napoleon_use_ivar = True

html_theme = "furo"
html_title = f"ibvs_qp {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_copy_source = False
pygments_dark_style = "github-dark"


def _mathml(text: str, block: bool) -> str:
    tree = latex2mathml.tex2mathml(text, as_block=block)
    return tree if isinstance(tree, str) else tree.toxml()


def _inline(self, node: nodes.math) -> None:
    self.body.append(_mathml(node.astext(), block=False))
    raise nodes.SkipNode


def _block(self, node: nodes.math_block) -> None:
    self.body.append(f'<div class="equation">{_mathml(node.astext(), block=True)}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> None:
    """Write equations as MathML, which browsers draw themselves: no script, no network."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
