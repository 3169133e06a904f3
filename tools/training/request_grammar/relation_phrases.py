"""Phrase templates by condition name; {} is the anchor with its article."""

from __future__ import annotations

# Behind the noun, or behind "is". The anchor follows directly.
PLACED: dict[str, tuple[str, ...]] = {
    "near": (
        "near {}", "next to {}", "beside {}", "by {}", "close to {}", "at {}", "right next to {}", "near to {}",
        "nearby {}",
        "adjacent to {}", "right by {}", "besides {}", "alongside {}", "directly next to {}", "not far from {}",
        "in the vicinity of {}", "around {}", "close by {}", "right beside {}", "to the side of {}", "next {}",
    ),
    "on": (
        "on {}", "on top of {}", "sitting on {}", "lying on {}", "laying on {}", "standing on {}", "resting on {}",
        "placed on {}",
        "hanging on {}", "mounted on {}", "hung on {}", "that sits on {}", "on the top of {}", "upon {}",
        "sitting on top of {}",
        "stacked on {}", "attached to {}",
    ),
    "under": (
        "under {}", "underneath {}", "below {}", "beneath {}", "directly under {}", "just below {}", "tucked under {}",
        "right under {}", "tucked underneath {}", "sitting under {}", "that is pushed under {}", "hidden under {}",
        "tucked into {}", "pushed into {}",
    ),
    "above": (
        "above {}", "over {}", "directly above {}", "right above {}", "hanging over {}", "mounted above {}",
        "just above {}",
        "hanging above {}", "that hangs over {}", "directly over {}", "up above {}",
    ),
    "in": ("in {}", "inside {}", "inside of {}", "within {}", "that is kept in {}", "lying in {}", "stored in {}"),
    "left": (
        "left of {}", "to the left of {}", "on the left of {}", "on the left side of {}", "to the left side of {}",
        "on the left hand side of {}", "directly to the left of {}", "just left of {}", "at the left of {}",
        "immediately to the left of {}", "on the left-hand side of {}", "directly left of {}",
    ),
    "right": (
        "right of {}", "to the right of {}", "on the right of {}", "on the right side of {}",
        "to the right side of {}",
        "on the right hand side of {}", "directly to the right of {}", "just right of {}", "at the right of {}",
        "immediately to the right of {}", "on the right-hand side of {}", "directly right of {}",
    ),
    "front": (
        "in front of {}", "directly in front of {}", "right in front of {}", "in the front of {}", "before {}",
        "standing in front of {}", "at the front of {}",
    ),
    "behind": (
        "behind {}", "directly behind {}", "in back of {}", "at the back of {}", "to the rear of {}",
        "right behind {}",
        "in the back of {}", "that stands behind {}",
    ),
    "across": (
        "across from {}", "opposite {}", "opposite of {}", "opposite to {}", "directly across from {}",
        "across the room from {}", "on the other side of the room from {}", "on the opposite side of the room from {}",
        "on the opposite wall from {}",
    ),
    "against": (
        "against {}", "touching {}", "pushed up against {}", "leaning against {}", "up against {}", "leaning on {}",
        "pushed against {}", "resting against {}", "placed against {}",
    ),
    "end": ("at the end of {}", "at the foot of {}", "at the head of {}", "on the end of {}", "at the far end of {}"),
    "along": (
        "on the same wall as {}", "on the same side as {}", "on the same side of the room as {}",
        "along the same wall as {}",
        "on the side of the room with {}", "on the wall with {}", "on the side with {}",
    ),
    "facing": ("facing {}", "turned towards {}", "that faces {}", "pointing at {}", "facing towards {}"),
    "corner": ("in the corner of {}", "at the corner of {}", "near the corner of {}"),
    "center": ("in the middle of {}", "in the center of {}", "at the center of {}", "in the centre of {}"),
    "closest": (
        "closest to {}", "nearest {}", "nearest to {}", "closer to {}", "that is closest to {}", "most close to {}",
        "the closest to {}", "nearer to {}", "the nearest to {}", "closest {}",
    ),
    "farthest": (
        "farthest from {}", "furthest from {}", "furthest away from {}", "away from {}", "far from {}",
        "far away from {}",
        "farthest away from {}", "further from {}", "farther from {}", "most distant from {}", "further away from {}",
        "the furthest from {}", "farther away from {}", "the furthest distance away from {}",
    ),
}  # fmt: skip
# Frequencies, roughly as in requests of people.
WEIGHTS = {
    "near": 20, "on": 13, "under": 7, "above": 7, "in": 2, "left": 5, "right": 5, "front": 6, "behind": 5, "across": 2,
    "against": 3, "end": 1.5, "along": 1.5, "facing": 1, "corner": 0.7, "center": 1, "closest": 14, "farthest": 8,
}  # fmt: skip

