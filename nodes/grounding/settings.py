"""The numbers of grounding by theme, each with its unit. `placegraph evaluate-grounding --sensitivity` perturbs them.

Unless a line names another source, a value was chosen by hand on the development houses, seeds 0 to 999. A fit, a trust
and a score are numbers from 0 to 1; a condition holds from a fit of 0.5 on. `half_..._m` is the distance in metres at
which a fit has fallen to a half.
"""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class _Theme(BaseModel):
    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")


class NameSettings(_Theme):
    """How well a noun names a tag, in the order in which people use names."""

    same_words_fit: float = 1.0  # the same words
    head_noun_fit: float = 0.95  # an office chair, called chair
    synonym_fit: float = 0.9  # a couch, called sofa
    misspelled_fit: float = 0.88
    superclass_fit: float = 0.85  # a chair, called seat
    other_modifier_fit: float = 0.8  # a chair, called wooden chair
    shared_word_bonus: float = 0.03  # of two synonyms the one that shares a word is meant
    min_cosine: float = 0.45  # of embeddings; tests/nodes/grounding/test_name_matching.py has pairs on both sides
    min_nearest_cosine: float = 0.35  # of the nearest name when nothing has the name asked for
    min_place_similarity: float = 0.7  # the embeddings put bedroom and living room, which are not the same, at 0.5
    min_tag_share: float = 0.2  # of the strongest tag's weight; a weaker tag is an error of the detector
    tie_margin: float = 0.08  # scores within this of the best are equally good matches


class AppearanceSettings(_Theme):
    """Colours and sizes."""

    color_falloff: float = 30.0  # CIELAB distance at which a colour's fit has fallen to 1/e; room light dulls colours
    shade_lightness: float = 20.0  # CIELAB lightness between brown and dark brown
    min_color_fit: float = 0.6  # from which on an object is called by the colour
    min_size_fit: float = 0.4  # of the smallest of several, which someone may still call large
    short_side_weight: float = 0.25  # how much the shortest side counts in a thing's size, next to 1 for the others


class GroupSettings(_Theme):
    """Things alone or in groups of their kind."""

    alone_m: float = 2.0  # distance from its kind at which a thing is alone
    gap_m: float = 0.8  # gaps within a group; either of the two may be meant
    large_gap_m: float = 1.5


class NearnessSettings(_Theme):
    """Near, against, closest and farthest."""

    half_near_m: float = 1.5  # about two steps
    half_against_m: float = 0.3  # surfaces of touching things are some centimetres apart in a map
    half_wall_m: float = 0.4  # room boxes end inside the wall, and furniture stands off it a little
    through_wall_m: float = 3.0  # added to the distance to a thing in another room
    other_room_factor: float = 0.5  # factor on the fit of a relation to a thing in another room
    center_share: float = 0.1  # share of the distance between centres added, to order things that touch
    margin_m: float = 0.05  # distances closer than this are equal; the error of a box's surface
    uncertain_anchor_m: float = 2.0  # added to the distance to an anchor for each halving of its score


class DirectionSettings(_Theme):
    """Left, right, in front of, behind, across, and the order in a row."""

    margin_m: float = 0.1  # the error of a box centre from a depth camera
    min_share: float = 0.26  # sine of 15 degrees, within which nothing is to the left or right: the fit there is 0.5
    within_share: float = 0.1  # how much metres within the anchor's own width count
    half_side_m: float = 3.0  # "left of the sofa" means beside it
    half_front_m: float = 1.5
    unstated_fit: float = 0.75  # of "in front of" on the other side when no viewpoint is named
    across_m: float = 0.8  # nearer things are beside, not across


class BetweenSettings(_Theme):
    """Between two anchors."""

    aside_share: float = 0.5  # distance beside the line, as a share of its length, that halves the fit
    min_aside_m: float = 0.4  # at least this many metres, for anchors that are close together
    length_m: float = 6.0  # length of a pair at which its fit falls by a quarter of a halving; closer pairs are meant


