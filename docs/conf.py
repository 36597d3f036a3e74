# SPDX-License-Identifier: BSD-3-Clause
"""The documentation site: README, the pages of docs, and the reference of the Python package.

`scripts/docs.sh` builds it, and the reference of the C++ headers beside it.
"""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
_version = re.search(
    r'#define FILIPPOV_VERSION "([^"]+)"',
    (ROOT / "include/filippov/version.hpp").read_text(encoding="utf-8"),
)
assert _version is not None

project = "filippov"
author = "The filippov developers"
copyright = "The filippov developers"  # noqa: A001
release = version = _version[1]

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx_copybutton",
]
# The root of the repository is the source: a link in a page leads to the same place here as there.
root_doc = "docs/index"
include_patterns = ["*.md", "packaging/README.md", "docs/**"]
exclude_patterns = ["docs/images/**/*.txt", "docs/templates/**"]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
suppress_warnings = ["myst.header"]  # changelogs repeat their headings

templates_path = [str(ROOT / "docs/templates")]  # relative to two folders, by who reads it
autosummary_generate = True
autodoc_default_options = {"members": True, "undoc-members": False}
autodoc_typehints = "none"  # numpydoc tells them
numpydoc_show_class_members = False
numpydoc_xref_param_type = False
# Docstrings write absolute values as people do, which would be a substitution.
rst_prolog = "".join(f".. |{name}| replace:: \\|{name}\\|\n" for name in ("s", "slope"))

html_theme = "furo"
html_title = f"filippov {release}"
html_show_copyright = False
html_copy_source = False
pygments_style = "friendly"
