"""Opens a log in Rerun with camera, vehicle, push and thrusts side by side; needs rerun-sdk, which is large.

``python -m ibvs_qp.recording.layouts.rerun_view flight_qp.mcap``, or with ``--save flight.rrd`` a file for later.
Rerun opens the log without this as well: ``rerun flight_qp.mcap``.
"""

# Rerun is not installed with any extra, and its types are not known here.
# pyright: reportMissingImports=false
from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ibvs_qp.recording.topics import CONTROL_TOPIC

#: Messages of the topic of ticks, as Rerun names them.
COMPONENT = "ibvs_qp.ControlTick:message"
#: Plots: name, and fields of a `ControlTick` as Rerun selects them.
PLOTS = {
    "push [N]": (".push_n", ".push_reference_n"),
    "thrusts and limits [N]": (".command.thrusts[]", ".thrust_low_n[]", ".thrust_high_n[]"),
    "distance to the wall [m]": (".distance_m",),
    "price of active limits": (".command.active_limits[].price",),
}


def blueprint() -> Any:
    """The layout."""
    import rerun as rr
    import rerun.blueprint as rrb
    from rerun.blueprint.encodings import ComponentSourceKind, VisualizerComponentMapping

    def series(selector: str) -> Any:
        mapping = VisualizerComponentMapping(
            "Scalars:scalars", ComponentSourceKind.SourceComponent, source_component=COMPONENT, selector=selector
        )
        return rr.SeriesLines(names=selector.strip(".[]")).visualizer(mappings=[mapping])

    plots = [
        rrb.TimeSeriesView(
            origin=CONTROL_TOPIC, name=name, overrides={CONTROL_TOPIC: [series(selector) for selector in selectors]}
        )
        for name, selectors in PLOTS.items()
    ]
    scene = ("/vehicle/**", "/wall/**", "/tf", "/truth/pose", "/truth/tf")
    frame = rrb.SpatialInformation(target_frame="wall")
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Spatial2DView(origin="/camera/overlay", name="detections"),
                rrb.Spatial2DView(origin="/camera/depth", name="depth"),
                rrb.TextLogView(origin="/log", name="events"),
            ),
            rrb.Spatial3DView(origin="/", contents=list(scene), name="vehicle and wall", spatial_information=frame),
            rrb.Vertical(*plots),
            column_shares=[1.0, 1.2, 1.2],
        ),
        rrb.TimePanel(timeline="message_log_time"),
        collapse_panels=True,
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Open a log in Rerun.")
    parser.add_argument("log", type=Path)
    parser.add_argument("--save", type=Path, help="write an .rrd file instead of opening the viewer")
    arguments = parser.parse_args()
    try:
        import rerun as rr
    except ModuleNotFoundError:
        parser.exit(2, "rerun_view: needs Rerun: pip install rerun-sdk\n")
    rr.init("ibvs_qp", spawn=arguments.save is None)
    if arguments.save is not None:
        rr.save(arguments.save, default_blueprint=blueprint())
    else:
        rr.send_blueprint(blueprint())
    rr.log_file_from_path(arguments.log)


if __name__ == "__main__":
    main()
