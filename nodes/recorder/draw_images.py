"""Draw what the camera sees: colour, depth, tags, boxes and masks."""

from __future__ import annotations

import cv2
import numpy as np
import rerun as rr

from placegraph.nodes.recorder.drawing import Canvas, color_of, markdown
from placegraph.runtime import messages as m
from placegraph.runtime.arrays import F64

JPEG_QUALITY = 80  # 45 kB at 640x480, for viewing only: the exact image is in /messages
IMAGE = "world/camera/image"
FRUSTUM_M = 0.35  # distance of the image from the camera in the 3D view
FRUSTUM_COLOR = (255, 255, 255)
MAX_TAGS = 12


def draw_frame(canvas: Canvas, frame: m.Frame, pngs: dict[str, bytes]) -> None:
    """The camera's image of every frame."""
    _draw_camera(canvas, frame, pngs["depth"])


def draw_keyframe(canvas: Canvas, keyframe: m.Keyframe, pngs: dict[str, bytes]) -> None:
    """The camera and its image; a recording of all frames has drawn them already."""
    if not canvas.frames:
        draw_camera_pose(canvas, keyframe.world_from_camera)
        _draw_camera(canvas, keyframe, pngs["depth"])


def draw_camera_pose(canvas: Canvas, world_from_camera: F64) -> None:
    """Put the camera, with its image and frustum, at a (4, 4) pose."""
    transform = rr.Transform3D(translation=world_from_camera[:3, 3], mat3x3=world_from_camera[:3, :3])
    canvas.log("world/camera", transform)


def _draw_camera(canvas: Canvas, image: m.Frame | m.Keyframe, depth_png: bytes) -> None:
    height, width = image.depth.shape
    fx, fy, cx, cy = image.intrinsics
    pinhole = rr.Pinhole(
        image_from_camera=np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]),
        resolution=[width, height],
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=FRUSTUM_M,
        color=FRUSTUM_COLOR,
    )
    canvas.image_size = (height, width)
    canvas.log(IMAGE, pinhole)
    bgr = cv2.cvtColor(image.color, cv2.COLOR_RGB2BGR)
    jpeg = bytes(cv2.imencode(".jpg", bgr, (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))[1].data)
    canvas.log(f"{IMAGE}/color", rr.EncodedImage(contents=jpeg, media_type="image/jpeg"))
    depth = rr.EncodedDepthImage(
        depth_png, media_type="image/png", meter=1.0 / image.depth_unit_m, colormap="turbo", depth_range=[0.0, 6.0]
    )
    canvas.log(f"{IMAGE}/depth", depth)


def draw_tags(canvas: Canvas, tags: m.Tags, pngs: dict[str, bytes]) -> None:
    """The image's tags as a list, best first."""
    lines = [f"- **{markdown(name)}** {score:.2f}" for name, score in zip(tags.names, tags.scores, strict=True)]
    omitted = [f"and {len(lines) - MAX_TAGS} more"] if len(lines) > MAX_TAGS else []
    text = "\n".join([f"Frame {tags.frame_id}", "", *(lines[:MAX_TAGS] or ["nothing recognised"]), *omitted])
    canvas.log("tags", rr.TextDocument(text, media_type="text/markdown"))


def draw_detections(canvas: Canvas, detections: m.Detections, pngs: dict[str, bytes]) -> None:
    """Named boxes over the image."""
    labels = [f"{name} {score:.2f}" for name, score in zip(detections.names, detections.scores, strict=True)]
    boxes = rr.Boxes2D(
        array=detections.boxes_px,
        array_format=rr.Box2DFormat.XYXY,
        labels=labels,
        show_labels=True,
        colors=np.array([color_of(name) for name in detections.names], np.uint8).reshape(-1, 3),
        draw_order=30.0,
    )
    canvas.log(f"{IMAGE}/detections", boxes)


def draw_segments(canvas: Canvas, segments: m.Segments, pngs: dict[str, bytes]) -> None:
    """Masks over the image, in the colours of their names."""
    # Before the first image the masks span their own boxes.
    size = np.maximum(canvas.image_size, segments.boxes_px[:, [3, 2]].max(axis=0, initial=1))
    # Lowest score first: where masks overlap, the better one is visible.
    order = np.argsort(segments.scores, kind="stable")
    ids, masks = canvas.classes(segments.names), list(segments.masks())
    classes = np.zeros(size, np.uint8 if max(ids, default=0) < 256 else np.uint16)
    for i in order.tolist():
        x0, y0, x1, y1 = segments.boxes_px[i].tolist()
        classes[y0:y1, x0:x1][masks[i]] = ids[i]
    canvas.log(f"{IMAGE}/masks", rr.SegmentationImage(classes, opacity=0.45, draw_order=20.0))
