"""A made-up airfield whose exact colour is known along every ray, and a camera flying over it."""
