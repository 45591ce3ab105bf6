"""Picture sizes from headers, checked before memory is allocated for the pixels."""

from __future__ import annotations

import warnings
from io import BytesIO

MOST_PIXELS = 2**26
"""Most pixels of a picture or frame, 67 million: twice an 8K frame. Beyond, decoding alone takes seconds and
gigabytes."""
_AT_MOST = f"visup decodes at most {MOST_PIXELS / 1e6:.0f} million"


def picture_size(data: bytes) -> tuple[int, int] | None:
    """Width and height of a picture file in pixels, or None where its header cannot be read.

    Raises:
        ValueError: Pillow refuses the picture as too large to report its size.
    """
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(BytesIO(data)) as picture:
                return picture.size
    except Image.DecompressionBombError as fault:
        raise ValueError(f"has far too many pixels; {_AT_MOST}") from fault
    except Exception:
        # Pillow's readers may raise anything; the picture's decoder decides.
        return None


def check_picture_size(data: bytes) -> None:
    """Reject a picture that is too large to decode.

    Raises:
        ValueError: It is too large; the message says how large.
    """
    size = picture_size(data)
    if size is not None:
        check_pixels(*size)


def check_pixels(width: float, height: float) -> None:
    """Reject a picture with too many pixels.

    Raises:
        ValueError: They are too many.
    """
    if width * height > MOST_PIXELS:
        raise ValueError(f"has {width:.0f}x{height:.0f} pixels; {_AT_MOST}")
