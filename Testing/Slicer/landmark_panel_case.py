"""What the tests of landmarks in the panel share: an X-ray whose camera comes from landmarks, and its true camera."""

from __future__ import annotations

import landmark_case
import numpy as np
from panel_case import PanelCase, choose_node
from PolyPoseSlicer.study import parameters
from PolyPoseSlicer.study.camera_source import CameraSource
from PolyPoseSlicer.study.xray_source import XraySource

SOURCES = [source.value for source in CameraSource]


class LandmarksCase(PanelCase):
    """One X-ray without a camera, whose camera source is landmarks; the truth is self.camera."""

    def setUp(self) -> None:
        super().setUp()
        self.begin()

    def begin(self) -> None:
        """Fill the scene."""
        self.fill(xrays=2)
        rng = np.random.default_rng(11)
        self.camera = landmark_case.random_camera(rng)
        self.points = landmark_case.points_in_ct(rng, 6)
        self.pixels = self.camera.project(self.points)
        sources = parameters.xray_sources(self.panel.parameters)
        sources[0] = XraySource(sources[0].image, fields=landmark_case.fields_of(self.camera))
        parameters.store_xray_sources(self.panel.parameters, sources)
        self.ui.xraysTable.selectRow(0)
        self.choose(CameraSource.LANDMARKS)

    def choose(self, source: CameraSource) -> None:
        self.ui.cameraSource.currentIndex = SOURCES.index(source.value)

    def source(self, row: int = 0) -> XraySource:
        return parameters.xray_sources(self.panel.parameters)[row]

    def give(self, points: np.ndarray | None = None, pixels: np.ndarray | None = None) -> None:
        """Both lists, as if they had been picked."""
        points = self.points if points is None else points
        pixels = self.pixels if pixels is None else pixels
        choose_node(self.ui.ctLandmarks, landmark_case.add_ct_list(points))
        choose_node(self.ui.xrayLandmarks, landmark_case.add_xray_list(pixels))
        self.settle()

    def settle(self) -> None:
        """Until nothing is due."""
        part = self.panel.landmarks
        self.wait(lambda: not part._solve_timer.isActive() and not part._settle_timer.isActive())

    def rows(self) -> list[list[str]]:
        table = self.ui.landmarksTable
        return [[table.item(row, column).text() for column in range(4)] for row in range(table.rowCount)]

    def shown(self) -> np.ndarray:
        """The report's camera, as everything else in the panel sees it."""
        return self.panel.xrays.reader.report(self.source()).xray.extrinsic
