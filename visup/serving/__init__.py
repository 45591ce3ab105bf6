"""Serving: many cameras at once, for months, each in a process of its own that comes back by itself.

Read `site.py` (what is watched), `site_form.py` and `site_file.py` (how a user says it; `toml_lines.py`
finds the lines of mistakes, `site_paths.py` files and secrets, with `placeholders.py`) and `site_check.py`
(whether all of it will do).
"""
