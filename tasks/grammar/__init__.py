"""The grammar of task files, and analysis of the tree of a task.

Read in this order: `tasks.lark` (the language), `conditions.py` and `ast_courses.py` (the nodes
inside a stage), `nodes.py` (the file as a whole), `parser.py` (text to tree), `statement.py` (one
statement of the text), `analysis.py` (reachability, nullability, recursion), `structure.py` (stages and
actors of a task), `units.py` (units of amounts), `graphs.py` (graphs of stage names), `actor_builder.py`
(declarations of actors).
"""
