"""Fixtures of several tests of output."""

import pytest

from .runs import FORMATS, NEEDS


@pytest.fixture(params=FORMATS)
def suffix(request):
    """Every format whose package is there."""
    if request.param in NEEDS:
        pytest.importorskip(NEEDS[request.param])
    return request.param
