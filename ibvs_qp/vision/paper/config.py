"""Settings of the paper's pipeline; every length in pixels is for a picture 640 wide and scales with the width."""

from __future__ import annotations

from dataclasses import dataclass

from ibvs_qp.config.settings import setting, validate


@dataclass(frozen=True, kw_only=True)
class PaperConfig:
    """Normal image, bounding box, Canny, probabilistic Hough and slope threshold."""

    normal_stride: int = setting(
        1, "the normal image takes every so many-th depth reading; 1 as the paper, 2 costs a quarter", low=1, high=4
    )
    depth_unit_m: float = setting(
        1e-4, "depth is filtered as 16-bit numbers of this unit (reach 6.5 m)", unit="m", low=5e-5, high=1e-3
    )
    median_px: int = setting(5, "aperture of the depth's median filter, odd", unit="px", low=3, high=5)
    smooth_px: float = setting(9.0, "window over which filtered depth is averaged", unit="px", low=1.0, high=61.0)
    baseline_px: float = setting(8.0, "distance of the two readings of a gradient", unit="px", low=2.0, high=60.0)
    rays: int = setting(
        180, "directions of the search: an edge seen between arm and corner still gets a few", low=8, high=720
    )
    ray_step_px: float = setting(5.0, "distance of the places looked at along a ray", unit="px", low=1.0, high=20.0)
    spread_px: float = setting(
        24.0,
        "rays agree on a side within this: an edge 4 deg off level",
        unit="px",
        low=2.0,
        high=100.0,
    )
    change_deg: float = setting(
        48.0, "turn of the normal that ends the surface (5 cm in 14 px at 0.5 m: 77)", unit="deg", low=10.0, high=85.0
    )
    seed_px: float = setting(60.0, "window whose normals make that of the seed", unit="px", low=5.0, high=300.0)
    margin_px: float = setting(
        28.0, "grown around the box: gradients end half a window before the edge", unit="px", low=0.0, high=60.0
    )
    smallest_px: float = setting(60.0, "a box with a shorter side is refused", unit="px", low=10.0, high=400.0)
    canny_low: float = setting(25.0, "lower threshold of Canny, Sobel answer", unit="grey levels", low=1.0, high=1000.0)
    canny_high: float = setting(60.0, "upper threshold of Canny", unit="grey levels", low=1.0, high=2000.0)
    hough_angle_deg: float = setting(0.5, "angle step of the Hough transform", unit="deg", low=0.1, high=2.0)
    hough_votes: int = setting(40, "votes that make a line, at half resolution", low=5, high=500)
    min_length_px: float = setting(64.0, "shortest segment", unit="px", low=10.0, high=400.0)
    max_gap_px: float = setting(16.0, "largest gap within a segment", unit="px", low=1.0, high=100.0)
    slope_deg: float = setting(15.0, "largest slope from level or upright", unit="deg", low=2.0, high=40.0)
    end_sigma_px: float = setting(
        1.5, "error of a segment's end: whole pixels at half resolution", unit="px", low=0.1, high=10.0
    )

    def __post_init__(self) -> None:
        """Validate every field."""
        validate(self)
