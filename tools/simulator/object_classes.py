"""The classes of the house and the words for them: those of training, and synonyms that only evaluation says.

The first word of `said` is the class's name. `unsaid` words never occur in training: through the text encoder alone
must the detector understand them.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ObjectClass:
    """One class: the words used in training and the words kept for evaluation."""

    training_words: tuple[str, ...]
    held_out_words: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """What the truth calls it."""
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
    # parts of the building that are asked for like objects
    ObjectClass(("door", "room door"), ("doorway",)),
    ObjectClass(("window", "glass window"), ("windowpane",)),
    ObjectClass(("stairs", "staircase"), ("stairway",)),
)
NAMES: tuple[str, ...] = tuple(object_class.name for object_class in CLASSES)
