"""Flight after faults: hover from inertial data, retreat after the loss of a rotor."""
