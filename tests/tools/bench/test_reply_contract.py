"""2,000 hostile requests to the query server and the node; and whether a broken reply would be noticed."""

import json
import re

import pytest

from placegraph.nodes.grounding import GroundingNode
from placegraph.runtime.messages import Answer, Question
from placegraph.tools.bench.reply_contract import fuzz

FAST = {"use_model": False}


def test_two_thousand_requests_get_replies_that_keep_the_contract() -> None:
    outcome = fuzz(2000, mode="rules", seed=0, floors=1, settings=FAST)
    assert outcome.faults == []
    assert sum(outcome.statuses.values()) == len(outcome.ms) == 2000
    found = sum(count for (kind, status), count in outcome.statuses.items() if (kind, status) == ("real", "found"))
    asked = sum(count for (kind, _), count in outcome.statuses.items() if kind == "real")
    assert found > asked / 2  # real ones between them are still understood
    assert outcome.statuses["noise", "found"] == outcome.statuses["cut", "found"] == 0
    assert outcome.grown_mb < 30


def test_the_language_model_keeps_it_too() -> None:
    outcome = fuzz(40, mode="program", seed=1, floors=1)
    assert outcome.faults == [] and len(outcome.ms) == 40


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"candidates": [{"id": "O999", "name": "chair", "score": 1, "evidence": []}]}, "the first candidate"),
        ({"route": ["C999"]}, r"ids that are not in the graph: \['C999'\]"),
        ({"evidence": ["it is beside O998"]}, r"ids that are not in the graph: \['O998'\]"),
        ({"secret": 1}, "Extra inputs"),
        ("raise", "ZeroDivisionError: by zero"),
        ("silent", "0 answers from the node"),
    ],
)
def test_a_broken_reply_is_a_fault(monkeypatch, change, fault) -> None:
    step = GroundingNode.step

    def broken(self, message):
        given = step(self, message)
        if not isinstance(message, Question) or json.loads(given[0].json)["status"] != "found":
            return given
        if change == "raise":
            raise ZeroDivisionError("by zero")
        if change == "silent":
            return []
        fields = json.loads(given[0].json) | change
        answer = Answer(frame_id=-1, stamp_ns=0, question_id=message.question_id, json=json.dumps(fields))
        return [answer]

    monkeypatch.setattr(GroundingNode, "step", broken)
    outcome = fuzz(12, mode="rules", seed=0, floors=1, settings=FAST)
    assert outcome.faults
    assert all(re.search(fault, found) for found in outcome.faults)
