"""Search for gains: several objectives, the same search, budget and flights for both laws, compared on unseen seeds."""
