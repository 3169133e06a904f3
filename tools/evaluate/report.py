"""Scores as text: a line for each layer, and tables with aligned columns."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from placegraph.tools.evaluate.network_metrics import mean_of_defined
from placegraph.tools.evaluate.place_overlap import BOUNDARY_M


def number(value: float, digits: int = 3) -> str:
    """A number with so many digits after the point; a dash for NaN."""
    return "-" if math.isnan(value) else f"{value:.{digits}f}"


def plain(value: Any) -> Any:
    """Scores for JSON: floats to 4 digits, null for NaN."""
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, float):
        return None if math.isnan(value) else round(value, 4)
    return value


def table(rows: Sequence[Sequence[str]], left: Sequence[int] = (0,)) -> str:
    """Rows of equal length as aligned columns: those in `left` to the left, the others to the right."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join(
        "  ".join(
            cell.ljust(w) if i in left else cell.rjust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    )


COLUMNS = (  # of a table of maps: head, keys that lead to the number, its factor, digits
    ("ATE m", ("ate_rmse_m",), 1, 3),
    ("ATE %", ("ate_share",), 100, 2),
    ("path m", ("path_m",), 1, 1),
    ("floor P", ("floors", "precision"), 1, 2),
    ("floor R", ("floors", "recall"), 1, 2),
    ("room P", ("rooms", "precision"), 1, 2),
    ("room R", ("rooms", "recall"), 1, 2),
    ("room F1", ("rooms", "f1"), 1, 3),
    ("Hydra P", ("rooms", "hydra_precision"), 1, 2),
    ("Hydra R", ("rooms", "hydra_recall"), 1, 2),
    ("loc F1@.5", ("locations", "f1_at", "0.5"), 1, 3),
    ("obj P", ("objects", "precision"), 1, 3),
    ("obj R", ("objects", "recall"), 1, 3),
    ("obj IoU", ("objects", "mean_iou"), 1, 3),
    ("per found", ("objects", "map_per_found"), 1, 2),
    ("room names", ("place_names", "rooms", "top_1"), 1, 2),
    ("AUC", ("objects", "top_k", "auc"), 1, 3),
)


