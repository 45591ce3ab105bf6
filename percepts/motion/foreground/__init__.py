"""Which superpixels show something that moves by itself: soft evidence from many cues, and a belief.

Read `cues.py` (what one frame shows of each superpixel), `perceptron.py` (the trained function from cues
to log odds), `belief.py` (cues in the context of neighbours, of the past and of appearance; the belief
carried from frame to frame) and `objects.py` (from the belief to regions with ids). `_cues_jit.py` holds the
compiled loops of the first three. `foreground.json` is the trained model; `visup train motion` makes it.
"""
