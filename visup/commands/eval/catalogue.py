"""The evaluations, from which the commands of `visup eval` are made."""

from __future__ import annotations

import typer

from visup.commands.eval.machinery_evaluations import MACHINERY_EVALUATIONS
from visup.commands.eval.motion import MOTION
from visup.commands.eval.scene_evaluations import SCENE_EVALUATIONS

EVALUATIONS = (MOTION, *SCENE_EVALUATIONS, *MACHINERY_EVALUATIONS)


app = typer.Typer(no_args_is_help=True, help="Measure accuracy and speed against ground truth.")
for _evaluation in EVALUATIONS:
    app.command(_evaluation.name)(_evaluation.command())
