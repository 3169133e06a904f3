import threading

import psutil
import pytest

from placegraph.runtime.bus.session import Bus, BusConfig, IncomingQuery
from placegraph.runtime.errors import ConfigError, QueryError

pytestmark = pytest.mark.bus


def test_hub_and_clients_exchange_messages_in_order(bus_config, wait_until) -> None:
    with Bus(bus_config, hub=True) as hub, Bus(bus_config) as producer, Bus(bus_config) as consumer:
        got: list[tuple[bytes, bytes]] = []
        consumer.subscribe(lambda key, payload, attachment: got.append((payload, attachment)), "topic", "x")
        consumer.declare_alive("taker")
        present = threading.Event()
        producer.watch_alive(lambda name, alive: present.set() if name == "taker" and alive else None)
        put = producer.publisher("topic", "x")
        assert present.wait(10)
        for i in range(50):
            put(bytes([i]) * 100_000, i.to_bytes(8))
        wait_until(lambda: len(got) == 50, "50 messages")
        assert [int.from_bytes(attachment) for _, attachment in got] == list(range(50))
        assert hub.config is bus_config


def test_only_the_given_loopback_endpoint_listens(bus_config) -> None:
    before = {c.laddr for c in psutil.Process().net_connections("inet") if c.status in ("LISTEN", "NONE")}
    with Bus(bus_config, hub=True), Bus(bus_config):
        now = {c.laddr for c in psutil.Process().net_connections("inet") if c.status in ("LISTEN", "NONE")}
    opened = now - before
    assert {(ip, port) for ip, port in opened} == {("127.0.0.1", int(bus_config.endpoint.rsplit(":")[-1]))}


def test_second_hub_on_one_endpoint_is_refused(bus_config) -> None:
    with Bus(bus_config, hub=True), pytest.raises(ConfigError, match="is taken, another run may be up"):
        Bus(bus_config, hub=True)


@pytest.mark.parametrize(
    "endpoint", ["nonsense/1", "", "tcp/127.0.0.1", "tcp/127.0.0.1:99999", "tcp/no-such-host.invalid:7447"]
)
def test_unusable_endpoint_is_named(endpoint: str) -> None:
    with pytest.raises(ConfigError, match=rf"\[bus\] endpoint: cannot listen on {endpoint}: "):
        Bus(BusConfig(endpoint=endpoint), hub=True)


def test_nobody_there(bus_config, monkeypatch) -> None:
    monkeypatch.setattr("placegraph.runtime.bus.session.CONNECT_TIMEOUT_MS", 300)
    with pytest.raises(ConfigError, match="cannot reach a running placegraph at"):
        Bus(bus_config)


def test_questions_and_replies(bus_config) -> None:
    def on_request(request: IncomingQuery) -> None:
        if request.payload != b"silent":
            request.reply(b"re:" + request.payload)
            request.reply(b"ignored")
        else:
            kept.append(request)

    kept: list[IncomingQuery] = []
    with Bus(bus_config, hub=True), Bus(bus_config) as server, Bus(bus_config) as asker:
        with pytest.raises(QueryError, match="nobody answers"):
            asker.ask(b"x", 1.0, "ask")
        server.serve(on_request, "ask")
        server.declare_alive("server")
        ready = threading.Event()
        asker.watch_alive(lambda name, alive: ready.set())
        assert ready.wait(10)
        assert asker.ask(b"x", 5.0, "ask") == b"re:x"
        with pytest.raises(QueryError, match=r"no reply within 0\.3 s"):
            asker.ask(b"silent", 0.3, "ask")
        kept[0].reply(b"late")  # harmless: nobody waits any more


def test_an_error_reply_is_raised(bus_config) -> None:
    with Bus(bus_config, hub=True), Bus(bus_config) as server, Bus(bus_config) as client:
        ready = threading.Event()
        server.serve(lambda query: query._query.reply_err(b"no such map"), "ask")
        server.declare_alive("server")
        client.watch_alive(lambda name, alive: ready.set())
        assert ready.wait(10)
        with pytest.raises(QueryError, match="test/ask: no such map"):
            client.ask(b"x", 5.0, "ask")
