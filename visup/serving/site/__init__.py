"""The site file: which cameras are watched, for what, and where alerts go.

Read `records.py` (the site), `form.py` (the form of the file), `reading.py` (reads it and reports mistakes by
line, with `toml_lines.py`), `camera_settings.py` (resolves file names, and secrets with `placeholders.py`)
and `checking.py` (the preflight of a site).
"""
