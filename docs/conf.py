"""How Sphinx makes the guide from this folder: `make guide`."""

from grazemap.version import __version__

project = "grazemap"
release = __version__
extensions = ["myst_parser", "sphinx_copybutton"]
# for contributors, who read them in the repository
exclude_patterns = ["architecture.md", "way.md"]
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence"]
# examples leave out parts of requests as "..", which is no JSON
suppress_warnings = ["misc.highlighting_failure"]
smartquotes = False  # JSON in tables is to be copied
html_theme = "furo"
html_title = f"grazemap {__version__}"
html_favicon = "../service/grazemap_service/static/icon.svg"
html_copy_source = False
html_show_copyright = False
html_show_sphinx = False
html_use_index = False
html_css_files = ["guide.css"]
html_static_path = ["static"]
# what no page shows, and readers may want
copybutton_exclude = ".linenos, .gp, .go"
