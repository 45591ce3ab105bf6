"""`visup presets`: what each preset sets, and why."""

from __future__ import annotations


def presets() -> None:
    """List the presets of `visup watch --preset`: the rules, memory and frame rate of each, and why."""
    from visup.runs.inputs.presets import PRESETS
    from visup.terminal.console import echo

    for preset in PRESETS.values():
        objects = preset.objects
        pace = (
            "all frames"
            if preset.enough_fps is None
            else f"at least {preset.enough_fps:g} frames per second; the surplus is skipped"
        )
        without = f"all but {', '.join(sorted(preset.without))}" if preset.without else "all"
        echo(f"{preset.name}: {preset.about}")
        echo(f"  rules   {without}: {preset.rules_because}")
        echo(
            f"  memory  an object that left is forgotten after {objects.forget_left_s:g} s, a hidden one "
            f"after {objects.forget_nameless_s:g} s ({objects.forget_hidden_s:g} s once it is identified): "
            f"{preset.memory_because}"
        )
        echo(f"  pace    {pace}: {preset.pace_because}")
