"""Identity: votes on names, questions to the operator, and depth.

Read in this order: `votes.py` (the weighted, time-discounted vote), `identification.py` (when an object is
identified), `operator_questions.py` (when the operator is asked), `depth.py` (the distance of an object, from
the size of its model).

"""

from visup.rules.identity.depth import DepthReasoner, DepthSettings
from visup.rules.identity.identification import IdentityReasoner
from visup.rules.identity.operator_questions import QuestionReasoner, QuestionSettings
from visup.rules.identity.votes import VoteSettings

__all__ = [
    "DepthReasoner",
    "DepthSettings",
    "IdentityReasoner",
    "QuestionReasoner",
    "QuestionSettings",
    "VoteSettings",
]
