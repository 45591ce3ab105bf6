"""Shape: recognition of regions by their silhouettes (paper, section 4).

Read in this order:

- `silhouette/`: a mask normalised to one outline of unit area, and a map of its area.
- `shocks/`: skeleton, shocks, shock graph and its topological signatures.
- `matching/`: similarity of shapes: graphs, outlines, areas; shapes truncated by the border.
- `index/`: the stored form of a view, and the selection of views for full comparison.
- `database/`: the file, its views, and the search for views matching a silhouette.
- `refinement/`: orientations refined with the mesh of the model.
- `building/`: views rendered from meshes, exemplars of silhouettes, and the database of both.
- `drawing/`: contact sheets, and images that explain a match.

`behaviour.py` adapts this to the agent.
"""

from visup.percepts.shape.behaviour import ShapeBehaviour, ShapeSettings
from visup.percepts.shape.database.model_database import ModelDatabase, Ranking, ViewMatch

__all__ = ["ModelDatabase", "Ranking", "ShapeBehaviour", "ShapeSettings", "ViewMatch"]
