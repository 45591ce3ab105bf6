"""Similarity of shapes.

Read `graph_matching.py` (shock graphs, by recursive bipartite matching), `shape_similarity.py` (graphs,
outlines and areas combined), `truncated_views.py` (silhouettes cut by the image border) and
`exemplars.py` (a few representative silhouettes).
"""
