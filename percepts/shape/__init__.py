"""Shape: naming a region by its silhouette (paper, section 4).

A mask becomes a `Silhouette` (silhouette.py), its skeleton (skeleton.py) is split into shocks (shocks.py)
that form a `ShockGraph` (shock_graph.py) with topological signatures (signature.py); an index
(index.py) and recursive bipartite matching (match.py) find the views of a `ModelDatabase`
(database.py) that it looks like; behaviour.py offers all this to the agent. Read them in this order.
"""
