"""The model database: one file of views, and the search in it.

Read `model_database.py` (the public interface), `search.py` (from a shape to its likeliest views),
`catalogue.py` (views and shapes read lazily from the file), `file_format.py`, `file_writer.py` and
`file_reader.py` (the file), `taught_records.py` (taught views as rows of it), `view_directions.py`
(symmetric views, neighbouring views) and `time_budget.py` (milliseconds converted to an amount of work).
"""
