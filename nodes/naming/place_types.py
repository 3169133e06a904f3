"""The types of rooms and locations that places are named by, unless the settings list others."""

# the types that HM3DSem and ScanNet annotate most in homes
ROOM_TYPES = (
    "bathroom", "bedroom", "dining room", "garage", "hallway", "kitchen", "laundry room", "living room", "office",
    "playroom", "storage room",
)  # fmt: skip
# chosen by hand after the paper's examples ("bed with bedside tables", "kitchen area")
LOCATION_TYPES = (
    "bathing area", "cooking area", "dining area", "entrance area", "laundry area", "media area", "music area",
    "play area", "reading area", "sitting area", "sleeping area", "storage area", "washing area", "work area",
)  # fmt: skip
