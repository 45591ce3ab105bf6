"""Training of the motion segmentation model: `visup train motion`.

Read `examples.py` (cues and truth of labelled sequences), `fitting.py` (an ensemble of perceptrons by
gradient descent), `closed_loop.py` (both ensembles, the second on the model's own beliefs), then `runner.py`.
"""
