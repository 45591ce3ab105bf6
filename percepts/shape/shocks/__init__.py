"""Shock graphs: a silhouette as a rooted graph of parts.

Read `skeleton.py` (the medial axis and its significant branches), `shock_labels.py` (the four kinds of
shock), `skeletal_context.py` (the shape as seen from a point of its skeleton), `shock_graph.py` (the graph)
and `topological_signature.py` (signatures from the eigenvalues of its subgraphs).
"""
