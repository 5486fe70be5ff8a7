"""Initial cameras of an X-ray from a trained regressor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.view_names import label_of
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.standard_views import STANDARD_VIEWS
from PolyPoseLib.learned import pose_code
from PolyPoseLib.learned.camera_model import CameraModel
from PolyPoseLib.learned.network_input import network_input
from PolyPoseLib.similarity.torch_threads import one_torch_thread

ROTATIONS_RAD = (
    (0.0, 0.0, 0.0),
    (0.0, 0.0, 0.12),
    (0.0, 0.0, -0.12),
    (0.03, 0.0, 0.0),
    (-0.03, 0.0, 0.0),
    (0.0, 0.03, 0.0),
    (0.0, -0.03, 0.0),
)
"""Rotations of the camera about its source under which the X-ray is evaluated; each prediction is rotated back."""

MOST_VIEWS = 2
"""Standard views that are tried when the X-ray names none."""


class CameraRegressor:
    """A model, ready to predict the cameras of X-rays of the patient it was trained on.

    Parameters
    ----------
    model : CameraModel
        From :func:`PolyPoseLib.io.camera_models.load_model`.
    anchor_centre : (3,) array
        Centroid of the anchor, LPS mm.

    Raises
    ------
    InputError
        The model is inconsistent, or MONAI is missing.

    """

    def __init__(self, model: CameraModel, anchor_centre: np.ndarray) -> None:
        self.model = model
        self.network = model.network()
        self.centre = torch.as_tensor(anchor_centre, dtype=torch.float64)
        self.rotations = torch.as_tensor(model.views.centres, dtype=torch.float64)
        self.how = f"learned ({model.validation_mm:.0f} mm in its validation)"
        weakness = model.weakness
        self.warnings = () if weakness is None else (f"The camera model was trained too little: {weakness}.",)

    @classmethod
    def of(cls, model: CameraModel, ct: Volume, structures: Structures, anchor: str) -> CameraRegressor:
        """Of a study's CT and anchor; raises InputError when the model was trained on others."""
        model.require(ct, structures, anchor)
        return cls(model, structures.centroids(ct.affine)[structures.index(anchor)])

    def covers(self, xray: Xray) -> bool:
        """Whether the model was trained around the X-ray's standard view; around all of them if it names none."""
        wanted = set(STANDARD_VIEWS) if xray.standard_view is None else {xray.standard_view}
        return wanted <= set(self.model.views.views)

    def predict(self, xray: Xray) -> list[Camera]:
        """Cameras of an X-ray, likeliest first: for each possible standard view the mean over small rotations.

        Raises InputError when the X-ray's standard view is not one of the model's.
        """
        return [cameras[0] for cameras in self._predictions(xray)]

    def starts(self, xray: Xray) -> list[Camera]:
        """Cameras to refine, likeliest first: those of :meth:`predict`, and each rotation's own prediction.

        Raises InputError when the X-ray's standard view is not one of the model's.
        """
        found = self._predictions(xray)
        return [cameras[0] for cameras in found] + [each for cameras in found for each in cameras[1:]]

    def _predictions(self, xray: Xray) -> list[list[Camera]]:
        """Per standard view the mean camera, followed by the predictions under each rotation."""
        turns = np.stack([Rotation.from_rotvec(turn).as_matrix() for turn in ROTATIONS_RAD])
        detector, model = self.model.detector, self.model
        images = []
        for turn in turns:
            image, mask = detector.resampled(xray.image, xray.mask, xray.intrinsics, turn)
            images.append(network_input(image, mask, detector, model.views.distance_mm))
        with torch.no_grad(), one_torch_thread():
            logits, codes = self.network(torch.from_numpy(np.stack(images)))
        likelihood = logits.log_softmax(1).mean(0)
        back = torch.as_tensor(turns.transpose(0, 2, 1))
        views = self._views(xray, likelihood)
        cameras = []
        for view in views:
            turned = self._decode(codes[:, view].double(), view)
            turned[:, :3] = back @ turned[:, :3]
            mean = self._decode(self._encode(turned, view).mean(0, keepdim=True), view)
            cameras.append(
                [Camera(xray.intrinsics, each.numpy(), *xray.image.shape) for each in (*mean, *turned)]
            )
        return cameras

    def _views(self, xray: Xray, likelihood: torch.Tensor) -> Sequence[int]:
        """Indices of the possible standard views, likeliest first."""
        names = self.model.views.views
        if xray.standard_view is None:
            return likelihood.argsort(descending=True)[:MOST_VIEWS].tolist()
        if xray.standard_view not in names:
            raise InputError(
                f"{label_of(xray.name)}: its standard view {xray.standard_view} is not one of the camera model "
                f"({', '.join(names)}): train a model on this study, or choose another method."
            )
        return [names.index(xray.standard_view)]

    def _decode(self, codes: torch.Tensor, view: int) -> torch.Tensor:
        """Cameras (B, 4, 4) of codes (B, 9)."""
        return pose_code.decode(codes, self._rotation(codes, view), self.centre, *self._units())

    def _encode(self, extrinsics: torch.Tensor, view: int) -> torch.Tensor:
        """Codes (B, 9) of cameras (B, 4, 4)."""
        return pose_code.encode(extrinsics, self._rotation(extrinsics, view), self.centre, *self._units())

    def _rotation(self, like: torch.Tensor, view: int) -> torch.Tensor:
        return self.rotations[view].expand(len(like), 3, 3)

    def _units(self) -> tuple[float, float]:
        """Half tangent and distance that the codes are relative to."""
        return self.model.detector.half_tangent, self.model.views.distance_mm
