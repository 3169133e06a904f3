"""Settings that were renamed or removed, so that an old configuration file is refused with a helpful reason."""

from __future__ import annotations

# `<node>.<path of keys>` to the new path; one line each, in alphabetical order
RENAMED_SETTINGS = {
    "fusion.least_score": "fusion.min_score",
    "fusion.submap.least_move_m": "fusion.submap.min_move_m",
    "fusion.submap.least_turn_deg": "fusion.submap.min_turn_deg",
    "hierarchy.locations.least_area_m2": "hierarchy.locations.min_area_m2",
    "hierarchy.locations.least_objects": "hierarchy.locations.min_objects",
    "hierarchy.rooms.least_slice_m": "hierarchy.rooms.min_slice_m",
    "keyframe.lost_after_s": "keyframe.pose_timeout_s",
    "pose.rgbd.least_inliers": "pose.rgbd.min_inliers",
    "pose.rgbd.least_met": "pose.rgbd.min_met",
    "pose.rgbd.least_share": "pose.rgbd.min_share",
    "pose_graph.level.least_share": "pose_graph.level.min_share",
    "pose_graph.loops.least_likeness": "pose_graph.loops.min_likeness",
}

# `<node>.<path of keys>` to the reason why there is no such setting any more
REMOVED_SETTINGS = {
    "keyframe.in_flight": "the bus bounds the keyframes that wait for slow models",
}
