"""Sphinx: `pip install -e '.[docs]' && sphinx-build docs docs/_build`."""

from vlnhijack import __version__

project = "vlnhijack"
version = release = __version__
extensions = ["myst_nb"]
html_theme = "furo"
nb_execution_mode = "off"  # outputs are stored; tests/system/test_notebook.py runs the notebook
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]
