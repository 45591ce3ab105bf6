"""Shock graphs: a silhouette as a rooted graph of parts.

Read `skeleton.py` (the medial axis and its significant branches), `shock_labels.py` (the four kinds of
shock), `skeletal_context.py` (what a shape looks like from a place on its skeleton), `shock_graph.py` (the
graph) and `topological_signature.py` (what its eigenvalues tell).
"""
