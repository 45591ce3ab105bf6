"""What only its owner should know is left out of an address; what one needs to tell sources apart stays."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.redaction import has_secret, redacted

SECRETS = st.text(
    st.characters(codec="ascii", exclude_characters="&;?#/_@ ", categories=["L", "N", "P"]),
    min_size=6,
    max_size=12,
).map(lambda text: f"Zq{text}zQ")
SHAPES = (
    "rtsp://guard:{}@10.0.0.3:554/stream",
    "rtsp://{}@cell/1",
    "RTSP://{}:word@cell",
    "rtsp://guard:a/{}@cell/1",
    "rtsp://guard:a@{}@cell/1",
    "http://cell/video?user=guard&password={}",
    "http://cell/video?channel=1&token={}&size=2",
    "http://cell/video?x={}",
    "rtsp://10.0.0.3/user=admin_password={}_channel=1_stream=0.sdp",
    "http://guard:{}@[2001:db8::1]:80/video",
)


@given(SECRETS, st.sampled_from(SHAPES))
def test_a_secret_is_gone_and_once_is_enough(secret: str, shape: str) -> None:
    address = shape.format(secret)
    shown = redacted(address)
    assert secret not in shown
    assert has_secret(address)
    assert redacted(shown) == shown
    assert not has_secret(shown)


@pytest.mark.parametrize(
    ("address", "shown"),
    [
        ("rtsp://guard:word@10.0.0.3:554/stream", "rtsp://10.0.0.3:554/stream"),
        ("rtsp://guard:a/b@cell/1", "rtsp://cell/1"),
        ("http://cell/video?channel=1&subtype=0", "http://cell/video?channel=1&subtype=0"),
        ("http://cell/video?pwd=1234&channel=1", "http://cell/video?pwd=***&channel=1"),
        (
            "rtsp://10.0.0.3/user=admin_password=abc_channel=1.sdp",
            "rtsp://10.0.0.3/user=***_password=***_channel=1.sdp",
        ),
        ("http://cell/@user/stream", "http://cell/@user/stream"),
        ("http://[2001:db8::1]:80/a@b", "http://[2001:db8::1]:80/a@b"),
    ],
)
def test_what_tells_sources_apart_stays(address: str, shown: str) -> None:
    assert redacted(address) == shown


@given(st.text(max_size=30))
def test_what_is_no_address_is_left_as_it_is(text: str) -> None:
    if "://" not in text:
        assert redacted(text) == text


@given(st.text(max_size=30))
def test_any_text_can_stand_in_an_address(text: str) -> None:
    once = redacted(f"rtsp://{text}")
    assert redacted(once) == once
