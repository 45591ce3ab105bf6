"""Evaluation of shape recognition and of model databases.

Read `retrieval` (leave one out over classes), `view_recognition` with `view_queries` and `symmetry`, then
`scale` (databases grown by `augment`) and `robustness` (files and masks corrupted by `corrupt`).
"""
