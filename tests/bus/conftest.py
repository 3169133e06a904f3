import time
from collections.abc import Callable

import pytest

from placegraph.runtime.bus.session import BusConfig, free_endpoint


@pytest.fixture
def bus_config() -> BusConfig:
    return BusConfig(endpoint=free_endpoint(), prefix="test")


@pytest.fixture
def wait_until() -> Callable[[Callable[[], object], str], None]:
    def wait(condition: Callable[[], object], what: str, timeout_s: float = 30.0) -> None:
        deadline = time.monotonic() + timeout_s
        while not condition():
            assert time.monotonic() < deadline, f"{what}: not within {timeout_s} s"
            time.sleep(0.02)

    return wait
