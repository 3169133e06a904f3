"""Ask a running map where something is, over Zenoh alone: this machine needs `eclipse-zenoh`, but not placegraph.

    python examples/ask_over_zenoh.py "which chair is closest to the table" [tcp/127.0.0.1:7447]

On the other side: `placegraph run CONFIG --stay`. Prints the reply as JSON; docs and README explain its fields.
"""

import json
import sys

import zenoh


def main(text: str, endpoint: str = "tcp/127.0.0.1:7447") -> None:
    """Send one request and print the reply."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    with zenoh.open(config) as session:
        for reply in session.get("placegraph/ask", payload=json.dumps({"text": text}), timeout=60):
            print(reply.ok.payload.to_string())


if __name__ == "__main__":
    main(*sys.argv[1:])
