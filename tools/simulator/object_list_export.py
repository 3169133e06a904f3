"""A house as an object list (docs, "Other data"), for questions without images."""

from __future__ import annotations

from typing import Any

import numpy as np

from placegraph.tools.simulator.house_model import House


def object_list(house: House) -> dict[str, Any]:
    """Items by their ids, with their class, box and colour word; rooms with type and outline; floors with heights."""
    boxes = [placed.box for placed in house.items]
    return {
        "objects": [
            {
                "id": placed.id,
                "tags": [placed.item.name],
                "center": np.round(box.mean(axis=0), 4).tolist(),
                "size": np.round(box[1] - box[0], 4).tolist(),
                "color": placed.item.color_name or None,
                "room": placed.room,
            }
            for placed, box in zip(house.items, boxes, strict=True)
        ],
        "rooms": [
            {"id": room.id, "name": room.type, "floor": room.floor, "outline": np.round(room.polygon, 4).tolist()}
            for room in house.rooms
        ],
        "floors": [
            {"id": floor.index, "bottom": floor.z_m, "top": floor.z_m + floor.height_m} for floor in house.floors
        ],
    }
