"""Static pages: access denied, page not found."""

from __future__ import annotations

from html import escape

_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title} · visup</title>
<style>
:root {{ color-scheme: light dark; --ground: #f5f7f9; --card: #fff; --line: #d6dbe2; --link: #1d5f9e; }}
@media (prefers-color-scheme: dark) {{
  :root {{ --ground: #10151b; --card: #171e26; --line: #2e3844; --link: #7db8ee; }}
}}
body {{ background: var(--ground); font: 16px/1.5 system-ui, sans-serif; margin: 0; padding: 12vh 16px; }}
main {{ max-width: 34rem; margin: 0 auto; padding: 20px 24px; background: var(--card);
  border: 1px solid var(--line); border-radius: 8px; }}
h1 {{ font-size: 1.15rem; margin: 0 0 8px; }} p {{ margin: 0 0 8px; }} a {{ color: var(--link); }}
</style></head>
<body><main><h1>{title}</h1><p>{text}</p>{link}</main></body></html>
"""


def plain_page(title: str, text: str, *, back: bool = False) -> bytes:
    """A static page with one message.

    Args:
        title: Its heading.
        text: The message.
        back: Whether to link to the list of runs.
    """
    link = '<p><a href="/">All runs</a></p>' if back else ""
    return _PAGE.format(title=escape(title), text=escape(text), link=link).encode()
