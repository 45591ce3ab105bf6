"""How alike two shapes are.

Read `graph_matching.py` (shock graphs, by recursive bipartite matching), `shape_similarity.py` (graphs,
outlines and areas together), `truncated_views.py` (silhouettes that the image border cuts) and
`exemplars.py` (a few silhouettes that stand for many).
"""
