"""Views rendered at the station, each with its own size, field of view and head: streams, files,
snapshots, the terminal. One downlink, decoded once; every output on a thread of its own."""
