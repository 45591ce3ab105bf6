"""Who is who, and what follows from it: votes on names, questions to the operator, depth.

Read in this order: `votes.py` (the weighted, time-discounted vote), `identification.py` (who is identified,
and when),
`operator_questions.py` (when the operator is asked), `depth.py` (how far an object is, by the size of
its model).
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
