"""Shape: recognition of regions by their silhouettes (paper, section 4).

Read the rooms in this order:

- `silhouette/`: a mask in normal form: one outline of unit area, and a map of its area.
- `shocks/`: skeleton, shocks, shock graph and its topological signatures.
- `matching/`: similarity of shapes: graphs, outlines, areas; shapes truncated by the border.
- `index/`: the stored form of a view, and the choice of views for full comparison.
- `database/`: the file, its views, and the search for views that match a silhouette.
- `refinement/`: orientations refined with the mesh of the model.
- `building/`: views rendered from meshes, exemplars of silhouettes, the database built from both.
- `drawing/`: contact sheets, and pictures of why a silhouette matches a view.

`behaviour.py` makes this available to the agent.
"""

from visup.percepts.shape.behaviour import ShapeBehaviour, ShapeSettings
from visup.percepts.shape.database.model_database import ModelDatabase, Ranking, ViewMatch

__all__ = ["ModelDatabase", "Ranking", "ShapeBehaviour", "ShapeSettings", "ViewMatch"]