# What the target has, after "with", "that has", "without"; the name is the relation of the target.
HAVING: dict[str, tuple[str, ...]] = {
    "holds": ("{} on it", "{} on top", "{} on top of it", "{} in it", "{} inside", "{} sitting on it",
        "{} on them", "{} inside it",
              "{} lying on it", "{} stacked on it"),
    "with": ("{}", "{}", "{}", "{} attached", "{} at it"),
    "above": ("{} under it", "{} underneath", "{} below it", "{} beneath it", "{} underneath it", "{} tucked under it",
              "{} tucked underneath"),
    "under": ("{} above it", "{} over it", "{} hanging above it"),
    "near": ("{} next to it", "{} beside it", "{} nearby", "{} near it", "{} around it", "{} by it"),
    "behind": ("{} in front of it", "{} in front", "{} standing in front of it"),
    "front": ("{} behind it", "{} in back of it"),
}  # fmt: skip
HAVING_WEIGHTS = {"holds": 8, "with": 8, "above": 3, "under": 1, "near": 2, "behind": 2, "front": 1}
HOLDING = ("holding {}", "containing {}", "that holds {}", "that contains {}", "carrying {}", "full of {}")

# Without an anchor, behind the noun.
BARE: dict[str, tuple[str, ...]] = {
    "corner": ("in the corner", "in the corner of the room", "in a corner", "at the corner",
        "in one corner of the room",
               "tucked in the corner"),
    "center": ("in the middle of the room", "in the center of the room", "in the centre of the room",
        "in the room's center",
               "at the center of the room", "in the middle section of the room"),
    "alone": ("by itself", "all alone", "on its own", "all by itself", "standing alone", "off by itself",
        "isolated from the rest"),
    "leftmost": ("on the left", "to the left", "on the far left", "furthest left", "on the left side",
        "furthest to the left",
                 "on the left hand side", "farthest left", "at the left", "that is furthest to the left",
                 "on your left",
                 "on the left side of the room", "most left", "on left", "to your left"),
    "rightmost": ("on the right", "to the right", "on the far right", "furthest right", "on the right side",
        "furthest to the right",
                  "on the right hand side", "farthest right", "at the right", "that is furthest to the right",
                  "on your right",
                  "on the right side of the room", "most right", "on right", "to your right"),
    "frontmost": ("in front", "in the front", "at the front", "at the very front", "in the front row"),
    "backmost": ("in the back", "at the back", "in the very back", "at the back of the room", "at the very back",
        "in the back row",
                 "in the rear", "in the back of the room"),
    "middle": ("in the middle", "in the center", "in the middle of the row", "in between the others",
        "in the middle of them"),
    "highest": ("on top", "at the top", "highest up", "on the top"),
    "lowest": ("at the bottom", "lowest down", "on the bottom"),
    "closest": ("closest to me", "nearest to me", "closest to you", "nearest to where i am"),
    "farthest": ("farthest away", "furthest away", "farthest from me", "furthest from me"),
}  # fmt: skip
BARE_WEIGHTS = {
    "corner": 5, "center": 3, "alone": 2.5, "leftmost": 9, "rightmost": 9, "frontmost": 1.5, "backmost": 3, "middle": 3,
    "highest": 0.7, "lowest": 0.7, "closest": 0.7, "farthest": 0.7,
}  # fmt: skip
# Before the noun.
BEFORE: dict[str, tuple[str, ...]] = {
    "leftmost": ("left", "leftmost", "left most", "left-hand", "far left", "left-most", "lefthand", "furthest left"),
    "rightmost": ("right", "rightmost", "right most", "right-hand", "far right", "right-most", "righthand",
        "furthest right"),
    "middle": ("middle", "center", "central", "centre", "middlemost"),
    "frontmost": ("front", "front most", "foremost", "frontmost"),
    "backmost": ("back", "rear", "last", "rearmost", "backmost"),
    "largest": ("largest", "biggest", "larger", "bigger", "most large"),
    "smallest": ("smallest", "smaller", "tiniest", "littlest"),
    "tallest": ("tallest", "taller"),
    "shortest": ("shortest", "shorter"),
    "longest": ("longest", "longer", "widest", "wider"),
    "highest": ("highest", "upper", "top", "uppermost", "higher"),
    "lowest": ("lowest", "lower", "bottom", "lowermost"),
    "closest": ("closest", "nearest", "closer"),
    "farthest": ("farthest", "furthest", "further", "farther", "most distant"),
    "alone": ("solo", "lone", "isolated", "solitary"),
}  # fmt: skip
# Anchors that are part of the building, by relation.
BUILT = {"on": ("wall", "floor", "wall", "ground"), "against": ("wall",), "along": ("wall",), "above": ("floor",)}
BEFORE_WEIGHTS = {
    "leftmost": 6, "rightmost": 6, "middle": 4, "frontmost": 2, "backmost": 2, "largest": 6, "smallest": 6,
    "tallest": 2, "shortest": 1.5, "longest": 2, "highest": 2, "lowest": 2, "closest": 2, "farthest": 2, "alone": 0.7,
}  # fmt: skip
SIDES = {"leftmost": ("from the left", "from left", "on the left", "starting from the left", "counting from the left"),
         "rightmost": ("from the right", "from right", "on the right", "starting from the right",
             "counting from the right"),
         "backmost": ("from the back", "from the back of the room"), "frontmost": ("from the front",)}  # fmt: skip

