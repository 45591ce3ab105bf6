"""The model database: one file of views, and the search in it.

Read `model_database.py` (what users see), `search.py` (from a shape to its likeliest views), `catalogue.py`
(views and shapes made from the file when asked for), `file_format.py`, `file_writer.py` and
`file_reader.py` (the file), `taught_records.py` (what was taught, as rows of it), `view_directions.py`
(symmetric views, neighbouring views) and `time_budget.py` (milliseconds as an amount of work).
"""
