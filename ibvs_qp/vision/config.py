"""Settings of perception; every length in pixels is for a picture 640 wide and scales with the longer side."""

from __future__ import annotations

from dataclasses import dataclass, field

from ibvs_qp.config.settings import Checked, Derived, setting

#: Width of the picture for which pixel settings are stated [px].
REFERENCE_WIDTH = 640.0


@dataclass(frozen=True, kw_only=True)
class PlaneConfig(Checked):
    """Robust fit of the surface, in inverse depth. Gates are relative to depth, as the noise of an RGB-D camera is."""

    grid_columns: int = setting(80, "samples per row of the coarse grid (1/8 of 640)", low=20, high=320)
    hypotheses: int = setting(
        60, "random planes tried through the seed (60 find a 25 % surface with p > 0.98)", low=5, high=1000
    )
    coarse_gate: float = setting(
        0.025, "first gate, fraction of depth (RealSense board: 0.85 % rms, 3 sigma)", low=1e-3, high=0.2
    )
    fine_gate_sigmas: float = setting(3.0, "last gate in sigmas of the residuals", low=1.5, high=10.0)
    fine_gate_low: float = setting(0.006, "the last gate is never tighter, fraction of depth", low=1e-4, high=0.1)
    fine_gate_high: float = setting(0.022, "the last gate is never wider (0.02 m at 0.5 m is 0.04)", low=1e-3, high=0.2)
    seed_radius: int = setting(2, "half width of a seed window in grid cells", unit="cells", low=1, high=10)
    seed_reach: float = setting(0.45, "distance of points for a plane from the seed, normalised", low=0.05, high=2.0)
    min_samples: int = setting(120, "fewer inliers on the grid are refused (2.5 % of 4800)", low=10, high=5000)
    max_lean_deg: float = setting(15.0, "largest lean of the surface from vertical", unit="deg", low=1.0, high=90.0)
    max_oblique_deg: float = setting(65.0, "largest angle of the normal from the axis", unit="deg", low=5.0, high=89.0)
    distance_min_m: float = setting(0.12, "nearer surfaces are refused", unit="m", low=0.01, high=10.0)
    distance_max_m: float = setting(
        6.0, "farther surfaces are refused (range of the camera)", unit="m", low=0.2, high=100.0
    )
    common_mode_m: float = setting(
        0.001, "depth error common to one frame (design, section 5)", unit="m", low=0.0, high=0.1
    )
    lost_share: float = setting(
        0.5, "a tracked plane whose inliers fall below this fraction of before is searched anew", low=0.05, high=1.0
    )
    random_seed: int = setting(20, "seed of the hypotheses", low=0, high=2**31 - 1)

    @property
    def sound_scatter(self) -> float:
        """Largest standard deviation of depth, over depth, with which the surface holds together; RealSense: 0.85 %.

        Half of the first gate: outside it lie 5 % of the samples then.
        """
        return 0.5 * self.coarse_gate


@dataclass(frozen=True, kw_only=True)
class MaskConfig(Checked):
    """Parts of the vehicle in its own picture."""

    brush_length_m: float = setting(0.05, "length of the brush along the arm", unit="m", low=0.0, high=0.5)
    margin_px: float = setting(
        5.0, "grown around every part: bending, calibration, blur", unit="px", low=0.0, high=50.0
    )
    paint_margin_px: float = setting(
        28.0, "around the brush, where paint appears: no points", unit="px", low=0.0, high=200.0
    )


@dataclass(frozen=True, kw_only=True)
class DetectConfig(Checked):
    """Search for lines without a prediction."""

    half_range_deg: float = setting(
        14.0,
        "lines this near to level and upright are looked at where gravity is known",
        unit="deg",
        low=2.0,
        high=45.0,
    )
    band_cells: int = setting(
        4, "half width of the band around the surface's end in which its edges are sought (32 px)", low=1, high=20
    )
    min_length: float = setting(0.10, "shortest edge of paint, fraction of the picture's width", low=0.01, high=1.0)
    candidates: int = setting(16, "segments fitted to a fraction of a pixel per detection", low=1, high=100)
    period: int = setting(20, "frames between detections while tracks live", low=1, high=1000)
    lost_period: int = setting(3, "frames between detections while nothing is tracked", low=1, high=1000)
    min_score: float = setting(0.25, "weakest candidate that may start a track", low=0.0, high=1.0)


