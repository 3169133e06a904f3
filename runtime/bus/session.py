"""The only file that imports zenoh: publish, subscribe, serve, ask, liveliness.

One process (the launcher) is the hub, a Zenoh router on one endpoint; all others are its clients. Only that endpoint
listens, and multicast scouting is off unless the configuration turns it on.
"""

from __future__ import annotations

import json
import socket
from collections.abc import Callable
from types import TracebackType
from typing import Any

import zenoh
from pydantic import BaseModel, ConfigDict, Field

from placegraph.runtime.errors import ConfigError, QueryError

CONNECT_TIMEOUT_MS = 10_000  # chosen by hand: a hub that runs answers within milliseconds
PROBE_TIMEOUT_S = 1.0  # chosen by hand


class BusConfig(BaseModel):
    """`[bus]` of a dataflow file."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")

    endpoint: str = "tcp/127.0.0.1:7447"  # where the hub listens; another machine can reach it only if this says so
    # first part of every key, one for each robot; letters, digits and "._-", parts separated by "/"
    prefix: str = Field(default="placegraph", pattern=r"^[\w.-]+(/[\w.-]+)*$")
    multicast: bool = False  # whether Zenoh's discovery is sent and answered on the local network
    shared_memory: bool = (
        False  # off: payloads in shared memory stay pinned when a consumer is killed (seen, Zenoh 1.10)
    )

    def key(self, *parts: str) -> str:
        """The parts behind the prefix, joined to a Zenoh key."""
        return "/".join((self.prefix, *parts))


class IncomingQuery:
    """A query from outside that waits for its one reply; further replies are ignored."""

    def __init__(self, query: Any) -> None:
        self._query = query
        self.payload: bytes = query.payload.to_bytes() if query.payload is not None else b""

    def reply(self, payload: bytes) -> None:
        """Send the reply; the client's `ask` returns."""
        query, self._query = self._query, None
        if query is not None:
            with query:  # the client waits as long as a reference to the query is alive
                query.reply(query.key_expr, payload, encoding="application/json")


class Bus:
    """A Zenoh session as hub or client. Use as a context manager: an unclosed session keeps its process alive."""

    def __init__(self, config: BusConfig, *, hub: bool = False) -> None:
        """Open the session; raises ConfigError naming the endpoint when it cannot listen or nothing answers there."""
        self.config = config
        settings = zenoh.Config()
        values: dict[str, Any] = {
            "mode": "router" if hub else "client",
            "scouting/multicast/enabled": config.multicast,
            "listen/endpoints": [config.endpoint] if hub else [],
            "connect/endpoints": [] if hub else [config.endpoint],
            "connect/timeout_ms": CONNECT_TIMEOUT_MS,
            "connect/retry": {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 2},
            "transport/shared_memory/enabled": config.shared_memory,
        }
        try:
            for key, value in values.items():
                settings.insert_json5(key, json.dumps(value))
            if hub:
                _refuse_taken_port(config.endpoint)
            self._session = zenoh.open(settings)
        except zenoh.ZError as error:
            action = "listen on" if hub else "reach a running placegraph at"
            raise ConfigError(f"[bus] endpoint: cannot {action} {config.endpoint}: {error}") from None
        self._declarations: list[Any] = []  # Zenoh undeclares what is no longer referenced

    def publisher(self, *key: str) -> Callable[[bytes, bytes], None]:
        """Declare a publisher; returns put(payload, attachment), which blocks while the link is full."""
        publisher = self._session.declare_publisher(
            self.config.key(*key),
            congestion_control=zenoh.CongestionControl.BLOCK,
            reliability=zenoh.Reliability.RELIABLE,
        )
        self._declarations.append(publisher)

        def put(payload: bytes, attachment: bytes) -> None:
            publisher.put(payload, attachment=attachment)

        return put

    def put(self, payload: bytes, *key: str) -> None:
        """Publish once."""
        self._session.put(self.config.key(*key), payload, congestion_control=zenoh.CongestionControl.BLOCK)

    def subscribe(self, on_sample: Callable[[str, bytes, bytes], None], *key: str) -> None:
        """Call on_sample(key, payload, attachment) on Zenoh's thread for each sample; it must return at once."""

        def deliver(sample: Any) -> None:
            attachment = sample.attachment.to_bytes() if sample.attachment is not None else b""
            on_sample(str(sample.key_expr), sample.payload.to_bytes(), attachment)

        handler: Any = zenoh.handlers.Callback(deliver, indirect=False)
        self._declarations.append(self._session.declare_subscriber(self.config.key(*key), handler))

    def serve(self, on_query: Callable[[IncomingQuery], None], *key: str) -> None:
        """Declare a queryable; on_query runs on Zenoh's thread and must return at once, the reply may come later."""

        def deliver(query: Any) -> None:
            on_query(IncomingQuery(query))

        handler: Any = zenoh.handlers.Callback(deliver, indirect=False)
        self._declarations.append(self._session.declare_queryable(self.config.key(*key), handler, complete=True))

    def ask(self, payload: bytes, timeout_s: float, *key: str) -> bytes:
        """Send a request and wait for its reply; raises QueryError when there is none in time, or an error reply."""
        name = self.config.key(*key)
        for reply in self._session.get(name, payload=payload, timeout=timeout_s):
            if reply.ok is not None:
                return bytes(reply.ok.payload.to_bytes())
            text = reply.err.payload.to_bytes() if reply.err is not None else b""
            if text == b"Timeout":
                raise QueryError(f"{name}: no reply within {timeout_s:g} s")
            raise QueryError(f"{name}: {text.decode(errors='replace') or 'an error without a text'}")
        raise QueryError(f"{name}: nobody answers at {self.config.endpoint}: no run with a grounding node, or it ended")

    def declare_alive(self, name: str) -> None:
        """Hold a liveliness token until the session closes."""
        self._declarations.append(self._session.liveliness().declare_token(self.config.key("alive", name)))

    def watch_alive(self, on_change: Callable[[str, bool], None]) -> None:
        """Call on_change(name, present) for every liveliness token, also for those that exist already."""

        def deliver(sample: Any) -> None:
            on_change(str(sample.key_expr).rsplit("/", 1)[-1], sample.kind == zenoh.SampleKind.PUT)

        handler: Any = zenoh.handlers.Callback(deliver, indirect=False)
        subscriber = self._session.liveliness().declare_subscriber(self.config.key("alive", "*"), handler, history=True)
        self._declarations.append(subscriber)

    def close(self) -> None:
        """Undeclare everything and close; harmless when called again."""
        if not self._session.is_closed():
            self._session.close()  # type: ignore[no-untyped-call]

    def __enter__(self) -> Bus:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _refuse_taken_port(endpoint: str) -> None:
    # Zenoh sets options like SO_REUSEPORT on some systems, so two hubs on one port would share its clients.
    protocol, _, address = endpoint.partition("/")
    host, _, port = address.rpartition(":")
    if protocol != "tcp" or not port.isdigit() or int(port) == 0:
        return
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as probe:
        probe.settimeout(PROBE_TIMEOUT_S)  # another machine's address may swallow packets
        try:
            taken = probe.connect_ex((host.strip("[]"), int(port))) == 0
        except (OSError, OverflowError) as error:  # an unknown host, a port above 65535
            raise ConfigError(f"[bus] endpoint: cannot listen on {endpoint}: {error}") from None
    if taken:
        raise ConfigError(
            f"[bus] endpoint: {endpoint} is taken, another run may be up: stop it or set another endpoint"
        )


def free_endpoint() -> str:
    """A loopback TCP endpoint that was free a moment ago, for tests and private runs."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"