class SupportSettings(_Theme):
    """On, under, above, in, holds and with."""

    half_contact_m: float = 0.15  # gap between a thing and what carries it
    stands_share: float = 0.5  # of the anchor's height; above it a thing stands on the anchor: beds have headboards
    half_touch_m: float = 0.1  # gap to a thing that it hangs on or is a part of
    hanging_fit: float = 0.7  # of "on" for what touches an upright thing off the floor: a picture on the wall
    inside_or_on_fit: float = 0.8  # how well what is inside is "on", and what is on top is "in"
    floor_m: float = 0.1  # a room's box is as low as the lowest thing in it
    off_floor_m: float = 0.3  # a thing whose bottom is higher does not stand on the floor
    half_aside_m: float = 0.3  # a picture hangs above the sofa although they do not overlap
    half_rise_m: float = 3.0  # of two things above a table the closer one is meant
    same_height_m: float = 0.1  # heights closer than this are level
    inside_share: float = 0.7  # of the target's volume, from which on it is inside
    tucked_fit: float = 0.6  # of "under" for a chair at a desk
    half_tucked_m: float = 0.2
    raised_share: float = 0.3  # of the height of a table or bed: things in its box stand below it unless so high
    box_error_m: float = 0.05  # the anchor's box is grown by the error of its surfaces
    half_beside_m: float = 0.75  # "with" also means what stands beside


class RoomPositionSettings(_Theme):
    """In the corner, in the middle, at the end, facing."""

    half_corner_m: float = 0.8
    half_center_share: float = 0.35  # of the half size of a room or thing
    half_end_m: float = 1.0
    facing_cosine: float = 0.5  # within 60 degrees of the front


class ViewpointSettings(_Theme):
    """Where a viewer stands and which side of a thing people face."""

    back_to_wall_m: float = 0.5  # a thing this close to a wall has its back to it
    min_broad_ratio: float = 1.4  # ratio of its sides from which on a thing has a broad side that people face
    at_door_m: float = 1.5  # a door belongs to the rooms, and is meant by an asker, within this
    storey_m: float = 2.0  # height between an asker and a door on the same floor, at most
    same_direction_cosine: float = 0.9  # cosine between lines of sight to the same wall
    min_faced_share: float = 0.9  # score, as a share of the best, of the things that one faces together
    unstated_trust: float = 0.5  # nobody named a viewpoint: the room's centre is right more often than not


class ScoreSettings(_Theme):
    """How fits become scores."""

    min_fit: float = 0.03  # what fails a condition stays listed
    same_name_margin: float = 0.04  # names within this of the best are the same name
    similar_name_margin: float = 0.12  # meant too when one thing alone has the name: an office chair by chair
    related_name_margin: float = 0.2  # likewise: a chair by seat
    worse_name_factor: float = 0.4  # factor on the score of a thing with a less fitting name than others have
    runner_up_rank: float = 0.45  # of a rank: the thing next to the one meant
    level_rank: float = 0.97  # of a rank: a thing that the margin cannot tell from it
    outranked_rank: float = 0.1  # of a rank: a thing that is not compared
    miscount_factor: float = 0.6  # factor for each anchor more or less than the request counts
    weak_trust: float = 0.5  # of a relation to the nearest name, or to what a room of that kind typically holds
    anchor_condition_trust: float = 0.3  # of a relation of the only table there is, taken for the target's
    same_place_share: float = 0.9  # places whose score is this share of the best are meant together
    much_better_ratio: float = 2.0  # factor by which a thing that fails a condition may still precede those that hold
    tie_margin: float = 0.03  # scores closer than this do not tell two things apart


class GroundingSettings(_Theme):
    """All numbers of grounding, `[nodes.grounding.settings]` in a configuration."""

    names: NameSettings = NameSettings()
    appearance: AppearanceSettings = AppearanceSettings()
    groups: GroupSettings = GroupSettings()
    nearness: NearnessSettings = NearnessSettings()
    directions: DirectionSettings = DirectionSettings()
    between: BetweenSettings = BetweenSettings()
    support: SupportSettings = SupportSettings()
    room_position: RoomPositionSettings = RoomPositionSettings()
    viewpoint: ViewpointSettings = ViewpointSettings()
    scores: ScoreSettings = ScoreSettings()


DEFAULTS = GroundingSettings()
