"""Vocabulary of the grammar: things, adjectives and places of homes and offices."""

from __future__ import annotations


def _words(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(",") if part.strip())


FURNITURE = _words(
    "table, chair, desk, bed, sofa, couch, armchair, office chair, coffee table, end table, side table, dining table, "
    "nightstand, bedside table, dresser, wardrobe, closet, cabinet, kitchen cabinet, file cabinet, filing cabinet, "
    "bookshelf, book shelf, bookcase, shelf, shelves, shelving unit, rack, shoe rack, coat rack, bench, stool, "
    "ottoman, "
    "sofa chair, loveseat, futon, bunk bed, crib, headboard, counter, kitchen counter, island, workbench, drawer, "
    "chest, "
    "drawers, cupboard, sideboard, tv stand, vanity, folding chair, rolling chair, recliner, bar stool, lounge chair, "
    "conference table, display case, locker, podium, lectern, cart, trolley, partition, divider, "
    "bean bag, "
    "daybed, mattress, beanbag chair, rocking chair, high chair, foosball table, ping pong table, pool table, "
    "piano bench, "
    "desk chair, dining chair, computer desk, work table, standing desk, console, hutch, pantry, credenza, footrest"
)
FIXTURES = _words(
    "door, window, sink, toilet, bathtub, shower, shower curtain, curtain, curtains, blinds, mirror, radiator, "
    "heater, "
    "stove, oven, range hood, fridge, refrigerator, mini fridge, microwave, dishwasher, washing machine, dryer, "
    "washer, fireplace, water heater, fan, ceiling fan, light, lamp, floor lamp, table lamp, desk lamp, "
    "ceiling light, "
    "light switch, outlet, power outlet, thermostat, faucet, towel rack, bar, hand rail, handrail, grab bar, railing, "
    "pipe, vent, pillar, column, staircase, stairs, banister, doorway, door frame, window sill, whiteboard, "
    "white board, "
    "blackboard, chalkboard, chalk board, bulletin board, notice board, board, dry erase board, screen, "
    "projector screen, "
    "projector, fire extinguisher, fire alarm, exit sign, mailbox, paper towel dispenser, soap dispenser, hand dryer, "
    "toilet paper dispenser, stall, urinal, vending machine, water cooler, elevator, air conditioner, smoke detector"
)
THINGS = _words(
    "trash can, trashcan, garbage can, garbage bin, recycling bin, recycle bin, waste basket, bin, bucket, box, "
    "cardboard box, storage box, crate, basket, laundry basket, laundry hamper, hamper, bag, backpack, duffel bag, "
    "purse, handbag, suitcase, luggage, briefcase, shoes, pair of shoes, shoe, boots, slippers, jacket, coat, hat, "
    "clothes, towel, towels, pillow, cushion, throw pillow, blanket, comforter, sheet, rug, carpet, mat, doormat, "
    "book, books, stack of books, magazine, newspaper, paper, papers, folder, binder, notebook, envelope, calendar, "
    "poster, "
    "picture, painting, photo, picture frame, map, clock, alarm clock, wall clock, vase, plant, potted plant, flower, "
    "flowers, statue, sculpture, candle, globe, trophy, toy, teddy bear, stuffed animal, doll, ball, guitar, piano, "
    "keyboard, mouse, monitor, computer monitor, computer, computer tower, tower, laptop, printer, copier, scanner, "
    "telephone, phone, tablet, camera, speaker, radio, tv, television, remote, headphones, charger, cable, "
    "power strip, "
    "cup, mug, glass, bottle, water bottle, wine bottle, bowl, plate, dish, pot, pan, kettle, tea kettle, "
    "coffee maker, "
    "toaster, blender, rice cooker, cutting board, knife block, paper towel roll, toilet paper, tissue box, soap, "
    "soap bottle, shampoo, toothbrush, hair dryer, scale, ironing board, iron, vacuum cleaner, broom, mop, ladder, "
    "umbrella, bicycle, bike, scooter, stroller, skateboard, dumbbell, yoga mat, treadmill, exercise bike, helmet, "
    "tool box, drill, hammer, bulletin, sign, flag, fish tank, cage, dog bed, cat tree, sewing machine, typewriter, "
    "record player, game console, pen holder, stapler, tape, scissors, ruler, lamp shade, hanger, cabinet door, tray, "
    "jar, can, container, cooler, paper cutter, shredder, easel, tripod, music stand, microphone, drum, violin, "
    "chess set, "
    "puzzle, lego set, candle holder, coaster, wine rack, spice rack, fruit bowl, banana, apple, orange, bread, cake"
)
# Rare things, which teach the reader to copy any word.
RARE = _words(
    "angel statue, anchor, antenna, anvil, aquarium, armor, axe, badge, bagpipe, balloon, barrel, beaker, bell, "
    "birdcage, "
    "bonsai, boombox, bowling pin, bust, cactus, cannon, canoe, cash register, centrifuge, chandelier, "
    "cocktail shaker, "
    "compass, crystal ball, dartboard, dehumidifier, disco ball, dreamcatcher, drone, dumpster, fax machine, "
    "figurine, "
    "filter, fishing rod, flashlight, fondue set, fossil, funnel, gnome, goblet, gong, gramophone, harp, hourglass, "
    "incense, "
    "jewelry box, jukebox, kayak, kite, lantern, lava lamp, loom, magnifier, mannequin, mask, metronome, microscope, "
    "mobile, modem, mortar, necklace, oscilloscope, paddle, parasol, pedestal, periscope, pinata, planter, pulley, "
    "quilt, "
    "rocking horse, router, saddle, sandbag, server, sextant, shield, skeleton, snow globe, spinning wheel, "
    "surfboard, "
    "sword, tambourine, tapestry, telescope, terrarium, thermos, toolbox, totem, train set, trumpet, turntable, "
    "ukulele, urn, "
    "wagon, walker, watering can, wheelchair, whistle, wind chime, looking glass, wreath, xylophone, yarn, "
    "zipper, cubbies, wig, "
    "crutch"
)
ROOMS = _words(
    "kitchen, bedroom, bathroom, living room, dining room, office, hallway, garage, laundry room, storage room, "
    "study, "
    "basement, attic, guest room, kids room, master bedroom, playroom, lobby, conference room, classroom, library, "
    "gym, "
    "lounge, hall, laundry, foyer, family room, sitting room, restroom, washroom, utility room, workshop, media room, "
    "landing, cellar, kids bedroom, walk-in closet, spare room, waiting room, lab, studio, "
    "pantry, entrance hall, entryway, corridor, den, nursery, home office, meeting room, break room, mudroom, balcony"
)
AREAS = _words(
    "dining area, sitting area, seating area, work area, reading corner, sleeping area, cooking area, lounge area, "
    "media area, play corner, dressing area, eating area, tv area, "
    "play area, entrance area, study area, washing area, storage area, reading area, bathing area, laundry area"
)
FLOORS = _words(
    "upstairs, downstairs, first floor, second floor, third floor, ground floor, top floor, upper floor, lower floor, "
    "floor 1, floor 2, floor 3, second level, upper level, lowest floor, main floor, basement level, 2nd floor, "
    "1st floor"
)
COLORS = _words(
    "red, blue, green, yellow, orange, purple, pink, brown, black, white, gray, grey, beige, tan, silver, gold, "
    "golden, "
    "dark, light, dark brown, light brown, dark blue, light blue, dark green, light green, dark grey, light gray, "
    "navy "
    "blue, bright blue, greenish, reddish, maroon, cream, turquoise, teal, violet, colorful, off white, "
    "black and white"
)
SIZES = _words(
    "big, large, huge, small, little, tiny, tall, short, long, wide, narrow, thin, thick, low, high, medium sized, "
    "giant"
)
SHAPES = _words("round, square, rectangular, oval, circular, curved, l shaped, flat, cylindrical, boxy, skinny")
MATERIALS = _words(
    "wooden, wood, metal, glass, plastic, leather, fabric, stone, marble, steel, stainless steel, cardboard, wicker, "
    "ceramic, paper, cloth, velvet, concrete, rubber, mesh"
)
STATES = _words(
    "open, closed, empty, full, messy, neat, old, new, broken, clean, dirty, striped, patterned, floral, folded, "
    "cluttered, stacked, covered, framed, padded, hanging, plain, fancy, modern, antique, comfortable looking, shiny, "
    "fluffy, worn, transparent, dusty, boxed, spotted, checkered, solid, bare, unmade, made, upholstered, foldable"
)
PURPOSES = _words(
    "sit on, sit down, sleep in, sleep, lie down, wash my hands, wash dishes, cook dinner, boil water, make coffee, "
    "watch a movie, read a book, work at, write on, put my coat, hang my jacket, store food, keep milk cold, "
    "heat my lunch, "
    "put my feet up, take a shower, brush my teeth, dry my hands, throw this away, see myself, tell the time, "
    "print a page, "
    "drink from, eat from, carry water in, clean the floor, charge my phone, listen to music, cut paper, iron a shirt"
)
NUMBERS = {2: ("two", "2"), 3: ("three", "3"), 4: ("four", "4"), 5: ("five", "5"), 6: ("six", "6")}
ORDINALS = {2: ("second", "2nd"), 3: ("third", "3rd"), 4: ("fourth", "4th"), 5: ("fifth", "5th")}
