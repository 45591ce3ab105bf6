"""Functions that replay the reasoning: why, what-if, breakpoints, and the phases of a step."""
