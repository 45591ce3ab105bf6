"""Random worlds: machines at work in scenes that are drawn from a seed, with masks, brief and truth.

Read `world.py` (what a world is made of), `kinds/` (how one is scripted; `pick.py` first), `things/`
(what it is furnished with), `plate.py` and `frames.py` (how it is drawn: what rests once, what moves in
each frame), `truth.py`, `lesson.py` and `writer.py` (what is written of it).
"""