def means(rows: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """The mean of each column over the maps that have it, by the column's head; NaN where none does."""
    return {
        head: mean_of_defined(np.array([_value(row, keys) * factor for row in rows]))
        for head, keys, factor, _ in COLUMNS
    }


def maps_text(rows: Mapping[str, Mapping[str, Any]], averages: Mapping[str, Mapping[str, float]]) -> str:
    """A table of scores by label, then of means by label; columns without any value are left out."""
    shown = [column for column in COLUMNS if any(not math.isnan(_value(row, column[1])) for row in rows.values())]
    lines = [("map", *(head for head, *_ in shown))]
    for label, row in rows.items():
        lines.append((label, *(number(_value(row, keys) * factor, digits) for _, keys, factor, digits in shown)))
    for label, mean in averages.items():
        lines.append((label, *(number(mean[head], digits) for head, _, _, digits in shown)))
    return table(lines)


def _value(scores: Any, keys: Sequence[str]) -> float:
    for key in keys:
        scores = scores.get(key) if isinstance(scores, Mapping) else None
    return float("nan") if scores is None else float(scores)


def map_text(scores: Mapping[str, Any], per_class: bool) -> str:
    """Scores of one map in words: a line for each layer, and which layers the truth does not have."""
    lines = [_trajectory(scores)] if "ate_rmse_m" in scores else []
    layer_lines = {"floors": _floors, "rooms": _rooms, "locations": _locations, "objects": _objects}
    lines += [line for layer, text in layer_lines.items() if layer in scores for line in text(scores[layer])]
    absent = [layer for layer in layer_lines if layer not in scores]
    if len(absent) < len(layer_lines):
        lines += [f"{layer:<10} not in the truth: not scored" for layer in absent]
        if "ate_rmse_m" not in scores:
            lines.append("trajectory not in the truth: not scored; both frames are taken as equal")
    if "place_names" in scores:
        lines += [_place_names(layer, row) for layer, row in scores["place_names"].items()]
    if "connections" in scores:
        lines += _connections(scores["connections"])
    if per_class and "objects" in scores:
        lines += ["", _classes(scores["objects"]["classes"])]
    if "questions" in scores:
        lines += ["", _questions(scores["questions"])]
    return "\n".join(lines)


def _place_names(layer: str, row: Mapping[str, Any]) -> str:
    right = f"first name {number(row['top_1'])}, one of three {number(row['top_3'])}"
    return f"names of {layer}: {right}, of {row['judged']} that lie in one true place"


def _trajectory(scores: Mapping[str, Any]) -> str:
    of = f" of {scores['poses_given']}" if "poses_given" in scores else ""  # the rest is untrusted
    words = "ATE rmse {ate_rmse_m} m, max {ate_max_m} m, over {poses}{of} poses and {path_m} m of path".format(
        **scores, of=of
    )
    return (
        f"{words}: {number(100 * scores['ate_share'], 2)} % of it; RPE over 1 m of path "
        f"{number(scores['rpe_m'])} m, {number(scores['rpe_deg'], 2)} degrees"
    )


def _floors(row: Mapping[str, Any]) -> list[str]:
    return [
        f"floors     {row['truth']} of {row['of']} seen, {row['map']} in the map, {row['right']} with both boundaries "
        f"within {BOUNDARY_M:g} m: precision {number(row['precision'])}, recall {number(row['recall'])}, mean error "
        f"{number(row['boundary_error_m'], 2)} m"
    ]


def _rooms(row: Mapping[str, Any]) -> list[str]:
    return [
        f"rooms      {row['truth']} of {row['of']} seen, {row['map']} in the map: F1 {number(row['f1'])}, "
        f"precision {number(row['precision'])}, recall {number(row['recall'])} at IoU 0.5; Hydra precision "
        f"{number(row['hydra_precision'])}, recall {number(row['hydra_recall'])}"
    ]


def _locations(row: Mapping[str, Any]) -> list[str]:
    curve = " ".join(f"{delta}:{number(f1, 2)}" for delta, f1 in row["f1_at"].items())
    return [f"locations  {row['truth']} of {row['of']} seen, {row['map']} in the map: F1 by IoU {curve}"]


def _objects(row: Mapping[str, Any]) -> list[str]:
    lines = [
        f"objects    {row['truth']} of {row['of']} seen well, {row['map']} in the map ({row['aside']} set "
        f"aside): recall {number(row['recall'])}, precision {number(row['precision'])}, mean IoU "
        f"{number(row['mean_iou'])}, {number(row['map_per_found'], 2)} map objects for each found one "
        f"({number(row['map_per_found_any_name'], 2)} whatever the name); recall at IoU 0.5 "
        f"{number(row['recall_50'])}, at 0.25 whatever the name {number(row['recall_any_name'])}"
    ]
    top = row["top_k"]
    if top["objects"]:
        curve = ", ".join(f"{k.replace('_', ' ')} {number(top[k])}" for k in top if k.startswith("top_"))
        lines.append(
            f"names      AUC top-k {number(top['auc'])} of {top['objects']} objects and {top['classes']} classes; "
            f"{curve}"
        )
    return lines


def _classes(classes: Mapping[str, Mapping[str, int]]) -> str:
    heads = ("truth", "found", "map", "wrong")
    return table([("class", *heads), *((name, *(str(row[head]) for head in heads)) for name, row in classes.items())])


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
    ratios = f"{number(travel['min_ratio'], 2)} to {number(travel['max_ratio'], 2)}"
    return [
        *lines,
        f"travel     {number(travel['mean_ratio'])} of the true length on average between {travel['pairs']} pairs of "
        f"them on one floor, {ratios}",
    ]
