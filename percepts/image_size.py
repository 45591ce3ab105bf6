"""Image sizes from headers, checked before memory is allocated for the pixels."""

from __future__ import annotations

import warnings
from io import BytesIO

MAX_PIXELS = 2**26
"""Most pixels of an image or frame, 67 million: twice an 8K frame. Beyond, decoding alone takes seconds and
gigabytes."""
_AT_MOST = f"visup decodes at most {MAX_PIXELS / 1e6:.0f} million"


def image_size(data: bytes) -> tuple[int, int] | None:
    """Width and height of an image file in pixels, or None where its header cannot be read.

    Raises:
        ValueError: Pillow refuses the image as too large to report its size.
    """
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(BytesIO(data)) as image:
                return image.size
    except Image.DecompressionBombError as fault:
        raise ValueError(f"has far too many pixels; {_AT_MOST}") from fault
    except Exception:
        # Pillow's readers may raise anything; the image's decoder decides.
        return None


def check_image_size(data: bytes) -> None:
    """Reject an image that is too large to decode.

    Raises:
        ValueError: It is too large; the message says how large.
    """
    size = image_size(data)
    if size is not None:
        check_pixels(*size)


def check_pixels(width: float, height: float) -> None:
    """Reject an image with too many pixels.

    Raises:
        ValueError: They are too many.
    """
    if width * height > MAX_PIXELS:
        raise ValueError(f"has {width:.0f}x{height:.0f} pixels; {_AT_MOST}")