@dataclass(frozen=True, kw_only=True)
class LineConfig(Checked):
    """Sub-pixel refinement by profiles across the line, and the contents of its two sides."""

    profiles: int = setting(64, "profiles along a line", low=16, high=400)
    strip_px: float = setting(
        14.0, "half width of the search strip (wider jumps to parallel lines)", unit="px", low=3.0, high=60.0
    )
    contrast_min: float = setting(16.0, "weakest colour step, RGB norm", unit="grey levels", low=1.0, high=200.0)
    inlier_px: float = setting(1.5, "a profile this near supports the line", unit="px", low=0.2, high=10.0)
    bridge_px: float = setting(30.0, "longest gap bridged within a segment", unit="px", low=0.0, high=500.0)
    min_profiles: int = setting(7, "fewer supporting profiles are no line", low=4, high=100)
    bias_px: float = setting(0.02, "systematic error of the fit: sampling, blur, lens", unit="px", low=0.0, high=5.0)
    color_gate: float = setting(
        42.0,
        "RGB distance within which a colour is the board's or the paint's",
        unit="grey levels",
        low=5.0,
        high=200.0,
    )
    rho_max: float = setting(1.5, "lines farther off the axis are refused (L grows without bound)", low=0.2, high=10.0)


@dataclass(frozen=True, kw_only=True)
class TrackConfig(Checked):
    """Life of a track."""

    confirm_hits: int = setting(2, "hits needed to accept a new track", low=1, high=20)
    confirm_window: int = setting(3, "within this many frames", low=1, high=20)
    hold_s: float = setting(0.3, "longest time on prediction alone", unit="s", low=0.0, high=5.0)
    rise: float = setting(0.34, "weight gained per healthy frame", low=0.01, high=1.0)
    inlier_share_min: float = setting(0.30, "healthy: least fraction of agreeing profiles", low=0.05, high=1.0)
    rms_max_px: float = setting(0.8, "healthy: residual rms", unit="px", low=0.05, high=10.0)
    confidence_min: float = setting(0.3, "less certain lines are no features", low=0.0, high=1.0)
    duplicate_px: float = setting(4.0, "two tracks nearer than this are one", unit="px", low=0.5, high=50.0)
    capacity: int = setting(12, "most tracks kept", low=1, high=64)


@dataclass(frozen=True, kw_only=True)
class FlowConfig(Checked):
    """Velocity from sparse flow at half resolution."""

    points: int = setting(45, "most points followed", low=8, high=500)
    redetect: int = setting(10, "frames between searches for points", low=1, high=1000)
    points_low: int = setting(25, "fewer live points start a search at once", low=4, high=500)
    quality: float = setting(
        1e-3,
        "strength of the weakest followed corner as a fraction of the strongest; corners of noise get no weight",
        why="a screw on a plain board is 1000 times as strong as the board's texture",
        low=1e-4,
        high=0.5,
    )
    spacing_px: float = setting(8.0, "least distance of points, half resolution", unit="px", low=2.0, high=50.0)
    window_px: int = setting(15, "Lucas-Kanade window, half resolution (odd)", unit="px", low=5, high=41)
    grey_sigma: float = setting(1.2, "noise of the grey picture", unit="grey levels", low=0.1, high=20.0)
    pixel_sigma: float = setting(0.04, "error of a point beyond noise, half resolution", unit="px", low=0.001, high=2.0)
    gate_sigmas: float = setting(4.0, "residuals beyond this many robust sigmas get no weight", low=2.0, high=20.0)
    min_points: int = setting(6, "fewer agreeing points give no velocity", low=3, high=100)
    prior_m_s: float = setting(1.0, "spread assumed where nothing is visible", unit="m/s", low=0.05, high=50.0)
    rotation_sigma_rad: float = setting(
        7e-5, "error of the rotation between frames (3.4e-4 rad/s/sqrt(Hz) over 1/30 s)", unit="rad", low=0.0, high=0.1
    )
    interval_max_s: float = setting(0.15, "longer gaps between frames give no velocity", unit="s", low=0.01, high=2.0)
    speed_max_m_s: float = setting(3.0, "faster answers are refused", unit="m/s", low=0.1, high=50.0)


@dataclass(frozen=True, kw_only=True)
class VisionConfig(Checked):
    """All settings of perception."""

    brush_width_m: float = setting(
        Derived(0.08),
        "diameter of the round brush (design, section 4.4); a pilot's is that of the paint job unless it is stated",
        unit="m",
        low=0.005,
        high=0.5,
    )
    paint_color: tuple[int, int, int] | None = setting(None, "colour of the paint if known, RGB", low=0, high=255)
    board_color: tuple[int, int, int] | None = setting(
        None, "colour of the surface; sampled around the seed if absent", low=0, high=255
    )
    curved: bool = setting(True, "the wall may be round: its curvature is measured, and pictures are unrolled")
    plane: PlaneConfig = field(default_factory=PlaneConfig)
    mask: MaskConfig = field(default_factory=MaskConfig)
    detect: DetectConfig = field(default_factory=DetectConfig)
    line: LineConfig = field(default_factory=LineConfig)
    track: TrackConfig = field(default_factory=TrackConfig)
    flow: FlowConfig = field(default_factory=FlowConfig)
