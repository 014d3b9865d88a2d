"""What the tests share."""

from __future__ import annotations

import pytest

from medial_axis import MedialAxis, Mesh


@pytest.fixture(scope="session")
def blob() -> Mesh:
    return Mesh.read("builtin:blob")


@pytest.fixture(scope="session")
def axis(blob: Mesh) -> MedialAxis:
    return blob.medial_axis()
