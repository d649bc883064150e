"""For 04_what_the_vehicle_can_do: attainable wrenches of a vehicle at a wall, and the choice of one."""
