"""Real RGB-D cameras: resolution, lenses, place of the depth camera, noise law, shutter and exposure.

Sources: field of view, baseline and shutters of Intel's D400 series datasheet (337029) and Orbbec's Astra data sheet;
noise of the D435 from Intel's "Best-known methods for tuning D400 depth cameras" (RMS error = z^2 subpixel / (f
baseline), 0.08 px on a textured target); structured light from Khoshelham and Oude Elberink, Sensors 2012, 12(2)
(z^2 law, disparity in steps of an eighth of a pixel, random error of half a step). Lens coefficients and rotations
differ from device to device: those here are of the usual size.
"""

from __future__ import annotations

from dataclasses import dataclass

from ibvs_qp.vision.picture.settings import RgbdCameraSettings


@dataclass(frozen=True, kw_only=True)
class Device:
    """An RGB-D camera; the focal length of its colour camera is that of the scene."""

    distortion: tuple[float, ...]  # of the colour lens, k1 k2 p1 p2 k3
    depth_camera: tuple[int, int, float]  # (width, height, focal length) [px]
    depth_distortion: tuple[float, ...] = ()  # of the depth lens; the D435 rectifies its own pictures
    depth_rotation: tuple[float, float, float]  # vector from depth to colour axes [rad]
    depth_translation_m: tuple[float, float, float]  # depth camera in colour axes
    baseline_m: float  # of stereo imagers, or of imager and projector
    subpixel: float  # standard deviation of the disparity [px]
    correlation_px: float  # length over which its errors are alike: the window of the matcher
    disparity_step_px: float  # steps of the disparity; 0 for none
    depth_step_m: float = 0.001  # steps of the delivered depth
    shadow_side: int  # -1: the second eye is blocked left of near surfaces, +1 right of them
    other_hole_px: float  # widest hole on the other side
    fattening_px: float  # largest width by which a near surface grows
    readout_s: float  # first to last row of the colour picture
    exposure_step: float  # relative size of a step of the automatic exposure between pictures

    @property
    def depth_intrinsics(self) -> tuple[float, float, float, float]:
        """(fx, fy, cx, cy) of the depth camera [px]."""
        width, height, focal = self.depth_camera
        return focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)

    @property
    def settings(self) -> RgbdCameraSettings:
        """Data for the reader of its pictures."""
        return RgbdCameraSettings(
            distortion=self.distortion,
            depth_units_per_metre=1.0 / self.depth_step_m,
            depth_intrinsics=self.depth_intrinsics,
            depth_distortion=self.depth_distortion,
            depth_rotation=self.depth_rotation,
            depth_translation_m=self.depth_translation_m,
        )


#: Depth 848 x 480 with 87 degrees of view, 50 mm between the imagers, referred to the left one; colour 15 mm beside it.
REALSENSE_D435 = Device(
    distortion=(0.10, -0.22, 0.0005, -0.0004, 0.12),
    depth_camera=(848, 480, 447.0),
    depth_rotation=(0.002, -0.004, 0.003),
    depth_translation_m=(0.0148, 0.0002, 0.0003),
    baseline_m=0.050,
    subpixel=0.08,
    correlation_px=3.0,
    disparity_step_px=1.0 / 32.0,
    shadow_side=-1,
    other_hole_px=1.0,
    fattening_px=3.0,
    readout_s=0.020,
    exposure_step=0.15,
)
#: Structured light as of an Astra: depth 640 x 480 with 58.4 degrees, 75 mm to the projector, colour 25 mm beside.
ORBBEC = Device(
    distortion=(0.05, -0.12, -0.0006, 0.0003, 0.05),
    depth_camera=(640, 480, 573.0),
    depth_distortion=(-0.05, 0.10, 0.0003, 0.0002, -0.05),
    depth_rotation=(-0.003, 0.005, -0.004),
    depth_translation_m=(-0.025, -0.0003, 0.0010),
    baseline_m=0.075,
    subpixel=0.0625,
    correlation_px=2.0,
    disparity_step_px=0.125,
    shadow_side=1,
    other_hole_px=4.0,
    fattening_px=1.5,
    readout_s=0.025,
    exposure_step=0.15,
)
