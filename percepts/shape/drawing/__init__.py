"""Images of shapes and matches.

`contact_sheet.py` shows the content of a database, `pictures.py` explains a match, and `sheet.py` is the
drawing surface of both.
"""
