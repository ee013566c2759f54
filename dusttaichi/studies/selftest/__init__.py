"""`dust selftest`: whether a backend computes the right thing on this machine, and how fast."""
