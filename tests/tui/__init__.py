"""What the screens show, at several sizes, fed with canned snapshots."""
