"""A detector's network from an ONNX file, run by onnxruntime; needs `visup[onnx]`."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from visup.agent import Frame
from visup.agent.model.errors import ExtraMissingError, SettingsError
from visup.percepts.detections.boxes import Detection
from visup.percepts.detections.yolo import decode_yolo, letterbox

USUAL_SIDE = 640
"""Input size for networks that accept any."""


class YoloNetwork:
    """Detects objects in a frame by a network of the YOLO family; see `decode_yolo`.

    Args:
        path: The ONNX file. Class names are read from its metadata (`names`), where exporters write them.

    Attributes:
        names: Class names; empty where the file has none.

    Raises:
        ExtraMissingError: onnxruntime is not installed.
        SettingsError: The file cannot be read, or its network does not take images.
    """

    def __init__(self, path: Path) -> None:
        try:
            import onnxruntime
        except ModuleNotFoundError as missing:
            raise ExtraMissingError("a detector's network", "onnx") from missing
        if not path.is_file():
            raise SettingsError("there is no such file", where=str(path))
        options = onnxruntime.SessionOptions()
        options.log_severity_level = 4  # errors are reported below
        try:
            self._session: Any = onnxruntime.InferenceSession(
                str(path), options, providers=["CPUExecutionProvider"]
            )
        except Exception as fault:  # onnxruntime has no exception class for damaged files
            raise SettingsError(
                "the network cannot be read", where=str(path), expected="an ONNX file"
            ) from fault
        self._path = path
        self._input, self.size = self._taken()
        self.names = _names(self._session.get_modelmeta().custom_metadata_map)

    def __call__(self, frame: Frame) -> tuple[Detection, ...]:
        """The detections of a frame.

        Raises:
            SettingsError: The output has no known layout.
        """
        blob, fitted = letterbox(frame.image, self.size)
        (output, *_) = self._session.run(None, {self._input: blob})
        try:
            return decode_yolo(output, self.names, fitted)
        except ValueError as fault:
            raise SettingsError(
                f"the network's answer cannot be used: {fault}",
                where=str(self._path),
                expected="a detector of the YOLO family",
            ) from fault

    def _taken(self) -> tuple[str, tuple[int, int]]:
        """The name and (width, height) of the input."""
        (first, *_) = self._session.get_inputs()
        shape = list(first.shape)
        if len(shape) != 4 or shape[1] not in (3, "channels") or "float" not in first.type:
            raise SettingsError(
                f"the network takes {first.type} of shape {shape}",
                where=str(self._path),
                expected="pictures as (1, 3, height, width) of 32-bit floats",
            )
        height, width = (n if isinstance(n, int) and n > 0 else USUAL_SIDE for n in shape[2:])
        return first.name, (width, height)


def _names(notes: Mapping[str, str]) -> tuple[str, ...]:
    """Class names, which exporters write as `{0: 'person', 1: 'bicycle'}`."""
    try:
        names = ast.literal_eval(notes.get("names", ""))
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return ()
    if isinstance(names, dict):
        names = [names.get(n) for n in range(len(names))]
    return tuple(str(n) for n in names) if isinstance(names, list | tuple) else ()
