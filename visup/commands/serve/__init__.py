"""`visup serve`: many cameras under one supervisor; `site_commands.py` has the commands."""
