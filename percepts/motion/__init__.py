"""Motion segmentation: frames in, moving regions out (paper, section 3).

Start with `segmenter.py`, the main loop; each of its steps has its own folder:

- `features/`: the working image, motion constraints at its points, superpixels.
- `layers/`: affine motions fitted to constraints; background motion; labels of superpixels.
- `tracks/`: objects over time: prediction, update, salience, merging, initiation, deletion.
- `foreground/`: a learned per-superpixel probability of independent motion, and objects formed from it.
- `static_camera/`: background subtraction while the camera does not move, fused with the layers.
- `dark_sky/`: bodies that stand out from black space, whole and sharply, even when they hardly move.
- `outlines/`: from label probabilities to a mask and its contour.
- `output/`: reported regions, directives, and when each region came into view.

`behaviour.py` adapts this to the agent.
"""

from visup.percepts.motion.behaviour import MotionBehaviour
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.segmenter import MotionSegmenter

__all__ = ["MotionBehaviour", "MotionSegmenter", "MotionSettings"]
