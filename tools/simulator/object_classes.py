"""Object classes of the simulator and the words for them.

The first of `training_words` is the name of the class. `held_out_words` never occur in training; evaluation uses them
to test whether the detector generalises through the text encoder.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ObjectClass:
    """One class with the words of training and the words kept for evaluation."""

    training_words: tuple[str, ...]
    held_out_words: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The name in the ground truth."""
        return self.training_words[0]


CLASSES: tuple[ObjectClass, ...] = (
    # seats
    ObjectClass(("chair", "dining chair", "kitchen chair", "wooden chair"), ("seat",)),
    ObjectClass(("armchair", "easy chair", "recliner"), ("lounge chair",)),
    ObjectClass(("office chair", "desk chair", "swivel chair"), ("computer chair",)),
    ObjectClass(("stool", "bar stool", "footstool"), ("barstool",)),
    ObjectClass(("bench", "wooden bench", "hallway bench")),
    ObjectClass(("sofa", "settee", "loveseat"), ("couch",)),
    # tables
    ObjectClass(("table", "dining table", "kitchen table"), ("dinner table",)),
    ObjectClass(("coffee table", "low table", "living room table"), ("tea table",)),
    ObjectClass(("desk", "writing desk", "computer desk", "workstation"), ("office desk",)),
    ObjectClass(("nightstand", "bedside table", "night table"), ("bedside cabinet",)),
    # beds and storage
    ObjectClass(("bed", "double bed", "single bed"), ("mattress",)),
    ObjectClass(("wardrobe", "armoire"), ("closet",)),
    ObjectClass(("bookshelf", "bookcase", "shelf"), ("shelving unit",)),
    ObjectClass(("dresser", "bureau"), ("chest of drawers",)),
    ObjectClass(("cabinet", "sideboard", "credenza"), ("cupboard",)),
    ObjectClass(("shoe rack", "shoe shelf"), ("shoe stand",)),
    ObjectClass(("coat rack", "coat stand"), ("hat stand",)),
    # electronics
    ObjectClass(("tv", "television", "tv screen"), ("telly",)),
    ObjectClass(("monitor", "computer monitor", "computer screen"), ("display",)),
    ObjectClass(("keyboard", "computer keyboard")),
    ObjectClass(("laptop", "notebook computer"), ("laptop computer",)),
    ObjectClass(("printer", "inkjet printer"), ("laser printer",)),
    ObjectClass(("speaker", "stereo"), ("loudspeaker",)),
    # kitchen
    ObjectClass(("refrigerator", "fridge freezer"), ("fridge",)),
    ObjectClass(("stove", "cooker", "range"), ("oven",)),
    ObjectClass(("sink", "washbasin", "kitchen sink"), ("basin",)),
    ObjectClass(("kitchen counter", "countertop", "worktop"), ("kitchen unit",)),
    ObjectClass(("microwave", "microwave oven"), ("microwave cooker",)),
    ObjectClass(("kettle", "electric kettle"), ("teakettle",)),
    ObjectClass(("toaster", "bread toaster")),
    ObjectClass(("coffee machine", "coffee maker"), ("espresso machine",)),
    # bathroom and laundry
    ObjectClass(("toilet", "loo"), ("lavatory",)),
    ObjectClass(("bathtub", "bath tub"), ("tub",)),
    ObjectClass(("shower", "shower cabin")),
    ObjectClass(("mirror", "looking glass"), ("wall mirror",)),
    ObjectClass(("towel", "bath towel"), ("hand towel",)),
    ObjectClass(("washing machine", "laundry machine"), ("washer",)),
    ObjectClass(("laundry basket", "hamper"), ("clothes basket",)),
    ObjectClass(("ironing board",)),
    # light and decoration
    ObjectClass(("lamp", "floor lamp", "table lamp"), ("standing lamp",)),
    ObjectClass(("ceiling lamp", "pendant lamp"), ("ceiling light",)),
    ObjectClass(("potted plant", "plant", "house plant"), ("houseplant",)),
    ObjectClass(("vase", "flower vase"), ("flowerpot",)),
    ObjectClass(("picture", "painting", "picture frame"), ("artwork",)),
    ObjectClass(("clock", "wall clock"), ("timepiece",)),
    ObjectClass(("rug", "carpet"), ("floor mat",)),
    ObjectClass(("curtain", "drapes"), ("curtains",)),
    ObjectClass(("pillow", "cushion"), ("throw pillow",)),
    # things
    ObjectClass(("cup", "coffee cup", "teacup"), ("mug",)),
    ObjectClass(("bowl", "dish"), ("salad bowl",)),
    ObjectClass(("bottle", "wine bottle", "water bottle"), ("flask",)),
    ObjectClass(("book", "books"), ("novel",)),
    ObjectClass(("box", "carton"), ("cardboard box",)),
    ObjectClass(("trash can", "waste bin"), ("garbage can",)),
    ObjectClass(("suitcase", "travel bag"), ("luggage",)),
    ObjectClass(("backpack", "rucksack"), ("school bag",)),
    ObjectClass(("ball", "football"), ("soccer ball",)),
    ObjectClass(("teddy bear", "stuffed animal"), ("stuffed toy",)),
    ObjectClass(("guitar", "acoustic guitar"), ("electric guitar",)),
    ObjectClass(("piano", "pianoforte"), ("upright piano",)),
    ObjectClass(("bicycle", "bike"), ("mountain bike",)),
    ObjectClass(("radiator", "heater")),
    # parts of the building that questions ask for like objects
    ObjectClass(("door", "room door"), ("doorway",)),
    ObjectClass(("window", "glass window"), ("windowpane",)),
    ObjectClass(("stairs", "staircase"), ("stairway",)),
)
NAMES: tuple[str, ...] = tuple(object_class.name for object_class in CLASSES)
