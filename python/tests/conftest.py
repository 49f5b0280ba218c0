import signal
import sys
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

# Programs inherit ignored signals, as under `nohup`. They get the default for a signal that this process catches.
for ignored in (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)):
    if signal.getsignal(ignored) == signal.SIG_IGN:
        signal.signal(ignored, lambda *_: None)

ROOT = Path(__file__).resolve().parents[2]
# The driver under test is the one of the examples, which knows nothing of virtual controllers.
sys.path.insert(0, str(ROOT / "examples" / "python"))


@pytest.fixture
def root() -> Path:
    return ROOT
