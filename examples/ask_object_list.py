"""Ask about objects that another system detected: boxes with names, no images and no map.

    python examples/ask_object_list.py "the chair next to the table"

The language model that comes with placegraph parses the request. Prints the object's own id and the evidence.
"""

import json
import sys
import tempfile
from pathlib import Path

from placegraph.runtime.query.request import make_question
from placegraph.tools.query.offline_query import OfflineQuery

ROOM = {  # metres, z up; only id, tags, center and size are needed
    "objects": [
        {"id": "red chair", "tags": ["chair"], "center": [0, 0, 0.5], "size": [0.5, 0.5, 1], "color": "red"},
        {"id": "other chair", "tags": ["chair"], "center": [3, 0, 0.5], "size": [0.5, 0.5, 1]},
        {"id": "table", "tags": ["table"], "center": [3, 1, 0.4], "size": [1, 1, 0.8]},
    ]
}


def main(text: str) -> None:
    """Answer one request about ROOM."""
    with tempfile.TemporaryDirectory() as folder, OfflineQuery() as query:
        file = Path(folder) / "room.json"
        file.write_text(json.dumps(ROOM))
        reply = query.ask(file, make_question(text))
    print(reply["status"], reply["object_id"])
    for sentence in reply["evidence"]:
        print(f"  {sentence}")


if __name__ == "__main__":
    main(*sys.argv[1:])
