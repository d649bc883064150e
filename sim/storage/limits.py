"""Largest files that are read, each far above the files of the project; a larger one is a wrong or a hostile file.

Those of TOML are in `ibvs_qp.config.files`.
"""

#: A log compressed, and its arrays in memory [bytes]: 40 min of flight under both laws, at 0.9 MB/s each.
LARGEST_LOG, LARGEST_ARRAYS = 1 << 30, 1 << 32
#: The journal of a search [bytes]: 1000 trials have 5 MB.
LARGEST_JOURNAL = 1 << 30
#: A summary, or the trials of a search [bytes]: 200 trials have 0.2 MB.
LARGEST_JSON = 64 << 20
#: A table of flights [bytes], and its rows times columns: a million flights of 43 columns have 130 MB (docs/sweeps.md).
LARGEST_TABLE, MOST_CELLS = 4 << 30, 500_000_000
#: A picture as a file [bytes], and its longer side [px]: float depth of 8192 x 8192 px without compression.
LARGEST_PICTURE, LONGEST_SIDE = 1 << 28, 8192
#: A manifest [bytes] and [rows]: ten hours of pictures at 30 Hz.
LARGEST_MANIFEST, MOST_FRAMES = 64 << 20, 1_000_000