LOOKING_FIRST: tuple[str, ...] = (
    "facing {}", "when facing {}", "if you are facing {}", "if you face {}", "looking at {}", "when looking at {}",
    "if you look at {}", "looking towards {}", "when you are facing {}", "standing in front of {}",
    "standing at the foot of {}",
    "standing in the middle of the room facing {}", "when standing in the middle of the room looking at {}", "face {}",
    "when you are looking/facing towards {}", "if looking at {} from the center of the room", "while facing {}",
    "looking straight at {}", "if you're looking at {}", "turn to face {}", "from the foot of {}", "as you look at {}",
    "with {} in front of you", "standing at the end of {}", "stand facing {}", "if you are looking straight on at {}",
)  # fmt: skip
LOOKING_LAST: tuple[str, ...] = (
    "when facing {}", "if you are facing {}", "as you face {}", "when looking at {}", "while facing {}",
    "if you look at {}",
    "when looking from the foot of {}", "when you face {}", "facing {}", "while standing at the foot of {}",
    "if you're facing {}", "from the perspective of facing {}", "when standing in front of {}",
)  # fmt: skip
FROM: tuple[str, ...] = (
    "standing at {}", "from {}", "when viewed from {}", "as seen from {}", "seen from {}", "if looking from {}",
    "when you enter through {}", "if you walk in through {}", "walking in through {}", "when lying on {}",
    "if you are lying on {}",
    "when sitting at {}", "sitting on {}", "if you sit on {}", "coming in from {}", "when you walk in {}",
    "entering by {}",
    "viewed from {}", "from the point of view of {}", "if you stand by {}", "when standing at {}",
    "when you come through {}",
    "when you walk through {}", "as you walk in {}", "as you enter {}", "when you just walked through {}",
    "when you walk in through {}", "turn like you just walked through {}",
)  # fmt: skip
ENTERING = (
    ("as you enter the room", "enter"), ("when you enter", "enter"), ("as you walk in",
    "walk in"), ("upon entering", "entering"),
    ("when you walk in", "walk in"), ("when entering the room", "entering"), ("as you come in", "come in"),
    ("if you just walk in", "walk in"), ("from the entrance", "entrance"), ("from the doorway", "doorway"),
)  # fmt: skip
BACK: tuple[str, ...] = (
    "with your back to {}", "with {} behind you", "with {} at your back", "with your back against {}",
    "with your back up to {}", "if {} is behind you", "turning your back to {}",
)  # fmt: skip
