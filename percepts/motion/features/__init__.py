"""Image measurements made before any object is known.

Read `work_image.py` (the reduced image and its history), `motion_constraints.py` (displacements of points,
each with its information matrix), `superpixels.py` (cells that follow edges) and `tone_histograms.py` (how
well a cell's tone fits a label). `settings.py` holds the settings of motion segmentation.
`_*_jit.py` are the compiled loops of the files of the same name; `_partition_jit.py` serves `superpixels.py`.
"""
