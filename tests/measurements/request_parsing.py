"""How well requests are parsed: `python tests/measurements/request_parsing.py [adapter,examples,plain,rules] [-v]`.

On the 100 human-written sentences whose programs were written by hand (human_programs.jsonl; the sentences lie in
../shared), and on 300 generated ones with nouns and phrasings that training never says. "noun": the target's noun.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.nodes.grounding.llm_parser import default_adapter_path, parse_by_examples, parse_by_model
from placegraph.nodes.grounding.name_matching import NameMatcher
from placegraph.nodes.grounding.program import Thing, normalized
from placegraph.nodes.grounding.program_syntax import format_program, parse_program
from placegraph.nodes.grounding.reasoner import Reasoner
from placegraph.nodes.naming.place_types import LOCATION_TYPES, ROOM_TYPES
from placegraph.runtime.errors import QueryError
from placegraph.runtime.language.language_model import LanguageModel
from placegraph.runtime.scene_graph import GraphNode, SceneGraph
from placegraph.tools.training.request_grammar import examples

ROOT = Path(__file__).parents[2]
PROGRAMS = ROOT / "tests" / "nodes" / "grounding" / "human_programs.jsonl"
SENTENCES = ROOT.parent / "shared" / "data" / "language" / "human_requests.jsonl"


def people():
    """Human-written sentences with the programs that are right."""
    lines = SENTENCES.read_text("utf-8").splitlines()
    for line in PROGRAMS.read_text("utf-8").splitlines():
        label = json.loads(line)
        yield json.loads(lines[label["line"]])["text"], label["programs"]


def by_rules(text):
    box = np.zeros((2, 3))
    building = GraphNode(id="B0", parent="", tags=(), box=box, footprint=box[:, :2], first_frame=-1, last_frame=-1)
    graph = SceneGraph.of([building])
    reasoner = Reasoner(NameMatcher(TextEncoder().encode), None, (*ROOM_TYPES, *LOCATION_TYPES), use_model=False)
    return reasoner.parse(graph, text).target, 1.0


def main(arguments):
    adapter = Path(next((a for a in arguments if a.endswith(".gguf")), default_adapter_path()))
    model = LanguageModel(adapter_path=adapter)
    ways = {
        "adapter": lambda text: (lambda r: (r.thing or Thing(), r.confidence))(parse_by_model(model, text)),
        "plain": lambda text: (lambda r: (r.thing or Thing(), r.confidence))(
            parse_by_model(model, text, use_adapter=False)
        ),
        "examples": lambda text: (lambda r: (r.thing or Thing(), r.confidence))(parse_by_examples(model, text)),
        "rules": by_rules,
    }
    kept = [(one.text, [one.program]) for one in examples(1_000_003, 500, 300, held_out=True)]
    heads = ("sentences", "read by", "exact program", "noun", "s p50", "s p95", "confidence right, wrong")
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for name, cases in (("100 of people", list(people())), ("300 generated", kept)):
        for way in next((a.split(",") for a in arguments if a[0] != "-" and not a.endswith(".gguf")), ["adapter"]):
            exact, noun, seconds, sure = [], [], [], []
            for text, programs in cases:
                began = time.monotonic()
                try:
                    thing, confidence = ways[way](text)
                except QueryError:
                    thing, confidence = Thing(), 0.0
                seconds.append(time.monotonic() - began)
                right = [normalized(parse_program(program)) for program in programs]
                exact.append(normalized(thing) in right)
                noun.append(normalized(thing).noun in {one.noun for one in right})
                sure.append(confidence)
                if "-v" in arguments and not exact[-1]:
                    print(f"  {text!r}\n     {format_program(thing)}\n     {' | '.join(programs)}  ({confidence:.2f})")
            ok, sure = np.array(exact), np.array(sure)
            parts = f"{np.median(sure[ok]) if ok.any() else 0:.3f}, {np.median(sure[~ok]) if (~ok).any() else 0:.3f}"
            times = f"{np.percentile(seconds, 50):.2f} | {np.percentile(seconds, 95):.2f}"
            print(f"| {name} | {way} | {ok.mean():.3f} | {np.mean(noun):.3f} | {times} | {parts} |", flush=True)
    model.close()


if __name__ == "__main__":
    main(sys.argv[1:])
