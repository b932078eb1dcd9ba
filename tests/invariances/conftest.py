"""What is of one machinery is tried by its kin in every run, and itself in the long one."""

import pytest

from cases.parts import KIN


@pytest.hookimpl(tryfirst=True)  # before those that are marked are left out
def pytest_collection_modifyitems(items):
    for item in items:
        given = item.callspec.params if hasattr(item, "callspec") else {}
        names = [given.get("name"), *given.get("pair", ())]
        if any(isinstance(name, str) and name in KIN for name in names):
            item.add_marker(pytest.mark.slow)
