"""Foreground: the probability that each superpixel moves independently, and objects formed from it.

Read `cues.py` (features of each superpixel in one frame), `perceptron.py` (the trained function from cues
to log odds), `belief.py` (cues in the context of neighbours, past and appearance; the belief carried from
frame to frame) and `objects.py` (from the belief to regions with ids). `_cues_jit.py` holds the compiled
loops of the first three. `foreground.json` is the trained model; `visup train motion` makes it.
"""
