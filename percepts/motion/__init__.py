"""Motion segmentation: frames in, moving regions out (paper, section 3).

Read `segmenter.py` first: it is the loop, and each of its steps lives in a room of its own:

- `features/`: the working image, motion constraints at its points, superpixels.
- `layers/`: affine motions fitted to constraints; the background's; labels of superpixels.
- `tracks/`: objects over time: prediction, update, salience, merging, initiation, deletion.
- `foreground/`: learned soft evidence of independent motion; the belief, and the objects formed from it.
- `static_camera/`: background subtraction while the camera does not move, fused with the layers.
- `outlines/`: from label probabilities to a mask and its contour.
- `output/`: the reported regions, directives, and since when each region has been in view.

`behaviour.py` makes this available to the agent.
"""

from visup.percepts.motion.behaviour import MotionBehaviour
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.segmenter import MotionSegmenter

__all__ = ["MotionBehaviour", "MotionSegmenter", "MotionSettings"]
