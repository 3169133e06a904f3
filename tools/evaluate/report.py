"""Scores as text: a line for each layer, and tables of equal columns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any


def number(value: float, digits: int = 3) -> str:
    """A number with so many digits behind the point; a dash where it is not defined."""
    return "-" if math.isnan(value) else f"{value:.{digits}f}"


def plain(value: Any) -> Any:
    """Scores as JSON has them: floats to 4 digits, null where one is not defined."""
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items()}
    if isinstance(value, float):
        return None if math.isnan(value) else round(value, 4)
    return value


def table(rows: Sequence[Sequence[str]]) -> str:
    """Rows of equal length as aligned columns: the first to the left, the others to the right."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join(
        "  ".join(cell.rjust(w) if i else cell.ljust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True)))
        for row in rows
    )


def house_text(scores: dict[str, Any], per_class: bool) -> str:
    """Scores of a house, as house.house_scores gives them, in words."""
    floors, rooms, places, things = (scores[name] for name in ("floors", "rooms", "locations", "objects"))
    curve = " ".join(f"{delta}:{number(f1, 2)}" for delta, f1 in places["f1_at"].items())
    lines = [
        f"floors     {floors['truth']} true, {floors['map']} in the map, {floors['right']} with both boundaries within "
        f"0.5 m (mean error {number(floors['boundary_error_m'], 2)} m)",
        f"rooms      {rooms['truth']} of {rooms['of']} seen, {rooms['map']} in the map: F1 {number(rooms['f1'])}, "
        f"precision {number(rooms['precision'])}, recall {number(rooms['recall'])} at IoU 0.5; Hydra precision "
        f"{number(rooms['hydra_precision'])}, recall {number(rooms['hydra_recall'])}",
        f"locations  {places['truth']} of {places['of']} seen, {places['map']} in the map: F1 by IoU {curve}",
        f"objects    {things['truth']} of {things['of']} seen well, {things['map']} in the map ({things['aside']} set "
        f"aside): recall {number(things['recall'])}, precision {number(things['precision'])}, mean IoU "
        f"{number(things['mean_iou'])}, {number(things['map_per_found'], 2)} map objects for each found one; recall at "
        f"IoU 0.5 {number(things['recall_50'])}, whatever the name {number(things['recall_any_name'])}",
    ]
    top = things["top_k"]
    if top["objects"]:
        curve = ", ".join(f"{k.replace('_', ' ')} {number(top[k])}" for k in top if k.startswith("top_"))
        lines.append(
            f"names      AUC top-k {number(top['auc'])} of {top['objects']} objects and {top['classes']} classes; "
            f"{curve}"
        )
    if "connections" in scores:
        lines += _connections(scores["connections"])
    if per_class:
        heads = ("truth", "found", "map", "wrong")
        rows_of = [(name, *(str(row[head]) for head in heads)) for name, row in things["classes"].items()]
        lines += ["", table([("class", *heads), *rows_of])]
    if "questions" in scores:
        lines += ["", _questions(scores["questions"])]
    return "\n".join(lines)


def _questions(scores: dict[str, Any]) -> str:
    heads = list(scores["all"])
    rows = [("form", *(head.replace("_", " ") for head in heads))]
    for form, row in [*scores["forms"].items(), ("all", scores["all"])]:
        cells = (str(row[head]) if isinstance(row[head], int) else number(row[head], 2) for head in heads)
        rows.append((form, *cells))
    return table(rows)


def _connections(scores: dict[str, Any]) -> list[str]:
    """Scores as connections.connection_scores gives them."""
    travel = scores["travel"]
    lines = []
    for name in ("doors", "stairs"):
        row, error = scores[name], number(scores[name]["width_error_m"], 2)
        lines.append(
            f"{name.ljust(11)}{row['truth']} of {row['of']} between rooms seen, {row['map']} in the map: precision "
            f"{number(row['precision'])}, recall {number(row['recall'])}, width off by {error} m"
        )
    ratios = f"{number(travel['least_ratio'], 2)} to {number(travel['largest_ratio'], 2)}"
    return [
        *lines,
        f"travel     {number(travel['mean_ratio'])} of the true length on average between {travel['pairs']} pairs of "
        f"them on one floor, {ratios}",
    ]
