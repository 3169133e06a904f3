"""Noise model of an OAK-D: exposure and noise of the colour camera, and depth by passive stereo.

Stereo measures disparity, which is focal length times baseline over depth. A constant error in disparity is a depth
error that grows with the square of the distance. Matching fails at edges, glare, and blank or grazing surfaces.
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist

import cv2
import numpy as np

from placegraph.runtime.arrays import F32, F64, U8, U16, Bool
from placegraph.runtime.errors import SourceError

NATIVE_WIDTH_PX = 640  # disparities below are in pixels of the mono cameras' 640 x 400 or 480 output


@dataclass(frozen=True, eq=False)
class RenderedView:
    """One noise-free rendering.

    color (H, W, 3) uint8 sRGB; depth_m (H, W) float32 along the optical axis, 0 where nothing is hit; instance (H, W)
    uint16, item id + 1, 0 for the building; shine (H, W) uint8, the greater of gloss and glow times 255, where stereo
    finds little to match.
    """

    color: U8
    depth_m: F32
    instance: U16
    shine: U8


@dataclass(frozen=True)
class SensorSettings:
    """Quality of the camera. The defaults imitate an OAK-D indoors; values without a source are chosen by hand."""

    # colour, in 8 bit levels after the camera's own processing
    exposure: float = 1.0  # differs by house, see sensor_settings
    white: tuple[float, float] = (1.0, 1.0)  # gains of red and blue that white balance leaves
    target_level: float = 118.0  # auto exposure steers the mean towards 18 % grey
    adaption: float = 0.6  # share of the way to the target level
    read_levels: float = 1.2
    shot_levels: float = 2.2  # at level 255; grows with the square root of the light
    vignette: float = 0.14  # share of light lost in the corners of a 69 degree lens
    blur_px: float = 0.55  # sigma at 640 px width: lens, demosaicing and scaling
    # depth: docs.luxonis.com, Configuring Stereo Depth (baseline, search range) and StereoDepth (subpixel)
    baseline_m: float = 0.075
    subpixel: int = 8  # steps per pixel: three fractional bits
    noise_px: float = 0.09  # sigma of disparity on a well textured surface, before rounding
    nearest_m: float = 0.35  # 400P: 441 px * 0.075 m / 95 px of search
    farthest_m: float = 9.0
    # failed matches, as shares of the pixels; chosen so that 85 to 95 % of a furnished room stay valid
    edge_share: float = 0.45
    fat_share: float = 0.45  # of edges where the nearer surface grows by up to two pixels
    blank_share: float = 0.075
    shiny_share: float = 0.5
    grazing: float = 4.5  # tangent of the viewing angle from where surfaces begin to drop out


def sensor_settings(seed: int) -> SensorSettings:
    """The settings of one house: exposure and white balance differ from house to house."""
    random = np.random.default_rng([seed, 7101])
    red, blue = random.normal(1, 0.025, 2).tolist()
    return SensorSettings(exposure=float(np.exp(random.normal(0, 0.1))), white=(red, blue))


DEFAULT_SETTINGS = SensorSettings()


def simulate_camera(
    view: RenderedView, intrinsics: F64, random: np.random.Generator, settings: SensorSettings = DEFAULT_SETTINGS
) -> tuple[U8, F32]:
    """Colour (H, W, 3) uint8 and depth (H, W) float32 metres along the axis, 0 unknown, as the camera gives them.

    `intrinsics` are fx fy cx cy in px. Raises SourceError when the arrays of the view differ in size.
    """
    if view.color.shape[:2] != view.depth_m.shape or view.shine.shape != view.depth_m.shape:
        raise SourceError(f"a view's colour {view.color.shape} and depth {view.depth_m.shape} are of different sizes")
    color = _add_color_noise(view.color, random, settings)
    return color, _stereo_depth(view, color, float(intrinsics[0]), random, settings)


def _add_color_noise(color: U8, random: np.random.Generator, settings: SensorSettings) -> U8:
    height, width = color.shape[:2]
    blurred = cv2.GaussianBlur(color, (3, 3), settings.blur_px * width / NATIVE_WIDTH_PX)
    mean = max(float(cv2.mean(blurred[::8, ::8])[1]), 8.0)
    gain = (settings.target_level / mean) ** settings.adaption * settings.exposure * random.normal(1, 0.02)
    gain = float(np.clip(gain, 0.6, 1.9))
    drift = random.normal(1, 0.008, 2)
    x, y = np.linspace(-1, 1, width, dtype=np.float32), np.linspace(-1, 1, height, dtype=np.float32)[:, None]
    falloff = gain * (1 - np.float32(settings.vignette / 2) * (x * x + y * y))
    # the sigma of a pixel follows from its green level
    levels = np.arange(256, dtype=np.float32)
    sigma = np.sqrt(settings.read_levels**2 + settings.shot_levels**2 * levels / 255) * np.sqrt(max(gain, 0.7))
    strength = cv2.LUT(blurred[..., 1], sigma.astype(np.float32))
    grain = random.standard_normal((height, width), dtype=np.float32) * strength
    shift = strength * np.float32(0.8)
    red, blue = (grain + shift * _smooth_noise(random, (height, width), 2) for _ in range(2))
    white = (settings.white[0] * drift[0], 1.0, settings.white[1] * drift[1])
    planes = [
        cv2.multiply(plane, falloff, scale=balance, dtype=cv2.CV_32F) + noise
        for plane, balance, noise in zip(cv2.split(blurred), white, (red, grain, blue), strict=True)
    ]
    return np.asarray(cv2.merge([cv2.convertScaleAbs(np.maximum(plane, 0)) for plane in planes]), np.uint8)


def _stereo_depth(
    view: RenderedView, color: U8, focal_px: float, random: np.random.Generator, settings: SensorSettings
) -> F32:
    shape, per_native = view.depth_m.shape, NATIVE_WIDTH_PX / view.depth_m.shape[1]
    span = np.float32(focal_px * per_native * settings.baseline_m)
    seen = (view.depth_m > 0).astype(np.uint8)
    true = np.asarray(span / np.maximum(view.depth_m, np.float32(0.05)) * seen, np.float32)
    kernel = np.ones((3, 3), np.uint8)
    nearer, farther = cv2.dilate(true, kernel), cv2.erode(true, kernel)
    edge: U8 = (nearer - farther > np.maximum(0.12 * nearer, 0.6)).astype(np.uint8)
    fat_edge: U8 = np.asarray(cv2.dilate(edge, kernel), np.uint8)
    edge_noise = _smooth_noise(random, shape, 6)
    disparity = np.where(
        (fat_edge > 0) & (edge_noise > _quantile(settings.fat_share)), cv2.dilate(nearer, kernel), true
    )
    strength = np.float32(settings.noise_px) * (1 + np.float32(0.5) * _textureless(color))
    disparity = disparity + strength * (
        np.float32(0.8) * _smooth_noise(random, shape, 2) + np.float32(0.6) * _smooth_noise(random, shape, 8)
    )
    disparity = np.round(disparity * np.float32(settings.subpixel)) / np.float32(settings.subpixel)
    depth = span / np.maximum(disparity, np.float32(0.05))
    lost = _unmatched_pixels(view, color, true, edge, fat_edge, focal_px, random, settings)
    known = (depth >= settings.nearest_m) & (depth <= settings.farthest_m) & (disparity > 0.1) & ~lost & (seen > 0)
    return np.asarray(depth * known, np.float32)


def _unmatched_pixels(
    view: RenderedView, color: U8, true: F32, edge: U8, fat_edge: U8, focal_px: float, random: np.random.Generator,
    settings: SensorSettings,
) -> Bool:  # fmt: skip
    """(H, W) where stereo finds no match: blobs on blank, overexposed and shiny surfaces, edges, grazing views."""
    shape = true.shape
    blob = _smooth_noise(random, shape, 12) * np.float32(0.85) + _smooth_noise(random, shape, 4) * np.float32(0.53)
    shiny = view.shine.astype(np.float32) * np.float32(1 / 255)
    blank = _textureless(color)
    level = blank * np.float32(settings.blank_share) + shiny * shiny * np.float32(settings.shiny_share)
    level += cv2.inRange(color, (251, 251, 251), (255, 255, 255)) * np.float32(0.3 / 255)
    along = cv2.GaussianBlur(true, (5, 5), 1.2)
    slope = cv2.magnitude(
        cv2.Sobel(along, cv2.CV_32F, 1, 0, scale=1 / 8), cv2.Sobel(along, cv2.CV_32F, 0, 1, scale=1 / 8)
    )
    # on a plane the disparity changes by disparity * tan(angle) / focal per pixel
    steep = slope * np.float32(focal_px) / np.maximum(along, np.float32(0.1))
    level += np.clip(steep - np.float32(settings.grazing), 0, 8) * np.float32(0.04) * (fat_edge == 0)
    level += edge * np.float32(settings.edge_share) + fat_edge * np.float32(0.1)
    return blob > _UPPER_QUANTILES.take(np.clip(level * 200, 0, 199).astype(np.intp))


def _textureless(color: U8) -> F32:
    """(H, W) 1 where the image has no detail to match, 0 from a contrast of about 24 levels around the pixel."""
    gray = cv2.blur(color[..., 1], (3, 3))
    contrast = cv2.blur(cv2.morphologyEx(gray, cv2.MORPH_GRADIENT, np.ones((5, 5), np.uint8)), (9, 9))
    return np.asarray(np.clip(1 - (contrast.astype(np.float32) - 5) * np.float32(1 / 18), 0, 1), np.float32)


def _smooth_noise(random: np.random.Generator, shape: tuple[int, ...], step: int) -> F32:
    """Normal noise (H, W) of about unit variance, smooth over `step` pixels."""
    size = (shape[0] // step + 2, shape[1] // step + 2)
    coarse = random.standard_normal(size, dtype=np.float32) * np.float32(1.5)  # interpolation averages variance away
    fine = cv2.resize(coarse, (size[1] * step, size[0] * step), interpolation=cv2.INTER_LINEAR)
    return np.asarray(fine[: shape[0], : shape[1]])


def _quantile(share: float) -> np.float32:
    """The number of sigmas above which a normal field has `share` of its values."""
    return np.float32(_UPPER_QUANTILES[int(np.clip(share * 200, 0, 199))])


def _upper_quantiles() -> F32:
    """Upper quantiles of the normal distribution for shares of 0, 1/200, ... of the pixels; 9 sigma for 0."""
    shares = [NormalDist().inv_cdf(1 - k / 200) for k in range(1, 200)]
    return np.array([9.0, *shares], np.float32)


_UPPER_QUANTILES = _upper_quantiles()
