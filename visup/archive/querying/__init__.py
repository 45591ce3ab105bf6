"""SQL queries over a lake.

Read `views.py` (the tables for queries), `database.py` (read-only SQL over them), `examples.py` (example
queries) and `answers.py` (results as text and files).
"""
