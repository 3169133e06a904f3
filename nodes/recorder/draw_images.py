"""Draw what the camera sees: colour, depth, tags, boxes and masks."""

from __future__ import annotations

import cv2
import numpy as np
import rerun as rr

from placegraph.nodes.recorder.drawing import Picture, color_of, markdown
from placegraph.runtime import messages as m
from placegraph.runtime.arrays import F64

JPEG_QUALITY = 80  # for the eye: 45 kB at 640x480, the exact image lies in /messages
IMAGE = "world/camera/image"
FRUSTUM_M = 0.35  # how far before the camera its image hangs in the 3D view
FRUSTUM_COLOR = (255, 255, 255)
MAX_TAGS = 12


def draw_frame(picture: Picture, frame: m.Frame, pngs: dict[str, bytes]) -> None:
    """The camera's image, of every frame."""
    _draw_camera(picture, frame, pngs["depth"])


def draw_keyframe(picture: Picture, keyframe: m.Keyframe, pngs: dict[str, bytes]) -> None:
    """The camera where it saw this image; in a recording of all frames they are drawn already."""
    if not picture.frames:
        draw_camera_pose(picture, keyframe.world_from_camera)
        _draw_camera(picture, keyframe, pngs["depth"])


def draw_camera_pose(picture: Picture, world_from_camera: F64) -> None:
    """Put the camera, and so its image and frustum, at a (4, 4) pose."""
    transform = rr.Transform3D(translation=world_from_camera[:3, 3], mat3x3=world_from_camera[:3, :3])
    picture.log("world/camera", transform)


def _draw_camera(picture: Picture, image: m.Frame | m.Keyframe, depth_png: bytes) -> None:
    height, width = image.depth.shape
    fx, fy, cx, cy = image.intrinsics
    pinhole = rr.Pinhole(
        image_from_camera=np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]),
        resolution=[width, height],
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=FRUSTUM_M,
        color=FRUSTUM_COLOR,
    )
    picture.image_size = (height, width)
    picture.log(IMAGE, pinhole)
    bgr = cv2.cvtColor(image.color, cv2.COLOR_RGB2BGR)
    jpeg = bytes(cv2.imencode(".jpg", bgr, (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))[1].data)
    picture.log(f"{IMAGE}/color", rr.EncodedImage(contents=jpeg, media_type="image/jpeg"))
    depth = rr.EncodedDepthImage(
        depth_png, media_type="image/png", meter=1.0 / image.depth_unit_m, colormap="turbo", depth_range=[0.0, 6.0]
    )
    picture.log(f"{IMAGE}/depth", depth)


def draw_tags(picture: Picture, tags: m.Tags, pngs: dict[str, bytes]) -> None:
    """The image's tags as a list, best first."""
    lines = [f"- **{markdown(name)}** {score:.2f}" for name, score in zip(tags.names, tags.scores, strict=True)]
    rest = [f"and {len(lines) - MAX_TAGS} more"] if len(lines) > MAX_TAGS else []
    text = "\n".join([f"Frame {tags.frame_id}", "", *(lines[:MAX_TAGS] or ["nothing recognised"]), *rest])
    picture.log("tags", rr.TextDocument(text, media_type="text/markdown"))


def draw_detections(picture: Picture, detections: m.Detections, pngs: dict[str, bytes]) -> None:
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
    picture.log(f"{IMAGE}/detections", boxes)


def draw_segments(picture: Picture, segments: m.Segments, pngs: dict[str, bytes]) -> None:
    """Masks over the image, in the colours of their names."""
    # Without an image so far the masks span their own boxes.
    size = np.maximum(picture.image_size, segments.boxes_px[:, [3, 2]].max(axis=0, initial=1))
    # Worst first: where masks overlap, the better one is seen.
    order = np.argsort(segments.scores, kind="stable")
    ids, masks = picture.classes(segments.names), list(segments.masks())
    classes = np.zeros(size, np.uint8 if max(ids, default=0) < 256 else np.uint16)
    for i in order.tolist():
        x0, y0, x1, y1 = segments.boxes_px[i].tolist()
        classes[y0:y1, x0:x1][masks[i]] = ids[i]
    picture.log(f"{IMAGE}/masks", rr.SegmentationImage(classes, opacity=0.45, draw_order=20.0))
