"""What remains when something fails: hover on inertial data, flight after a lost rotor."""
