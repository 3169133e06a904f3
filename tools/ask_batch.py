"""`placegraph ask-batch`: answer a file of questions about maps or object lists in one process."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from placegraph.runtime.query.request import make_question
from placegraph.tools.query.offline_query import OfflineQuery
from placegraph.tools.query.question_file import LineAnswerer, answer_all


def ask_batch(
    questions: Annotated[Path, typer.Argument(metavar="QUESTIONS", help="A file of JSON lines with id and text.")],
    out: Annotated[Path, typer.Option(help="The file for the answers, JSON lines in the same order.")],
    graph: Annotated[
        Path | None, typer.Option(help="Map folder, graph file or object list, for lines that name none.")
    ] = None,
    k: Annotated[int, typer.Option(help="How many candidates to list.")] = 5,
    mode: Annotated[str, typer.Option(help="As of `placegraph ask`.")] = "program",
) -> None:
    """Answer a file of questions about saved maps or object lists."""
    make_question("-", k=k, mode=mode)  # checks the options once, not in every line
    with OfflineQuery() as query:
        if graph is not None:
            query.check(graph)
        counts = answer_all(LineAnswerer(query, questions.parent, graph, k=k, mode=mode), questions, out)
    print(f"{counts.text()}: {out}")
