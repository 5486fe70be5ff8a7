"""What the scene shows a track on: the request's nodes by the names that the track has for them."""

from __future__ import annotations

from .track_plan import TrackPlan
from .track_request import TrackRequest
from .track_scene import TrackInputs
from .writer import segment_id


def inputs_of(request: TrackRequest, plan: TrackPlan) -> TrackInputs:
    """The nodes of a request; X-rays that are files have none. Raises InputError for an unknown segment."""
    shown = [each for each in plan.cameras if each.source.image is not None]
    return TrackInputs(
        ct=request.ct,
        segmentation=request.segmentation,
        structures={
            name: [segment_id(request.segmentation, each) for each in ids]
            for name, ids in request.by_structure().items()
        },
        images={each.name: each.source.image for each in shown},
        first={each.name: each.first for each in plan.cameras},
        mirrored={each.name: each.mirrored for each in plan.cameras},
    )
