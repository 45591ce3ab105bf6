"""Shape: what a region is, by its silhouette (paper, section 4).

Read the rooms in this order:

- `silhouette/`: a mask in normal form: one outline of unit area, and a map of its area.
- `shocks/`: skeleton, shocks, shock graph and its topological signatures.
- `matching/`: how alike two shapes are: graphs, outlines, areas; shapes that a border cuts.
- `index/`: what is stored of a view, and which views are worth a full comparison.
- `database/`: the file, its views, and the search for the views that a silhouette looks like.
- `refinement/`: orientations made exact with a model's own mesh.
- `building/`: views rendered from meshes, exemplars of silhouettes, the database built from both.
- `drawing/`: pictures for people: contact sheets, and why a silhouette matches a view.

`behaviour.py` offers all this to the agent.
"""

from visup.percepts.shape.behaviour import ShapeBehaviour, ShapeSettings
from visup.percepts.shape.database.model_database import ModelDatabase, Ranking, ViewMatch

__all__ = ["ModelDatabase", "Ranking", "ShapeBehaviour", "ShapeSettings", "ViewMatch"]
