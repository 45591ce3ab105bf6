"""Distance and its class: how far apart two bodies are, relative to how large they are.

A gap of 40 px is large for two screws and nothing for two trains. Classes compare the gap with the size of
the two, the geometric mean of the square roots of their boxes' areas (relative distance in the manner of
Clementini, Di Felice and Hernandez 1997).
"""

CLASS_NAMES = ("very_close_to", "close_to", "apart_from", "far_from")
LIMITS = (0.25, 1.0, 3.0)
"""Gap over size at which one class ends and the next begins."""
