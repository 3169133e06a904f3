"""Right answers, time and calls on the questions of tests/nodes/grounding.

    python tests/measurements/grounding_answers.py [program|rules|deductive]... [-v]

Arguments choose modes (program, rules, deductive; all without any); -v prints the questions that were answered wrong.
"cpu s" is the time on the processor, which other jobs on the machine do not change; the node runs on one thread.
"""

import importlib.util
import json
import sys
import time
import tomllib
from pathlib import Path

import numpy as np

from placegraph.nodes.grounding import NODE, GroundingConfig
from placegraph.runtime.node import Context
from placegraph.runtime.query.request import MODES

QUESTIONS = Path(__file__).parents[1] / "nodes" / "grounding"
NOWHERE = (np.nan,) * 3


def house():
    spec = importlib.util.spec_from_file_location("house", QUESTIONS / "conftest.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def measure(node, made, entries, mode, verbose):
    """Right answers, seconds, seconds on the processor and calls, one each a question."""
    right, seconds, busy, calls = [], [], [], []
    for entry in entries:
        question = made.make_question(entry["text"], entry.get("viewpoint", NOWHERE), mode=mode)
        began, worked = time.monotonic(), time.process_time()
        (answer,) = node.step(question)
        seconds.append(time.monotonic() - began)
        busy.append(time.process_time() - worked)
        fields = json.loads(answer.json)
        calls.append(fields["llm_calls"])
        ids = entry["ids"]
        right.append(fields["object_id"] in ids if ids else fields["status"] == "not_in_map")
        if verbose and not right[-1]:
            print(f"  {entry['text']!r}: {fields['object_id']} {fields.get('error', '')}, right {ids}")
            print(f"    {json.dumps(fields['parse'])}\n    {fields['evidence'][:5]}")
    return right, seconds, busy, calls


def main(arguments):
    made = house()
    node = NODE(GroundingConfig(), Context())
    node.start()
    node.step(made.make_graph_message(made.make_house()))
    heads = ("questions", "mode", "exact id", "s p50", "s p95", "cpu s p50", "cpu s p95", "calls a question")
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}", flush=True)
    for name in ("questions.toml", "questions_held_out.toml"):
        entries = tomllib.loads((QUESTIONS / name).read_text())["question"]
        for mode in [mode for mode in MODES if mode in arguments] or MODES:
            right, seconds, busy, calls = measure(node, made, entries, mode, "-v" in arguments)
            times = " | ".join(
                f"{np.percentile(values, share):.2f}" for values in (seconds, busy) for share in (50, 95)
            )
            print(f"| {name} | {mode} | {sum(right)}/{len(right)} | {times} | {np.mean(calls):.2f} |", flush=True)
    node.stop()


main(sys.argv[1:])
