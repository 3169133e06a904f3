"""How a recording opens: the world large, what the camera sees, the tree, the words and the plots around it."""

from __future__ import annotations

import rerun.blueprint as rrb

from placegraph.runtime.recording import FRAME


def opening_view(frames: bool) -> rrb.Blueprint:
    """The viewer's first layout. `frames`: the camera moves with every frame, not with keyframes alone."""
    so_far = rrb.VisibleTimeRanges(
        timeline=FRAME, start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.cursor_relative()
    )
    world = rrb.Spatial3DView(
        origin="world",
        name="World",
        contents=[
            "+ $origin/**",
            "- $origin/camera/image/depth",
            "- $origin/camera/image/detections",
            "- $origin/overhead",
        ],
        overrides={"world/path": so_far},
    )
    image = "world/camera/image"
    seen = rrb.Tabs(
        rrb.Spatial2DView(
            origin=image, name="Camera" if frames else "Keyframe", contents=["+ $origin/**", "- $origin/depth"]
        ),
        rrb.Spatial2DView(origin=image, name="Depth", contents=["+ $origin/depth"]),
    )
    plots = rrb.Tabs(
        rrb.TimeSeriesView(origin="pose", name="Pose quality"),
        rrb.TimeSeriesView(origin="health/step_ms", name="Step time, ms"),
        rrb.TimeSeriesView(origin="health/queue", name="Queues"),
        rrb.TimeSeriesView(origin="health/drops", name="Drops"),
        rrb.TimeSeriesView(origin="health/memory_mb", name="Memory, MB"),
        rrb.TextLogView(origin="log", name="Log"),
    )
    words = rrb.Horizontal(
        rrb.TextDocumentView(origin="answers", name="Answer"),
        rrb.TextDocumentView(origin="tags", name="Tags"),
        plots,
        column_shares=[3, 2, 4],
    )
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(world, words, row_shares=[5, 2]),
            rrb.Vertical(seen, rrb.GraphView(origin="graph", name="Scene graph"), row_shares=[2, 3]),
            column_shares=[5, 3],
        ),
        # A person wants the newest state first: of a live run as it grows, of a finished one its whole map.
        rrb.TimePanel(timeline=FRAME, state="collapsed", play_state="following"),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
    )
