"""Pose: the orientation of objects and their rotation (paper, section 5, figure 5).

Read in this order: `reasoner.py` (the belief, and when it is updated), `interpretation_tree.py` (which view
hypotheses belong together; its compiled loop is `_interpretation_tree_jit.py`), `angular_velocity.py` (one
rate, or two with a change between), `angular_velocity_fit.py` (the least squares) and `rotations.py`
(rotation vectors and matrices).
"""

from visup.rules.pose.reasoner import PoseReasoner, PoseSettings, pose_support

__all__ = ["PoseReasoner", "PoseSettings", "pose_support"]
