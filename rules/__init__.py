"""Reasoning: from percepts to an interpretation of the scene (paper, section 5 and part of 7.4).

Read `reasoners.py` first (all reasoners, in the order in which they run), then the folders: `presence` (which
objects exist), `identity` (what they are), `pose` (orientation and rotation), `relations` (between objects)
and `coupling` (objects that move as one body); `formula`, `language`, `predicates`, `monitoring` and `safety`
(safety
rules: their language and runtime verification); `activation` (which behaviours are needed) and `wording`
(sentences, and conditions in words). Below them are `geometry` (outlines, fits) and `smoothing` (hysteresis,
exponential moving averages).

Decisions and their explanations share the same conditions: `wording/conditions.py`.
"""
