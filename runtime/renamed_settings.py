"""Settings that have another name than in earlier versions, so that an old file is refused with the new key."""

from __future__ import annotations

# `<node>.<path of keys>` to the new path; one line each, in alphabetical order
RENAMED_SETTINGS = {
    "fusion.least_score": "fusion.min_score",
    "fusion.submap.least_move_m": "fusion.submap.min_move_m",
    "fusion.submap.least_turn_deg": "fusion.submap.min_turn_deg",
    "hierarchy.locations.least_area_m2": "hierarchy.locations.min_area_m2",
    "hierarchy.locations.least_objects": "hierarchy.locations.min_objects",
    "hierarchy.rooms.least_slice_m": "hierarchy.rooms.min_slice_m",
    "pose.initial_threshold_m": "pose.kiss_icp.initial_threshold_m",
    "pose.max_innovation_m": "pose.kiss_icp.max_innovation_m",
    "pose.max_points_per_voxel": "pose.kiss_icp.max_points_per_voxel",
    "pose.min_motion_m": "pose.kiss_icp.min_motion_m",
    "pose.min_points": "pose.kiss_icp.min_points",
    "pose.min_quality": "pose.kiss_icp.min_quality",
    "pose.relock_quality": "pose.kiss_icp.min_quality_after_loss",
    "pose.rgbd.coast_s": "pose.rgbd.max_coasting_s",
    "pose.rgbd.features.keypoints": "pose.rgbd.features.max_keypoints",
    "pose.rgbd.features.least_inliers": "pose.rgbd.features.min_inliers",
    "pose.rgbd.features.least_met": "pose.rgbd.features.min_overlap",
    "pose.rgbd.features.ratio": "pose.rgbd.features.lowe_ratio",
    "pose.rgbd.features.surface.least_noise_m": "pose.rgbd.features.surface.min_noise_m",
    "pose.rgbd.features.surface.noise": "pose.rgbd.features.surface.noise_per_m",
    "pose.rgbd.features.surface.reach_m": "pose.rgbd.features.surface.max_distance_m",
    "pose.rgbd.features.trials": "pose.rgbd.features.ransac_trials",
    "pose.rgbd.least_inliers": "pose.rgbd.min_inliers",
    "pose.rgbd.least_met": "pose.rgbd.min_overlap",
    "pose.rgbd.least_share": "pose.rgbd.min_inlier_share",
    "pose.rgbd.places": "pose.rgbd.max_remembered_views",
    "pose.rgbd.track.back_px": "pose.rgbd.track.max_forward_backward_px",
    "pose.rgbd.track.corners": "pose.rgbd.track.max_corners",
    "pose.rgbd.track.levels": "pose.rgbd.track.pyramid_levels",
    "pose.rgbd.track.patches_below": "pose.rgbd.track.min_corner_inliers",
    "pose.rgbd.track.reference_share": "pose.rgbd.track.min_reference_overlap",
    "pose.rgbd.track.surface.least_noise_m": "pose.rgbd.track.surface.min_noise_m",
    "pose.rgbd.track.surface.noise": "pose.rgbd.track.surface.noise_per_m",
    "pose.rgbd.track.surface.reach_m": "pose.rgbd.track.surface.max_distance_m",
    "pose.rgbd.tries": "pose.rgbd.max_candidates",
    "pose.voxel_m": "pose.kiss_icp.voxel_m",
    "pose_graph.level.least_share": "pose_graph.level.min_share",
    "pose_graph.level.near_rad": "pose_graph.level.max_angle_rad",
    "pose_graph.level.rounds": "pose_graph.level.iterations",
    "pose_graph.loop_m": "pose_graph.loop_sigma_m",
    "pose_graph.loop_rad": "pose_graph.loop_sigma_rad",
    "pose_graph.loops.apart": "pose_graph.loops.min_candidate_gap",
    "pose_graph.loops.features.keypoints": "pose_graph.loops.features.max_keypoints",
    "pose_graph.loops.features.least_inliers": "pose_graph.loops.features.min_inliers",
    "pose_graph.loops.features.least_met": "pose_graph.loops.features.min_overlap",
    "pose_graph.loops.features.ratio": "pose_graph.loops.features.lowe_ratio",
    "pose_graph.loops.features.surface.least_noise_m": "pose_graph.loops.features.surface.min_noise_m",
    "pose_graph.loops.features.surface.noise": "pose_graph.loops.features.surface.noise_per_m",
    "pose_graph.loops.features.surface.reach_m": "pose_graph.loops.features.surface.max_distance_m",
    "pose_graph.loops.features.trials": "pose_graph.loops.features.ransac_trials",
    "pose_graph.loops.least_likeness": "pose_graph.loops.min_layout_correlation",
    "pose_graph.loops.reach_m": "pose_graph.loops.max_distance_m",
    "pose_graph.loops.skip": "pose_graph.loops.skip_newest",
    "pose_graph.loops.still_m": "pose_graph.loops.min_motion_m",
    "pose_graph.loops.still_rad": "pose_graph.loops.min_turn_rad",
    "pose_graph.loops.surprise_m": "pose_graph.loops.max_deviation_m",
    "pose_graph.loops.surprise_rad": "pose_graph.loops.max_deviation_rad",
    "pose_graph.loops.surprise_share": "pose_graph.loops.deviation_share",
    "pose_graph.loops.tries": "pose_graph.loops.max_candidates",
    "pose_graph.loops.tries_by_look": "pose_graph.loops.max_layout_candidates",
    "pose_graph.loops.turn_rad": "pose_graph.loops.max_angle_rad",
    "pose_graph.moved_m": "pose_graph.min_correction_m",
    "pose_graph.moved_rad": "pose_graph.min_correction_rad",
    "pose_graph.odometry_m": "pose_graph.odometry_sigma_m",
    "pose_graph.odometry_rad": "pose_graph.odometry_sigma_rad",
    "pose_graph.pull_m": "pose_graph.min_loop_error_m",
    "pose_graph.pull_rad": "pose_graph.min_loop_error_rad",
    "pose_graph.slack": "pose_graph.keyframes_before_loop",
}


def setting_error(node: str, path: tuple[str, ...], reason: str) -> str:
    """One line for a refused setting of a node: `[nodes.<node>] key: reason`, or the new key of a renamed one."""
    key = ".".join(path)
    new = RENAMED_SETTINGS.get(f"{node}.{key}")
    if new is not None:
        new_node, _, new_key = new.partition(".")
        reason = f"this setting is now called {new_key}" + (f" of [nodes.{new_node}]" if new_node != node else "")
    return f"[nodes.{node}] {key}: {reason}"
