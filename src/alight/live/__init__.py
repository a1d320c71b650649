"""The live bench: a hard-timed host, its recordings, and a page to watch and steer it."""
