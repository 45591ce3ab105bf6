"""Evaluation of shape recognition and of model databases.

Read `retrieval` (leave-one-out over classes), `view_recognition` with `view_queries` and `symmetry`, and the
`descriptors` of other methods. Size and robustness of databases are evaluated in `tests/oracles/shape`.
"""
