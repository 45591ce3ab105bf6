"""Training of what motion segmentation has learnt: `visup train motion`.

Read `examples.py` (cues and truth of labelled sequences), `fitting.py` (an ensemble of perceptrons by
gradient descent), `closed_loop.py` (both ensembles, the second on beliefs that the model itself held), then
`runner.py`.
"""
