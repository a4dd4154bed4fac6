"""HTML pages that load nothing: styles, scripts and data lie in them. Needs no package."""

import html
import json
import pathlib

WEB = pathlib.Path(__file__).resolve().parents[1] / "web"
PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,"><title>{title}</title><style>{style}</style></head>
<body>{body}{data}<script>{scripts}</script></body></html>
"""
DATA = """<script type="application/json" id="described">{described}</script>
<script type="text/plain" id="packed">{packed}</script>"""


def read_web(*names):
    """The text of files of drivers/web together."""
    return "\n".join((WEB / name).read_text(encoding="utf-8") for name in names)


def web_page(title, body, styles, scripts, described=None, packed=""):
    """The text of a page with a title (text), a body (HTML), and styles and scripts of drivers/web by their names.
    Scripts read `described`, values of JSON, and `packed`, the text of a Pack, from elements of these ids."""
    data = "" if described is None else DATA.format(described=json.dumps(described).replace("<", "\\u003c"), packed=packed)
    return PAGE.format(title=html.escape(title), style=read_web(*styles), body=body, data=data,
                       scripts=read_web(*scripts))
