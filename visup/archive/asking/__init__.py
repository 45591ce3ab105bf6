"""Questions to a lake.

Read `views.py` (the tables as people ask for them), `database.py` (SQL over them that reads the lake and does
nothing else), `examples.py` (questions to begin with) and `answers.py` (answers as text and files).
"""
