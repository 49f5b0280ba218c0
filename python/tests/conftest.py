import sys
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

ROOT = Path(__file__).resolve().parents[2]
# The driver under test is the one of the examples, which knows nothing of virtual controllers.
sys.path.insert(0, str(ROOT / "examples" / "python"))


@pytest.fixture
def root() -> Path:
    return ROOT
