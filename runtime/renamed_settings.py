"""Settings that have another name than in earlier versions, so that an old file is refused with the new key."""

from __future__ import annotations

# `<node>.<path of keys>` to the new path; one line each, in alphabetical order
RENAMED_SETTINGS = {
    "fusion.least_score": "fusion.min_score",
    "fusion.submap.least_move_m": "fusion.submap.min_move_m",
    "fusion.submap.least_turn_deg": "fusion.submap.min_turn_deg",
    "grounding.location_types": "naming.location_types",
    "grounding.name_places": "naming.method",
    "grounding.room_types": "naming.room_types",
    "hierarchy.locations.least_area_m2": "hierarchy.locations.min_area_m2",
    "hierarchy.locations.least_objects": "hierarchy.locations.min_objects",
    "hierarchy.rooms.least_slice_m": "hierarchy.rooms.min_slice_m",
    "pose.rgbd.least_inliers": "pose.rgbd.min_inliers",
    "pose.rgbd.least_met": "pose.rgbd.min_met",
    "pose.rgbd.least_share": "pose.rgbd.min_share",
    "pose_graph.level.least_share": "pose_graph.level.min_share",
    "pose_graph.loops.least_likeness": "pose_graph.loops.min_likeness",
}


def setting_error(node: str, path: tuple[str, ...], reason: str) -> str:
    """One line for a refused setting of a node: `[nodes.<node>] key: reason`, or the new key of a renamed one."""
    key = ".".join(path)
    new = RENAMED_SETTINGS.get(f"{node}.{key}")
    if new is not None:
        new_node, _, new_key = new.partition(".")
        reason = f"this setting is now called {new_key}" + (f" of [nodes.{new_node}]" if new_node != node else "")
    return f"[nodes.{node}] {key}: {reason}"
