"""Trains the location network on simulated scans of rooms (room_scans.py) with the true outlines as labels."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import Tensor

from placegraph.nodes.hierarchy.birds_eye_view import SIZE_PX, birds_eye_image
from placegraph.nodes.hierarchy.floors import FloorSpan
from placegraph.nodes.hierarchy.locations import LocationConfig
from placegraph.nodes.hierarchy.plan_grid import PlanGrid
from placegraph.runtime.arrays import F32, F64, U8
from placegraph.runtime.errors import SourceError
from placegraph.tools.simulator.house_frames import generate_house
from placegraph.tools.training import training_loop as loop
from placegraph.tools.training.location_network import LocationNetwork, LocationTargets, losses
from placegraph.tools.training.room_scans import RoomScan, add_mapping_errors, join, read_scans, scan_rooms, write_scans

TRAINING_SEEDS = range(20_000, 40_000)
VARIANTS = 2  # walks through each house
BATCH = 12
RATE = 2e-3
MIN_OBJECTS = 1  # a location with fewer mapped objects is no target
JOINED = 0.12  # share of samples that are two rooms in one
THIN_M = 0.04  # fewer points make the samples faster; the image closes such gaps
NEXT_M = 0.4  # neighbouring rooms are nearer than this


def simulate_scans(seeds: range, folder: Path) -> None:
    """Simulates VARIANTS walks through each house and stores them in `folder`; existing files are kept."""
    folder.mkdir(parents=True, exist_ok=True)
    for seed in seeds:
        files = [folder / f"{seed}_{variant}.npz" for variant in range(VARIANTS)]
        if all(file.exists() for file in files):
            continue
        house = generate_house(seed)
        for variant, file in enumerate(files):
            write_scans(scan_rooms(house, variant), file)


class LocationSamples:
    """Random rooms of stored scans with mapping errors, rotated, mirrored and scaled, from one seed."""

    def __init__(self, folder: Path, seed: int) -> None:
        """Read all scans of `folder`; raises SourceError when there is none."""
        files = sorted(folder.glob("*_*.npz"), key=lambda file: [int(part) for part in file.stem.split("_")])
        self._houses = [
            [thin_out(scan) for scan in read_scans(file)] for file in files if file.stem.replace("_", "").isdigit()
        ]
        self._rooms = [(i, k) for i, house in enumerate(self._houses) for k, scan in enumerate(house) if scan.objects]
        if not self._rooms:
            raise SourceError(f"{folder}: no scans; simulate them with write_houses")
        self._random = np.random.default_rng(seed)
        self._order: list[int] = []

    def sample(self) -> tuple[U8, LocationTargets]:
        """The next image (SIZE_PX, SIZE_PX, 3) and its targets; every room comes once before any is repeated."""
        if not self._order:
            self._order = self._random.permutation(len(self._rooms)).tolist()
        house, k = self._rooms[self._order.pop()]
        scan = self._houses[house][k]
        if self._random.random() < JOINED:
            near = [neighbor for neighbor in self._houses[house] if neighbor is not scan and _adjacent(scan, neighbor)]
            if near:
                scan = join(scan, near[int(self._random.integers(len(near)))])
        scan = add_mapping_errors(scan, self._random, missing=float(self._random.uniform(0, 0.35)))
        return birds_eye_sample(random_transform(scan, self._random))


def thin_out(scan: RoomScan) -> RoomScan:
    """The room with one point of each object in a cell of THIN_M."""
    objects = []
    for xyz in scan.objects:
        _, first = np.unique(np.floor(xyz / THIN_M).astype(np.int64), axis=0, return_index=True)
        objects.append(xyz[np.sort(first)])
    return replace(scan, objects=tuple(objects))


def random_transform(scan: RoomScan, random: np.random.Generator) -> RoomScan:
    """The room rotated by any angle about z, perhaps mirrored, slightly scaled."""
    angle, scale = random.uniform(0, 2 * np.pi), np.exp(random.uniform(-0.12, 0.12))
    c, s = np.cos(angle) * scale, np.sin(angle) * scale
    flat = np.array([[c, -s], [s, c]]) @ np.diag([random.choice([-1, 1]), 1])
    solid = np.eye(3, dtype=np.float32)
    solid[:2, :2] = flat
    middle = (scan.rectangle[:2] + scan.rectangle[2:]) / 2
    shift = np.append(middle, 0).astype(np.float32)
    return replace(
        scan,
        objects=tuple(np.asarray((xyz - shift) @ solid.T, np.float32) for xyz in scan.objects),
        outlines=tuple((xy - middle) @ flat.T for xy in scan.outlines),
    )


def birds_eye_sample(scan: RoomScan) -> tuple[U8, LocationTargets]:
    """The bird's-eye image of a scan, and boxes and masks of the locations of which enough was mapped."""
    image, grid = birds_eye_image(scan.objects, span_of(scan), LocationConfig().band_high_share)
    seen = np.bincount([location for location in scan.location if location >= 0], minlength=len(scan.outlines))
    boxes, masks = [], []
    for outline in (xy for xy, count in zip(scan.outlines, seen, strict=True) if count >= MIN_OBJECTS):
        xy = np.clip((outline - grid.origin) / grid.cell_m, 0, SIZE_PX)
        boxes.append(np.concatenate((xy.min(axis=0), xy.max(axis=0))))
        masks.append(coarse_mask(outline, grid))
    return image, LocationTargets(
        torch.from_numpy(np.array(boxes, np.float32).reshape(-1, 4)),
        torch.from_numpy(np.array(masks, np.float32).reshape(-1, SIZE_PX // 4, SIZE_PX // 4)),
    )


def coarse_mask(outline: F64, grid: PlanGrid) -> F32:
    """(SIZE_PX / 4, SIZE_PX / 4) share of each coarse cell that is inside an outline (K, 2), metres, world frame."""
    pixels = np.round((outline - grid.origin) / grid.cell_m - 0.5).astype(np.int32)
    mask = cv2.fillPoly(np.zeros(grid.shape, np.float32), [pixels], 1.0)
    return np.asarray(cv2.resize(mask, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA), np.float32)


def span_of(scan: RoomScan) -> FloorSpan:
    """The floor's heights as the hierarchy would find them."""
    return FloorSpan(scan.low_m, scan.high_m, scan.low_m, scan.high_m)


def train_locations(data: Path, checkpoint: Path, steps: int, seed: int = 3, threads: int = 1) -> LocationNetwork:
    """Trains on the scans of `data`, resuming from `checkpoint`; returns the averaged network."""
    torch.manual_seed(seed)
    torch.set_num_threads(threads)
    samples = LocationSamples(data, seed)
    network = LocationNetwork().to(memory_format=torch.channels_last)  # type: ignore[call-overload]

    def step(i: int) -> dict[str, Tensor]:
        batch = [samples.sample() for _ in range(BATCH)]
        images = torch.from_numpy(np.stack([image for image, _ in batch])).permute(0, 3, 1, 2).float() / 255
        with torch.autocast("cpu", dtype=torch.bfloat16):
            outputs = network(images.contiguous(memory_format=torch.channels_last))
        return losses(outputs, [shown for _, shown in batch], SIZE_PX)

    trained: LocationNetwork = loop.fit(network, step, steps=steps, rate=RATE, checkpoint=checkpoint)
    return trained


def _adjacent(a: RoomScan, b: RoomScan) -> bool:
    gap = np.maximum(a.rectangle[:2] - b.rectangle[2:], b.rectangle[:2] - a.rectangle[2:]).max()
    return bool(a.floor == b.floor and gap < NEXT_M)
