"""What the figures, outcomes and limits of a report mean, in one plain sentence each, and which values are good."""

from __future__ import annotations

#: Meaning of every figure of merit, by its key in summary.json (docs/metrics.md defines them exactly).
FIGURES = {
    "completed": "Whether the vehicle painted every row, climbed between them and backed away from the wall.",
    "reason": "Why the flight ended.",
    "duration_s": "Simulated time from start to end.",
    "real_time_factor": "Simulated over computing time; 1 keeps up with the clock. It does not measure flight quality.",
    "stroke_m": "Length of the shortest painted row; good: the length that the scene asks for.",
    "coverage": "Share of the wanted stripes that has paint on it; good: near 100 %.",
    "path_rms_straight_m": "Typical distance of the brush from the ideal line on straight parts; smaller is better.",
    "path_rms_corner_m": "The same within 10 cm of a corner; smaller is better.",
    "path_max_m": "Largest distance from the ideal line; smaller is better.",
    "height_error_rms_m": "Typical distance above or below the row being painted; smaller is better.",
    "force_rms_straight_n": "Typical difference of true and commanded push on straight parts; smaller is better.",
    "force_rms_corner_n": "The same within 10 cm of a corner; smaller is better.",
    "force_peak_n": "Hardest push on the wall at any moment; good: little more than the commanded push.",
    "contact_share": "Share of the painting time in which the brush touched the wall; good: 100 %.",
    "first_touch_s": "When the brush first touched the wall.",
    "settle_s": "Time from the first touch until the push stays within 0.5 N of the command; shorter is better.",
    "bounces": "How often the brush left the wall within 3 s of the first touch; good: 0.",
    "tilt_rms_deg": "Typical lean of the vehicle; good: near 0, since tilted rotors push without leaning.",
    "tilt_peak_deg": "Largest lean; smaller is better.",
    "yaw_rms_deg": "Typical angle between the heading and straight at the wall; smaller is better.",
    "yaw_peak_deg": "The largest of these angles; smaller is better.",
    "velocity_rms_m_s": "Typical error of the vehicle's own estimate of its velocity; smaller is better.",
    "propeller_clearance_min_m": "Least distance of a propeller to wall or board; 0 would be a crash.",
    "step_us.p50": "Computing time of one control command, half of them took less; the period is 4000 µs.",
    "step_us.p99": "The time that 99 of 100 commands stayed below, with other programs on the computer.",
    "vision_ms.p50": "Computing time to find surface and edges in one picture; a picture comes every 33 ms at 30 Hz.",
    "vision_ms.p99": "The time that 99 of 100 pictures stayed below, with other programs on the computer.",
}
#: Meaning of every outcome of a control tick.
OUTCOMES = {
    "solved": "The solver reached its accuracy: the normal case.",
    "inaccurate_accepted": "The solver ended with less accuracy, and the result passed the checks.",
    "capped_accepted": "The solver used up its iterations, and the result passed the checks.",
    "exact_fallback": "The solver's result failed the checks; the exact solver answered instead.",
    "analytic_fallback": "No solution passed the checks, now or shortly before; the analytic law flew this tick.",
    "hold": "Inputs were missing or unusable: the vehicle carried its weight and kept level.",
}
#: Meaning of the limits by the beginning of their names.
LIMITS = {
    "thrust": "A rotor was at its least or greatest thrust, or changed it as fast as it may.",
    "tilt": "The vehicle was kept from leaning further.",
    "yaw": "The vehicle was kept from turning away from the wall.",
    "view": "The vehicle was kept from losing the guide line from the picture.",
    "push_ceiling": "The brush was kept from pushing harder.",
    "approach_speed": "The vehicle was slowed down in front of the wall.",
}


def limit_words(name: str) -> str:
    """Meaning of a limit; empty for one of a user's own."""
    return next((words for start, words in LIMITS.items() if name.startswith(start)), "")
