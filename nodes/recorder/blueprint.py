"""The layout in which a recording opens: the world, and around it the images, the scene graph, texts and plots."""

from __future__ import annotations

import rerun.blueprint as rrb

from placegraph.runtime.recording import FRAME


def opening_view(frames: bool) -> rrb.Blueprint:
    """The viewer's first layout. `frames`: every camera frame is drawn, not keyframes alone."""
    until_now = rrb.VisibleTimeRanges(
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
        overrides={"world/path": until_now},
    )
    image = "world/camera/image"
    images = rrb.Tabs(
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
    texts_and_plots = rrb.Horizontal(
        rrb.TextDocumentView(origin="answers", name="Answer"),
        rrb.TextDocumentView(origin="tags", name="Tags"),
        plots,
        column_shares=[3, 2, 4],
    )
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(world, texts_and_plots, row_shares=[5, 2]),
            rrb.Vertical(images, rrb.GraphView(origin="graph", name="Scene graph"), row_shares=[2, 3]),
            column_shares=[5, 3],
        ),
        # Show the newest state: a live run as it grows, a finished one with its whole map.
        rrb.TimePanel(timeline=FRAME, state="collapsed", play_state="following"),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
    )
