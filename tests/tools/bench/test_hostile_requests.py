import json
from collections import Counter

from placegraph.runtime.errors import QueryError
from placegraph.runtime.query.request import parse_request
from placegraph.tools.bench.hostile_requests import KINDS, requests

TEXTS = ["the chair near the window", "find the lamp on the table, please"]


def test_requests_follow_from_the_seed_and_hold_every_kind() -> None:
    first = list(requests(TEXTS, 400, 3))
    assert first == list(requests(TEXTS, 400, 3)) != list(requests(TEXTS, 400, 4))
    assert {kind for kind, _ in first} == set(KINDS) and len(first) == 400


def test_real_ones_are_in_due_form_and_broken_ones_are_broken() -> None:
    accepted: Counter[str] = Counter()
    counts: Counter[str] = Counter()
    for kind, payload in requests(TEXTS, 1500, 0):
        counts[kind] += 1
        try:
            parse_request(payload)
            accepted[kind] += 1
        except QueryError:
            pass
    assert accepted["real"] == counts["real"] and accepted["mutated"] == counts["mutated"]
    assert accepted["noise"] == 0 and accepted["steering"] == counts["steering"]
    assert 0 < accepted["long"] < counts["long"] and 0 < accepted["wrong"] < counts["wrong"] / 2


def test_mutations_change_the_words() -> None:
    texts = {json.loads(payload)["text"] for kind, payload in requests(TEXTS, 300, 1) if kind == "mutated"}
    assert len(texts - set(TEXTS)) > 50
