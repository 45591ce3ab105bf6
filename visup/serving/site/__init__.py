"""The site file: which cameras are watched, for what, and where alerts go.

Read `records.py` (what is watched), `form.py` (how a user says it), `reading.py` (a file is read, and its
mistakes are told by line: `toml_lines.py`), `camera_settings.py` (files from the file's folder, secrets in
place by `placeholders.py`) and `checking.py` (whether all of it will do).
"""
