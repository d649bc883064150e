"""The fault matrix: every fault in contact and free, with and without the supervisor, scored and reported."""
